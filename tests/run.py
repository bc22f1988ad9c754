"""The stages of `make test` and `make test-release`, one after another, and the time each took.

`python tests/run.py [release] [--retry] [pytest arguments]`. A failed stage ends the run. With --retry, the tests
that failed run once more, one after another, before a stage counts as failed: the machine may be shared.
"""

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
WRAPPER: Final = os.environ.get("HORNBILL_VCAN_WRAPPER", "")
BYTE_CODE: Final = ROOT / "build" / "pycache"
"""Where all processes of a run keep theirs, whatever the environment says: compiling takes longer than importing."""
NO_KERNEL: Final = 125
"""Exit status of a wrapper that cannot provide a kernel with CAN on this machine."""
FAILED: Final = 1
"""Exit status of pytest when tests failed, and of nothing else."""


@dataclass(frozen=True)
class Stage:
    """Some of the tests, run by one command."""

    name: str
    select: tuple[str, ...]
    """Arguments for pytest: which tests."""
    workers: tuple[str, ...] = ()
    wrapper: tuple[str, ...] = ()

    def command(self, *, again: bool, further: list[str]) -> list[str]:
        """The command line. `again` runs what failed last time, without workers."""
        how = ("--last-failed", "--last-failed-no-failures", "none") if again else self.workers
        return [*self.wrapper, sys.executable, "-m", "pytest", *self.select, *how, *further]


TEST: Final = (
    Stage("unit, contract, behaviour", ("tests/unit", "tests/contract", "tests/behaviour"), ("-n", "auto")),
    Stage("socketcan", ("tests/socketcan", "-p", "no:cacheprovider"), wrapper=(WRAPPER, "--") if WRAPPER else ()),
    Stage("browser, side by side", ("tests/e2e", "-m", "not alone"), ("-n", "2", "--dist", "loadfile")),
    Stage("browser, one at a time", ("tests/e2e", "-m", "alone")),
)
RELEASE: Final = (Stage("fresh environments, image, other browsers", ("tests/release",)),)


def run(stage: Stage, *, retry: bool, further: list[str]) -> str:
    """Run a stage: "passed", "passed on retry", "SKIPPED: …" or "FAILED"."""
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(BYTE_CODE)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)

    def tests(again: bool) -> int:
        return subprocess.run(
            stage.command(again=again, further=further), cwd=ROOT, env=environment, check=False
        ).returncode

    code = tests(again=False)
    if code == 0:
        return "passed"
    if code == NO_KERNEL and stage.wrapper:
        return f"SKIPPED: {WRAPPER} cannot provide a kernel with CAN on this machine"
    if code == FAILED and retry and not stage.wrapper:
        print(f"{stage.name}: what failed runs once more", flush=True)
        if tests(again=True) == 0:
            return "passed on retry"
    return "FAILED"


def main(arguments: list[str]) -> int:
    """Exit status: 0 when no stage failed."""
    release = "release" in arguments
    retry = "--retry" in arguments
    further = [each for each in arguments if each not in ("release", "--retry")]
    table: list[str] = []
    result = "passed"
    for stage in RELEASE if release else TEST:
        begun = time.monotonic()
        result = run(stage, retry=retry, further=further)
        table.append(f"{time.monotonic() - begun:6.0f} s  {stage.name}: {result}")
        if result == "FAILED":
            break
    print("\n".join(table), flush=True)
    return int(result == "FAILED")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

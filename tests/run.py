"""The stages of `make test` and `make test-release`, and the time each took.

`python tests/run.py [release] [--retry] [pytest arguments]`. Stages of one step run side by side, and what each
printed follows when it has ended; steps run one after another. A failed stage ends the run after its step. With
--retry, the tests that failed run once more, one after another, before a stage counts as failed: the machine may be
shared.
"""

import os
import shlex
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
WRAPPER: Final = tuple(shlex.split(os.environ.get("HORNBILL_VCAN_WRAPPER", "")))
"""Command that provides a kernel with CAN, with its options."""
BYTE_CODE: Final = ROOT / "build" / "pycache"
"""Where all processes of a run keep theirs, whatever the environment says: compiling takes longer than importing."""
FAILURES: Final = ROOT / "build" / "failures"
"""Where each stage notes which of its tests failed: stages side by side would overwrite each other's."""
NO_KERNEL: Final = 125
"""Exit status of a wrapper that cannot provide a kernel with CAN on this machine."""
FAILED: Final = 1
"""Exit status of pytest when tests failed, and of nothing else."""


TIMED_OUT: Final = 124
"""Exit status of a wrapper that ended a run which took too long."""


@dataclass(frozen=True)
class Stage:
    """Some of the tests, run by one command."""

    name: str
    select: tuple[str, ...] = ()
    """Arguments for pytest: which tests."""
    workers: tuple[str, ...] = ()
    wrapper: tuple[str, ...] = ()
    program: tuple[str, ...] = ()
    """What runs them if it is not pytest."""

    def command(self, *, again: bool, further: list[str]) -> list[str]:
        """The command line. `again` runs what failed last time, without workers."""
        if self.program:
            return [*self.program]
        how = self.workers
        if "no:cacheprovider" not in self.select:  # else what failed is not stored, and all of it runs again
            if again:
                how = ("--last-failed", "--last-failed-no-failures", "none")
            how = (*how, "-o", f"cache_dir={FAILURES / self.name.split(',')[0]}")
        return [*self.wrapper, sys.executable, "-m", "pytest", *self.select, *how, *further]


@dataclass(frozen=True)
class Outcome:
    """How a stage ended: "passed", "passed on retry", "SKIPPED: …" or "FAILED"."""

    stage: Stage
    result: str
    seconds: float


VITEST: Final = Stage("page, without a browser", program=("npm", "--prefix", "web", "run", "--silent", "test"))
CORE: Final = ("tests/unit", "tests/contract", "tests/behaviour")
COMMANDS: Final = ("tests/commands", "tests/links")
BROWSER: Final = ("-n", "4", "--dist", "loadfile", "--no-loadscope-reorder")
"""A page waits half of the time. e2e/conftest.py orders the files."""
SHORT: Final = ("-m", "not release")
LONG: Final = ("-m", "release")
SOCKETCAN: Final = ("tests/socketcan", "-p", "no:cacheprovider")
KERNEL: Final = (*WRAPPER, "--") if WRAPPER else ()
TEST: Final = (
    (
        # One worker more than cores: some of these tests wait.
        Stage(
            "unit, contract, behaviour", (*CORE, *SHORT), ("-n", str((os.cpu_count() or 1) + 1), "--dist", "worksteal")
        ),
        # These two wait for servos most of the time, in real time.
        Stage("socketcan", (*SOCKETCAN, *SHORT), wrapper=KERNEL),
        Stage("commands, links", (*COMMANDS, *SHORT), ("-n", "3", "--dist", "loadfile")),
    ),
    (Stage("browser", ("tests/e2e", *SHORT), BROWSER), VITEST),
)
RELEASE: Final = (
    (
        Stage("long tests", (*CORE, *COMMANDS, *LONG), ("-n", "auto", "--dist", "loadfile")),
        Stage("socketcan, long tests", (*SOCKETCAN, *LONG), wrapper=KERNEL),
    ),
    (Stage("browser, long tests", ("tests/e2e", *LONG), BROWSER),),
    (Stage("fresh environments, image, other browsers", ("tests/release",)),),
)


def run(stage: Stage, *, again: bool, further: list[str], quiet: bool) -> tuple[int, str]:
    """Run a stage: its exit status, and what it printed if it is `quiet`."""
    # Matrices are small: further threads of the linear algebra would only take time from other processes.
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(BYTE_CODE), "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(
        stage.command(again=again, further=further), cwd=ROOT, env=environment, check=False, text=True,
        stdout=subprocess.PIPE if quiet else None, stderr=subprocess.STDOUT if quiet else None,
    )  # fmt: skip
    return done.returncode, done.stdout or ""


def step(stages: tuple[Stage, ...], *, retry: bool, further: list[str]) -> list[Outcome]:
    """Run stages side by side, then what failed in them once more if it is to be retried."""
    begun = time.monotonic()

    def first(stage: Stage) -> tuple[Stage, int, float]:
        code, printed = run(stage, again=False, further=further, quiet=len(stages) > 1)
        if printed:
            print(f"== {stage.name}\n{printed}", flush=True)
        return stage, code, time.monotonic() - begun

    with ThreadPoolExecutor(len(stages)) as side_by_side:
        ended = list(side_by_side.map(first, stages))
    outcomes: list[Outcome] = []
    for stage, code, seconds in ended:
        result = "passed" if code == 0 else "FAILED"
        if code == NO_KERNEL and stage.wrapper:
            result = f"SKIPPED: {WRAPPER[0]} cannot provide a kernel with CAN on this machine"
        elif retry and not stage.program and code in ((FAILED, TIMED_OUT) if stage.wrapper else (FAILED,)):
            print(f"{stage.name}: what failed runs once more", flush=True)
            again = time.monotonic()
            if run(stage, again=True, further=further, quiet=False)[0] == 0:
                result = "passed on retry"
            seconds += time.monotonic() - again
        outcomes.append(Outcome(stage, result, seconds))
    return outcomes


def main(arguments: list[str]) -> int:
    """Exit status: 0 when no stage failed."""
    release = "release" in arguments
    retry = "--retry" in arguments
    further = [each for each in arguments if each not in ("release", "--retry")]
    begun = time.monotonic()
    outcomes: list[Outcome] = []
    for stages in RELEASE if release else TEST:
        outcomes += step(stages, retry=retry, further=further)
        if any(one.result == "FAILED" for one in outcomes):
            break
    print("\n".join(f"{one.seconds:6.0f} s  {one.stage.name}: {one.result}" for one in outcomes))
    if not release:
        print("  left to make test-release: tests marked `release`, and those in tests/release")
    print(f"{time.monotonic() - begun:6.0f} s  in all", flush=True)
    return int(any(one.result == "FAILED" for one in outcomes))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

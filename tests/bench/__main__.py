"""`make bench`: results as JSON lines, each compared with a peer in the same run or with a physical limit.

`make bench BENCH="stack plots"` runs those named; `COMPARE=COMMIT` runs them on that commit, too, in turn.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parents[1])]

from bench.compare import compare  # noqa: E402

USUAL = (
    "stack", "reading", "configuring", "streaming", "stopping", "jogging", "commanding", "start", "adapter",
    "connecting", "allocation", "simulation", "recorder", "sockets", "page", "view", "guest", "rest",
)  # fmt: skip
"""Modules that run if none is named."""

LONG = ("load", "plots", "endurance", "mechanics", "improve", "identify", "soak", "overnight", "database")
"""Modules that run only when named: most take minutes."""


def main(arguments: Sequence[str]) -> int:
    """Print the lines; exit 1 if one is beyond what it must be."""
    parser = argparse.ArgumentParser(prog="make bench", description=__doc__)
    parser.add_argument("modules", nargs="*", help=f"of {', '.join(USUAL)}; only when named: {', '.join(LONG)}")
    parser.add_argument("--compare", metavar="COMMIT", help="run that commit and this checkout in turn")
    chosen = parser.parse_args(arguments)
    unknown = sorted(set(chosen.modules) - {*USUAL, *LONG})
    if unknown:
        parser.error(f"no such benchmark: {', '.join(unknown)}")
    modules = chosen.modules or USUAL
    began = time.monotonic()
    beyond: list[str] = []
    for found in compare(modules, chosen.compare) if chosen.compare else _lines(modules):
        sys.stdout.write(json.dumps(found) + "\n")
        sys.stdout.flush()
        if not found.get("ok", True):
            beyond.append(found["bench"])
    summary = f"{time.monotonic() - began:.0f} s" + (f"; beyond what must be: {'; '.join(beyond)}" if beyond else "")
    sys.stderr.write(summary + "\n")
    return 1 if beyond else 0


def _lines(modules: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Run the modules; the time of each goes to the error output."""
    for name in modules:
        began = time.monotonic()
        yield from import_module(f"bench.{name}").figures()
        sys.stderr.write(f"{time.monotonic() - began:6.0f} s  {name}\n")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""An earlier commit and this checkout, measured in turn: the figures of both and their ratios."""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HERE = Path(__file__).parents[2]
ROUNDS = 3
IN_BROWSER = {"plots", "page", "view"}
"""Modules that need the page of their commit."""

Lines = dict[str, dict[str, Any]]
"""Lines of a run by name."""


def compare(modules: Sequence[str], commit: str) -> Iterator[dict[str, Any]]:
    """Medians of `ROUNDS` runs of each module, as [old, new, new divided by old]; lines that only one has are left out.

    Each side runs its own benchmarks on its own code, both with the packages of this checkout.
    """
    with _checkout(commit, build=not {*modules}.isdisjoint(IN_BROWSER)) as old:
        for module in modules:
            runs = [(_run(old, module), _run(HERE, module)) for _ in range(ROUNDS)]
            for name in runs[0][1]:
                if name in runs[0][0]:
                    yield _both(name, [(before[name], after[name]) for before, after in runs])


def _both(name: str, pairs: list[tuple[dict[str, Any], dict[str, Any]]]) -> dict[str, Any]:
    figures: dict[str, list[float | None]] = {}
    for key in pairs[0][1]["figures"]:
        if key in pairs[0][0]["figures"]:
            old, new = (statistics.median(one["figures"][key] for one in side) for side in zip(*pairs, strict=True))
            figures[key] = [old, new, round(new / old, 3) if old else None]
    return {"bench": name, "judged": pairs[0][1]["judged"], "old_new_ratio": figures}


@contextmanager
def _checkout(commit: str, *, build: bool) -> Generator[Path]:
    """A temporary worktree of the commit; with `build`, it has its own page if the sources differ."""
    with tempfile.TemporaryDirectory() as folder:
        old = Path(folder) / "old"
        git = ("git", "-C", str(HERE))
        subprocess.run([*git, "worktree", "add", "--quiet", "--detach", str(old), commit], check=True)
        try:
            (old / "web/node_modules").symlink_to(HERE / "web/node_modules")
            if build and subprocess.run([*git, "diff", "--quiet", commit, "--", "web"], check=False).returncode:
                command = ["npm", "--prefix", "web", "run", "--silent", "build"]
                subprocess.run(command, cwd=old, check=True, stdout=subprocess.DEVNULL)
            else:
                (old / "web/dist").symlink_to(HERE / "web/dist")
            yield old
        finally:
            subprocess.run([*git, "worktree", "remove", "--force", str(old)], check=True)


def _run(checkout: Path, module: str) -> Lines:
    paths = os.pathsep.join(str(checkout / part) for part in ("server", "tests", ""))
    ran = subprocess.run(
        [sys.executable, "tests/bench/__main__.py", module], cwd=checkout, env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE, check=False,
    )  # fmt: skip
    return {found["bench"]: found for found in map(json.loads, ran.stdout.splitlines())}

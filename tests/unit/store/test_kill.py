"""Acknowledged rows survive a killed server. Few kills here, many in release/test_kill.py."""

import os
import re
import secrets
import subprocess
import sys
from pathlib import Path

import hornbill

ROOTS = Path(hornbill.__file__).parent.parent, Path(__file__).parents[2]


def kill_and_check(place: str, kills: int) -> None:
    """Kill a writer this many times at random points, and check that every acknowledged row is stored."""
    seed = secrets.randbits(32)
    fresh = [] if "://" in place else ["FRESH"]
    done = subprocess.run(
        [sys.executable, Path(__file__).with_name("killing.py"), str(seed), str(kills), place, *fresh],
        env={"PYTHONPATH": os.pathsep.join((*map(str, ROOTS), *sys.path)), "PATH": os.defpath},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, f"seed {seed}: {done.stderr[-3000:]}"
    found = re.match(r"(\d+) kills, (\d+) rows", done.stdout)
    assert found is not None, done.stdout
    assert int(found[1]) == kills
    assert int(found[2]) > kills, f"too few rows: {done.stdout}"


def test_acknowledged_rows_survive_kills(place: str) -> None:
    kill_and_check(place, 12)

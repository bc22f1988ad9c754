"""The server may be killed at any moment: what was acknowledged is there, and the next start is clean."""

import os
import re
import secrets
import subprocess
import sys
from pathlib import Path

import hornbill

KILLS = 110
ROOTS = Path(hornbill.__file__).parent.parent, Path(__file__).parents[2]


def test_every_acknowledged_row_survives_kills_at_random_points(place: str) -> None:
    seed = secrets.randbits(32)
    fresh = [] if "://" in place else ["FRESH"]
    done = subprocess.run(
        [sys.executable, Path(__file__).with_name("killing.py"), str(seed), str(KILLS), place, *fresh],
        env={"PYTHONPATH": os.pathsep.join((*map(str, ROOTS), *sys.path)), "PATH": os.defpath},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, f"seed {seed}: {done.stderr[-3000:]}"
    found = re.match(r"(\d+) kills, (\d+) rows", done.stdout)
    assert found is not None, done.stdout
    assert int(found[1]) == KILLS
    assert int(found[2]) > KILLS, f"too few rows for the kills to hit anything: {done.stdout}"
    print(done.stdout)

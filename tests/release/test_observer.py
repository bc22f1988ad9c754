"""An observer sends no frame in ten minutes of page loads, doctor, Stop, a crash and a restart, counted by candump."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
SECONDS = 600


def test_an_observer_sends_no_frame_in_ten_minutes() -> None:
    wrapper = shlex.split(os.environ.get("HORNBILL_VCAN_WRAPPER", ""))
    if not wrapper and not Path("/sys/class/net/vcan0").exists():
        pytest.skip("no vcan0 here, and no HORNBILL_VCAN_WRAPPER")
    if wrapper:
        wrapper += ["--timeout", str(SECONDS + 300), "--"]
    test = "tests/socketcan/test_beside_an_autopilot.py::test_an_observer_sends_no_frame"
    command = [*wrapper, sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test]
    environment = {**os.environ, "HORNBILL_OBSERVED_S": str(SECONDS)}
    done = subprocess.run(
        command, cwd=TESTS.parent, env=environment, capture_output=True, text=True, timeout=SECONDS + 400, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout

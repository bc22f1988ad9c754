"""The test of SIGUSR1: the process itself takes the stop, when no page and no program does."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import httpx
import pytest

PATIENCE_S = 60.0


def until(look: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE_S
    while not look():
        assert time.monotonic() < end, what
        time.sleep(0.05)


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
def test_sigusr1_stops_every_servo_and_says_who_it_was() -> None:
    command = [sys.executable, "-m", "hornbill", "demo", "--port", "0", "--servos", "2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+/", process.stdout.readline())
            assert found is not None
            with httpx.Client(base_url=found[0] + "api/v1", timeout=PATIENCE_S) as api:
                until(lambda: len(api.get("/servos").json()) == 2, "both servos are found")
                assert api.get("/stop").json()["latched"] is False
                os.kill(process.pid, signal.SIGUSR1)
                until(lambda: bool(api.get("/stop").json()["latched"]), "it is stopped")
                stop = api.get("/stop").json()
                assert (stop["by"], stop["mode"]) == ("signal SIGUSR1", "off")
                assert len(stop["servos"]) == 2
                until(lambda: all(one["confirmed"] for one in api.get("/stop").json()["servos"]), "both confirm")
                assert process.poll() is None
        finally:
            process.terminate()
            process.wait(timeout=PATIENCE_S)

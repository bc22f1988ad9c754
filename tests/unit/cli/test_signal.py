"""SIGUSR1 stops every servo, without a page or a client."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import httpx
import pytest

TIMEOUT_S = 60.0


def until(done: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not done():
        assert time.monotonic() < end, what
        time.sleep(0.05)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGUSR1")
def test_sigusr1_stops_every_servo() -> None:
    command = [sys.executable, "-m", "hornbill", "demo", "--port", "0", "--servos", "2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+/", process.stdout.readline())
            assert found is not None
            with httpx.Client(base_url=found[0] + "api/v1", timeout=TIMEOUT_S) as api:
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
            process.wait(timeout=TIMEOUT_S)

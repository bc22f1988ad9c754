"""SIGUSR1 stops every servo, without a page or a client. SIGTERM turns torque off before the server ends."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from typer.testing import CliRunner

from hornbill.cli import app

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


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM")
def test_sigterm_turns_the_torque_of_a_moving_servo_off_first(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hornbill", "serve", "--sim-api", "--port", "0", "--data-dir", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+/", process.stdout.readline())
            assert found is not None
            with httpx.Client(base_url=found[0] + "api/v1", timeout=TIMEOUT_S) as api:
                new = {"model": "BLA21-06U-A0", "firmware": "1.300", "node_id": 20, "servo_id": 5}
                servo = f"/servos/{api.post('/sim/servos', json=new).raise_for_status().json()['uid']}"
                until(lambda: api.get(servo).is_success and api.get(servo).json()["state"] == "ready", "it is ready")
                changed = api.put(f"{servo}/parameters/speed_torque_control", json={"value": True})
                changed.raise_for_status()
                api.post("/bus/log", json={"name": "end"}).raise_for_status()
                lease = {"Lease": api.post("/leases", json={"holder": "test", "ttl_s": 30}).json()["id"]}
                api.post(f"{servo}/torque", json={"mode": "on"}, headers=lease).raise_for_status()
                turning = {"type": "speed", "value": 20}
                api.post(f"{servo}/command", json=turning, headers=lease).raise_for_status()
                until(lambda: api.get(servo).json()["angle_deg"] > 5, "it moves")
        finally:
            process.terminate()
            process.wait(timeout=TIMEOUT_S)
    done = CliRunner().invoke(app, ["decode", "--json", str(tmp_path / "logs" / "end.log")])
    frames: list[dict[str, Any]] = [json.loads(line) for line in done.stdout.splitlines()]
    torque = [one for one in frames if one["type"].endswith("GetSet") and one["fields"]["name"] == "0x20"]
    assert [(one["kind"], one["fields"]["value"].get("value"), one["source"]) for one in torque[-2:]] == [
        ("request", 1, 127),
        ("response", 1, 20),
    ], "the servo confirms that it is off"

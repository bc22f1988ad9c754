"""Two processes on a kernel's CAN: simulated servos in one, the server in the other, as with real adapters."""

import re
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

PATIENCE_S = 60.0
"""Starting is slow where system calls are dear."""


@contextmanager
def hornbill(*words: str) -> Generator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "hornbill", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.wait(timeout=20)


def until(look: Callable[[], Any], what: str) -> Any:
    end = time.monotonic() + PATIENCE_S
    while not (found := look()):
        assert time.monotonic() < end, what
        time.sleep(0.3)
    return found


def test_a_servo_of_another_process_is_configured_saved_and_moved(vcan0: str, tmp_path: Path) -> None:
    serving = ("serve", "--bus", vcan0, "--port", "0", "--data-dir", str(tmp_path / "data"))
    with hornbill("sim", "--bus", vcan0, "--servos", "2") as sim, hornbill(*serving) as server:
        assert sim.stdout is not None
        assert server.stdout is not None
        found = re.search(r"http://\S+/", server.stdout.readline())
        assert found is not None
        api = httpx.Client(base_url=found[0] + "api/v1", timeout=60)

        def ready() -> list[dict[str, Any]]:
            servos = [one for one in api.get("/servos").json() if one["state"] == "ready"]
            return servos if len(servos) == 2 else []

        one, other = until(ready, "two servos ready")
        assert {one["model"], other["model"]} == {"BLA21-06U-A0", "BLA15-06U-A0"}
        assert len(api.get("/allocations").json()["allocations"]) == 1, "one of the two asked for its node id"
        path = f"/servos/{one['uid']}"
        patched = api.patch(path + "/parameters", json={"values": {"angle_limit_cw": 75}}).json()
        assert patched["outcome"] == "applied"
        job = api.post(path + "/save?wait=true").json()
        assert job["state"] == "succeeded", job
        lease = api.post("/leases", json={"holder": "test", "ttl_s": 30}).json()["id"]
        command = {"type": "angle", "value": 30, "wait": "settled", "timeout_s": 20}
        moved = api.post(path + "/command", json=command, headers={"Lease": lease}).json()
        assert moved["settled"] is True, moved
        stopped = api.post("/stop").json()
        assert stopped["latched"]
        until(lambda: all(each["confirmed"] for each in api.get("/stop").json()["servos"]), "all stopped")
        api.close()

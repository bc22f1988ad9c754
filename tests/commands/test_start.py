"""`hornbill demo`, started as a user does: it prints its address, finds nothing wrong, and ends."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest

from commands.command_line import hornbill
from e2e.servers import running_demo, until
from hornbill.client import Hornbill


def test_a_demo_starts_finds_nothing_wrong_and_ends_and_its_port_is_in_use() -> None:
    with running_demo("--servos", "2", "--seed", "5") as (process, url):
        api = httpx.Client(base_url=url + "api/v1", timeout=60)
        assert api.get("/health").json()["demo"] is True
        until(lambda: [one["state"] for one in api.get("/servos").json()] == ["ready"] * 2, 60, "not ready")
        assert "<title>" in httpx.get(url).text

        port = re.search(r":(\d+)/", url)
        assert port is not None
        command = [sys.executable, "-m", "hornbill", "demo", "--port", port[1]]
        again = subprocess.run(command, capture_output=True, text=True, check=False)
        assert again.returncode == 9
        assert "--port" in again.stderr

        # A computer that was busy is a finding for ten seconds.
        until(lambda: "busy" not in hornbill(url, "doctor").output, 60, "the computer is busy")
        examined = hornbill(url, "doctor")
        assert examined.exit_code == 0, examined.output
        assert re.fullmatch(r"0 findings, \d\d checks passed\.\n", examined.stdout)
        as_json = hornbill(url, "doctor", "--json")
        assert (as_json.exit_code, json.loads(as_json.stdout)) == (0, [])

        api.delete("/bus").raise_for_status()
        examined = hornbill(url, "doctor")
        assert examined.exit_code == 1
        assert examined.stdout.startswith("Failure: No bus is connected\n")
        assert "hornbill bus connect INTERFACE:CHANNEL." in examined.stdout
        assert "/api/v1" not in examined.stdout
        as_json = hornbill(url, "doctor", "--json")
        assert (as_json.exit_code, [one["code"] for one in json.loads(as_json.stdout)]) == (1, ["no_bus"])

        api.close()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0


def test_a_demo_in_virtual_time_with_faults_keeps_leases_and_refuses_adapters() -> None:
    with running_demo("--servos", "1", "--speed", "20", "--chaos", "3") as (process, url):
        api = httpx.Client(base_url=url + "api/v1", timeout=60)
        until(lambda: [one["state"] for one in api.get("/servos").json()] == ["ready"], 60, "not ready")
        first = api.get("/sim/clock").json()
        assert (first["virtual"], first["speed"]) == (True, 20)
        assert api.get("/sim/chaos").json()["seed"] == 3
        with Hornbill(url) as client, client.lease("a rig in virtual time", ttl_s=30) as lease:
            until(lambda: api.get("/sim/clock").json()["elapsed_s"] - first["elapsed_s"] > 60, 60, "no time passes")
            assert lease.lost is None
        second = api.get("/sim/clock").json()
        # a late clock catches up, so the speed is limited on average since the start
        began = second["now"] - second["elapsed_s"]
        assert second["elapsed_s"] <= 20 * (time.time() - began) + 5
        assert api.put("/sim/clock", json={"speed": "max"}).json()["speed"] == "max"
        refused = api.put("/bus", json={"address": "socketcan:can0"}).json()
        assert (refused["code"], refused["cause"]) == ("bus_open_failed", "virtual_time")
        assert "--speed" in refused["detail"]
        api.close()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0


def test_a_network_address_without_a_token_is_rejected() -> None:
    refused = subprocess.run(
        [sys.executable, "-m", "hornbill", "demo", "--host", "0.0.0.0"],
        capture_output=True, text=True, check=False, timeout=60,
        env={**os.environ, "HORNBILL_CONTAINER": "0"},  # in a container it would be allowed
    )  # fmt: skip
    assert refused.returncode == 2
    assert "127.0.0.1" in refused.stderr


@pytest.mark.parametrize(("program", "node_id"), [("ardupilot", 10), pytest.param("px4", 1, marks=pytest.mark.release)])
def test_a_demo_with_an_autopilot_is_joined_as_guest(program: str, node_id: int) -> None:
    began = time.monotonic()
    with running_demo("--servos", "3", "--autopilot", program) as (_, url):
        while True:
            servos = {one["servo_id"]: one["commanded_by"] for one in httpx.get(url + "api/v1/servos").json()}
            if servos.get(1) and servos.get(3):
                break
            assert time.monotonic() - began < 60
            time.sleep(0.2)
        assert {by["node_id"] for by in servos[1] + servos[3]} == {node_id}
        assert servos.get(0, []) == [], "a new servo has no servo ID"
        assert httpx.get(url + "api/v1/bus").json()["role"] == "guest"


@pytest.mark.release
def test_the_outputs_of_a_moving_autopilot_do_not_match_a_plan(tmp_path: Path) -> None:
    plan = tmp_path / "plan.json"
    with running_demo("--servos", "1", "--autopilot", "ardupilot") as (_, url):
        while not [one for one in httpx.get(url + "api/v1/servos").json() if one["state"] == "ready"]:
            time.sleep(0.2)
        begin = [sys.executable, "-m", "hornbill", "autopilot", "plan", "--server", url]
        plan.write_text(subprocess.run(begin, capture_output=True, text=True, check=True).stdout)
        verify = [sys.executable, "-m", "hornbill"]
        verify += ["autopilot", "verify", str(plan), "--server", url]
        done = subprocess.run(verify, input="\n" * 9, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1, done.stderr
    assert "not_moved" in done.stdout, "a sweep is no held control"

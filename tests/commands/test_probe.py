"""`hornbill probe` determines the settings of a simulated servo."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from e2e.servers import Server, running, until
from hornbill.client import Hornbill
from hornbill.errors import Conflict, Stopped
from hornbill.probe.steps import Probe, ProbeResult
from hornbill.wire.services import GetSetRequest

UNITS = ("hundred_degrees", "radian", "degree", "tenth_degree")


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with running("demo", "--servos", "5", "--seed", "3") as started:
        started.ready(5)
        yield started


def results(probed: ProbeResult) -> dict[str, object]:
    return {one.key: one.value for one in probed.answers}


def quick(seconds: float) -> None:
    time.sleep(seconds / 3)


def connected(server: Server, number: int) -> str:
    """A new ready servo with a node ID; one of the demo oscillates and does not settle."""
    body = {"model": "BLA21-06U-A0", "firmware": "1.300", "node_id": number, "servo_id": number}
    uid = str(server.api.post("/sim/servos", json=body).raise_for_status().json()["uid"])
    until(lambda: any(one["uid"] == uid and one["state"] == "ready" for one in server.servos()), 40, "it is not ready")
    return uid


@pytest.mark.parametrize(
    "place", [0, *(pytest.param(one, marks=pytest.mark.release) for one in range(1, 4))], ids=UNITS
)
def test_it_determines_each_unit_of_a_position(server: Server, place: int) -> None:
    uid = connected(server, 40 + place)
    server.api.patch(f"/sim/servos/{uid}", json={"position_unit": UNITS[place]}).raise_for_status()
    server.api.put(f"/servos/{uid}/position-unit", json={"unit": None}).raise_for_status()
    with Hornbill(server.url) as hornbill:
        probed = Probe(hornbill, hornbill.find(uid=uid), lambda text: text.startswith("Turns"), sleep=quick).run()
        assert hornbill.find(uid=uid).read("torque_mode") == "off"
    assert results(probed)["position_unit"] == UNITS[place]
    assert probed.completed == ["read", "move"]
    assert set(probed.skipped) == {"restart", "save"}


@pytest.mark.release
@pytest.mark.parametrize("usual", [False, True])
def test_it_determines_restart_and_save(server: Server, tmp_path: Path, usual: bool) -> None:
    uid = str(server.servos()[0]["uid"])  # it has a stored node ID: requesting one takes a second
    switches = {"acknowledges_save": usual, "acknowledges_restart": usual, "array_command_shows": usual}
    body = {"behaviour": switches, "restart_delay_s": 0.3 if usual else 2.5}
    server.api.patch(f"/sim/servos/{uid}", json=body).raise_for_status()
    command = [sys.executable, "-m", "hornbill", "probe", uid, "--yes-move", "--json", "--report", tmp_path / "x"]
    found: dict[str, Any] = {"array_command_obeyed": None}
    report: dict[str, Any] = {}
    for _ in range(5):
        if found["array_command_obeyed"] is not None:
            break
        # "not read in time" is the right answer on a machine that is too busy
        ran = subprocess.run(
            command, capture_output=True, text=True, check=False, env={**os.environ, "HORNBILL_URL": server.url}
        )
        assert ran.returncode == 0, ran.stderr
        report = json.loads(ran.stdout)
        assert report["completed"] == ["read", "move", "restart", "save"]
        found = {one["key"]: one["value"] for one in report["answers"]}
    for name in ("acknowledges_save", "acknowledges_restart"):
        assert found[name] is usual, name
    assert (found["array_command_obeyed"], found["array_command_shows"]) == (True, usual)
    assert found["save_opcode_restarts"] is True
    assert found["restart_loses_ram"] is True
    assert found["keeps_node_id"] is True
    delay_s = body["restart_delay_s"]
    assert isinstance(delay_s, float)
    slack_s = 10  # a busy machine delays what is measured
    assert delay_s <= found["restart_time_s"] < delay_s + slack_s
    assert delay_s + 0.05 <= found["save_time_s"] < delay_s + 0.05 + slack_s
    assert 0.09 < found["status_interval_s"] < 0.11
    assert 0.9 < found["node_status_interval_s"] < 1.1
    assert found["status_unused_zero"] is True
    assert 0.0003 < found["latency_s"] < 0.1
    servo = server.api.get(f"/servos/{uid}").json()
    assert found["identity"]["0x53"] == servo["hardware_version"]
    assert found["refused_rows"] == []
    markdown = (tmp_path / "x.md").read_text(encoding="utf-8")
    assert "| Is SAVE acknowledged? | " + ("Yes" if usual else "No") in markdown
    assert json.loads((tmp_path / "x.json").read_text(encoding="utf-8")) == report
    assert (tmp_path / "x.log").stat().st_size > 10_000


def test_without_confirmation_nothing_is_written_and_nothing_moves(server: Server, tmp_path: Path) -> None:
    from hornbill.probe.evidence import ProbeEvidence
    from hornbill.wire.messages import ArrayCommand
    from hornbill.wire.services import ExecuteOpcodeRequest, RestartNodeRequest
    from hornbill.wire.value import ValueKind

    with Hornbill(server.url) as hornbill:
        servo = hornbill.servos()[0]
        probed = Probe(hornbill, servo, lambda _text: False, sleep=quick).run()
    assert probed.completed == ["read"]
    (tmp_path / "x.log").write_bytes(probed.recording)
    seen = ProbeEvidence.read(tmp_path / "x.log", range(1, 128)).transfers
    requests = [one.structure for one in seen if isinstance(one.structure, GetSetRequest)]
    assert len(requests) > 50
    assert all(one.value.kind is ValueKind.EMPTY for one in requests)
    assert not [
        one for one in seen if isinstance(one.structure, (ArrayCommand, ExecuteOpcodeRequest, RestartNodeRequest))
    ]


def test_unsaved_values_and_a_stop_prevent_it(server: Server) -> None:
    with Hornbill(server.url) as hornbill:
        servo = hornbill.servos()[0]
        before = servo.read("angle_p_gain")
        assert isinstance(before, int)
        servo.write("angle_p_gain", before + 1)
        with pytest.raises(Conflict, match="angle_p_gain"):
            Probe(hornbill, servo, lambda _text: True).run()
        servo.write("angle_p_gain", before)
        hornbill.stop()
        with pytest.raises(Stopped, match="stop --clear"):
            Probe(hornbill, servo, lambda _text: True).run()
        hornbill.clear_stop()

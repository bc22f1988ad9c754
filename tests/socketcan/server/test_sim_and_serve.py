"""A complete job over REST on a Linux CAN bus, on a servo of another process."""

import pytest

from socketcan.processes import until
from socketcan.server.bench import Bench

pytestmark = pytest.mark.release


def test_a_servo_of_another_process_is_configured_saved_and_moved(bench: Bench) -> None:
    api = bench.api
    one, other = until(bench.ready, "two servos ready")
    assert (one["model"], other["model"]) == ("BLA21-06U-A0", "BLA15-06U-A0")
    assert bench.allocations()[other["uid"]] == other["node_id"], "one of the two requested its node ID"
    assert one["uid"] not in bench.allocations()
    path = f"/servos/{one['uid']}"
    # Its own timeout of one second could strike while a busy machine lets neither process run.
    values = {"angle_limit_cw": 75, "timeout_time": 5000}
    patched = api.patch(path + "/parameters", json={"values": values}).json()
    assert patched["outcome"] == "applied"
    job = api.post(path + "/save?wait=true", json={"confirm": ["torque_on_in_rom"]}).json()
    assert job["state"] == "succeeded", job
    reading = api.get(path + "/parameters/angle_limit_cw").json()
    assert (reading["value"], reading["rom"], reading["stale"]) == (75, 75, False)
    lease = api.post("/leases", json={"holder": "test", "ttl_s": 30}).json()["id"]
    command = {"type": "angle", "value": 30, "wait": "settled", "timeout_s": 60}
    moved = api.post(path + "/command", json=command, headers={"Lease": lease}).json()
    assert moved["settled"] is True, moved
    api.delete(f"/leases/{lease}")
    stopped = api.post("/stop").json()
    assert stopped["latched"]
    until(lambda: all(each["confirmed"] for each in api.get("/stop").json()["servos"]), "all stopped")
    api.delete("/stop")


def test_every_parameter_of_both_servos_is_read_and_listed(bench: Bench) -> None:
    for servo in until(bench.ready, "two servos ready"):
        found = bench.api.get(f"/servos/{servo['uid']}/parameters?refresh=true").json()["parameters"]
        assert len(found) == 51, "all but the four rows for PWM input, which neither model has"
        assert not [key for key, each in found.items() if each["raw"] is None]
        assert found["node_id"]["value"] == (servo["node_id"] if servo["uid"] == bench.resident else 0)
        assert found["model_number"]["raw"] in (61, 62)


def test_a_saved_servo_keeps_its_allocated_node_id(bench: Bench) -> None:
    path = f"/servos/{bench.requesting}"
    before = bench.api.get(path).json()
    changed = bench.api.patch(path + "/parameters", json={"values": {"servo_id": 9}}).json()
    assert changed["outcome"] == "applied"
    job = bench.api.post(path + "/save?wait=true", json={"torque_on": True}).json()  # a test before moved it
    assert job["state"] == "succeeded", job
    after = bench.api.get(path).json()
    assert (after["node_id"], after["servo_id"]) == (before["node_id"], 9)

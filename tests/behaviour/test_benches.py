"""Benches that share a database."""

from behaviour.rig import Rig, json
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo


@scene()
async def test_a_bench_reports_its_bus_servos_and_motion_control(rig: Rig, servo: Servo, lease: str) -> None:
    (bench,) = json(await rig.call("GET", "/benches"))
    assert (bench["name"], bench["state"], bench["is_this"]) == (rig.host.bench, "online", True)
    assert (bench["bus"], bench["bus_state"], bench["role"]) == ("memory:host", "active", "host")
    assert (bench["servos_online"], bench["servos_total"], bench["faults"]) == (1, 1, 0)
    assert (bench["holder"], bench["torque_stopped"]) == ("test", False)
    json(await rig.call("POST", "/stop"))
    (bench,) = json(await rig.call("GET", "/benches"))
    assert (bench["holder"], bench["torque_stopped"]) == ("test", True)

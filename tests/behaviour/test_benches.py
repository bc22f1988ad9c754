"""Benches that share a database."""

import asyncio
from pathlib import Path
from typing import Any

from behaviour.rig import Rig, json
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.store.servos import ServoFacts
from hornbill.store.store import Store
from hornbill.units import Uid


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


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_servos_of_other_benches_are_in_the_inventory_with_bench_and_last_contact(
    rig: Rig, servo: Servo, tmp_path: Path
) -> None:
    there = Uid("5a" * 16)
    with Store(tmp_path, bench="right", wall=lambda: 1000.0) as right:
        right.servos.seen(there, ServoFacts(model="BLA21-06U-A0"))
    found: list[Any] = []
    async with asyncio.timeout(30):
        while not found:  # a refresh that had begun before does not contain it
            await rig.host.store.refresh()
            found = json(await rig.call("GET", "/inventory?q=5a5a"))
    (one,) = found
    assert (one["uid"], one["online"]) == (there, False)
    assert (one["bench"], one["bench_seen_at"]) == ("right", 1000.0)
    (own,) = json(await rig.call("GET", f"/inventory?q={servo.serial}"))
    assert (own["uid"], own["bench"]) == (servo.uid, rig.host.bench)

"""The firmware version of a servo: what 0x52 says, whatever rows it answers or refuses."""

from dataclasses import replace

import pytest

from behaviour.rig import PLAIN, Rig, json
from behaviour.scene import scene
from hornbill.units import Uid

UID = bytes(range(16))


@pytest.mark.parametrize("firmware", ["1.010", "1.300"])
@scene(lambda firmware: replace(PLAIN, firmware=firmware, uid=UID))
async def test_it_is_what_0x52_says_also_where_every_newer_row_is_refused(rig: Rig, firmware: str) -> None:
    oldest = rig.host.catalog.firmware_steps[0]
    newer = {row.key for row in rig.host.catalog.parameters.values() if row.since != oldest}
    assert newer
    rig.bench.servo(Uid(UID.hex())).conditions.refuse_keys |= newer
    (servo,) = await rig.ready()
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["firmware"] == firmware
    assert servo.model is not None
    assert set(servo.registers) == set(servo.model.rows(servo.firmware))


@scene(replace(PLAIN, firmware="1.010", uid=UID))
async def test_it_is_unknown_where_0x52_is_refused_and_not_guessed_from_the_rows(rig: Rig) -> None:
    rig.bench.servo(Uid(UID.hex())).conditions.refuse_keys.add("firmware_version")
    (servo,) = await rig.ready()
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["firmware"] is None

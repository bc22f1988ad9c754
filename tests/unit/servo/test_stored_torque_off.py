"""The note of servos with torque on for a save, in a store that a thread writes."""

import asyncio
from pathlib import Path
from typing import Any, cast

from hornbill.schema.catalog import Catalog
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Hub
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.servo.torque_off.stored import SAVES_KEY, StoredTorqueOff
from hornbill.store.store import Store
from hornbill.units import Raw, Uid

CATALOG = Catalog.load()


def test_every_servo_with_torque_on_for_a_save_is_noted_until_the_save_ends(tmp_path: Path) -> None:
    servos = [Servo(Uid(f"{number:02x}" * 16), CATALOG) for number in range(5)]

    def noted() -> set[str]:
        with Store(tmp_path) as other:
            stored = other.settings.get(SAVES_KEY, {})
            assert isinstance(stored, dict)
            return set(stored)

    async def scene(store: Store) -> None:
        unused = cast(Any, None)
        stored = StoredTorqueOff(store, unused, unused, TimeBase(lambda: 0.0), Hub())
        await asyncio.gather(*(stored.energising(one, Raw(0), one.output_state) for one in servos))
        assert noted() == {one.uid for one in servos}
        await asyncio.gather(stored.energising(servos[0], Raw(0), servos[0].output_state), over(stored, servos[1]))
        await store.settled()
        assert noted() == {one.uid for one in servos} - {servos[1].uid}

    async def over(stored: StoredTorqueOff, servo: Servo) -> None:
        stored.over(servo)

    async def run() -> None:
        with Store(tmp_path) as store:
            store.begin()
            await scene(store)

    asyncio.run(run())

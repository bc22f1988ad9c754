"""What is noted of outputs that are on for a save, while a server runs whose store is written by a thread."""

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


def test_outputs_that_come_on_at_once_are_all_noted_in_the_database_and_each_until_it_is_over(tmp_path: Path) -> None:
    servos = [Servo(Uid(f"{number:02x}" * 16), CATALOG) for number in range(5)]

    def noted() -> set[str]:
        with Store(tmp_path) as other:
            kept = other.settings.get(SAVES_KEY, {})
            assert isinstance(kept, dict)
            return set(kept)

    async def scene(store: Store) -> None:
        nobody = cast(Any, None)  # nothing is owed, and nobody stops
        kept = StoredTorqueOff(store, nobody, nobody, TimeBase(lambda: 0.0), Hub())
        await asyncio.gather(*(kept.energising(one, Raw(0), one.output_state) for one in servos))
        assert noted() == {one.uid for one in servos}
        await asyncio.gather(kept.energising(servos[0], Raw(0), servos[0].output_state), over(kept, servos[1]))
        await store.settled()
        assert noted() == {one.uid for one in servos} - {servos[1].uid}

    async def over(kept: StoredTorqueOff, servo: Servo) -> None:
        kept.over(servo)

    async def run() -> None:
        with Store(tmp_path) as store:
            store.begin()
            await scene(store)

    asyncio.run(run())

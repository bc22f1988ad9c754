"""Stored knowledge of each servo, and how much of it is still valid when the servo is seen again."""

import logging

from hornbill.servo.device.drift import DriftDetector, doubtful, drifted
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.servos import ServoFacts, StoredServo
from hornbill.store.store import Store

log = logging.getLogger(__name__)


class RomKnowledge:
    """The stored inventory, as used by the fleet."""

    def __init__(self, store: Store, hub: Hub, base: TimeBase, drift: DriftDetector) -> None:
        self._store = store
        self._inventory = store.servos
        self._hub = hub
        self._base = base
        self._drift = drift

    def all(self) -> list[StoredServo]:
        """All known servos."""
        return self._inventory.all()

    def here(self) -> list[StoredServo]:
        """Servos that were last seen on this bench."""
        return [one for one in self.all() if one.bench in (None, self._store.bench)]

    def recall(self, servo: Servo) -> None:
        """Restore stored ROM values if the servo has not restarted since: only a save changes ROM, and it restarts."""
        stored = self._inventory.get(servo.uid)
        if servo.rom_lost or stored is None or stored.last_seen is None or servo.status is None:
            return
        self._base.follow()  # the computer may have been suspended since the last check
        away = self._base.utc_now() - stored.last_seen
        if away < 0:  # the clock was set meanwhile, so the time proves nothing
            return
        if servo.status.uptime_sec > away + 2:
            doubt = doubtful(stored)
            for key, raw in stored.rom.items():
                if key not in doubt and key in servo.registers and servo.registers[key].rom is None:
                    servo.registers[key].rom = raw

    async def doubt(self, servo: Servo) -> None:
        """Mark the values in ROM as doubtful until `remember`. Await before sending anything that may change ROM.

        Otherwise a later process that finds the servo still running would assume the old values. The database is
        updated when this returns. Never raises.
        """
        try:
            stored = self._inventory.get(servo.uid)
            if stored is not None:
                self._inventory.put_drift(servo.uid, {**stored.rom, **stored.drift})
                self._inventory.put_rom(
                    servo.uid, {k: raw for k, raw in stored.rom.items() if k not in drifted(stored)}
                )
                await self._store.settled()
        except Exception:  # a full disk must not block a save
            log.exception("doubtful ROM values of %s could not be stored", servo.title)

    def remember(self, servo: Servo) -> None:
        """Compare a servo's ROM values with the stored ones, then store them and its identity. Never raises."""
        facts = ServoFacts(
            name=servo.name, model=servo.model.name if servo.model else None, model_number=servo.model_number,
            hardware_version=servo.hardware_version, firmware=servo.firmware, serial=servo.serial_number,
            production_date=servo.production_date, node_id=servo.node_id, servo_id=servo.servo_id,
        )  # fmt: skip
        try:
            rom = self._drift.check(servo, self._inventory.get(servo.uid))
            self._inventory.seen(servo.uid, facts)
            self._inventory.put_rom(servo.uid, rom)
        except Exception:  # a full disk must not block monitoring and stopping this servo
            log.exception("%s could not be stored", servo.title)
            text = f"Data of {servo.title} could not be stored. Check the data folder and its disk."
            self._hub.publish(
                LogEvent("warning", "store_failed", text, servo.uid, {"what": "servo", "servo": servo.title})
            )

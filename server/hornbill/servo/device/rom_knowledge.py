"""What is kept of a servo beyond this process, and what of it still holds when it is seen again."""

import logging

from hornbill.servo.device.drift import DriftDetector, doubtful, drifted
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.servos import ServoFacts, StoredServo
from hornbill.store.store import Store

log = logging.getLogger(__name__)


class RomKnowledge:
    """The inventory as the fleet uses it."""

    def __init__(self, store: Store, hub: Hub, base: TimeBase, drift: DriftDetector) -> None:
        self._store = store
        self._inventory = store.servos
        self._hub = hub
        self._base = base
        self._drift = drift

    def all(self) -> list[StoredServo]:
        """Every servo ever met."""
        return self._inventory.all()

    def recall(self, servo: Servo) -> None:
        """ROM changes only by a save, and a save restarts the servo: what was known holds while it has run on."""
        kept = self._inventory.get(servo.uid)
        if servo.rom_lost or kept is None or kept.last_seen is None or servo.status is None:
            return
        self._base.follow()  # the computer may have been suspended since the last look
        away = self._base.utc_now() - kept.last_seen
        if away < 0:  # the clock was set meanwhile: it proves nothing
            return
        if servo.status.uptime_sec > away + 2:
            doubt = doubtful(kept)
            for key, raw in kept.rom.items():
                if key not in doubt and key in servo.registers and servo.registers[key].rom is None:
                    servo.registers[key].rom = raw

    async def doubt(self, servo: Servo) -> None:
        """Wait for it before something is sent that may change ROM: until `remember` knows better, nobody knows it.

        Without this, whoever meets a servo that did not restart would take for ROM what it held before. It is in the
        database when this returns. Never raises.
        """
        try:
            kept = self._inventory.get(servo.uid)
            if kept is not None:
                self._inventory.keep_drift(servo.uid, {**kept.rom, **kept.drift})
                self._inventory.keep_rom(servo.uid, {k: raw for k, raw in kept.rom.items() if k not in drifted(kept)})
                await self._store.settled()
        except Exception:  # a full disk keeps nobody from saving
            log.exception("what is in doubt of %s could not be kept in the store", servo.title)

    def remember(self, servo: Servo) -> None:
        """Keep who a servo is and what its ROM holds, compared with what was known of it. Never raises."""
        facts = ServoFacts(
            name=servo.name, model=servo.model.name if servo.model else None, model_number=servo.model_number,
            hardware_version=servo.hardware_version, firmware=servo.firmware, serial=servo.serial_number,
            production_date=servo.production_date, node_id=servo.node_id, servo_id=servo.servo_id,
        )  # fmt: skip
        try:
            rom = self._drift.look(servo, self._inventory.get(servo.uid))
            self._inventory.met(servo.uid, facts)
            self._inventory.keep_rom(servo.uid, rom)
        except Exception:  # a full disk must not keep anybody from watching and stopping this servo
            log.exception("%s could not be kept in the store", servo.title)
            text = f"What is known of {servo.title} could not be stored. Check the data folder and its disk."
            self._hub.publish(
                LogEvent("warning", "store_failed", text, servo.uid, {"what": "servo", "servo": servo.title})
            )

"""Owns Quencher: torque off, or the brake, written into 0x20 of one servo until it answers that it holds it."""

import asyncio
import logging
from collections.abc import Callable

from hornbill.errors import HornbillError
from hornbill.schema.parameter import Parameter
from hornbill.servo.asking import STOP, Asker
from hornbill.servo.servo import Servo
from hornbill.units import Raw

log = logging.getLogger(__name__)

MODES: dict[str, Raw] = {"off": 1, "brake": 2}
"""Values of 0x20 that take the output away (section 4.13): 0 is ON and is not here."""

AGAIN_S = 0.02
AGAIN_LATER_S = 0.25
AGAIN_ABSENT_S = 1.0
"""Pauses between two tries: at first; of a servo that is heard and does not answer; of one that is not even heard,
which may be switched off for good. It is asked at once when it comes back."""

SOON = 25
"""Tries at the first pause, half a second in all."""

NEVER_FOR_LONG_S = 60.0
_OFF: Raw = 1


class Quencher:
    """Writes with the priority of stop, past every queue. Holds no list of servos: whoever calls knows whom."""

    def __init__(self, asker: Asker, row: Parameter) -> None:
        """`row` is torque_mode, 0x20."""
        self._asker = asker
        self._row = row
        self._hurry = asyncio.Event()
        self._hurried = 0

    def hurry(self) -> None:
        """Ask at once, and often, whoever has not answered yet: the bus is back, or a servo is."""
        self._hurried += 1
        self._hurry.set()
        self._hurry = asyncio.Event()

    async def quench(self, servo: Servo, mode: str) -> None:
        """Write `mode` (off or brake), again and again until the servo answers that it holds it.

        While it is offline another may sit on its node id and answer instead of it: that does not count.
        """
        wanted, tries = MODES[mode], 0
        while True:
            hurried = self._hurried
            try:
                if await self._asker.write(servo, self._row, wanted, STOP) == wanted:
                    if servo.online:
                        return
                    tries = SOON
            except HornbillError as error:
                log.debug("%s: torque %s: %s", servo.title, mode, error.detail)
            except Exception:  # whatever it is, the servo still has to be stopped
                log.exception("%s: torque %s", servo.title, mode)
            tries = 0 if await self._pause(servo, tries + 1, hurried) else tries + 1

    async def keep_braked(self, servo: Servo, wanted: Callable[[], bool]) -> None:
        """Write the brake again at a third of the servo's own time-out (0x27), while `wanted` says so.

        4.19 does not say that the time-out leaves a brake alone, and 0x20 counts as a command: with 0x26 at off it
        could let go of what the brake holds. Writing 2 energises nothing, so it is done whether or not it is needed.
        """
        while True:
            time_out = (servo.raw("timeout_time") or 1000) / 1000
            await asyncio.sleep(max(AGAIN_S, min(NEVER_FOR_LONG_S, time_out / 3)))
            if not wanted():
                return
            if servo.raw("timeout_action") in (None, _OFF):
                await self.quench(servo, "brake")

    async def _pause(self, servo: Servo, tries: int, hurried: int) -> bool:
        """The pause after so many tries in vain; whether somebody hurried since the last of them began."""
        pause = AGAIN_S if tries <= SOON else AGAIN_LATER_S if servo.online else AGAIN_ABSENT_S
        if hurried != self._hurried:
            pause = AGAIN_S
        try:
            async with asyncio.timeout(pause):
                await self._hurry.wait()
        except TimeoutError:
            return hurried != self._hurried
        return True

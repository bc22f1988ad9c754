"""Simulated servos on an event loop, each with its own port."""

import asyncio
import logging
from collections.abc import Callable
from typing import Final

from hornbill.domain.autopilot import Program
from hornbill.errors import BusDisconnected, Unknown
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.autopilot import SimulatedAutopilot
from hornbill.sim.bench.chaos import Chaos, Wire
from hornbill.sim.bench.demo import demo_fleet
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.units import Instant, Uid
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort

__all__ = ["Bench", "demo_fleet"]

log = logging.getLogger(__name__)

_NEVER: Final = float("inf")


class Bench:
    """Runs servos on the clock of the event loop. `port_factory` opens a port by name, on any bus.

    Servos added before `start` are switched on by it, later ones at once. `seed` determines everything not specified by
    recipes. All methods are called on the event loop.
    """

    def __init__(
        self, port_factory: Callable[[str], CanPort], catalog: Catalog, seed: int = 1, wire: Wire | None = None
    ) -> None:
        """`wire`: the embedded bus, if its frames may be disturbed."""
        self._open = port_factory
        self._catalog = catalog
        self._seed = seed
        self._drivers: dict[Uid, _Driver] = {}
        self._added = 0
        self._running = False
        self.autopilot: SimulatedAutopilot | None = None
        """The autopilot that shares the bus, if any."""
        self.chaos = Chaos(self, wire)
        """Faults injected at random."""

    @property
    def servos(self) -> dict[Uid, SimulatedServo]:
        """All servos by unique ID, in the order they were added."""
        return {uid: driver.servo for uid, driver in self._drivers.items()}

    def add(self, recipe: Recipe) -> SimulatedServo:
        """Add a servo.

        Raises InvalidValue for an unknown model or firmware, ValueError for values invalid in ROM or a duplicate unique
        ID.
        """
        servo = recipe.build(self._catalog, f"{self._seed}/{self._added}")
        uid = Uid(servo.uid.hex())
        if uid in self._drivers:
            raise ValueError(f"A servo {uid} is on the bench already.")
        self._added += 1
        driver = _Driver(servo, f"servo{self._added}", recipe.story)
        if self._running:
            driver.start(self._open)
        self._drivers[uid] = driver
        return servo

    def servo(self, uid: Uid) -> SimulatedServo:
        """The servo with this unique ID, simulated up to now. Raises Unknown."""
        driver = self._driver(uid)
        driver.catch_up()
        return driver.servo

    def story(self, uid: Uid) -> str:
        """Purpose of this servo, for users. Empty if none. Raises Unknown."""
        return self._driver(uid).story

    async def set_autopilot(self, program: Program | None, *, outputs: int = 4, rate_hz: float = 50.0) -> None:
        """Add an autopilot to the bus, in place of the present one. None removes it."""
        before, self.autopilot = self.autopilot, None
        if before is not None:
            await before.close()
        if program is not None:
            loop = asyncio.get_running_loop()
            self.autopilot = SimulatedAutopilot(
                self._open("autopilot"), program, outputs=outputs, rate_hz=rate_hz, clock=loop.time,
                taken={int(servo.node_id) for servo in self.servos.values()},
            )  # fmt: skip
            self.autopilot.start()

    async def remove(self, uid: Uid) -> None:
        """Remove a servo from the bench and the bus. Raises Unknown."""
        driver = self._driver(uid)
        del self._drivers[uid]  # first: it may be requested again while closing
        await driver.close()

    async def start(self) -> None:
        """Open a port for every servo and switch them on. Idempotent."""
        if not self._running:
            self._running = True
            for driver in self._drivers.values():
                driver.start(self._open)

    async def stop(self) -> None:
        """Switch all servos off and close their ports, until `start`. Values in RAM are lost. Idempotent."""
        if not self._running:
            return
        self._running = False
        self.chaos.stop()
        await self.set_autopilot(None)
        for driver in list(self._drivers.values()):
            driver.servo.power_off(driver.now())
            await driver.close()

    async def close(self) -> None:
        """Remove all servos from the bus. Idempotent. The bench cannot be started again."""
        self._running = False
        self.chaos.stop()
        await self.set_autopilot(None)
        drivers, self._drivers = self._drivers, {}
        for driver in drivers.values():
            await driver.close()

    def power(self, uid: Uid, on: bool) -> None:
        """Switch the supply of a servo. Raises Unknown."""
        driver = self._driver(uid)
        now = driver.now()
        if on:
            driver.servo.power_on(now)
        else:
            driver.servo.power_off(now)
        driver.process(now)

    def turn_manually(self, uid: Uid, angle_deg: float) -> bool:
        """Turn a horn without torque manually until 0x08 reads `angle_deg`. False: it has torque. Raises Unknown."""
        driver = self._driver(uid)
        now = driver.now()
        turned = driver.servo.turn_manually(angle_deg, now)
        driver.process(now)
        return turned

    def _driver(self, uid: Uid) -> "_Driver":
        driver = self._drivers.get(uid)
        if driver is None:
            raise Unknown("unknown_servo", f"Simulated servo {uid} not found.", cause="not_simulated", uid=uid)
        return driver


class _Driver:
    """One servo, its port, and the timer for its next message: only that is visible to others."""

    def __init__(self, servo: SimulatedServo, name: str, story: str) -> None:
        self.servo = servo
        self.story = story
        self._name = name
        self._port: CanPort | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None

    def now(self) -> Instant:
        loop = self._loop or asyncio.get_running_loop()
        return loop.time()

    def start(self, open_port: Callable[[str], CanPort]) -> None:
        self._loop = asyncio.get_running_loop()
        self._port = open_port(self._name)
        self._port.listen(self._on_frames)
        now = self._loop.time()
        self.servo.power_on(now)
        self.process(now)

    async def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        port, self._port = self._port, None
        if port is not None:
            await port.close()

    def process(self, now: Instant) -> None:
        """Send the frames of the servo, and set the timer for its next one. It may fire too early, never late."""
        port, loop = self._port, self._loop
        if port is None or loop is None:
            return
        frames = self.servo.take_outbox()
        if frames:
            try:
                port.send(frames)
            except BusDisconnected as error:
                log.debug("%s could not send: %s", self._name, error.detail)
        due = self.servo.next_message()
        if self._timer is not None:
            if self._timer.when() <= due:
                return
            self._timer.cancel()
        self._timer = None if due == _NEVER else loop.call_at(max(due, now), self._wake)

    def _on_frames(self, frames: list[Frame]) -> None:
        now = self.now()
        if self.servo.on_frames(frames, now):
            self.process(now)

    def catch_up(self) -> None:
        """Simulate up to now. Otherwise the state of the servo is that at its last message."""
        if self._loop is not None:
            now = self.now()
            self.servo.advance(now)
            self.process(now)

    def _wake(self) -> None:
        self._timer = None
        self.catch_up()

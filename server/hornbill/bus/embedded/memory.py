"""A CAN bus inside one process, its medium driven by the event loop's clock."""

import asyncio
from collections import deque
from collections.abc import Sequence

from hornbill.bus.embedded.medium import Medium
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.bus.transmit import QUEUE_LIMIT
from hornbill.units import Instant
from hornbill.wire.frame import Frame

COALESCE_S = 0.001
"""On a real event loop, frames are delivered at most this often: its timers are no finer anyway."""


class MemoryBus:
    """Carries frames between its ports as a CAN bus would.

    Among all ports with something queued the lowest identifier wins, ports with the same one in the
    order they began to wait; a frame on the wire is never interrupted. A frame takes its exact bits at
    `bitrate` (bit/s) and carries the instant of its last bit. On a loop whose clock `jumps` each frame is delivered
    at that instant; on a real loop all that ended since the last time are, once in COALESCE_S at most.

    `fast` leaves out the bit times, and load and busy time stay 0: what was sent is delivered in the
    next turn of the loop. `history` keeps that many (port name, frame) of what was acknowledged.
    `queue_limit` is the number of frames a port keeps; a full one drops what would leave last and
    counts an error.

    Simplified: two ports that offer the same identifier with different data count an error each and
    are sent one after the other (a real bus would destroy both, again and again); a corrupted frame
    takes its whole time and an error frame; a sender without anybody on the bus to acknowledge tries until
    it is passive and then waits, silently, for another port; bus-off lasts until `recover`.
    """

    def __init__(
        self,
        *,
        bitrate: int = 1_000_000,
        fast: bool = False,
        history: int = 0,
        queue_limit: int = QUEUE_LIMIT,
    ) -> None:
        if bitrate <= 0:
            raise ValueError(f"a bitrate of {bitrate} bit/s is not above 0: CAN knows up to 1000000")
        self.bitrate = bitrate
        self._medium = Medium(0.0 if fast else 1.0 / bitrate, history)
        self._fast = fast
        self._queue_limit = queue_limit
        self._loop: asyncio.AbstractEventLoop | None = None
        self._pause = COALESCE_S
        self._alarm: asyncio.TimerHandle | None = None
        self._not_before: Instant = 0.0

    def port(self, name: str, *, bitrate: int | None = None) -> MemoryPort:
        """A new port; frames that waited for somebody to acknowledge them go out now.

        At another `bitrate` (bit/s) than the bus, it takes whatever is on the wire for an error and what it
        sends is one to all others: its error flags destroy frames until it is passive, its own frames make it
        bus-off. Raises ValueError when `name` is that of an open port.
        """
        if name in self._medium.ports:
            raise ValueError(f"the bus already has an open port {name!r}: close it or choose another name")
        self._settle_for_change()
        rate = self.bitrate if bitrate is None else bitrate
        fits = rate == self.bitrate
        port = self._medium.ports[name] = MemoryPort(self, name, rate, self._queue_limit, fits=fits)
        if not fits:
            self._medium.misfits.add(port)
        self._schedule()
        return port

    @property
    def history(self) -> deque[tuple[str, Frame]]:
        """The last frames acknowledged, oldest first, each with the name of the port that sent it."""
        return self._medium.history

    def load(self) -> float:
        """The share of the last second the bus was busy, 0..1."""
        if self._loop is None:
            return 0.0
        now = self._loop.time()
        self._medium.settle(now)
        return self._medium.load.share(now)

    # Faults.

    def loss(self, pct: float, *, seed: int = 1, port: MemoryPort | None = None) -> None:
        """Lose `pct` (0..100 %) of all frames on the way to every receiver, or on the way to `port` alone."""
        self._settle_for_change()
        self._medium.faults.lose(pct, seed, port)

    def corruption(self, pct: float, *, seed: int = 1) -> None:
        """Corrupt `pct` (0..100 %) of all transmissions: every node counts an error, the sender repeats.

        Above about 11 % a sender's error counter climbs until it is bus-off, as on a real bus.
        """
        self._settle_for_change()
        self._medium.faults.corrupt(pct, seed)

    def noise(self, on: bool = True) -> None:
        """Let there be nothing but noise on the wire, or end it. Raises RuntimeError outside of an event loop.

        All that can be seen is error frames: controllers turn passive, and those that try to send bus-off.
        """
        loop = self._find_loop()
        self._settle_for_change()
        if on and not self._medium.faults.noise:
            self._medium.begin_noise(loop.time())
        self._medium.faults.noise = on
        self._schedule()

    def bus_off(self, port: MemoryPort) -> None:
        """Put `port` into bus-off: what it has queued is dropped, and it neither sends nor hears until `recover`."""
        self.withdraw(port)
        port.go_bus_off()

    def recover(self, port: MemoryPort | None = None) -> None:
        """Bring `port`, or every one, back from passive or bus-off."""
        self._settle_for_change()
        for one in tuple(self._medium.ports.values()) if port is None else (port,):
            one.recover()
        self._schedule()

    # What ports call.

    def offer(self, port: MemoryPort, frames: Sequence[Frame]) -> None:
        """Let `frames` take part in arbitration from this instant on."""
        loop = self._loop or self._find_loop()
        self._medium.offer(port, frames, loop.time())
        self._schedule()

    def withdraw(self, port: MemoryPort) -> None:
        """Let what `port` has queued take part no longer."""
        self._settle_for_change()
        self._medium.withdraw(port)

    def leave(self, port: MemoryPort) -> None:
        """Take `port` off the bus."""
        self.withdraw(port)
        del self._medium.ports[port.name]
        self._medium.misfits.discard(port)
        self._medium.faults.forget(port)
        if not self._medium.ports and self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None

    # Delivery.

    def _find_loop(self) -> asyncio.AbstractEventLoop:
        """The loop this bus runs on: that of the first call that needs one."""
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
            self._pause = 0.0 if self._fast or getattr(self._loop, "jumps", False) else COALESCE_S
        return self._loop

    def _settle_for_change(self) -> None:
        """Finish the past under the rules of the past, before a port or a fault changes."""
        if self._loop is not None:
            now = self._loop.time()
            self._medium.settle(now)
            self._distribute()
            self._medium.resume(now)

    def _distribute(self) -> None:
        """Put what the wire carried into the inboxes of those who heard it."""
        medium = self._medium
        carried, medium.carried = medium.carried, []
        busy_s, medium.busy_s = medium.busy_s, 0.0
        if not carried and not busy_s:
            return
        deaf = medium.faults.deaf
        senders = {sender for sender, _ in carried}
        everything = [frame for _, frame in carried]
        for port in medium.ports.values():
            if not port.hears:
                continue
            statistics = port.statistics
            statistics.busy_s += busy_s
            frames = [frame for sender, frame in carried if sender is not port] if port in senders else everything
            if port in deaf:
                kept = [frame for frame in frames if not deaf[port].strikes()]
                statistics.rx_dropped += len(frames) - len(kept)
                frames = kept
            statistics.rx_frames += len(frames)
            port.inbox += frames
            if port.receive_errors:
                port.heard_well(len(frames))

    def _schedule(self) -> None:
        """Set the alarm for the next end of a frame. It may prove too early, never too late."""
        if self._loop is None or (end := self._medium.next_end()) is None:
            return
        due = max(end, self._not_before)
        if self._alarm is not None:
            if self._alarm.when() <= due:
                return
            self._alarm.cancel()
        self._alarm = self._loop.call_at(due, self._wake)

    def _wake(self) -> None:
        assert self._loop is not None
        self._alarm = None
        now = self._loop.time()
        self._not_before = now + self._pause
        if self._fast:
            self._medium.settle_untimed(now)
        else:
            self._medium.settle(now)
        self._distribute()
        self._schedule()
        for port in tuple(self._medium.ports.values()):
            if not port.inbox:
                continue
            frames, port.inbox = port.inbox, []
            if port.sink is None:
                continue
            try:
                port.sink(frames)
            except Exception as error:
                # One node's mistake must not cost the others their frames.
                self._loop.call_exception_handler(
                    {"message": f"a frame sink of {port.address} raised", "exception": error}
                )

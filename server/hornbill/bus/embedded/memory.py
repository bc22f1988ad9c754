"""An in-process CAN bus driven by the clock of the event loop."""

import asyncio
from collections import deque
from collections.abc import Sequence

from hornbill.bus.embedded.medium import Medium
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.bus.transmit import QUEUE_LIMIT
from hornbill.units import Instant
from hornbill.wire.frame import Frame

COALESCE_S = 0.001
"""Minimum interval between deliveries on a real event loop, whose timers are no finer."""


class MemoryBus:
    """Carries frames between its ports as a CAN bus would.

    The lowest queued identifier wins arbitration; equal ones are sent in order of queuing. A frame on the wire is never
    interrupted. A frame takes its exact bit times at `bitrate` (bit/s) and carries the time of its last bit. On a loop
    whose clock `jumps`, each frame is delivered at that time; on a real loop, all completed frames are delivered
    together, at most once per COALESCE_S.

    With `fast` there are no bit times, load and busy time stay 0, and frames are delivered in the next loop iteration.
    `history` is the number of acknowledged (port name, frame) to retain. `queue_limit` is the maximum number of frames
    queued in a port; a full queue drops the frame that would be sent last and counts an error.

    Simplifications: two ports that send the same identifier with different data count an error each and are sent one
    after the other (a real bus would destroy both repeatedly); a corrupted frame takes its whole time plus an error
    frame; a sender without another node to acknowledge retries until it is passive and then waits for another port;
    bus-off lasts until `recover`.
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
            raise ValueError(f"A bit rate of {bitrate} bit/s is not above 0. CAN supports up to 1000000.")
        self.bitrate = bitrate
        self._medium = Medium(0.0 if fast else 1.0 / bitrate, history)
        self._fast = fast
        self._queue_limit = queue_limit
        self._loop: asyncio.AbstractEventLoop | None = None
        self._pause = COALESCE_S
        self._timer: asyncio.TimerHandle | None = None
        self._not_before: Instant = 0.0

    def port(self, name: str, *, bitrate: int | None = None) -> MemoryPort:
        """Open a port. Frames that waited for an acknowledging node are sent now.

        At another `bitrate` (bit/s) than the bus, the port sees errors in all frames, and others see errors in its
        frames: its error flags destroy frames until it is passive, and sending drives it to bus-off. Raises ValueError
        if a port `name` is open.
        """
        if name in self._medium.ports:
            raise ValueError(f"The bus already has an open port {name!r}. Close it or choose another name.")
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
        """The last acknowledged frames, oldest first, with the name of the sending port."""
        return self._medium.history

    def load(self) -> float:
        """Bus load over the last second, 0..1."""
        if self._loop is None:
            return 0.0
        now = self._loop.time()
        self._medium.settle(now)
        return self._medium.load.share(now)

    # Faults.

    def loss(self, pct: float, *, seed: int = 1, port: MemoryPort | None = None) -> None:
        """Lose `pct` (0..100 %) of all frames for every receiver, or only for `port`."""
        self._settle_for_change()
        self._medium.faults.lose(pct, seed, port)

    def corruption(self, pct: float, *, seed: int = 1) -> None:
        """Corrupt `pct` (0..100 %) of all transmissions: every node counts an error, the sender repeats.

        Above about 11 % the error counter of a sender rises until bus-off, as on a real bus.
        """
        self._settle_for_change()
        self._medium.faults.corrupt(pct, seed)

    def noise(self, on: bool = True) -> None:
        """Replace all traffic by noise, or end the noise. Raises RuntimeError outside of an event loop.

        Only error frames are seen: controllers become passive, and those that send go to bus-off.
        """
        loop = self._find_loop()
        self._settle_for_change()
        if on and not self._medium.faults.noise:
            self._medium.begin_noise(loop.time())
        self._medium.faults.noise = on
        self._schedule()

    def bus_off(self, port: MemoryPort) -> None:
        """Put `port` into bus-off: its queue is dropped, and it neither sends nor receives until `recover`."""
        self.withdraw(port)
        port.go_bus_off()

    def recover(self, port: MemoryPort | None = None) -> None:
        """Recover `port`, or all ports, from passive or bus-off."""
        self._settle_for_change()
        for each in tuple(self._medium.ports.values()) if port is None else (port,):
            each.recover()
        self._schedule()

    # Called by ports.

    def offer(self, port: MemoryPort, frames: Sequence[Frame]) -> None:
        """Queue `frames` for arbitration from now on."""
        loop = self._loop or self._find_loop()
        self._medium.offer(port, frames, loop.time())
        self._schedule()

    def withdraw(self, port: MemoryPort) -> None:
        """Remove the queued frames of `port` from arbitration."""
        self._settle_for_change()
        self._medium.withdraw(port)

    def leave(self, port: MemoryPort) -> None:
        """Remove `port` from the bus."""
        self.withdraw(port)
        del self._medium.ports[port.name]
        self._medium.misfits.discard(port)
        self._medium.faults.forget(port)
        if not self._medium.ports and self._timer is not None:
            self._timer.cancel()
            self._timer = None

    # Delivery.

    def _find_loop(self) -> asyncio.AbstractEventLoop:
        """The event loop of this bus: that of the first call that needs one."""
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
            self._pause = 0.0 if self._fast or getattr(self._loop, "jumps", False) else COALESCE_S
        return self._loop

    def _settle_for_change(self) -> None:
        """Settle up to now under the current rules, before a port or a fault changes."""
        if self._loop is not None:
            now = self._loop.time()
            self._medium.settle(now)
            self._distribute()
            self._medium.resume(now)

    def _distribute(self) -> None:
        """Put carried frames into the inboxes of their receivers."""
        medium = self._medium
        carried, medium.carried = medium.carried, []
        busy_s, medium.busy_s = medium.busy_s, 0.0
        if not carried and not busy_s:
            return
        lossy = medium.faults.lossy
        senders = {sender for sender, _ in carried}
        everything = [frame for _, frame in carried]
        for port in medium.ports.values():
            if not port.receives:
                continue
            statistics = port.statistics
            statistics.busy_s += busy_s
            frames = [frame for sender, frame in carried if sender is not port] if port in senders else everything
            if port in lossy:
                received = [frame for frame in frames if not lossy[port].strikes()]
                statistics.rx_dropped += len(frames) - len(received)
                frames = received
            statistics.rx_frames += len(frames)
            port.inbox += frames
            if port.receive_errors:
                port.count_received(len(frames))

    def _schedule(self) -> None:
        """Set the timer for the next end of a frame. It may fire too early, never too late."""
        if self._loop is None or (end := self._medium.next_end()) is None:
            return
        due = max(end, self._not_before)
        if self._timer is not None:
            if self._timer.when() <= due:
                return
            self._timer.cancel()
        self._timer = self._loop.call_at(due, self._wake)

    def _wake(self) -> None:
        assert self._loop is not None
        self._timer = None
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
                # An exception of one node must not affect delivery to the others.
                self._loop.call_exception_handler(
                    {"message": f"frame sink of {port.address} raised an exception", "exception": error}
                )

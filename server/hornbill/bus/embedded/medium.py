"""Simulation of the wire of an embedded bus up to a given time."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from hornbill.bus.embedded.load import LoadMeter
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.bus.embedded.wire_faults import WireFaults
from hornbill.bus.transmit import QueuedFrame
from hornbill.units import Instant
from hornbill.wire.bittime import ERROR_FRAME_BITS, INTERFRAME_BITS, NOISE_BITS, frame_bits
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState

_NOISE_PERIOD_S = 0.01
"""How often noise is counted while the bus is otherwise idle."""


class _Transmission(NamedTuple):
    sender: MemoryPort
    waiting: QueuedFrame
    bits: int
    ends: Instant


class Medium:
    """The wire between controllers: arbitration, bit times, acknowledgement, errors.

    Calls must be in order of `now`. An arbitration is decided only after its time has passed: then all frames queued
    until that time are known, whatever the order of execution.
    """

    def __init__(self, bit_s: float, history: int) -> None:
        """`bit_s` is the bit time in seconds. 0 sends everything at the time of settling."""
        self.ports: dict[str, MemoryPort] = {}
        self.misfits: set[MemoryPort] = set()
        """Ports with another bit rate than the bus."""
        self.faults: WireFaults[MemoryPort] = WireFaults()
        self.load = LoadMeter()
        self.history: deque[tuple[str, Frame]] = deque(maxlen=history)
        self.carried: list[tuple[MemoryPort, Frame]] = []
        """Sender and frame of acknowledged frames since the list was last emptied."""
        self.busy_s = 0.0
        """Bus time used since it was last set to 0, s."""
        self._bit_s = bit_s
        self._noise_s = NOISE_BITS * (bit_s or 1e-6)
        self._offering: dict[MemoryPort, None] = {}  # a dict, in order of offering
        self._on_wire: _Transmission | None = None
        self._idle_at: Instant = 0.0

    def offer(self, port: MemoryPort, frames: Sequence[Frame], now: Instant) -> None:
        """Queue `frames` of `port` for arbitration from `now` on. Frames beyond the queue limit count as errors."""
        self.settle(now)
        if not self._offering:
            self._idle_at = max(self._idle_at, now)
        self._offering[port] = None
        for frame in frames:
            port.statistics.errors += port.queue.put(frame, now)

    def withdraw(self, port: MemoryPort) -> None:
        """Remove the queued frames of `port` from arbitration."""
        self._offering.pop(port, None)

    def resume(self, now: Instant) -> None:
        """Start a frame that waited for an acknowledging node `now` rather than in the past."""
        if self._on_wire is None:
            self._idle_at = max(self._idle_at, now)

    def settle(self, now: Instant) -> None:
        """Simulate the bus up to `now`. An arbitration at `now` itself stays open, as more frames may be queued."""
        if self.faults.noise:
            self._make_noise(now)
            return
        if not self._bit_s:
            return
        while True:
            if self._on_wire is not None:
                if self._on_wire.ends > now:
                    return
                self._finish(self._on_wire)
                self._on_wire = None
            if self._idle_at >= now or (sender := self._winner()) is None:
                return
            self._on_wire = self._start(sender)

    def settle_untimed(self, now: Instant) -> None:
        """Send all queued frames at `now`, in order of arbitration and without bit times."""
        if self.faults.noise:
            self._make_noise(now)
            return
        self._idle_at = now
        while (sender := self._winner()) is not None:
            self._finish(self._start(sender))

    def next_end(self) -> Instant | None:
        """End of the frame on the wire, or of the one that would win now. None if the bus is idle."""
        if self.faults.noise:
            return self._idle_at + _NOISE_PERIOD_S if self.ports else None
        if self._on_wire is not None:
            return self._on_wire.ends
        sender = self._winner()
        if sender is None:
            return None
        return self._idle_at + self._duration(sender.queue.head())

    def begin_noise(self, now: Instant) -> None:
        """Destroy the frame on the wire, and every attempt from `now` on, until `faults.noise` is cleared."""
        self.faults.noise = True
        sent, self._on_wire = self._on_wire, None
        self._idle_at = max(self._idle_at, now)
        if sent is not None:
            self._repeat(sent, acknowledged=True)

    def _make_noise(self, now: Instant) -> None:
        """Error frames back to back up to `now`. The port that would win starts sending each time, and fails."""
        while self._offering and self._idle_at < now:
            sender = min(self._offering, key=lambda port: port.queue.head().id)
            for port in self._watchers(sender):
                port.count_error()
            sender.failed(acknowledged=True)
            if not sender.taking_part:
                del self._offering[sender]
            self._idle_at += self._noise_s
            self._count_busy(NOISE_BITS)
        if (cycles := int((now - self._idle_at) / self._noise_s)) > 0:
            for port in self._watchers():
                port.count_error(cycles)
            self._idle_at += cycles * self._noise_s
            self._count_busy(cycles * NOISE_BITS)

    def _count_busy(self, bits: int) -> None:
        """Record that the bus was busy for `bits` until it became idle."""
        if self._bit_s:
            self.busy_s += bits * self._bit_s
            self.load.add(self._idle_at, bits * self._bit_s)

    def _duration(self, frame: Frame) -> float:
        return (frame_bits(frame) - INTERFRAME_BITS) * self._bit_s if self._bit_s else 0.0

    def _winner(self) -> MemoryPort | None:
        """The port with the next frame. None if no port may send."""
        winner: MemoryPort | None = None
        lowest = 0
        for port in self._offering:
            identifier = port.queue.head().id
            if winner is None or identifier < lowest:
                winner, lowest = port, identifier
        if winner is not None and winner.state is PortState.PASSIVE and not self._may_retry(winner):
            return None
        return winner

    def _may_retry(self, passive: MemoryPort) -> bool:
        """Whether a passive port retries. Without bit times, only if a node can acknowledge."""
        return self._acknowledged(passive) or bool(self._bit_s and self._watchers(passive))

    def _start(self, sender: MemoryPort) -> _Transmission:
        waiting = sender.queue.take()
        if not sender.queue:
            del self._offering[sender]
        frame = waiting.frame
        for port in self._offering:
            other = port.queue.head()
            if other.id == frame.id and other.data != frame.data and port is not sender:
                for clashing in (port, sender):
                    clashing.statistics.errors += 1
                    clashing.statistics.error_frames += 1
        bits = frame_bits(frame) if self._bit_s else 0
        return _Transmission(sender, waiting, bits, self._idle_at + self._duration(frame))

    def _finish(self, sent: _Transmission) -> None:
        bits = sent.bits
        acknowledged = self._acknowledged(sent.sender)
        spoilt = bool(self.misfits) and self._misfit_error(sent.sender)
        spoilt |= self.faults.corrupted()
        if acknowledged and not spoilt:
            self._deliver(sent)
        else:
            bits += ERROR_FRAME_BITS
            if spoilt:
                for port in self._receivers(sent.sender):
                    port.count_error()
            self._repeat(sent, acknowledged=acknowledged)
        self._idle_at = sent.ends + (INTERFRAME_BITS + bits - sent.bits) * self._bit_s
        self._count_busy(bits)

    def _misfit_error(self, sender: MemoryPort) -> bool:
        """Whether a port at another bit rate destroys this frame, as its sender or with an active error flag.

        Ports at another bit rate that only listened count an error. Once passive, they no longer disturb the bus.
        """
        spoilt = not sender.fits
        for port in self.misfits:
            if port is not sender and port.taking_part:
                spoilt |= port.state is PortState.ACTIVE
                port.count_error(first=True)
        return spoilt

    def _deliver(self, sent: _Transmission) -> None:
        sent.sender.succeeded()
        frame = Frame(sent.waiting.frame.id, sent.waiting.frame.data, sent.ends)
        self.history.append((sent.sender.name, frame))
        if self.faults.lost():
            for port in self._receivers(sent.sender):
                port.statistics.rx_dropped += 1
        else:
            self.carried.append((sent.sender, frame))

    def _repeat(self, sent: _Transmission, *, acknowledged: bool) -> None:
        sender = sent.sender
        sender.failed(acknowledged=acknowledged)
        if sender.taking_part:
            sender.queue.put_back(sent.waiting)
            self._offering[sender] = None
        else:
            self._offering.pop(sender, None)

    def _watchers(self, sender: MemoryPort | None = None) -> list[MemoryPort]:
        return [port for port in self.ports.values() if port is not sender and port.taking_part]

    def _receivers(self, sender: MemoryPort) -> list[MemoryPort]:
        return [port for port in self.ports.values() if port is not sender and port.receives]

    def _acknowledged(self, sender: MemoryPort) -> bool:
        return any(port is not sender and port.receives for port in self.ports.values())

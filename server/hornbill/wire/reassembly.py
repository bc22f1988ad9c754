"""Reassembly of received frames into transfers, tolerant of lost, repeated and damaged frames."""

import logging
from binascii import crc_hqx
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, cast

from hornbill.units import Instant
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import parse
from hornbill.wire.transfer import TOGGLE, Transfer
from hornbill.wire.types import BY_KEY

log = logging.getLogger(__name__)

_MAX_TRANSFER_BYTES: Final = 512
"""More than the longest transfer of any known type. Limits a transfer that never ends."""

_MAX_ROUTES: Final = 8192
_UNKNOWN_TYPE: Final = -1
_SHORTEST_START: Final = 4  # two bytes of CRC, one of payload, the tail

# Transfer(...) without its function call.
_new: Final = cast("Callable[[type[Transfer], tuple[object, ...]], Transfer]", tuple.__new__)

_Route: TypeAlias = tuple[Kind, int, int, int, int, int]
"""Kind, type id, source, destination, priority, CRC seed (or _UNKNOWN_TYPE) of one CAN identifier."""

_Session: TypeAlias = tuple[int, Instant, bytes, bytes]
"""Toggle and transfer ID expected next, time of the first frame, bytes so far, data of the last frame."""

DropReason: TypeAlias = Literal[
    "bad_identifier",
    "bad_tail",
    "bad_toggle",
    "bad_crc",
    "duplicates",
    "unexpected",
    "interrupted",
    "timed_out",
    "too_long",
    "evicted",
    "unknown_type",
    "not_ours",
]
"""Why a frame was dropped. Also the names of the counters."""


@dataclass(slots=True)
class ReassemblyCounters:
    """Frames and transfers processed by a Reassembler, and frames dropped by reason."""

    frames: int = 0
    transfers: int = 0
    bad_identifier: int = 0
    """Frames with more than 29 bits of identifier, or a service with node 0 at either end."""
    bad_tail: int = 0
    """Frames without a tail byte, and first frames that are too short or anonymous."""
    bad_toggle: int = 0
    """Frames with an unexpected toggle bit: a frame before them was lost."""
    bad_crc: int = 0
    duplicates: int = 0
    """Frames repeated by an adapter. Harmless."""
    unexpected: int = 0
    """Continuation frames of a transfer whose start was not received."""
    interrupted: int = 0
    """Incomplete transfers replaced by the next one with the same identifier."""
    timed_out: int = 0
    too_long: int = 0
    evicted: int = 0
    """Transfers dropped because too many others were in progress."""
    unknown_type: int = 0
    """Multi-frame transfers of an unknown data type."""
    not_ours: int = 0
    """Service frames between other nodes, and all frames with our own node ID."""


class Reassembler:
    """Turns received frames into transfers, per source, type, destination and priority.

    With `node_id` (1..127), services addressed to other nodes and frames of other senders with this node ID are
    dropped. Without it, all transfers are returned, as a monitor needs. `timeout` is the maximum duration of a
    transfer from its first frame, in seconds. Beyond `max_sessions` transfers in progress, the oldest is dropped.

    Single-frame transfers are returned whatever their type. Longer ones require the signature of their type, so
    those of unknown types are dropped. A repeated single-frame transfer is returned twice: this is harmless, because
    responses are matched by transfer ID and messages carry state, whereas filtering repetitions could ignore a node
    that restarts its transfer IDs.
    """

    __slots__ = (
        "_max_sessions", "_node_id", "_on_drop", "_on_own_id", "_routes", "_sessions", "_swept", "_timeout", "counters",
    )  # fmt: skip

    def __init__(
        self,
        node_id: int | None = None,
        *,
        timeout: float = 2.0,
        max_sessions: int = 4096,
        on_drop: Callable[[DropReason, int, bytes], object] | None = None,
        on_own_id: Callable[[Frame], object] | None = None,
    ) -> None:
        """`on_drop` is called with reason, identifier and data of dropped frames, except services between other nodes.

        `on_own_id` is called with every frame that has `node_id`, before `feed` returns.
        """
        if node_id is not None and not 1 <= node_id <= 127:
            raise ValueError(f"node_id is {node_id}. Use 1 to 127, or None to receive everything.")
        if timeout <= 0 or max_sessions < 1:
            raise ValueError(f"A timeout of {timeout} s and {max_sessions} sessions must both be above 0.")
        self.counters = ReassemblyCounters()
        self._on_drop = on_drop
        self._on_own_id = on_own_id
        self._node_id = node_id
        self._timeout = timeout
        self._max_sessions = max_sessions
        self._routes: dict[int, _Route | None] = {}
        self._sessions: dict[int, _Session] = {}
        self._swept: Instant = 0.0

    @property
    def sessions(self) -> int:
        """Number of transfers in progress."""
        return len(self._sessions)

    @property
    def routes(self) -> int:
        """Number of identifiers cached."""
        return len(self._routes)

    def feed(self, frames: Sequence[Frame], now: Instant | None = None) -> list[Transfer]:
        """The transfers these frames complete, in bus order. Never raises.

        `now` is the time of frames without their own (`at` 0.0). A transfer has the time of its last frame.
        """
        # One function with local names, single-frame transfers first: the hottest loop of the program.
        transfers: list[Transfer] = []
        complete, new = transfers.append, _new
        routes, sessions, timeout = self._routes, self._sessions, self._timeout
        stamp = at = 0.0 if now is None else now
        for can_id, data, at in frames:
            at = at or stamp
            try:
                route = routes[can_id]
            except KeyError:
                route = self._learn(can_id)
            if route is None or not data:
                self._drop_frame(can_id, data, at)
                continue
            tail = data[-1]
            kind, type_id, source, destination, priority, seed = route
            if tail >= 0xC0:
                if tail & TOGGLE:
                    self._drop("bad_toggle", can_id, data)
                    continue
                payload = data[:-1]
            elif tail >= 0x80:
                self._begin(can_id, route, data, at)
                continue
            else:
                session = sessions.get(can_id)
                if session is None:
                    if seed != _UNKNOWN_TYPE:
                        self._drop("unexpected", can_id, data)
                    continue
                expected, started, gathered, _ = session
                if tail & 0x3F != expected or at - started > timeout:
                    self._break(can_id, session, data, at)
                    continue
                gathered += data[:-1]
                if tail < 0x40:
                    if len(gathered) <= _MAX_TRANSFER_BYTES:
                        sessions[can_id] = (expected ^ TOGGLE, started, gathered, data)
                    else:
                        del sessions[can_id]
                        self._drop("too_long", can_id, data)
                    continue
                del sessions[can_id]
                payload = gathered[2:]
                if crc_hqx(payload, seed) != gathered[0] | gathered[1] << 8:
                    self._drop("bad_crc", can_id, data)
                    continue
            complete(new(Transfer, (kind, type_id, source, destination, priority, tail & 31, payload, at)))
        self.counters.frames += len(frames)
        self.counters.transfers += len(transfers)
        if sessions and not 0 <= at - self._swept <= self._timeout:
            self._sweep(at)
        return transfers

    def _learn(self, can_id: int) -> _Route | None:
        """Parse a new identifier and cache its fields. None if its frames are to be dropped."""
        if len(self._routes) >= _MAX_ROUTES:
            self._routes.clear()
        kind, type_id, source, destination, priority, _ = parse(can_id)
        service = kind != Kind.MESSAGE
        route: _Route | None = None
        wanted = source != self._node_id and (
            not service or (source and destination and self._node_id in (None, destination))
        )
        if wanted and 0 <= can_id < 1 << 29:
            data_type = BY_KEY.get((service, type_id))
            seed = _UNKNOWN_TYPE if data_type is None else data_type.crc_seed
            route = kind, type_id, source, destination, priority, seed
        self._routes[can_id] = route
        return route

    def _begin(self, can_id: int, route: _Route, data: bytes, at: Instant) -> None:
        """Start a session with the first frame of a multi-frame transfer."""
        sessions = self._sessions
        before = sessions.pop(can_id, None)
        if before is not None:
            self._drop("duplicates" if before[3] == data else "interrupted", can_id, data)
        tail = data[-1]
        if tail & TOGGLE:
            self._drop("bad_toggle", can_id, data)
        elif not route[2] or len(data) < _SHORTEST_START:
            self._drop("bad_tail", can_id, data)
        elif route[5] == _UNKNOWN_TYPE:
            self._drop("unknown_type", can_id, data)
        else:
            if len(sessions) >= self._max_sessions:
                oldest = next(iter(sessions))
                self._drop("evicted", oldest, sessions.pop(oldest)[3])
            sessions[can_id] = (tail & 31 | TOGGLE, at, data[:-1], data)

    def _break(self, can_id: int, session: _Session, data: bytes, at: Instant) -> None:
        """Handle an unexpected continuation frame: a repetition is ignored, any other ends the session."""
        expected, started, _, last = session
        if at - started > self._timeout:
            reason = "timed_out"
        elif data == last:
            # A sender that missed the acknowledgement repeats its frame. The toggle bit reveals it.
            self._drop("duplicates", can_id, data)
            return
        else:
            reason = "interrupted" if (data[-1] ^ expected) & 31 else "bad_toggle"
        del self._sessions[can_id]
        self._drop(reason, can_id, data)

    def _sweep(self, at: Instant) -> None:
        """Discard timed out transfers."""
        self._swept = at
        late = [can_id for can_id, session in self._sessions.items() if at - session[1] > self._timeout]
        for can_id in late:
            self._drop("timed_out", can_id, self._sessions.pop(can_id)[3])

    def _drop_frame(self, can_id: int, data: bytes, at: Instant) -> None:
        """Count a frame without a route or a tail byte."""
        if can_id & 0x7F == self._node_id and 0 <= can_id < 1 << 29:
            self.counters.not_ours += 1
            if self._on_own_id is not None:
                self._on_own_id(Frame(can_id, data, at))
        elif 0 <= can_id < 1 << 29 and can_id & 0x7F and can_id & 0x7F00 and self._routes.get(can_id) is None:
            self.counters.not_ours += 1
        else:
            self._drop("bad_tail" if self._routes.get(can_id) else "bad_identifier", can_id, data)

    def _drop(self, reason: DropReason, can_id: int, data: bytes) -> None:
        setattr(self.counters, reason, getattr(self.counters, reason) + 1)
        if self._on_drop is not None:
            self._on_drop(reason, can_id, data)
        if log.isEnabledFor(logging.DEBUG):
            log.debug("dropped (%s): %08x %s", reason, can_id, data.hex())

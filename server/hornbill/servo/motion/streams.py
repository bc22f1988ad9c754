"""Streams: setpoints for many servos at a steady rate, as bursts, with counts of missed slots."""

import asyncio
import math
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from hornbill.domain.note import Note
from hornbill.errors import BusBudget, Busy, InvalidValue, Unknown
from hornbill.servo.device.position_estimate import HALF_TURN_DEG
from hornbill.servo.device.requests import READ
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.bursts import Bursts, Prepared, Setpoint
from hornbill.servo.motion.setpoint_runner import PeriodicSource, SetpointRunner
from hornbill.servo.motion.trapezoid import Track, TrapezoidProfile
from hornbill.servo.runtime.hub import LogEvent
from hornbill.units import Uid

SHARE: Final = 0.40
"""Maximum share of the bus for all streams."""

FULL: Final = 0.85
"""Maximum share of the bus for streams and broadcasts of servos, above which slots are late. Reads wait for both."""

BROADCASTS: Final = 0.0029
"""Share of the bus for the broadcasts of one servo: Status at 10 Hz and NodeStatus at 1 Hz (table 2-2), 22 frames."""

MAX_ENDED: Final = 20


@dataclass(slots=True)
class Leg:
    """Move of one servo of a stream to its target, in degrees."""

    track: Track
    goal: float
    profile: TrapezoidProfile


@dataclass(slots=True)
class BurstTotals:
    """Sent bursts and missed slots of all streams since the start."""

    sent: int = 0
    misses: int = 0


@dataclass(slots=True, eq=False)
class SetpointStream(PeriodicSource):
    """A stream, one burst per slot. `share`: of the bus, 0..1. `legs`: servos still moving to a target. `ended`: why it
    ended, None while it runs.
    """

    id: str
    holder: str
    lease_id: str
    kind: str
    rate_hz: float
    prepared: Prepared
    share: float
    bursts: Bursts = field(repr=False)
    totals: BurstTotals = field(repr=False)
    legs: dict[Uid, Leg] = field(default_factory=dict[Uid, Leg])
    sent: int = 0
    worst_skew_s: float = 0.0
    ended: Note | None = None

    @property
    def uids(self) -> list[Uid]:
        """Servos it commands."""
        return [part.servo.uid for part in self.prepared.parts]

    def set_out(self, goals: Mapping[Uid, float], profile: TrapezoidProfile) -> None:
        """Start moving to `goals`. Servos with shorter moves go slower, so that all arrive at the same time."""
        current = {one.servo.uid: one.target.raw / one.target.parameter.per_unit for one in self.prepared.parts}
        tracks = {uid: self.legs[uid].track if uid in self.legs else Track(current[uid]) for uid in goals}
        farthest = max(abs(goal - tracks[uid].at) for uid, goal in goals.items())
        for uid, goal in goals.items():
            part = abs(goal - tracks[uid].at) / farthest if farthest > 0 else 1.0
            part = max(part, 0.05)  # 0 would never brake a moving horn
            slower = TrapezoidProfile(profile.speed * part, profile.acceleration * part)
            self.legs[uid] = Leg(tracks[uid], goal, slower)

    async def send_next(self) -> bool:
        """Send one burst, advancing each move by one slot. A stream has no last setpoint."""
        self._advance()
        sent = self.bursts.send(self.lease_id, self.prepared)
        self.sent += 1
        self.totals.sent += 1
        self.worst_skew_s = max(self.worst_skew_s, sent.skew_s)
        return False

    def miss(self, slots: int) -> None:
        """Count slots in which nothing was sent."""
        self.misses += slots
        self.totals.misses += slots

    def interrupt(self, why: Note) -> LogEvent:
        """Note why it ended."""
        self.ended = why
        text = f"A stream to {len(self.uids)} servos ended: {why.text}"
        return LogEvent("notice", "stream_ended", text, params={"servos": len(self.uids)})

    def _advance(self) -> None:
        if not self.legs:
            return
        values: dict[Uid, float] = {}
        for uid, leg in list(self.legs.items()):
            if leg.track.step(leg.goal, leg.profile, self.period_s):
                del self.legs[uid]
            # reversing at a lower acceleration than before may overshoot the range of a burst
            values[uid] = min(max(round(leg.track.at, 1), -HALF_TURN_DEG), HALF_TURN_DEG)
        self.prepared = self.bursts.renewed(self.prepared, values, clamp=True)


class Streams:
    """Each stream runs under the lease it was started with. It ends with that lease, with a stop, and when motion of
    one of its servos is refused; then the servos stay under their last value while the lease is valid.
    """

    def __init__(
        self, services: HostServices, bursts: Bursts, runner: SetpointRunner, online: Callable[[], int]
    ) -> None:
        """`online` returns the number of servos online."""
        self._requests = services.requests
        self._base = services.base
        self._leases = services.leases
        self._bursts = bursts
        self._runner = runner
        self._online = online
        self._streams: dict[str, SetpointStream] = {}
        self.totals = BurstTotals()

    def all(self) -> list[SetpointStream]:
        """Running streams and the last ended ones, oldest first."""
        return list(self._streams.values())

    def get(self, stream_id: str) -> SetpointStream:
        """The stream with this ID. Raises Unknown(unknown_stream)."""
        found = self._streams.get(stream_id)
        if found is None:
            raise Unknown(
                "unknown_stream",
                f"There is no stream {stream_id[:40]!r}.",
                cause="stream_not_found",
                stream=stream_id[:40],
            )
        return found

    def commands(self, uid: Uid) -> bool:
        """Whether a running stream commands this servo."""
        return any(one.ended is None and uid in one.uids for one in self._streams.values())

    async def begin(self, lease_id: str | None, servos: Sequence[Servo], kind: str, rate_hz: float) -> SetpointStream:
        """Start a stream at `rate_hz`, initially holding each servo where it is (angle) or at 0 (speed and torque).

        Raises what Bursts.prepare raises, Busy for a servo of another stream, and BusBudget with the possible rate.
        """
        lease = self._leases.require(lease_id, self._base.now(), *(servo.uid for servo in servos))
        for servo in servos:
            if self.commands(servo.uid):
                raise _other_stream(servo)
        values = await asyncio.gather(*(self._rest(servo, kind) for servo in servos))
        setpoints = [Setpoint(servo, kind, value) for servo, value in zip(servos, values, strict=True)]
        # a horn not held may be outside its limits: it is held at the nearest limit (section 4.31)
        prepared = await self._bursts.prepare(lease_id, setpoints, clamp=True)
        share = self._check_budget(prepared, rate_hz)
        for servo in servos:  # another stream may have started during the reads
            if self.commands(servo.uid):
                raise _other_stream(servo)
        made = SetpointStream(
            1.0 / rate_hz, secrets.token_hex(6), lease.holder, lease.id, kind, rate_hz, prepared, share,
            self._bursts, self.totals,
        )  # fmt: skip
        self._streams[made.id] = made
        for old in [one.id for one in self._streams.values() if one.ended is not None][:-MAX_ENDED]:
            del self._streams[old]
        self._runner.start(made)
        return made

    def put(
        self, stream_id: str, lease_id: str | None, values: Mapping[str, float], profile: TrapezoidProfile | None = None
    ) -> SetpointStream:
        """Set new values (degrees, rpm or %) by UID, all or none. They are sent with the next burst.

        A value between two register steps is rounded, because streamed values are computed. `profile`: move at limited
        speed, angles only; servos with shorter moves go slower, so that all arrive at the same time.

        Raises Unknown, Busy once it has ended, LeaseRequired, LeaseHeld, OutOfRange, InvalidValue, NeedsConfirmation.
        """
        stream = self.get(stream_id)
        self._leases.require(lease_id, self._base.now(), *stream.uids)
        if stream.ended is not None:
            raise Busy(f"The stream has ended: {stream.ended.text} Start a new one.", cause="stream_ended")
        uids = set(stream.uids)
        foreign = next((uid for uid in values if uid not in uids), None)
        if foreign is not None:
            raise InvalidValue(
                f"{foreign[:40]!r} is not part of this stream. Use servos the stream was started with.",
                cause="not_in_stream",
                uid=foreign[:40],
            )
        per_unit = {part.servo.uid: part.target.parameter.per_unit for part in stream.prepared.parts}
        steps = {Uid(uid): round(value * per_unit[Uid(uid)]) / per_unit[Uid(uid)] for uid, value in values.items()}
        there = self._bursts.renewed(stream.prepared, steps)
        if profile is not None and stream.kind != "angle":
            raise InvalidValue(
                f"A profile applies to angles only. Omit it for {stream.kind}.", cause="profile_angle_only"
            )
        if profile is None:
            stream.prepared = there
            for uid in steps:
                stream.legs.pop(uid, None)
        else:
            stream.set_out(steps, profile)
        return stream

    async def end(self, stream_id: str) -> SetpointStream:
        """End a stream. Its servos stay under their last value while the lease is valid. Raises Unknown."""
        stream = self.get(stream_id)
        if stream.ended is None:
            stream.interrupt(Note("Ended by request.", "ended_by_request"))
        self._runner.end(stream)
        return stream

    async def _rest(self, servo: Servo, kind: str) -> float:
        if kind != "angle":
            return 0.0
        row = servo.registers.get("current_angle")
        if row is None:
            return 0.0  # unknown model: preparing the burst raises the error
        return await self._requests.read(servo, row.parameter, READ) / row.parameter.per_unit

    def _check_budget(self, prepared: Prepared, rate_hz: float) -> float:
        """Check a stream's share of the bus, given other streams and broadcasts. Returns the share."""
        one = self._bursts.bus_s(prepared)
        share = one * rate_hz
        streaming = sum(other.share for other in self._streams.values() if other.ended is None)
        left = min(SHARE, FULL - self._online() * BROADCASTS) - streaming
        if share > left:
            possible = max(0, math.floor(left / one))
            raise BusBudget(
                f"{len(prepared.parts)} servos at {rate_hz:g} Hz need {share:.0%} of the bus, but only "
                f"{max(0.0, left):.0%} is left for streams. {_remedy(possible)}",
                bus_share=round(share, 4), left=round(max(0.0, left), 4), possible_hz=possible,
                cause="stream_too_fast", servos=len(prepared.parts), rate_hz=rate_hz,
            )  # fmt: skip
        return share


def _other_stream(servo: Servo) -> Busy:
    text = f"{servo.title} is commanded by another stream. End that stream first."
    return Busy(text, cause="commanded_by_other_stream", servo=servo.title)


def _remedy(possible_hz: int) -> str:
    if possible_hz < 1:
        return "End another stream, or reduce polling."
    return f"Use at most {possible_hz} Hz, or fewer servos."

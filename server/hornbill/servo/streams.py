"""Owns Streams: setpoints for many servos at a steady rate, as bursts, with every late slot counted."""

import asyncio
import logging
import math
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from hornbill.errors import BusBudget, Busy, HornbillError, InvalidValue, Unknown
from hornbill.servo.asking import READ, Asker
from hornbill.servo.bursts import Bursts, Prepared, Wish
from hornbill.servo.hub import Happened, Hub
from hornbill.servo.jogging import Profile, Track
from hornbill.servo.leases import Leases
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Uid

log = logging.getLogger(__name__)

SHARE: Final = 0.40
"""Share of the bus that streams together may take."""

FULL: Final = 0.85
"""Share of the bus that streams and what servos say unasked may take: above it slots are late. Reads wait for both."""

BROADCASTS: Final = 0.0029
"""Share of the bus one servo takes unasked: Status ten times a second and NodeStatus once (table 2-2), 22 frames."""

SKIP: Final = 1.0
"""A slot that is late by this many periods is missed: the next ones keep the beat, none is caught up."""

ENDED_KEPT: Final = 20


@dataclass(slots=True)
class Leg:
    """The way of one servo of a stream to where it was told to go, in degrees."""

    track: Track
    goal: float
    profile: Profile


@dataclass(slots=True)
class Stream:
    """One stream. `share` of the bus 0..1; `worst_late_s`: how long after its time a burst left at worst.

    `misses`: slots in which nothing was sent in time. `legs`: who is still on the way. `ended`: why it is over, None
    while it runs.
    """

    id: str
    holder: str
    lease_id: str
    kind: str
    rate_hz: float
    prepared: Prepared
    share: float
    legs: dict[Uid, Leg] = field(default_factory=dict[Uid, Leg])
    sent: int = 0
    misses: int = 0
    worst_late_s: float = 0.0
    worst_skew_s: float = 0.0
    ended: str | None = None
    task: asyncio.Task[None] | None = field(default=None, repr=False)

    @property
    def uids(self) -> list[Uid]:
        """Whom it commands."""
        return [part.servo.uid for part in self.prepared.parts]


class Streams:
    """Every stream runs under the lease it was begun with, and ends with it, with a stop, and with any servo of it that
    may not be moved any more: then the servos stay under their last value while the lease lives.
    """

    def __init__(
        self,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        leases: Leases,
        bursts: Bursts,
        online: Callable[[], int],
    ) -> None:
        """`online` gives how many servos are on the bus."""
        self._asker = asker
        self._hub = hub
        self._base = base
        self._leases = leases
        self._bursts = bursts
        self._online = online
        self._streams: dict[str, Stream] = {}
        self.sent = self.misses = 0
        """Bursts that left, and slots that were missed, of every stream since the start."""

    def all(self) -> list[Stream]:
        """Streams that run and the last that ended, oldest first."""
        return list(self._streams.values())

    def get(self, stream_id: str) -> Stream:
        """The stream of that id. Raises Unknown(unknown_stream)."""
        found = self._streams.get(stream_id)
        if found is None:
            raise Unknown("unknown_stream", f"There is no stream {stream_id[:40]!r}. GET /api/v1/streams lists them.")
        return found

    def commands(self, uid: Uid) -> bool:
        """Whether a running stream commands this servo."""
        return any(one.ended is None and uid in one.uids for one in self._streams.values())

    async def begin(self, lease_id: str | None, servos: Sequence[Servo], kind: str, rate_hz: float) -> Stream:
        """Hold every servo where it is (angle), or still (speed and torque 0), and go on at `rate_hz` from there.

        Raises what Bursts.prepare raises, Busy for a servo of another stream, BusBudget with the rate that would fit.
        """
        lease = self._leases.require(lease_id, self._base.now())
        for servo in servos:
            if self.commands(servo.uid):
                raise Busy(f"{servo.title} is commanded by another stream. End that first: DELETE /api/v1/streams/ID.")
        values = await asyncio.gather(*(self._rest(servo, kind) for servo in servos))
        wishes = [Wish(servo, kind, value) for servo, value in zip(servos, values, strict=True)]
        # a horn may stand outside its limits with nobody holding it: it is held at the nearest (section 4.31)
        prepared = await self._bursts.prepare(lease_id, wishes, clamp=True)
        share = self._check_budget(prepared, rate_hz)
        for servo in servos:  # somebody else may have begun one while we asked
            if self.commands(servo.uid):
                raise Busy(f"{servo.title} is commanded by another stream. End that first: DELETE /api/v1/streams/ID.")
        made = Stream(secrets.token_hex(6), lease.holder, lease.id, kind, rate_hz, prepared, share)
        self._streams[made.id] = made
        for old in [one.id for one in self._streams.values() if one.ended is not None][:-ENDED_KEPT]:
            del self._streams[old]
        made.task = asyncio.get_running_loop().create_task(self._run(made))
        return made

    def put(
        self, stream_id: str, lease_id: str | None, values: Mapping[str, float], profile: Profile | None = None
    ) -> Stream:
        """New values (degrees, rpm or %) by uid, all or nothing; they leave with the next burst.

        A value between two steps of its register becomes the nearer one: what is streamed was computed.
        `profile`: go there at a limited speed, angles only; those with a shorter way go slower, so that all arrive at
        one time. Raises Unknown, Busy once it has ended, LeaseRequired, LeaseHeld, OutOfRange, InvalidValue,
        NeedsConfirmation.
        """
        stream = self.get(stream_id)
        self._leases.require(lease_id, self._base.now())
        if stream.ended is not None:
            raise Busy(f"The stream has ended: {stream.ended} Begin a new one.")
        uids = set(stream.uids)
        foreign = next((uid for uid in values if uid not in uids), None)
        if foreign is not None:
            raise InvalidValue(f"{foreign[:40]!r} is no servo of this stream. Name some of those it was begun with.")
        per_unit = {part.servo.uid: part.target.parameter.per_unit for part in stream.prepared.parts}
        steps = {Uid(uid): round(value * per_unit[Uid(uid)]) / per_unit[Uid(uid)] for uid, value in values.items()}
        there = self._bursts.renewed(stream.prepared, steps)
        if profile is not None and stream.kind != "angle":
            raise InvalidValue(f"A profile is for angles; a {stream.kind} has no way to go. Leave it out.")
        if profile is None:
            stream.prepared = there
            for uid in steps:
                stream.legs.pop(uid, None)
        else:
            self._set_out(stream, steps, profile)
        return stream

    async def end(self, stream_id: str, why: str) -> Stream:
        """End a stream. Its servos stay under their last value while the lease lives. Raises Unknown."""
        stream = self.get(stream_id)
        self._end(stream, why)
        return stream

    async def close(self) -> None:
        """End all."""
        tasks = [one.task for one in self._streams.values() if one.task is not None]
        for stream in self._streams.values():
            self._end(stream, "The server ends.")
        await asyncio.gather(*tasks, return_exceptions=True)

    @staticmethod
    def _set_out(stream: Stream, goals: Mapping[Uid, float], profile: Profile) -> None:
        told = {one.servo.uid: one.target.raw / one.target.parameter.per_unit for one in stream.prepared.parts}
        tracks = {uid: stream.legs[uid].track if uid in stream.legs else Track(told[uid]) for uid in goals}
        farthest = max(abs(goal - tracks[uid].at) for uid, goal in goals.items())
        for uid, goal in goals.items():
            part = abs(goal - tracks[uid].at) / farthest if farthest > 0 else 1.0
            part = max(part, 0.05)  # 0 would never brake what still moves
            stream.legs[uid] = Leg(tracks[uid], goal, Profile(profile.speed * part, profile.acceleration * part))

    def _go_on(self, stream: Stream, dt: float) -> None:
        """Every servo that is on its way, `dt` seconds further."""
        for uid, leg in list(stream.legs.items()):
            there = leg.track.step(leg.goal, leg.profile, dt)
            try:
                stream.prepared = self._bursts.renewed(stream.prepared, {uid: round(leg.track.at, 1)}, clamp=True)
            except InvalidValue:
                continue  # float16 has no such angle: it goes by the next one there is; the goal itself was checked
            if there:
                del stream.legs[uid]

    def _end(self, stream: Stream, why: str) -> None:
        if stream.ended is None:
            stream.ended = why
        if stream.task is not None and not stream.task.done():
            stream.task.cancel()

    async def _run(self, stream: Stream) -> None:
        """One burst a period. A slot that passed is not caught up: its setpoint is old, and two at once help nobody."""
        period = 1.0 / stream.rate_hz
        due = self._base.now()
        try:
            while True:
                late = self._base.now() - due
                if late >= period * SKIP:
                    missed = int(late / period)
                    stream.misses += missed
                    self.misses += missed
                    due += missed * period
                stream.worst_late_s = max(stream.worst_late_s, late)
                self._go_on(stream, period)
                sent = self._bursts.send(stream.lease_id, stream.prepared)
                stream.sent += 1
                self.sent += 1
                stream.worst_skew_s = max(stream.worst_skew_s, sent.skew_s)
                due += period
                await asyncio.sleep(max(0.0, due - self._base.now()))
        except HornbillError as error:
            stream.ended = error.detail
            text = f"A stream to {len(stream.uids)} servos has ended: {error.detail}"
            self._hub.tell(Happened("notice", "stream_ended", text))
        except Exception as error:  # a defect of ours must not look like a stream that runs
            log.exception("a stream failed")
            stream.ended = f"hornbill itself failed: {error!r}. Report this."
            self._hub.tell(Happened("failure", "stream_ended", stream.ended))

    async def _rest(self, servo: Servo, kind: str) -> float:
        if kind != "angle":
            return 0.0
        row = servo.registers.get("current_angle")
        if row is None:
            return 0.0  # of no known model: preparing it says so
        return await self._asker.read(servo, row.parameter, READ) / row.parameter.per_unit

    def _check_budget(self, prepared: Prepared, rate_hz: float) -> float:
        """The share a stream takes; what others stream counts, and what is on the bus anyway."""
        one = self._bursts.bus_s(prepared)
        share = one * rate_hz
        streaming = sum(other.share for other in self._streams.values() if other.ended is None)
        left = min(SHARE, FULL - self._online() * BROADCASTS) - streaming
        if share > left:
            possible = max(0, math.floor(left / one))
            raise BusBudget(
                f"{len(prepared.parts)} servos at {rate_hz:g} Hz take {share:.0%} of the bus, and "
                f"{max(0.0, left):.0%} is left for streams. {_remedy(possible)}",
                bus_share=round(share, 4), left=round(max(0.0, left), 4), possible_hz=possible,
            )  # fmt: skip
        return share


def _remedy(possible_hz: int) -> str:
    if possible_hz < 1:
        return "End another stream, or poll less (PUT …/telemetry)."
    return f"Up to {possible_hz} Hz would fit; or stream to fewer servos."

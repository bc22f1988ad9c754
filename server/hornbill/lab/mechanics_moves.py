"""Motions that measure the mechanics of one horn, on any servo that can be commanded and read."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple, Protocol

import numpy as np

from hornbill.domain.frequency_response import Estimate
from hornbill.errors import DidNotMove, NoResponse
from hornbill.lab import mechanics
from hornbill.lab.mechanics import Breakaway, Pulse, SupplySample, Zone
from hornbill.servo.runtime.computing import Compute, inline
from hornbill.sim.mechanics.plant import Plant

Kind = Literal["angle", "speed", "torque"]

MARGIN_DEG: Final = 4.0
"""Distance beyond the range at which a measurement ends: a horn under a torque command is stopped by commands only."""
SILENT_S: Final = 0.08
"""Time without a reading after which a torque command is replaced by the command to hold."""
LOST_PULSES: Final = 6
"""Pulses that may be discarded because readings were lost, before the measurement ends."""

_LEVELS: Final = (0.05, 0.09, 0.15)
"""Torque above load and static friction, share of stall torque."""
_REPEATS: Final = 2
_DWELL_S: Final = 0.5
_BROKEN_AWAY_DEG: Final = 0.35
_PULSE_S: Final = 3.0
_RISE_S: Final = 0.02
"""Time after a command in which torque rises and is read instead of the angle."""
_STEADY_S: Final = 0.065
"""Time after which the supply reading, measured 20 times a second, is that of the present torque."""
_REST_S: Final = 2.5
_REST_DEG: Final = 0.05
_SIDES: Final = 5
_SIDE_DEG: Final = 5.0
_SWEEP_RPM: Final = 5.0
_SEARCH_DEG: Final = 0.5
_SEARCH_S: Final = 0.025
"""End stops are searched at 20°/s, 3.3 rpm."""
_LAG_DEG: Final = 4.0
_BACK_OFF_DEG: Final = 3.0


class Sample(NamedTuple):
    """A reading and its time, s."""

    t: float
    value: float


class Horn(Protocol):
    """A servo under test, in the directions of its registers. Every method may raise what motion raises."""

    def now(self) -> float:
        """Present time, s."""
        ...

    async def read(self, key: str) -> Sample | None:
        """A reading of a row in its unit. None if it was lost."""
        ...

    async def command(self, kind: Kind, value: float) -> float:
        """Command an angle (°), speed (rpm) or torque (%). Returns the time at which it took effect, s."""
        ...

    async def pause(self, seconds: float) -> None:
        """Wait."""
        ...


@dataclass(frozen=True, slots=True)
class Range:
    """Where and how hard a horn may be moved."""

    from_deg: float
    to_deg: float
    torque_pct: float
    speed_rpm: float

    @property
    def centre(self) -> float:
        """Middle of the range, °."""
        return round((self.from_deg + self.to_deg) / 2.0, 1)

    @property
    def span(self) -> float:
        """Size of the range, °."""
        return self.to_deg - self.from_deg


@dataclass(slots=True)
class Found:
    """What was measured: estimates by name, and load and friction along the travel."""

    estimates: dict[str, Estimate | None] = field(default_factory=dict[str, Estimate | None])
    zones: list[Zone] = field(default_factory=list[Zone])
    rms_deg: float | None = None


class Moves:
    """Measurements of one horn within a range."""

    def __init__(
        self, horn: Horn, plant: Plant, bounds: Range, noise_deg: float = 0.0, *, compute: Compute = inline
    ) -> None:
        """`noise_deg`: noise of angle readings, until `noise` measures it. `compute` runs the fit."""
        self._horn = horn
        self._plant = plant
        self._bounds = bounds
        self._noise_deg = noise_deg
        self._compute = compute
        self._lost = 0

    async def noise(self) -> Estimate:
        """Noise of the angle readings at rest."""
        await self.rest(self._bounds.centre)
        seen = [await self._angle() for _ in range(100)]
        found = mechanics.noise_of([one.value for one in seen if one is not None])
        self._noise_deg = found.value
        return found

    async def rest(self, at_deg: float) -> float:
        """Move to an angle and wait until the horn rests. Returns its mean angle, °."""
        await self._horn.command("angle", round(at_deg, 1))
        until = self._horn.now() + _REST_S
        before: float | None = None
        still = 0
        while self._horn.now() < until:
            await self._horn.pause(0.06)
            here = await self._mean(3)
            if here is None:
                continue
            still = still + 1 if before is not None and abs(here - before) <= _REST_DEG + 2 * self._noise_deg else 0
            before = here
            if still >= 2:
                return here
        if before is None:
            raise NoResponse("The angle could not be read. Check the bus and its load.", cause="angle_unknown")
        return before

    async def _mean(self, count: int) -> float | None:
        seen = [await self._angle() for _ in range(count)]
        values = [one.value for one in seen if one is not None]
        return float(np.mean(values)) if values else None

    async def _angle(self) -> Sample | None:
        found = await self._horn.read("current_angle")
        if found is None:
            return None
        low, high = self._bounds.from_deg - MARGIN_DEG, self._bounds.to_deg + MARGIN_DEG
        if not low <= found.value <= high:
            raise DidNotMove(
                f"The horn is at {found.value:+.1f}°, outside of the range {self._bounds.from_deg:g}° to "
                f"{self._bounds.to_deg:g}°. The measurement was ended. Check the load, or choose a wider range.",
                cause="not_following",
                angle_deg=found.value,
            )
        return found

    async def breakaway(self) -> Breakaway:
        """Raise torque by steps of 1 % on a resting horn until it moves, in both directions."""
        seen = Breakaway()
        for direction in (1, -1):
            held = await self._hold(direction)
            if held is None:
                continue
            begin, percent = held
            while abs(percent) < self._bounds.torque_pct:
                percent += direction
                if await self._moves(begin, direction, percent):
                    still, moved = direction * (percent - direction) / 100.0, direction * percent / 100.0
                    if direction > 0:
                        seen.cw = (still, moved)
                    else:
                        seen.ccw = (still, moved)
                    break
        await self.rest(self._bounds.centre)
        return seen

    async def _hold(self, direction: int) -> tuple[float, int] | None:
        """Approach the centre in this direction and hold the horn by torque alone. Returns its angle and the torque, %.

        The torque ends what the angle loop still creeps. A reading of it may be half a percent too little.
        """
        more = 0
        for _ in range(4):
            await self.rest(self._bounds.centre - direction)
            here = await self.rest(self._bounds.centre)
            percent = round(await self._holding() * 100.0) + more
            await self._horn.command("torque", percent)
            await self._horn.pause(0.3)
            begin = await self._mean(5)
            await self._horn.pause(0.1)
            later = await self._mean(5)
            if begin is None or later is None:
                continue
            if abs(later - begin) <= 0.1 + self._noise_deg:
                return later, percent
            more -= 1 if later > here else -1
        return None

    async def _holding(self) -> float:
        """Torque of a resting horn, share."""
        seen = [await self._horn.read("current_torque") for _ in range(3)]
        values = [one.value for one in seen if one is not None]
        return float(np.median(values)) / 100.0 if values else 0.0

    async def _moves(self, begin: float, direction: int, percent: int) -> bool:
        """Whether a horn moves under a torque. Then it is commanded to hold."""
        since = await self._horn.command("torque", percent)
        answered = since
        least = _BROKEN_AWAY_DEG + 3 * self._noise_deg
        while self._horn.now() < since + _DWELL_S:
            seen = await self._angle()
            if seen is None:
                if self._horn.now() > answered + SILENT_S:
                    break
                continue
            answered = seen.t
            if abs(seen.value - begin) > least:
                await self.rest(begin)
                return (seen.value - begin) * direction > 0
        return False

    async def pulses(self, breakaway: float, load: float) -> tuple[list[Pulse], list[SupplySample]]:
        """Torque forwards and backwards from rest, at several levels in both directions."""
        pulses: list[Pulse] = []
        supply: list[SupplySample] = []
        for _ in range(_REPEATS):
            for level in _LEVELS:
                for direction in (1, -1):
                    force = breakaway + level
                    there, back = (round(100.0 * (sign * direction * force - load)) for sign in (1, -1))
                    if max(abs(there), abs(back)) > self._bounds.torque_pct:
                        continue
                    pulse = await self._pulse(direction, there, back, supply)
                    if pulse is not None:
                        pulses.append(pulse)
        await self.rest(self._bounds.centre)
        return pulses, supply

    async def _pulse(self, direction: int, there: int, back: int, supply: list[SupplySample]) -> Pulse | None:
        start = self._bounds.centre - direction * 0.2 * self._bounds.span
        distance = 0.25 * self._bounds.span
        begin = await self.rest(start)
        pulse = Pulse(before=await self._holding())
        rest = [await self._angle() for _ in range(4)]
        first = await self._horn.command("torque", there)
        pulse.commands.append((0.0, there / 100.0))
        pulse.angle += [(min(one.t - first, 0.0), one.value) for one in rest if one is not None]
        fastest = self._bounds.speed_rpm * 6.0

        def forth(moved: float, speed: float) -> bool:
            return moved * direction >= distance or speed >= fastest

        def returned(moved: float, _speed: float) -> bool:
            return moved * direction <= 0.2 * distance

        since = 0.0
        for percent, ends in ((there, forth), (back, returned)):
            if ends is returned:
                since = await self._horn.command("torque", percent) - first
                pulse.commands.append((since, percent / 100.0))
            if not await self._phase(pulse, supply, first, since, percent, ends, begin):
                await self._horn.command("angle", round(start, 1))
                self._lost += 1
                if self._lost > LOST_PULSES:
                    raise NoResponse(
                        "Too many readings were lost while the horn moved. Check the bus, or reduce its load.",
                        cause="servo_not_responding",
                    )
                return None
        await self._horn.command("angle", round(start, 1))
        return pulse

    async def _phase(
        self, pulse: Pulse, supply: list[SupplySample], first: float, since: float, percent: int,
        ends: Callable[[float, float], bool], begin: float,
    ) -> bool:  # fmt: skip
        """Sample under one torque until its end. False if readings were lost."""
        answered, turn, volts = self._horn.now(), 0, 0
        while (now := self._horn.now()) - first - since < _PULSE_S:
            if now > answered + SILENT_S:
                return False
            turn += 1
            if not turn % 3 or now - first - since < _RISE_S:
                if (torque := await self._horn.read("current_torque")) is not None:
                    pulse.torque.append((torque.t - first, torque.value / 100.0))
                continue
            if now - first - since > _STEADY_S and volts < 3:
                volts += 1
                if (measured := await self._horn.read("current_voltage")) is not None:
                    supply.append(SupplySample(percent / 100.0, measured.value))
                continue
            seen = await self._angle()
            if seen is None:
                continue
            answered = seen.t
            recent = [one for one in pulse.angle[-6:] if one[0] >= 0.0]
            pulse.angle.append((seen.t - first, seen.value))
            speed = (
                abs(seen.value - recent[0][1]) / max(seen.t - first - recent[0][0], 1e-3) if len(recent) > 3 else 0.0
            )
            if ends(seen.value - begin, speed):
                return True
        return True

    async def friction(self, volts: float) -> Found:
        """Friction, inertia, load, backlash, torque lag and supply from torque steps and pulses.

        `volts`: supply relative to nominal.
        """
        found = Found()
        seen = await self.breakaway()
        rough = mechanics.breakaway_of(seen, None)
        if rough is None:
            raise DidNotMove(
                f"The horn did not move at the permitted torque of {self._bounds.torque_pct:g} %. Check whether it is "
                "blocked, or permit more torque.",
                cause="blocked_at_torque",
                torque_pct=self._bounds.torque_pct,
            )
        load = mechanics.load_guess(seen)
        pulses, supply = await self.pulses(rough.value, load)
        fitted = await self._compute(mechanics.fit, self._plant, volts, pulses, rough.value, load, self._noise_deg)
        if fitted is None:
            found.estimates |= {"breakaway": rough}
            return found
        found.rms_deg = fitted.rms_deg
        found.estimates |= mechanics.intervals(fitted)
        share = found.estimates["load_pct"]
        if share is not None:
            share = Estimate(share.value / 100.0, share.low / 100.0, share.high / 100.0)
        found.estimates["breakaway"] = mechanics.breakaway_of(seen, share)
        found.estimates["supply_ohm"] = mechanics.supply_of(supply, self._plant)
        return found

    async def deadband(self) -> Estimate | None:
        """Move the target by 0.1° until the resting horn follows, in both directions."""
        held: list[float] = []
        moved: list[float] = []
        centre = self._bounds.centre
        for direction in (1, -1, 1, -1, 1, -1):
            begin, target, error = await self.rest(centre), centre, 0.0
            for _ in range(100):
                before, target = error, round(target + 0.1 * direction, 1)
                await self._horn.command("angle", target)
                await self._horn.pause(0.15)
                here, error = await self._mean(5), (target - begin) * direction
                if here is not None and (here - begin) * direction > 0.1 + 2 * self._noise_deg:
                    held.append(before)
                    moved.append(error)
                    break
        await self.rest(centre)
        return mechanics.threshold_of(held, moved, error_deg=mechanics.QUANTUM_DEG + self._noise_deg)

    async def repeatability(self) -> mechanics.Sides:
        """Approach the centre of the range from both sides."""
        centre, ends = self._bounds.centre, dict[int, list[float]]()
        away = min(_SIDE_DEG, 0.4 * self._bounds.span)
        for _ in range(_SIDES):
            for side in (-1, 1):
                await self.rest(centre + side * away)
                await self.rest(centre)
                ends.setdefault(side, []).append(await self._mean(9) or centre)
        return mechanics.sides_of(ends[-1], ends[1])

    async def speed(self) -> Estimate | None:
        """Highest speed over the range, rpm, from a step over most of it in both directions."""
        found: list[Estimate] = []
        for side in (1, -1):
            await self.rest(self._bounds.centre - side * 0.4 * self._bounds.span)
            target = self._bounds.centre + side * 0.4 * self._bounds.span
            began = await self._horn.command("angle", round(target, 1))
            samples: list[tuple[float, float]] = []
            while self._horn.now() < began + _REST_S:
                seen = await self._angle()
                if seen is not None:
                    samples.append((seen.t - began, seen.value))
                    if abs(seen.value - target) < 1.0:
                        break
            one = mechanics.speed_of(samples)
            found += [] if one is None else [one]
        await self.rest(self._bounds.centre)
        return min(found, key=lambda one: one.value) if found else None

    async def travel(self) -> list[Zone]:
        """Load and friction along the range, from a slow sweep in both directions."""
        low, high = self._bounds.from_deg + 1.0, self._bounds.to_deg - 1.0
        swept: list[list[tuple[float, float]]] = []
        for begin, end, side in ((low, high, 1), (high, low, -1)):
            await self.rest(begin)
            swept.append(await self._sweep(begin, end, side))
            await self._horn.command("angle", round(end, 1))
        await self.rest(self._bounds.centre)
        return mechanics.along(*swept)

    async def _sweep(self, begin: float, end: float, side: int) -> list[tuple[float, float]]:
        samples: list[tuple[float, float]] = []
        began = await self._horn.command("speed", side * _SWEEP_RPM)
        answered, lasts = began, abs(end - begin) / (_SWEEP_RPM * 6.0) * 2.0 + 1.0
        while self._horn.now() < began + lasts:
            torque = await self._horn.read("current_torque")
            seen = await self._angle()
            if seen is None:
                if self._horn.now() > answered + SILENT_S:
                    raise NoResponse(
                        "Too many readings were lost while the horn moved. Check the bus, or reduce its load.",
                        cause="servo_not_responding",
                    )
                continue
            answered = seen.t
            if torque is not None and abs(seen.value - begin) > 2.0:
                samples.append((seen.value, torque.value / 100.0))
            if (seen.value - end) * side >= 0.0:
                return samples
        raise DidNotMove(
            f"The horn did not reach {end:+.1f}° at {_SWEEP_RPM:g} rpm. Check whether it is blocked there.",
            cause="not_following",
            angle_deg=end,
        )

    async def end_stops(self) -> dict[str, Estimate | None]:
        """Search both end stops from the present angle, slowly.

        The caller limits torque and speed before. None for a stop that is not within the range.
        """
        begin = await self.rest(await self._mean(5) or self._bounds.centre)
        found: dict[str, Estimate | None] = {}
        for name, side, end in (
            ("stop_cw_deg", 1, self._bounds.to_deg),
            ("stop_ccw_deg", -1, self._bounds.from_deg),
        ):
            found[name] = await self._search(begin, side, end)
            await self.rest(begin)
        return found

    async def _search(self, begin: float, side: int, end: float) -> Estimate | None:
        target, silent = begin, 0
        while (end - target) * side > 0.0:
            target += side * _SEARCH_DEG
            await self._horn.command("angle", round(target, 1))
            await self._horn.pause(_SEARCH_S)
            here = await self._mean(2)
            silent = silent + 1 if here is None else 0
            if silent > 8:
                raise NoResponse("The angle could not be read. Check the bus and its load.", cause="angle_unknown")
            if here is None or (target - here) * side < _LAG_DEG:
                continue
            await self._horn.pause(0.3)
            at, later = await self._mean(5), None
            if at is not None:
                await self._horn.pause(0.15)
                later = await self._mean(5)
            if at is None or later is None or abs(later - at) > 0.1 + self._noise_deg:
                continue  # it still moves
            await self._horn.command("angle", round(later - side * _BACK_OFF_DEG, 1))
            await self._horn.pause(0.3)
            reach = mechanics.QUANTUM_DEG + self._noise_deg
            return Estimate(later, later - reach, later + reach)
        return None

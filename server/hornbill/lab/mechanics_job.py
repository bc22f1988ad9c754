"""Mechanics as jobs: motions that measure friction, backlash, load, deadband and end stops of one horn."""

import asyncio
import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Final, cast

from hornbill.domain.fields import Param, known
from hornbill.domain.frequency_response import Estimate
from hornbill.domain.mechanics import MechanicsTest, Quantity
from hornbill.domain.set_up import SetUp
from hornbill.errors import Busy, HornbillError, InvalidValue, NoResponse, NotInThisModel
from hornbill.lab import conditions, mechanics
from hornbill.lab.horn import CommandedHorn
from hornbill.lab.mechanics_moves import Found, Kind, Moves, Range, Sample
from hornbill.servo.device.requests import READ
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.device.temporary_values import FORCE_LIMITS, TemporaryValues, tightened
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.computing import Compute
from hornbill.servo.runtime.jobs import RunningJob, Step
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.steps import Evidence
from hornbill.sim.mechanics.plant import plant_of
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Raw

PROCEDURE: Final = "mechanics/1"

REACH_DEG: Final = 20.0
"""Range to either side of the present angle if none is given, °."""
LEAST_SPAN_DEG: Final = 16.0
LARGEST_DEG: Final = 170.0
"""Speed and torque commands count no turns, so the range must not reach ±180°."""

STOP_PCT, STOP_RPM = 30, 30
"""Limits of torque and speed while end stops are searched."""
STOP_LOAD_PCT: Final = 20
"""A load above cannot be told from a stop, and could drop the horn, at STOP_PCT."""

TESTS: Final[dict[MechanicsTest, str]] = {
    "deadband": "Move the target in small steps",
    "repeatability": "Approach an angle from both sides",
    "speed": "Measure the speed of a large step",
    "friction": "Measure friction, inertia and load by torque",
    "travel": "Sweep the range slowly",
    "end_stops": "Search the end stops",
}
"""Steps in order: what depends on the servo's own gains first. backlash is part of friction."""
OWN_GAINS: Final = ("deadband", "repeatability", "speed")
STEADY: Final[Mapping[str, float]] = {
    "speed_torque_control": 1, "smoothing": 0, "angle_boost": 0, "angle_dead_band": 1.0,
}  # fmt: skip
"""Temporary values with which any horn comes to rest between measurements. The P gain is an eighth of its default."""
CALM: Final = 8

UNITS: Final[Mapping[Quantity, str]] = {
    "inertia": "", "breakaway": "", "coulomb": "", "viscous": "", "backlash_deg": "°", "torque_lag_s": "s",
    "load_pct": "%", "supply_ohm": "Ω", "sensor_noise_deg": "°", "deadband_deg": "°", "reversal_deg": "°",
    "repeatability_deg": "°", "top_speed_rpm": "rpm", "stop_cw_deg": "°", "stop_ccw_deg": "°",
}  # fmt: skip

_WORDS: Final[Mapping[Quantity, tuple[str, float, str]]] = {
    "inertia": ("inertia", 1.0, ""), "breakaway": ("breakaway", 100.0, " %"), "coulomb": ("friction", 100.0, " %"),
    "viscous": ("viscous friction", 100.0, " %"), "backlash_deg": ("backlash", 1.0, "°"),
    "torque_lag_s": ("torque lag", 1000.0, " ms"), "load_pct": ("load", 1.0, " %"),
    "supply_ohm": ("supply", 1.0, " Ω"), "sensor_noise_deg": ("noise", 1.0, "°"),
    "deadband_deg": ("deadband", 1.0, "°"), "reversal_deg": ("difference between both sides", 1.0, "°"),
    "repeatability_deg": ("repeatability", 1.0, "°"), "top_speed_rpm": ("top speed", 1.0, " rpm"),
    "stop_cw_deg": ("clockwise stop", 1.0, "°"), "stop_ccw_deg": ("counterclockwise stop", 1.0, "°"),
}  # fmt: skip
"""Word of each quantity, and factor and unit in which a text shows it."""


@dataclass(frozen=True, slots=True)
class MechanicsPlan:
    """What to measure, and where and how hard the horn may be moved. Without a range: around the present angle."""

    tests: Sequence[MechanicsTest]
    from_deg: float | None
    to_deg: float | None
    torque_pct: float
    speed_rpm: float
    note: str
    set_up: SetUp


class _BusHorn:
    """The horn of a servo on the bus, as `Moves` takes it."""

    def __init__(self, services: HostServices, motion: Motion, servo: Servo, lease_id: str | None) -> None:
        self._base = services.base
        self._motion = motion
        self._servo = servo
        self._lease_id = lease_id
        self._horn = CommandedHorn(services.requests, motion, services.base, servo, lease_id)

    def now(self) -> float:
        return self._base.now()

    async def read(self, key: str) -> Sample | None:
        found = await self._horn.sample(key)
        return None if found is None else Sample(*found)

    async def command(self, kind: Kind, value: float) -> float:
        for attempt in range(COMMAND_TRIES):
            try:
                target = await self._motion.command(self._servo, self._lease_id, kind, value, clamp=False)
            except NoResponse:
                if attempt == COMMAND_TRIES - 1:
                    raise
                continue
            at = self._servo.registers[target.parameter.key].at
            return self._base.now() if at is None else at
        raise AssertionError("unreachable")

    async def pause(self, seconds: float) -> None:
        self._motion.may_move(self._servo, self._lease_id)
        await asyncio.sleep(seconds)


COMMAND_TRIES: Final = 4


class MechanicsTests:
    """Measures mechanics as jobs of kind mechanics, which need torque on and a lease.

    Gains and limits are temporary values. A test that ends early turns torque off, whatever the reason, and restores
    them; what cannot be restored is owed until the servo responds.
    """

    def __init__(self, services: HostServices, motion: Motion, store: Store, compute: Compute) -> None:
        """`compute` runs the fit, which takes seconds."""
        self._services = services
        self._requests = services.requests
        self._base = services.base
        self._motion = motion
        self._store = store
        self._compute = compute

    def begin(self, servo: Servo, lease_id: str | None, plan: MechanicsPlan) -> RunningJob:
        """Start a measurement. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NotInThisModel, InvalidValue before it
        sends anything."""
        wanted: set[MechanicsTest] = {"friction" if one == "backlash" else one for one in plan.tests}
        if not wanted:
            raise InvalidValue("No test is chosen. Choose at least one.", cause="tests_missing")
        if plan.from_deg is not None and plan.to_deg is not None:
            _check_range(plan.from_deg, plan.to_deg)
        if "speed_torque_control" not in servo.registers:
            raise NotInThisModel(
                f"{servo.title} has no speed and torque control (0x25), with which mechanics are measured. Update its "
                "firmware, or use a step test.",
                cause="row_not_in_servo",
                servo=servo.title,
                key="speed_torque_control",
            )
        if servo.model is None:
            raise NotInThisModel(f"The model of {servo.title} is unknown.", cause="not_identified", servo=servo.title)
        self._motion.may_move(servo, lease_id)
        tests: list[MechanicsTest] = [one for one in TESTS if one in wanted]
        steps = [
            Step("check", "Check the servo and record conditions"),
            *(Step(one, TESTS[one]) for one in tests),
            Step("restore", "Restore all values"),
            Step("evaluate", "Store the results"),
        ]
        return self._services.jobs.start(
            "mechanics", servo.uid, steps, lambda job: self._work(job, servo, lease_id, plan, tests)
        )

    async def _work(
        self, job: RunningJob, servo: Servo, lease_id: str | None, plan: MechanicsPlan, tests: list[MechanicsTest]
    ) -> dict[str, object]:
        async with servo.changing:
            temporary = TemporaryValues(self._services.owed, self._requests, servo)
            try:
                document, found = await self._measure(job, servo, lease_id, plan, tests, temporary)
                job.begin("restore")
                await temporary.restore_all()
                job.done("restore", Evidence("rows_restored", "all rows restored and verified"))
            except BaseException:
                await shielded(self._end_badly(servo, temporary))
                raise
        job.begin("evaluate")
        document |= {
            "warnings": await conditions.warnings(self._requests, servo),
            "estimates": {
                name: None if one is None else cast("Json", asdict(one)) for name, one in found.estimates.items()
            },
            "zones": cast("Json", [[*one] for one in found.zones]),
        }
        run = await self._store.run(self._store.runs.add, servo.uid, plan.note, document, kind="mechanics")
        count = sum(one is not None for one in found.estimates.values())
        text = f"run {run.id}: {count} quantities"
        job.done("evaluate", Evidence("mechanics_stored", text, {"run": run.id, "quantities": count}))
        return {"run": run.id}

    async def _end_badly(self, servo: Servo, temporary: TemporaryValues) -> None:
        """Turn torque off and restore all rows."""
        if self._motion.is_commanded(servo.uid):  # otherwise Stop or the end of the lease has done so
            with contextlib.suppress(HornbillError):  # torque off is then pending and repeated until acknowledged
                await self._motion.disable_torque(servo, "off")
        await temporary.restore()

    async def _measure(
        self,
        job: RunningJob,
        servo: Servo,
        lease_id: str | None,
        plan: MechanicsPlan,
        tests: list[MechanicsTest],
        temporary: TemporaryValues,
    ) -> tuple[dict[str, Json], Found]:
        job.begin("check")
        row = servo.registers["current_angle"].parameter
        start = await self._requests.read(servo, row, READ) / row.per_unit
        document = await conditions.record(self._requests, self._base, servo, plan.set_up, PROCEDURE)
        bounds = await self._bounds(servo, lease_id, plan, start)
        assert servo.model is not None
        plant, supply = plant_of(servo.model), cast("float | None", document["voltage_v"])
        moves = Moves(
            _BusHorn(self._services, self._motion, servo, lease_id), plant, bounds, compute=self._compute
        )  # fmt: skip
        text = f"horn at {start:+.1f}°, {supply} V, moves within {bounds.from_deg:+.1f}° to {bounds.to_deg:+.1f}°"
        values = known(angle_deg=start, supply_v=supply, from_deg=bounds.from_deg, to_deg=bounds.to_deg)
        found = Found()
        found.estimates["sensor_noise_deg"] = await moves.noise()
        job.done("check", Evidence("mechanics_conditions", text, values))
        volts = (supply or servo.model.nominal_v) / servo.model.nominal_v
        steady = False
        for test in tests:
            job.begin(test)
            if test not in OWN_GAINS and not steady:
                steady = True
                await self._steady(servo, temporary)
            before = len(found.estimates)
            match test:
                case "deadband":
                    found.estimates["deadband_deg"] = await moves.deadband()
                case "repeatability":
                    sides = await moves.repeatability()
                    found.estimates |= {"repeatability_deg": sides.repeatability, "reversal_deg": sides.reversal}
                case "speed":
                    found.estimates["top_speed_rpm"] = await moves.speed()
                case "travel":
                    found.zones = await moves.travel()
                case "end_stops":
                    await self._limit(servo, temporary, start)
                    found.estimates |= await moves.end_stops()
                case _:
                    found.estimates |= (await moves.friction(volts)).estimates
            job.done(test, _evidence(test, found, before))
        await self._motion.command(servo, lease_id, "angle", start, clamp=False)
        return document, found

    async def _bounds(self, servo: Servo, lease_id: str | None, plan: MechanicsPlan, start: float) -> Range:
        """The range, whose ends are permitted before anything moves."""
        low = start - REACH_DEG if plan.from_deg is None else plan.from_deg
        high = start + REACH_DEG if plan.to_deg is None else plan.to_deg
        if plan.from_deg is None and plan.to_deg is None:
            low, high = max(low, -LARGEST_DEG), min(high, LARGEST_DEG)
        _check_range(low, high)
        if not low <= start <= high:
            raise InvalidValue(
                f"The horn of {servo.title} is at {start:+.1f}°, outside of the range {low:g}° to {high:g}°. Move it "
                "there first.",
                cause="outside_range",
                servo=servo.title,
                angle_deg=start,
                minimum=low,
                maximum=high,
            )
        await self._motion.freshen(servo, "angle")
        lease = self._motion.may_move(servo, lease_id)
        for end in (low, high):
            self._motion.permit(servo, lease, "angle", end, clamp=False, confirm=())
        return Range(low, high, plan.torque_pct, plan.speed_rpm)

    async def _steady(self, servo: Servo, temporary: TemporaryValues) -> None:
        """Write the temporary gains, softest first."""
        gain = servo.registers["angle_p_gain"].parameter
        wanted: dict[str, float] = {**STEADY, "angle_p_gain": max((gain.default or CALM) // CALM, 1)}
        values: dict[str, Raw] = {
            key: round(value * servo.registers[key].parameter.per_unit)
            for key, value in wanted.items()
            if key in servo.registers
        }
        for key in values:
            await self._requests.read(servo, servo.registers[key].parameter, READ)
        await temporary.set(values)

    async def _limit(self, servo: Servo, temporary: TemporaryValues, start: float) -> None:
        """Limit torque and speed while end stops are searched, and check that the horn does not need more."""
        row = servo.registers["current_torque"].parameter
        load = max([abs(await self._requests.read(servo, row, READ)) for _ in range(3)])
        if load > STOP_LOAD_PCT:
            raise Busy(
                f"The horn of {servo.title} is loaded with {load} % torque and could drop when torque is limited to "
                f"{STOP_PCT} %. Relieve it first.",
                cause="horn_loaded",
                servo=servo.title,
                load_pct=load,
                limit_pct=STOP_PCT,
            )
        for key in FORCE_LIMITS:
            await self._requests.read(servo, servo.registers[key].parameter, READ)
        await temporary.set(tightened(servo, STOP_RPM, STOP_PCT))


def _check_range(low: float, high: float) -> None:
    if high - low < LEAST_SPAN_DEG or low < -LARGEST_DEG or high > LARGEST_DEG:
        raise InvalidValue(
            f"A range from {low:g}° to {high:g}° is not possible. Enter at least {LEAST_SPAN_DEG:g}° within "
            f"±{LARGEST_DEG:g}°.",
            cause="range_not_possible",
            minimum=-LARGEST_DEG,
            maximum=LARGEST_DEG,
            least_deg=LEAST_SPAN_DEG,
        )


def _evidence(test: MechanicsTest, found: Found, before: int) -> Evidence:
    """What a step has measured."""
    if test == "travel":
        count = len(found.zones)
        bound = len(mechanics.binding(found.zones))
        text = f"load and friction at {count} angles, {bound} of them binding"
        return Evidence("travel_swept", text, {"points": count, "binding": bound})
    new = list(found.estimates.items())[before:]
    lines = [_text(cast("Quantity", name), one) for name, one in new]
    values: dict[str, Param] = {name: round(one.value, 5) for name, one in new if one is not None}
    return Evidence("mechanics_measured", ", ".join(lines) or "nothing new", values)


def _text(name: Quantity, one: Estimate | None) -> str:
    word, factor, unit = _WORDS[name]
    if one is None:
        return f"{word} not measurable"
    value, low, high = (f"{factor * each:.3g}" for each in (one.value, one.low, one.high))
    return f"{word} {value}{unit} ({low} to {high})"

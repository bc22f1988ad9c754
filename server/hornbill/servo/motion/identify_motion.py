"""Wiggle: a small bounded motion of one horn, after which everything is restored."""

import asyncio
import contextlib
import functools
from collections.abc import Awaitable, Callable, Iterator
from copy import copy
from dataclasses import dataclass, field

from hornbill.domain.fields import Param, known
from hornbill.errors import (
    Busy,
    DidNotMove,
    HornbillError,
    NoResponse,
    OutOfRange,
    TorqueOff,
    Unknown,
)
from hornbill.schema.parameter import DUMMY
from hornbill.servo.device import permission
from hornbill.servo.device.output import MODES, ON, OutputRecord
from hornbill.servo.device.requests import POLL, READ
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.device.temporary_values import FORCE_LIMITS, TemporaryValues, tightened
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.setpoint_runner import PeriodicSource, SetpointRunner
from hornbill.servo.motion.trapezoid import Track, TrapezoidProfile
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.leases import HeldLease
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.steps import Evidence
from hornbill.units import Instant, Raw

AMPLITUDE_DEG = 3.0
TIMES = 2
PERIOD_S = 0.025
CREEP = TrapezoidProfile(speed=20.0, acceleration=20.0 / PERIOD_S)
"""0.5° per slot from the start, 3.3 rpm. The speed and torque limits are for faults only."""

ARRIVAL_SLOTS = 4
"""Slots after each leg in which the horn is only read, so that its arrival is seen."""

LIMIT_RPM, LIMIT_PCT = 30, 30
FURTHEST_DEG = AMPLITUDE_DEG + 1.0
"""Deviation above which torque is switched off."""

STILL_DEG = 0.5
"""Tolerance between two readings at rest, and of the final position."""

RESTING_DEG = 0.2
"""Maximum difference between consecutive readings, PERIOD_S apart, of a horn at rest: two steps of the sensor."""

MOVED_DEG = 1.0
"""A horn whose readings span less did not move. With normal play and deadband, they span about 5°."""

HELD_LOAD_PCT = 20
"""A horn under a higher load could drop when its torque is limited to LIMIT_PCT."""

SILENT_S = 5.0
SETTLES_WITHIN_S = 1.5
QUIET_S = 1.0

STEPS = {
    "check": "Horn at rest; torque and limits read",
    "limit": "Speed and torque limited",
    "wiggle": "Wiggled",
    "return": "Back at its first angle",
    "restore": "All values restored",
}


@dataclass(slots=True)
class _Horn:
    """Initial state of the horn, in degrees, and its readings since. `home`: the final command."""

    mode: Raw
    output: OutputRecord
    commanded: bool
    centre: float
    home: float
    low: float
    high: float
    tolerance: float
    seen: list[float] = field(default_factory=list[float])

    @property
    def deviation(self) -> float:
        """Maximum deviation from its start position, degrees."""
        return max((abs(angle - self.centre) for angle in self.seen), default=0.0)


@dataclass(slots=True, eq=False)
class _Wiggle(PeriodicSource):
    """The angles of a wiggle, None where the horn is only read. `command`: True if a step was acknowledged."""

    path: Iterator[float | None]
    command: Callable[[float], Awaitable[bool]]
    read: Callable[[], Awaitable[object]]
    lost: float | None = field(default=None, init=False)

    async def send_next(self) -> bool:
        """Send one step, again if it was lost, and read the angle."""
        angle = self.lost
        if angle is None:
            try:
                angle = next(self.path)
            except StopIteration:
                return True
        self.lost = None
        if angle is not None and not await self.command(angle):
            self.lost = angle
            return False
        await self.read()
        return False


class IdentifyMotion:
    """Turns the horn twice by 3° to either side of its position, or as far as its angle limits allow.

    If the servo has 0x25, its speed and torque are limited meanwhile, to the values of soft start (section 4.14).
    Torque is restored at the end: off and brake are written again; a horn commanded under the caller's lease gets its
    previous command again; a horn that held its position without a command keeps holding it, because torque off could
    drop its load and would be stored by the next save (0x20 is in ROM). The timeout (0x26, 0x27) then applies as after
    any command. If anything fails, torque goes off, as for all motion.
    """

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        runner: SetpointRunner,
        job: RunningJob,
        servo: Servo,
        lease: HeldLease,
        *,
        own: bool,
    ) -> None:
        """`own`: the lease belongs to the job, which renews it while running."""
        self._requests = services.requests
        self._base = services.base
        self._leases = services.leases
        self._motion = motion
        self._runner = runner
        self._job = job
        self._servo = servo
        self._lease = lease
        self._own = own
        self._temporary = TemporaryValues(services.owed, services.requests, servo)
        self._answered: Instant = services.base.now()

    async def run(self) -> dict[str, object]:
        """Wiggle and return the job's result. Raises as `Identify.identify`, and DidNotMove."""
        job = self._job
        job.begin("check")
        horn = await self._check_horn()
        try:
            job.begin("limit")
            job.done("limit", await self._limit())
            job.begin("wiggle")
            await self._wiggle(horn)
            job.done("wiggle", _evidence(horn))
            job.begin("return")
            back = await self._settle(horn)
            away = abs(back - horn.centre)
            text = f"{back:+.1f}°, {away:.1f}° from the start position"
            job.done("return", Evidence("returned", text, {"angle_deg": back, "away_deg": round(away, 1)}))
            job.begin("restore")
            self._check_ours()
            await self._torque_as_found(horn)
            await self._temporary.restore_all(self._renew)
            if horn.mode == 0:
                self._check_ours()
            if horn.mode == 0 and not horn.commanded:
                self._motion.stop_commanding(self._servo)
            job.done("restore", self._restored(horn))
        except BaseException as error:
            await shielded(self._end_badly(horn, error))
            raise
        moved = max(horn.seen) - min(horn.seen) >= MOVED_DEG
        job.result = {
            "from_deg": horn.centre, "low_deg": min(horn.seen), "high_deg": max(horn.seen), "back_deg": back,
            "moved": moved,
        }  # fmt: skip
        if not moved or abs(back - horn.centre) > horn.tolerance:
            what = "did not move" if not moved else "did not return to its start position"
            raise DidNotMove(
                f"The horn of {self._servo.title} {what}: {_evidence(horn).text}, finally at {back:+.1f}°. Check "
                "whether it is blocked, and its deadband (0x2E) and its speed and torque limits (0x3A to 0x3D).",
                cause="wiggle_failed",
                servo=self._servo.title,
                moved=moved,
                back_deg=back,
            )
        return job.result

    async def _check_horn(self) -> _Horn:
        servo = self._servo
        keys = ["torque_mode", "command_angle", "angle_limit_cw", "angle_limit_ccw", "current_torque"]
        for key in [*keys, "angle_dead_band", "timeout_action", "timeout_time"]:
            await self._read(key)
        centre = await self._read("current_angle")
        await asyncio.sleep(0.1)
        again = await self._read("current_angle")
        if abs(again - centre) > STILL_DEG:
            raise Busy(
                f"The horn of {servo.title} is turning. Wait until it is at rest.",
                cause="horn_turning",
                servo=servo.title,
            )
        mode, commanded = servo.raw("torque_mode") or 0, self._motion.is_commanded(servo.uid)
        command = servo.raw("command_angle")
        row = permission.row_for(servo, "angle")
        if mode == 0 and command in (None, DUMMY):
            raise Busy(
                f"{servo.title} is under a speed or torque command. Command an angle or turn torque off first.",
                cause="under_speed_command",
                servo=servo.title,
            )
        load = servo.raw("current_torque") or 0
        if mode == 0 and abs(load) > HELD_LOAD_PCT:
            raise Busy(
                f"The horn of {servo.title} is loaded with {abs(load)} % torque and could drop when torque is limited "
                f"to {LIMIT_PCT} %. Relieve it first, or turn torque off.",
                cause="horn_loaded",
                servo=servo.title,
                load_pct=abs(load),
                limit_pct=LIMIT_PCT,
            )
        low, high = (limit / row.per_unit for limit in permission.bounds(servo, row))
        near = centre if command is None else command / row.per_unit
        horn = _Horn(
            mode=mode,
            output=copy(servo.output),
            commanded=commanded,
            centre=centre,
            # never far away: after a timeout (4.19) or an overload, the horn must not jump back
            home=near if mode == 0 and abs(near - centre) <= MOVED_DEG else centre,
            low=max(low, centre - AMPLITUDE_DEG),
            high=min(high, centre + AMPLITUDE_DEG),
            # it may rest on one side of its deadband before and on the other afterwards
            tolerance=max(STILL_DEG, 2 * (servo.number("angle_dead_band") or 0) + 0.2),
        )
        if not low <= centre <= high or horn.high - horn.low < AMPLITUDE_DEG - STILL_DEG:
            raise OutOfRange(
                f"The horn of {servo.title} is at {centre:.1f}°, and its angle limits of {low:g}° to {high:g}° leave "
                "no room to wiggle. Turn it manually to within the limits, or widen them.",
                minimum=low, maximum=high, unit=row.unit, requested=centre,
                cause="wiggle_range_too_small", servo=servo.title,
            )  # fmt: skip
        found = ("on", "off", "the brake")[mode] + (", under command" if commanded else "")
        text = f"horn at rest at {centre:+.1f}°, torque {found}; range {horn.low:+.1f}° to {horn.high:+.1f}°"
        values = {
            "angle_deg": centre, "torque": ("on", "off", "brake")[mode], "commanded": commanded,
            "low_deg": horn.low, "high_deg": horn.high,
        }  # fmt: skip
        self._job.done("check", Evidence("at_rest", text, values))
        return horn

    async def _limit(self) -> Evidence:
        """Write the limits, then the row that activates them, before torque comes on."""
        servo = self._servo
        self._renew()
        self._motion.may_move(servo, self._lease.id)  # a change that it waited for may have changed that
        if "speed_torque_control" not in servo.registers:
            firmware = servo.firmware_text or "unknown"
            text = f"firmware {firmware} has no 0x25, so the servo applies no limits; only the command is slow"
            return Evidence("not_limited", text, known(firmware=servo.firmware_text))
        for key in (*FORCE_LIMITS, "speed_torque_control"):
            await self._read(key)
        await self._temporary.set({**tightened(servo, LIMIT_RPM, LIMIT_PCT), "speed_torque_control": 1})
        text = f"speed to {LIMIT_RPM} rpm, torque to {LIMIT_PCT} % (0x25 and 0x3A to 0x3D, temporarily, in RAM)"
        return Evidence("limited", text, {"speed_rpm": LIMIT_RPM, "torque_pct": LIMIT_PCT})

    async def _wiggle(self, horn: _Horn) -> None:
        if horn.mode != 0:
            self._renew()
            await self._motion.torque_on(self._servo, self._lease.id)
        read = functools.partial(self._sample, horn)
        await self._runner.follow(_Wiggle(PERIOD_S, _path(horn), self._command, read))

    async def _command(self, degrees: float) -> bool:
        """Send one step. False if it was lost: it is then checked and sent as a new command, never as an old frame."""
        self._renew()
        try:
            await self._motion.command(self._servo, self._lease.id, "angle", round(degrees, 1), clamp=True)
        except NoResponse:
            if self._base.now() - self._answered > SILENT_S:
                raise
            return False
        self._answered = self._base.now()
        return True

    async def _sample(self, horn: _Horn) -> float | None:
        row = self._servo.registers["current_angle"].parameter
        self._renew()
        try:
            angle = await self._requests.read(self._servo, row, POLL) / row.per_unit
        except NoResponse:
            return None
        self._answered = self._base.now()
        horn.seen.append(angle)
        if abs(angle - horn.centre) > FURTHEST_DEG:
            raise DidNotMove(
                f"The horn of {self._servo.title} is at {angle:+.1f}°, more than {FURTHEST_DEG:g}° from "
                f"{horn.centre:+.1f}°, although not commanded there. Torque goes off. Check what moves it.",
                cause="horn_off_position",
                servo=self._servo.title,
                angle_deg=angle,
                centre_deg=horn.centre,
            )
        return angle

    async def _settle(self, horn: _Horn) -> float:
        """Wait until the horn is at rest at its start position, not merely passing it. Returns its angle."""
        until, back = self._base.now() + SETTLES_WITHIN_S, None
        while self._base.now() < until or (back is None and self._base.now() - self._answered < SILENT_S):
            self._motion.may_move(self._servo, self._lease.id)
            angle = await self._sample(horn)
            if angle is not None:
                rests = back is not None and abs(angle - back) <= RESTING_DEG
                back = angle
                if rests and abs(angle - horn.centre) <= horn.tolerance:
                    break
            await asyncio.sleep(PERIOD_S)
        return await self._read("current_angle")

    def _check_ours(self) -> None:
        """Raises what `Motion.may_move` raises, and TorqueOff if torque was switched off meanwhile."""
        self._renew()
        self._motion.may_move(self._servo, self._lease.id)
        if not self._motion.is_commanded(self._servo.uid):
            raise TorqueOff(
                f"Torque of {self._servo.title} was switched off before it was restored.",
                cause="torque_switched_off",
                servo=self._servo.title,
            )

    async def _torque_as_found(self, horn: _Horn) -> None:
        if horn.mode != 0:
            mode = next(word for word, raw in MODES.items() if raw == horn.mode)
            await self._motion.disable_torque(self._servo, mode)
            self._servo.output.restore_reason(horn.output)

    def _restored(self, horn: _Horn) -> Evidence:
        end = {1: "torque is off, as before", 2: "the brake is on, as before"}.get(horn.mode)
        values: dict[str, Param] = {"torque": ("on", "off", "brake")[horn.mode], "commanded": bool(horn.commanded)}
        if end is None:
            end = "its command continues" if horn.commanded else "it holds its position, as before"
            action, after = self._servo.raw("timeout_action") or 0, self._servo.raw("timeout_time") or 0
            if action and not horn.commanded:
                end += f", until its timeout (0x26) switches torque off in {after / 1000:g} s"
                values["timeout_s"] = after / 1000
        return Evidence("restored", f"all rows restored and verified; {end}", values)

    async def _end_badly(self, horn: _Horn, error: BaseException) -> None:
        """Switch torque off (or brake, if it was on the brake) and restore all rows."""
        servo = self._servo
        if self._motion.is_commanded(servo.uid):  # otherwise Stop or the end of the lease has done so
            with contextlib.suppress(HornbillError):  # torque off is then pending and repeated until acknowledged
                await self._motion.disable_torque(servo, "brake" if horn.mode == MODES["brake"] else "off")
                if horn.mode != ON:
                    servo.output.restore_reason(horn.output)
        elif self._motion.stop.latched or self._motion.torque_off.pending(servo.uid):
            await self._motion.torque_off.acknowledged(QUIET_S)
        left = await self._temporary.restore()
        if left and isinstance(error, HornbillError):
            text = f" Not restored yet: {', '.join(left)}. They follow as soon as the servo responds."
            error.extend(after=text, also="not_restored_yet", servo=servo.title, not_restored=left)

    async def _read(self, key: str) -> float:
        self._renew()
        register = self._servo.registers[key]
        return await self._requests.read(self._servo, register.parameter, READ) / register.parameter.per_unit

    def _renew(self) -> None:
        if self._own:
            with contextlib.suppress(Unknown):  # the next motion reports why
                self._leases.renew(self._lease.id, self._base.now())


def _evidence(horn: _Horn) -> Evidence:
    if not horn.seen:
        return Evidence("angle_unknown", "its angle could not be read")
    low, high, readings = min(horn.seen), max(horn.seen), len(horn.seen)
    return Evidence(
        "wiggled",
        f"{readings} readings from {low:+.1f}° to {high:+.1f}°, at most {horn.deviation:.1f}° from {horn.centre:+.1f}°",
        {"low_deg": low, "high_deg": high, "readings": readings, "most_deg": horn.deviation, "angle_deg": horn.centre},
    )


def _path(horn: _Horn) -> Iterator[float | None]:
    """Angle of each slot; None after each leg, where the horn is only read."""
    track = Track(horn.centre)
    for goal in [horn.high, horn.low] * TIMES + [horn.centre, horn.home]:
        while track.at != goal:
            track.step(goal, CREEP, PERIOD_S)
            yield track.at
        for _ in range(ARRIVAL_SLOTS):
            yield None

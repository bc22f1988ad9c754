"""The wiggle: one small bounded motion of one horn, and everything as it was found afterwards."""

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
    UnexpectedResult,
    Unknown,
)
from hornbill.schema.parameter import DUMMY
from hornbill.servo.device import permission
from hornbill.servo.device.output import MODES, ON, OutputRecord
from hornbill.servo.device.requests import POLL, READ
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.setpoint_runner import PeriodicSource, SetpointRunner
from hornbill.servo.motion.temporary_values import TemporaryValues
from hornbill.servo.motion.trapezoid import Track, TrapezoidProfile
from hornbill.servo.runtime.hub import LogEvent
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.leases import HeldLease
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.steps import Evidence
from hornbill.units import Instant, Raw

AMPLITUDE_DEG = 3.0
TIMES = 2
PERIOD_S = 0.025
CREEP = TrapezoidProfile(speed=20.0, acceleration=20.0 / PERIOD_S)
"""0.5° a slot from the first on, 3.3 rpm: the limits of speed and torque are for what goes wrong."""

ARRIVAL_SLOTS = 4
"""After each way, to let the horn arrive, so that it is seen to."""

LIMIT_RPM, LIMIT_PCT = 30, 30
FURTHEST_DEG = AMPLITUDE_DEG + 1.0
"""A horn that is found further away than this is let go."""

STILL_DEG = 0.5
"""What a horn at rest may differ by between two looks, and how near it must come to where it was."""

MOVED_DEG = 1.0
"""A horn whose readings span less did not move: play and dead band of a healthy one leave some 5°."""

HELD_LOAD_PCT = 20
"""A horn that holds more than this could fall when its torque is limited to LIMIT_PCT."""

SILENT_S = 5.0
SETTLES_WITHIN_S = 1.5
QUIET_S = 1.0

STEPS = {
    "check": "Horn at rest, torque and limits read",
    "limit": "Speed and torque limited",
    "wiggle": "Wiggled",
    "return": "Back where it was",
    "restore": "Everything as it was found",
}


@dataclass(slots=True)
class _Horn:
    """The horn as it was found, in degrees, and what was seen of it since. `home` is the command it ends on."""

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
        """How far from its place it was seen."""
        return max((abs(angle - self.centre) for angle in self.seen), default=0.0)


@dataclass(slots=True, eq=False)
class _Wiggle(PeriodicSource):
    """The angles of a wiggle, None where the horn is only looked at. `command`: whether a step was answered."""

    path: Iterator[float | None]
    command: Callable[[float], Awaitable[bool]]
    look: Callable[[], Awaitable[object]]
    lost: float | None = field(default=None, init=False)

    async def send_next(self) -> bool:
        """Send one step, once more where it was lost, and look at the horn."""
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
        await self.look()
        return False


class IdentifyMotion:
    """The horn turns twice to 3 degrees on either side of where it stands, or as far as its angle limits let it.

    Where there is 0x25, the servo itself is limited for the time, by what its soft start uses (section 4.14).
    Torque is in the end what it was in the beginning: off and brake are written again; a horn that was commanded
    under the caller's lease is commanded again what it was; one that held its place with nobody commanding it goes on
    holding it: torque off could drop what it carries, and would be kept by the next save (0x20 is in ROM). Its own
    time-out (0x26, 0x27) holds for it as after every command. When anything fails on the way torque goes off, as for
    every motion.
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
        """`own`: the lease is the job's, and renewed as long as it goes on."""
        self._requests = services.requests
        self._hub = services.hub
        self._base = services.base
        self._leases = services.leases
        self._motion = motion
        self._runner = runner
        self._job = job
        self._servo = servo
        self._lease = lease
        self._own = own
        self._borrowed = TemporaryValues(services.requests, servo)
        self._answered: Instant = services.base.now()

    async def run(self) -> dict[str, object]:
        """Wiggle; the job's result. Raises as `Wiggle.identify` says, and DidNotMove."""
        job = self._job
        job.begin("check")
        horn = await self._look()
        try:
            job.begin("limit")
            job.done("limit", await self._limit())
            job.begin("wiggle")
            await self._wiggle(horn)
            job.done("wiggle", _evidence(horn))
            job.begin("return")
            back = await self._settle(horn)
            away = abs(back - horn.centre)
            text = f"{back:+.1f}°, {away:.1f}° from where it was"
            job.done("return", Evidence("returned", text, {"angle_deg": back, "away_deg": round(away, 1)}))
            job.begin("restore")
            self._check_ours()
            await self._torque_as_found(horn)
            if left := await shielded(self._borrowed.give_back(self._renew)):
                raise UnexpectedResult(
                    f"{self._servo.title} was not found to hold its own values again.",
                    keys=left,
                    cause="rows_not_restored",
                    servo=self._servo.title,
                )
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
            what = "did not move" if not moved else "did not come back to where it was"
            raise DidNotMove(
                f"The horn of {self._servo.title} {what}: {_evidence(horn)}, in the end {back:+.1f}°. Look whether it "
                "is blocked, and at its dead band (0x2E) and its limits of speed and torque (0x3A to 0x3D).",
                cause="wiggle_failed",
                servo=self._servo.title,
                moved=moved,
                back_deg=back,
            )
        return job.result

    async def _look(self) -> _Horn:
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
                f"The horn of {servo.title} holds {abs(load)} % of its torque and could fall when that is limited to "
                f"{LIMIT_PCT} %. Relieve it first, or turn torque off.",
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
            # never far away: an output that timed out (4.19) or was overcome is not brought back with a jump
            home=near if mode == 0 and abs(near - centre) <= MOVED_DEG else centre,
            low=max(low, centre - AMPLITUDE_DEG),
            high=min(high, centre + AMPLITUDE_DEG),
            tolerance=max(STILL_DEG, (servo.number("angle_dead_band") or 0) + 0.2),
        )
        if not low <= centre <= high or horn.high - horn.low < AMPLITUDE_DEG - STILL_DEG:
            raise OutOfRange(
                f"The horn of {servo.title} stands at {centre:.1f}°, and its angle limits of {low:g}° to {high:g}° "
                "leave no room to wiggle. Turn it inside by hand, or widen the limits.",
                minimum=low, maximum=high, unit=row.unit, requested=centre,
                cause="wiggle_range_too_small", servo=servo.title,
            )  # fmt: skip
        found = ("on", "off", "the brake")[mode] + (", under command" if commanded else "")
        text = f"horn at rest at {centre:+.1f}°, torque {found}; room {horn.low:+.1f} to {horn.high:+.1f}°"
        values = {
            "angle_deg": centre, "torque": ("on", "off", "brake")[mode], "commanded": commanded,
            "low_deg": horn.low, "high_deg": horn.high,
        }  # fmt: skip
        self._job.done("check", Evidence("at_rest", text, values))
        return horn

    async def _limit(self) -> Evidence:
        """Limits first, then the switch that brings them into effect; before torque comes on."""
        servo = self._servo
        self._renew()
        self._motion.may_move(servo, self._lease.id)  # the change it waited for may have changed that
        if "speed_torque_control" not in servo.registers:
            firmware = servo.firmware_text or "unknown"
            text = f"firmware {firmware} has no 0x25, so the servo limits nothing: the slow command alone bounds it"
            return Evidence("not_limited", text, known(firmware=servo.firmware_text))
        most = {
            "speed_limit_cw": LIMIT_RPM, "speed_limit_ccw": -LIMIT_RPM,
            "torque_limit_cw": LIMIT_PCT, "torque_limit_ccw": -LIMIT_PCT,
        }  # fmt: skip
        for key, number in most.items():
            await self._read(key)
            held, wanted = servo.raw(key) or 0, number * servo.registers[key].parameter.per_unit
            await self._borrowed.lend(key, min(held, wanted) if wanted > 0 else max(held, wanted))
        await self._read("speed_torque_control")
        await self._borrowed.lend("speed_torque_control", 1)
        text = f"speed to {LIMIT_RPM} rpm, torque to {LIMIT_PCT} % (0x25 and 0x3A to 0x3D, in RAM, for now)"
        return Evidence("limited", text, {"speed_rpm": LIMIT_RPM, "torque_pct": LIMIT_PCT})

    async def _wiggle(self, horn: _Horn) -> None:
        if horn.mode != 0:
            self._renew()
            await self._motion.torque_on(self._servo, self._lease.id)
        look = functools.partial(self._sample, horn)
        await self._runner.follow(_Wiggle(PERIOD_S, _path(horn), self._command, look))

    async def _command(self, degrees: float) -> bool:
        """One step. False when it was lost: it is decided anew, under a live lease, and no old frame is sent again."""
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
                f"The horn of {self._servo.title} was found at {angle:+.1f}°, further than {FURTHEST_DEG:g}° from "
                f"{horn.centre:+.1f}°, where it was not commanded to. Torque is taken off. Look what turns it.",
                cause="horn_off_position",
                servo=self._servo.title,
                angle_deg=angle,
                centre_deg=horn.centre,
            )
        return angle

    async def _settle(self, horn: _Horn) -> float:
        until, back = self._base.now() + SETTLES_WITHIN_S, None
        while self._base.now() < until or (back is None and self._base.now() - self._answered < SILENT_S):
            self._motion.may_move(self._servo, self._lease.id)
            angle = await self._sample(horn)
            back = back if angle is None else angle
            if angle is not None and abs(angle - horn.centre) <= horn.tolerance:
                break
            await asyncio.sleep(PERIOD_S)
        return await self._read("current_angle")

    def _check_ours(self) -> None:
        """Raises what `Motion.may_move` raises, and TorqueOff: somebody took torque, and has the last word."""
        self._renew()
        self._motion.may_move(self._servo, self._lease.id)
        if not self._motion.is_commanded(self._servo.uid):
            raise TorqueOff(
                f"Torque was taken from {self._servo.title} before it was as it was found.",
                cause="torque_switched_off",
                servo=self._servo.title,
            )

    async def _torque_as_found(self, horn: _Horn) -> None:
        if horn.mode != 0:
            mode = next(word for word, raw in MODES.items() if raw == horn.mode)
            await self._motion.disable_torque(self._servo, mode)
            self._servo.output.restore_reason(horn.output)

    def _restored(self, horn: _Horn) -> Evidence:
        end = {1: "torque is off, as it was", 2: "the brake is on, as it was"}.get(horn.mode)
        values: dict[str, Param] = {"torque": ("on", "off", "brake")[horn.mode], "commanded": bool(horn.commanded)}
        if end is None:
            end = "its command goes on" if horn.commanded else "it holds its place, as it did"
            action, after = self._servo.raw("timeout_action") or 0, self._servo.raw("timeout_time") or 0
            if action and not horn.commanded:
                end += f", until its own time-out (0x26) takes torque in {after / 1000:g} s"
                values["timeout_s"] = after / 1000
        return Evidence("restored", f"every row written back and read; {end}", values)

    async def _end_badly(self, horn: _Horn, error: BaseException) -> None:
        """Torque off (the brake, where it was found on the brake), and every row its own value again."""
        servo = self._servo
        if self._motion.is_commanded(servo.uid):  # else stop, or the end of the lease, has seen to it
            with contextlib.suppress(HornbillError):  # it is owed then, and written until it is answered
                await self._motion.disable_torque(servo, "brake" if horn.mode == MODES["brake"] else "off")
                if horn.mode != ON:
                    servo.output.restore_reason(horn.output)
        elif self._motion.stop.latched or self._motion.torque_off.pending(servo.uid):
            await self._motion.torque_off.acknowledged(QUIET_S)
        left = await self._borrowed.give_back()
        if not left:
            return
        text = (
            f"Not given back after the wiggle of {servo.title}: {', '.join(left)}. They hold what limits it, in RAM "
            "alone. Write them again, or restart it."
        )
        self._hub.publish(LogEvent("failure", "not_restored", text, servo.uid, {"servo": servo.title, "keys": left}))
        if isinstance(error, HornbillError):
            error.extend(after=f" {text}", also="not_restored_after_wiggle", servo=servo.title, not_restored=left)

    async def _read(self, key: str) -> float:
        self._renew()
        register = self._servo.registers[key]
        return await self._requests.read(self._servo, register.parameter, READ) / register.parameter.per_unit

    def _renew(self) -> None:
        if self._own:
            with contextlib.suppress(Unknown):  # the next motion says what became of it
                self._leases.renew(self._lease.id, self._base.now())


def _evidence(horn: _Horn) -> Evidence:
    if not horn.seen:
        return Evidence("angle_unknown", "its angle was never answered")
    low, high, readings = min(horn.seen), max(horn.seen), len(horn.seen)
    return Evidence(
        "wiggled",
        f"seen from {low:+.1f}° to {high:+.1f}° in {readings} readings, "
        f"at most {horn.deviation:.1f}° from {horn.centre:+.1f}°",
        {"low_deg": low, "high_deg": high, "readings": readings, "most_deg": horn.deviation, "angle_deg": horn.centre},
    )


def _path(horn: _Horn) -> Iterator[float | None]:
    """The angle of every slot; None after each way, where the horn is only looked at."""
    track = Track(horn.centre)
    for goal in [horn.high, horn.low] * TIMES + [horn.centre, horn.home]:
        while track.at != goal:
            track.step(goal, CREEP, PERIOD_S)
            yield track.at
        for _ in range(ARRIVAL_SLOTS):
            yield None

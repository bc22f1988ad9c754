"""Steps of a test plan on its servos: preparation, motion, checks of limits, and torque off at the end."""

import asyncio
import contextlib
from collections.abc import Collection, Iterator
from typing import Final

from hornbill.domain.change import Reason
from hornbill.domain.motion import Caution
from hornbill.domain.plan import PlanMove, PlanQuantity, PlanStep, RunPlan
from hornbill.errors import HornbillError, NoResponse, UnexpectedResult, Unknown
from hornbill.schema.fault import OVERVIEW, REGISTERS, bits_of
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.writing import WriteOptions
from hornbill.servo.device import permission
from hornbill.servo.device.output import KEY, ON, OutputState
from hornbill.servo.device.permission import Target
from hornbill.servo.device.requests import POLL, READ, RetryPolicy
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion import cautions
from hornbill.servo.motion.jogs import Jogs
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.motion_control import MotionControl
from hornbill.servo.motion.settle import SAMPLE_S, wait_settled
from hornbill.servo.motion.trapezoid import TrapezoidProfile
from hornbill.servo.profiles.profiles import Profiles
from hornbill.servo.runs.fleet_run import check_outcome, rows_written
from hornbill.servo.runs.plan_run import Exceeded, PlanRun, PlanTarget
from hornbill.servo.runtime.hub import LeaseChanged
from hornbill.servo.runtime.leases import HeldLease
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.steps import Evidence
from hornbill.servo.torque_off.stored import StoredTorqueOff

LEASE_S: Final = 5.0
"""Time to live of the lease of a run, which renews it four times as often."""

WATCH_S: Final = 0.1
"""Interval at which limits are checked with up to four servos; longer with more, so that the bus keeps capacity."""

COMMAND_TRIES: Final = 4
"""A command without a response is sent again: no other client commands the servo meanwhile."""

TORQUE_OFF_S: Final = 1.0
"""Time for servos to acknowledge torque off at the end. It is repeated until they do."""

_MEASURED: Final[tuple[tuple[PlanQuantity, str, str, bool], ...]] = (
    ("temperature_c", "current_temperature", "temperature_c_max", False),
    ("torque_pct", "current_torque", "torque_pct_max", False),
    ("voltage_min_v", "current_voltage", "voltage_v_min", True),
    ("voltage_max_v", "current_voltage", "voltage_v_max", False),
)
"""Limit, row, name of the measured extreme, and whether the limit is a minimum."""


class _EndRun(Exception):
    """A stop rule ends the run."""


class _Drop(Exception):
    """A stop rule ends the run for one servo."""


class PlanSteps:
    """Carries out the steps of a plan under the lease of its run."""

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        jogs: Jogs,
        control: MotionControl,
        profiles: Profiles,
        changes: Changes,
        stored: StoredTorqueOff,
    ) -> None:
        self._requests = services.requests
        self._base = services.base
        self._hub = services.hub
        self._leases = services.leases
        self._motion = motion
        self._jogs = jogs
        self._control = control
        self._profiles = profiles
        self._changes = changes
        self._stored = stored

    def check_commands(self, plan: RunPlan, name: str, servo: Servo) -> list[Caution]:
        """Cautions about all commands of a servo, from its last readings. Sends nothing.

        Raises OutOfRange, InvalidValue, ModeOff, NotInThisModel.
        """
        found: dict[str, Caution] = {}
        for kind, value in _commands(plan, name):
            permission.check_enabled(servo, kind)
            target = permission.target(servo, kind, value, clamp=False)
            found |= {one.code: one for one in self._motion.cautions(servo, kind, target.raw)}
        return list(found.values())

    async def execute(self, run: PlanRun) -> None:
        """Carry out the plan. However it ends, the lease is released and torque is off.

        Raises what ends a run for all servos: Stopped, BusDisconnected, LeaseRequired, LeaseHeld.
        """
        renewing = asyncio.create_task(self._renew(run.lease))
        try:
            run.show_counts()
            if await self._prepare(run):
                await self._cycles(run)
        finally:
            renewing.cancel()
            await shielded(self._end(run))

    async def _renew(self, lease: HeldLease) -> None:
        """Renew the lease until it ends. The next command or check notices its end."""
        with contextlib.suppress(Unknown):
            while True:
                await asyncio.sleep(LEASE_S / 4)
                self._leases.renew(lease.id, self._base.now())
                self._hub.publish(LeaseChanged())

    async def _prepare(self, run: PlanRun) -> bool:
        """Write the profile, check all commands, turn torque on. Returns whether all servos are ready."""
        kinds = {} if run.request.profile is None else {"write": self._write}
        for kind, do in {**kinds, "check": self._check, "torque_on": self._torque_on}.items():
            for target in run.targets:
                if not await run.step(target, kind, do, whole=kind == "write"):
                    run.skip_all(Evidence("other_failed", f"{target.title} failed", {"servo": target.title}))
                    return False
        return True

    async def _write(self, run: PlanRun, target: PlanTarget) -> Evidence:
        profile = run.request.profile
        assert profile is not None
        target.record.use(profile)
        values, _left_out = self._profiles.values_for(profile, target.servo)
        options = WriteOptions(
            run.lease.id, confirm=run.request.confirm, by=run.request.by, job=run.job.id,
            reason=Reason(f"profile {profile.name}", "profile", {"profile": profile.name}),
        )  # fmt: skip
        outcome = await self._changes.apply(target.servo, values, options)
        check_outcome(target.title, outcome)
        return rows_written(sum(one.verdict == "applied" for one in outcome.changes), len(outcome.changes))

    async def _check(self, run: PlanRun, target: PlanTarget) -> Evidence:
        """Read what decides about the commands, check all of them, and note the fault bits that are set."""
        servo = target.servo
        self._motion.may_move(servo, run.lease.id)
        for kind in {kind for kind, _ in _commands(run.plan, target.name)} or {"angle"}:
            await self._motion.freshen(servo, kind, 0.0)
        self.check_confirmed(run.plan, target.name, servo, run.request.confirm)
        target.had = await self._faults(run, target, READ)
        text = f"all commands permitted, {len(target.had)} fault bits set"
        return Evidence("plan_checked", text, {"faults": len(target.had)})

    def check_confirmed(self, plan: RunPlan, name: str, servo: Servo, confirm: Collection[str]) -> None:
        """As `check_commands`; also raises NeedsConfirmation."""
        cautions.require(servo, self.check_commands(plan, name, servo), confirm)

    async def _torque_on(self, run: PlanRun, target: PlanTarget) -> Evidence:
        servo, holder = target.servo, run.lease.holder
        # stored first: a server that is killed is followed by one that turns torque off
        await self._stored.energising(servo, servo.raw(KEY), OutputState("off", "lease", holder, None))
        target.energised = True
        if await self._motion.torque_on(servo, run.lease.id) != ON:
            raise UnexpectedResult(
                f"{target.title} did not accept torque on.",
                differences=[{"key": KEY, "wanted": "on", "found": None}],
                cause="plan_torque_not_on",
                servo=target.title,
            )
        angle = servo.angle_deg or 0.0
        text = f"held at {angle:+.1f}° until motion control ends"
        return Evidence("held", text, {"angle_deg": angle, "held_by": "lease"})

    async def _cycles(self, run: PlanRun) -> None:
        began = self._base.now() - run.ran_s
        try:
            while not run.ended and not all(target.dropped for target in run.targets):
                await self._together(run, run.plan.steps[run.step_number - 1])
                run.ran_s = self._base.now() - began
                run.advance()
        except _EndRun:
            pass
        run.show(self._base.now(), always=True)

    async def _together(self, run: PlanRun, step: PlanStep) -> None:
        """Do one step on all its servos. If one of them ends the run, the others end, too."""
        targets = run.taking_part(step)
        doing = {target.uid: asyncio.create_task(self._do(run, target, step)) for target in targets}
        try:
            await asyncio.gather(*doing.values())
        except _EndRun:
            for target in targets:
                if not doing[target.uid].done():
                    why = Evidence("other_failed", "another servo ended the run", {"servo": run.failed[0].title})
                    run.job.skip(target.plan_step_name(run.step_number), why)
            raise
        finally:
            for task in doing.values():
                task.cancel()
            await asyncio.gather(*doing.values(), return_exceptions=True)

    async def _do(self, run: PlanRun, target: PlanTarget, step: PlanStep) -> None:
        """Do one step on one servo, count it, and apply the stop rules."""
        number, count = run.step_number, target.counts[run.step_number - 1]
        target.now_exceeded.clear()
        run.show_step(target, number, running=True, at=self._base.utc_now())
        run.show(self._base.now())
        rule: _EndRun | _Drop | None = None
        problem: HornbillError | None = None
        try:
            await self._watched(run, target, step)
        except (_EndRun, _Drop) as reached:
            rule = reached
        except HornbillError as error:
            if isinstance(error, run.ENDS):
                raise
            problem, rule = error, _EndRun() if run.plan.stop.on_limit == "stop" else _Drop()
        if problem is None or target.now_exceeded:
            count.runs += 1
            run.show_step(target, number, running=False, at=self._base.utc_now())
        if problem is not None:
            if target.problem is None:  # an exceeded limit explains why the servo switched itself off
                target.fail(problem)
            run.job.fail(target.plan_step_name(number), Evidence.of(problem))
        if isinstance(rule, _EndRun):
            raise rule
        if rule is not None:
            await self._drop(run, target)

    async def _drop(self, run: PlanRun, target: PlanTarget) -> None:
        target.dropped, target.goal = True, None
        with contextlib.suppress(HornbillError):  # torque off is then pending and repeated until acknowledged
            await self._motion.disable_torque(target.servo, "off", by=run.lease.holder)

    async def _watched(self, run: PlanRun, target: PlanTarget, step: PlanStep) -> None:
        """Do the motion of a step while limits are checked, and check them once at its end."""
        moving = asyncio.create_task(self._move(run, target, step))
        watching = asyncio.create_task(self._watch(run, target))
        try:
            await asyncio.wait((moving, watching), return_when=asyncio.FIRST_COMPLETED)
            if watching.done():
                await watching
            try:
                await moving
            except HornbillError as problem:
                if not isinstance(problem, run.ENDS):  # the servo may have switched itself off because of a fault
                    with contextlib.suppress(HornbillError):
                        await self._sample(run, target)
                raise
            await self._sample(run, target)
        finally:
            moving.cancel()
            watching.cancel()
            await asyncio.gather(moving, watching, return_exceptions=True)

    async def _watch(self, run: PlanRun, target: PlanTarget) -> None:
        while True:
            await asyncio.sleep(WATCH_S * _spread(run))
            await self._sample(run, target)

    async def _move(self, run: PlanRun, target: PlanTarget, step: PlanStep) -> None:
        match step.do:
            case "move":
                await self._move_to(run, target, step)
            case "speed":
                await self._push(run, target, "speed", step.speed_rpm, step.for_s)
            case "torque":
                await self._push(run, target, "torque", step.torque_pct, step.for_s)
            case "wait":
                await asyncio.sleep(step.for_s)

    async def _move_to(self, run: PlanRun, target: PlanTarget, step: PlanMove) -> None:
        """Move to an angle and wait for the horn. Then the position error is checked."""
        servo, count, limit = target.servo, target.counts[run.step_number - 1], run.plan.limits.position_error_deg
        angle = step.angle_of(target.name)
        target.goal = None
        if step.speed_deg_s is None:
            commanded = await self._command(run, target, "angle", angle)
        else:
            profile = TrapezoidProfile(step.speed_deg_s, step.accel_deg_s2)
            commanded, jog = await self._jogs.move(
                servo, run.lease.id, angle, profile, clamp=False, confirm=run.request.confirm
            )
            try:
                await asyncio.wait([jog])
            finally:
                self._jogs.end(servo.uid)
        found = await wait_settled(
            self._requests, servo, self._base, commanded.raw,
            band_deg=limit, dwell_s=step.dwell_s, timeout_s=step.timeout_s,
            still_allowed=lambda: self._motion.check_command(servo, run.lease.id, commanded),
            sample_s=SAMPLE_S * _spread(run),
        )  # fmt: skip
        if found.angle_deg is None or found.unmet == "samples":
            raise NoResponse(
                f"The angle of {target.title} could not be read after a move. Check the bus and its load.",
                cause="servo_not_responding",
                servo=target.title,
            )
        if found.time_s is None:
            error = abs(found.angle_deg - angle)
            count.error(error)
            self._exceed(run, target, "position_error_deg", round(error, 2), limit)
            return
        count.settled(found.time_s)
        count.error(found.max_deviation_deg or 0.0)
        target.goal = commanded

    async def _push(self, run: PlanRun, target: PlanTarget, kind: str, value: float, for_s: float) -> None:
        target.goal = None
        await self._command(run, target, kind, value)
        await asyncio.sleep(for_s)
        await self._command(run, target, kind, 0.0)

    async def _command(self, run: PlanRun, target: PlanTarget, kind: str, value: float) -> Target:
        for left in reversed(range(COMMAND_TRIES)):
            try:
                return await self._motion.command(
                    target.servo, run.lease.id, kind, value, clamp=False, confirm=run.request.confirm
                )
            except NoResponse:
                if not left:
                    raise
        raise AssertionError("unreachable")

    async def _sample(self, run: PlanRun, target: PlanTarget) -> None:
        """Read what the limits are about and apply them. A reading without a response is left out.

        Raises _EndRun and _Drop by the stop rules, and what ends motion of this servo.
        """
        limits = run.plan.limits
        values = {key: await self._value(target, key) for key in dict.fromkeys(key for _, key, _, _ in _MEASURED)}
        for quantity, key, name, least in _MEASURED:
            value, limit = values[key], getattr(limits, quantity)
            if value is None:
                continue
            value = abs(value) if quantity == "torque_pct" else value
            target.measure(name, value, least=least)
            if limit is not None and (value < limit if least else value > limit):
                self._exceed(run, target, quantity, value, limit)
        goal = target.goal
        if goal is not None and (angle := await self._value(target, "current_angle")) is not None:
            error = abs(angle - goal.raw / goal.parameter.per_unit)
            if target.goal is goal:  # otherwise a move has begun meanwhile
                target.counts[run.step_number - 1].error(error)
                if error > limits.position_error_deg:
                    self._exceed(run, target, "position_error_deg", round(error, 2), limits.position_error_deg)
        for key in sorted(await self._faults(run, target, POLL) - target.had):
            target.had.add(key)  # in a run that continues it counts again when it appears again
            self._exceed(run, target, "faults", key, None)
        if goal is not None and target.goal is goal:  # also notices torque off by another client
            self._motion.check_command(target.servo, run.lease.id, goal)
        else:
            self._motion.may_move(target.servo, run.lease.id)

    async def _value(self, target: PlanTarget, key: str, policy: RetryPolicy = POLL) -> float | None:
        """A reading in the unit of its row. None without a response, or if the servo lacks the row."""
        register = target.servo.registers.get(key)
        if register is None:
            return None
        try:
            return await self._requests.read(target.servo, register.parameter, policy) / register.parameter.per_unit
        except NoResponse:
            return None

    async def _faults(self, run: PlanRun, target: PlanTarget, policy: RetryPolicy) -> set[str]:
        """Keys of the set bits of the plan's levels. What the overview (0x18) shows as clear is not read."""
        overview = await self._value(target, OVERVIEW, policy)
        if overview is None:
            return set()
        known = {(bit.parameter, bit.bit): bit.key for bit in target.servo.catalog.faults}
        found: set[str] = set()
        for place, (register, level) in enumerate(REGISTERS.items()):
            summary = any(bit % 8 == place for bit in bits_of(int(overview)))
            if level in run.plan.limits.faults and summary:
                word = await self._value(target, register, policy)
                bits = bits_of(int(word or 0))
                found |= {known.get((register, bit), f"{level}_bit_{bit}") for bit in bits}
        return found

    def _exceed(
        self, run: PlanRun, target: PlanTarget, quantity: PlanQuantity, value: float | str, limit: float | None
    ) -> None:
        """Record an exceeded limit, once in a step, and apply the stop rules."""
        if quantity in target.now_exceeded and quantity != "faults":
            return
        at = self._base.utc_now()
        target.note(Exceeded(cycle=run.cycle, step=run.step_number, quantity=quantity, value=value, limit=limit, at=at))
        rules = run.plan.stop
        total = sum(one.exceeded_total for one in run.targets)
        if rules.on_limit == "stop" or (rules.after_exceeded is not None and total >= rules.after_exceeded):
            raise _EndRun
        if rules.on_limit == "drop":
            raise _Drop

    async def _end(self, run: PlanRun) -> None:
        """Release the lease, which turns torque off, and wait for the servos to acknowledge."""
        with contextlib.suppress(Unknown):  # it ended before, which turned torque off as well
            self._control.release(run.lease.id, "job_ended")
        torque_off = self._motion.torque_off
        await torque_off.acknowledged(TORQUE_OFF_S)
        for target in run.targets:
            name = target.step_name("torque_off")
            if not target.energised:
                continue
            run.job.begin(name)
            if torque_off.pending(target.uid):
                run.job.fail(name, Evidence("torque_off_pending", "not acknowledged yet, repeated until it is"))
            else:
                self._stored.over(target.servo)
                run.job.done(name, Evidence("torque_off", "0x20 is off"))


def _spread(run: PlanRun) -> float:
    """Factor of the intervals at which servos are read: above 1 with more than four."""
    return max(1.0, len(run.targets) / 4)


def _commands(plan: RunPlan, name: str) -> Iterator[tuple[str, float]]:
    """Kind and value of every command of a servo."""
    for step in plan.steps:
        if name not in plan.named(step):
            continue
        match step.do:
            case "move":
                yield "angle", step.angle_of(name)
            case "speed":
                yield "speed", step.speed_rpm
            case "torque":
                yield "torque", step.torque_pct
            case "wait":
                pass

"""Activity: what the motor and horn of a servo are doing, derived from received data."""

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple, TypeAlias

from hornbill.domain.event import EventCode
from hornbill.schema.effect import COMMANDS, MODE, in_force
from hornbill.servo.device.fleet import EVERY_SERVO
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.monitoring.oscillation import QUIET_S, Oscillation
from hornbill.servo.monitoring.polling import Polling
from hornbill.servo.runtime.hub import Hub, LogEvent, ReadingChanged, Sampled, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Raw, Uid
from hornbill.wire.messages import ArrayCommand
from hornbill.wire.transfer import Transfer

Doing: TypeAlias = Literal[
    "holding", "moving", "turning", "hunting", "saturated", "soft_start", "released", "held_after_timeout", "off",
    "brake", "unknown",
]  # fmt: skip

Alarm: TypeAlias = Literal["hunting", "saturated"]
ENDED: Final[Mapping[Alarm, EventCode]] = {"hunting": "hunting_ended", "saturated": "saturated_ended"}
ALARMS: Final[tuple[Alarm, ...]] = ("hunting", "saturated")

REST_S: Final = 0.6
"""Time after a new command in which motion does not count as oscillation at rest."""

STEADY_S: Final = 0.6
STARTS_DEG, FOLLOWS_DEG, STEADY_DEG = 0.5, 0.2, 0.3
"""A horn that moves by STARTS_DEG within STEADY_S is moving (FOLLOWS_DEG right after a new command). It is steady again
once it stays within STEADY_DEG for that time."""

EVERY_S: Final = 0.04
"""Minimum interval of the samples stored for this."""

SILENT_S: Final = 1.0
"""Age above which an angle no longer shows the activity."""

NEAR_LIMIT, CLEAR_OF_LIMIT = 0.9, 0.8
"""Shares of the torque limit: above the first, a motor at rest is saturated; below the second, no longer."""

MIN_LIMIT_PCT: Final = 5.0
"""A lower limit is treated as this one."""

CONFIRM_S: Final = 0.5
"""Minimum time between two readings near the torque limit."""

CALM_S: Final = 2.0
"""An alarm ends once the horn has held its position for this time without the cause, or when its output is off."""

NEW_COMMAND_DEG: Final = 0.3
"""An ArrayCommand of another tool that differs by less counts as a repetition."""

UNSTEADY_PCT: Final = 25.0
UNSTEADY_S: Final = 8.0
"""Torque variation at rest within this time that suggests an oscillation not visible in Status."""

FAST_POLL_HZ: Final = (23.7, 29.3)
FAST_POLL_S: Final = 2.0
RATE_POLL_HZ, RATE_POLL_S = 120.0, 1.0
MAX_FAST_POLLED: Final = 4
"""Then 0x08 is polled for this time at these rates in turn, because an oscillation at a multiple of a rate is not
visible at that rate. Once it is proved, 0x08 is polled at RATE_POLL_HZ for RATE_POLL_S to measure its frequency, if the
bus budget allows that. At most this number of servos at a time."""

NEVER: Final[Instant] = -math.inf

_REGISTER: Final = {kind: key for key, kind in COMMANDS.items()}
_AWAY: Final = frozenset((State.OFFLINE, State.IDENTIFYING, State.SAVING, State.RESTARTING, State.UPDATING))


class ServoActivity(NamedTuple):
    """Activity of a servo, its start, and the values behind it (None if unknown).

    `peak_to_peak_deg`: range of the angle, of the swings while hunting, else over the last STEADY_S. `torque_pct`: last
    reading of 0x0A. `torque_limit_pct`: its limit on that side. `rate_hz`: frequency while hunting, once measured.
    """

    doing: Doing
    since: Instant
    peak_to_peak_deg: float | None
    torque_pct: float | None
    torque_limit_pct: float
    rate_hz: float | None = None


@dataclass(slots=True)
class _Watch:
    """Observed data of one servo."""

    servo: Servo
    doing: Doing = "unknown"
    since: Instant = NEVER
    boot_count: int = 0
    oscillation: Oscillation = field(default_factory=Oscillation)
    angles: deque[tuple[Instant, float]] = field(default_factory=lambda: deque[tuple[Instant, float]](maxlen=64))
    angle_at: Instant = NEVER
    moving: bool = False
    commands: list[Raw | None] = field(default_factory=list[Raw | None])
    foreign: tuple[int, float] | None = None
    commanded_at: Instant = NEVER
    torque_pct: float | None = None
    torques: deque[tuple[Instant, float]] = field(default_factory=lambda: deque[tuple[Instant, float]](maxlen=64))
    near_since: Instant | None = None
    near: bool = False
    fast_until: Instant = NEVER
    fast_polls: int = 0
    rate_hz: float | None = None
    alarms: set[Doing] = field(default_factory=set[Doing])
    calm_since: Instant | None = None

    def forget_motion(self) -> None:
        """Discard motion data after a restart or a gap."""
        self.oscillation.reset()
        self.angles.clear()
        self.torques.clear()
        self.moving = self.near = False
        self.near_since = None


class Activities:
    """Follows angles, torque and commands, and publishes changes of activity.

    A horn is "at rest" while its command does not change. If it still oscillates, the control loop of the servo is
    hunting. Reads nothing itself, except faster polling where the angles of Status may mislead.
    """

    def __init__(
        self,
        hub: Hub,
        base: TimeBase,
        polling: Polling,
        find: Callable[[Uid], Servo | None],
        is_commanded: Callable[[Uid], bool],
    ) -> None:
        """`find` returns the servo with a UID; `is_commanded`, whether a client of this server commands it."""
        self._hub = hub
        self._base = base
        self._polling = polling
        self._find = find
        self._is_commanded = is_commanded
        self._watches: dict[Uid, _Watch] = {}
        hub.subscribe(self._on_sample, Sampled)
        hub.subscribe(self._on_servo, ServoChanged)
        hub.subscribe(self._on_reading, ReadingChanged)

    def of(self, servo: Servo) -> ServoActivity:
        """Current activity of a servo."""
        watch = self._watch(servo)
        limit = torque_limit_pct(servo, watch.torque_pct or 0.0)
        if watch.doing == "unknown":
            return ServoActivity("unknown", watch.since, None, None, limit)
        if watch.doing == "hunting":
            wide = watch.oscillation.peak_to_peak_deg()
        else:
            wide = _range(watch.angles) if watch.angles else None
        return ServoActivity(
            watch.doing, watch.since, None if wide is None else round(wide, 1), watch.torque_pct, limit, watch.rate_hz
        )

    def tick(self) -> None:
        """Detect missing angles. Call a few times a second."""
        now = self._base.now()
        for watch in self._watches.values():
            if now - watch.angle_at > SILENT_S and watch.doing != "unknown":
                self._judge(watch, now)

    def on_array_command(self, transfer: Transfer, message: ArrayCommand) -> None:
        """Process an ArrayCommand of another tool. A repetition of the same command leaves the horn at rest."""
        commands = {one.actuator_id: (int(one.command_type), one.command_value) for one in message.commands}
        for watch in self._watches.values():
            command = commands.get(watch.servo.servo_id or 0, commands.get(EVERY_SERVO))
            if command is None or not watch.servo.online:
                continue
            before, watch.foreign = watch.foreign, command
            if before is None or before[0] != command[0] or _differs(before, command):
                watch.commanded_at = transfer.at

    def _on_sample(self, sample: Sampled) -> None:
        if sample.value is None or sample.key not in ("current_angle", "current_torque"):
            return
        watch = self._watches.get(sample.uid)
        if watch is None:
            servo = self._find(sample.uid)
            if servo is None:
                return
            watch = self._watch(servo)
        if sample.key == "current_angle":
            self._angle(watch, sample.t, sample.value)
        else:
            self._torque(watch, sample.t, sample.value)

    def _angle(self, watch: _Watch, t: Instant, degrees: float) -> None:
        if t - watch.angle_at > SILENT_S or watch.boot_count != watch.servo.boot_count:
            watch.forget_motion()
            watch.boot_count = watch.servo.boot_count
        watch.angle_at = t
        self._check_command(watch, t)
        if t - watch.commanded_at >= REST_S:
            watch.oscillation.add(t, degrees)
        angles = watch.angles
        if angles and t - angles[-1][0] < EVERY_S:
            return
        angles.append((t, degrees))
        while t - angles[0][0] > STEADY_S:
            angles.popleft()
        span, new = _range(angles), t - watch.commanded_at < STEADY_S
        at_rest = not watch.moving and watch.doing == "holding"
        if watch.moving:
            watch.moving = span > STEADY_DEG or (new and span >= FOLLOWS_DEG)
        else:
            watch.moving = span >= STARTS_DEG or (new and span >= FOLLOWS_DEG)
        if watch.moving:
            watch.near, watch.near_since = False, None
        if at_rest and not watch.moving and not watch.alarms and not watch.oscillation.suspected:
            return  # still holding: anything else that could change this is published
        self._judge(watch, t)
        if watch.doing == "moving" and watch.oscillation.suspected:
            self._poll_fast(watch, t, "current_angle")

    def _torque(self, watch: _Watch, t: Instant, pct: float) -> None:
        watch.torque_pct = pct
        share = abs(pct) / max(torque_limit_pct(watch.servo, pct), MIN_LIMIT_PCT)
        if watch.moving or share < CLEAR_OF_LIMIT:
            watch.near, watch.near_since = False, None
        elif share >= NEAR_LIMIT:
            watch.near_since = t if watch.near_since is None else watch.near_since
            watch.near = t - watch.near_since >= CONFIRM_S
        if t - watch.commanded_at < REST_S:
            watch.torques.clear()
        elif not watch.torques or t - watch.torques[-1][0] >= CONFIRM_S / 2:
            watch.torques.append((t, pct))
        while watch.torques and t - watch.torques[0][0] > UNSTEADY_S:
            watch.torques.popleft()
        if watch.near_since is not None and not watch.near:
            self._poll_fast(watch, t, "current_torque")
        if watch.torques and _range(watch.torques) >= UNSTEADY_PCT:
            self._poll_fast(watch, t, "current_angle")
        self._judge(watch, t)

    def _on_servo(self, change: ServoChanged) -> None:
        servo = self._find(change.uid)
        if servo is not None:
            self._judge(self._watch(servo), self._base.now())

    def _on_reading(self, change: ReadingChanged) -> None:
        watch = self._watches.get(change.uid)
        if watch is not None and (change.key in ("torque_mode", MODE) or change.key in COMMANDS):
            self._judge(watch, self._base.now())

    def _watch(self, servo: Servo) -> _Watch:
        watch = self._watches.get(servo.uid)
        if watch is None or watch.servo is not servo:
            watch = self._watches[servo.uid] = _Watch(servo, since=self._base.now(), boot_count=servo.boot_count)
        return watch

    def _check_command(self, watch: _Watch, now: Instant) -> None:
        """Check the command registers: a new command ends rest."""
        servo = watch.servo
        commands = [servo.raw(key) for key in COMMANDS]
        if commands != watch.commands:
            if watch.commands:
                watch.commanded_at = now
                watch.oscillation.reset()
            watch.commands = commands

    def _judge(self, watch: _Watch, now: Instant) -> None:
        doing = self._doing(watch, now)
        rate = watch.oscillation.rate_hz() if doing == "hunting" else None
        rate = watch.rate_hz if rate is None and doing == "hunting" else rate
        known = (rate is None) == (watch.rate_hz is None)
        watch.rate_hz = rate
        if doing != watch.doing or not known:
            began = doing == "hunting" != watch.doing
            if doing != watch.doing:
                watch.doing, watch.since = doing, now
            if began:
                self._poll_rate(watch, now)
            self._hub.publish(ServoChanged(watch.servo.uid))
        if doing == "hunting" and watch.oscillation.since_turn(now) > QUIET_S / 2:
            self._poll_fast(watch, now, "current_angle")
        self._alarm(watch, now)

    def _doing(self, watch: _Watch, now: Instant) -> Doing:
        servo = watch.servo
        state = servo.state
        if state in _AWAY:
            return "unknown"
        if state is State.SOFT_START:
            return "soft_start"
        output = servo.output_state
        if output.state == "off":
            return "released" if output.reason == "timeout" else "off"
        if output.state == "brake":
            return "brake"
        if output.state == "unknown" or now - watch.angle_at > SILENT_S:
            return "unknown"
        kind = in_force({key: servo.raw(key) for key in (MODE, *COMMANDS)}, servo.registers)
        if kind in ("speed", "torque") and servo.raw(_REGISTER[kind]) not in (0, None):
            return "turning"
        if self._is_hunting(watch, now):
            return "hunting"
        if watch.moving:
            return "moving"
        if watch.near:
            return "saturated"
        held = (
            servo.output.timed_out_at is not None and not servo.commanded_by_pwm and not self._is_commanded(servo.uid)
        )
        return "held_after_timeout" if held else "holding"

    def _is_hunting(self, watch: _Watch, now: Instant) -> bool:
        """Whether it is hunting. Unknown, so False, while a PWM signal may be moving it."""
        servo, swing = watch.servo, watch.oscillation
        if now - watch.commanded_at < REST_S or (servo.commanded_by_pwm and self._left_to_pwm(servo)):
            return False
        if swing.proved(now):
            return True
        return watch.doing == "hunting" and swing.since_turn(now) <= QUIET_S + len(FAST_POLL_HZ) * FAST_POLL_S

    @staticmethod
    def _left_to_pwm(servo: Servo) -> bool:
        return servo.output.commanded_at is None or servo.output.timed_out_at is not None

    def _poll_fast(self, watch: _Watch, now: Instant, key: str) -> None:
        """Poll a row faster for FAST_POLL_S, unless too many servos are polled so."""
        servo = watch.servo
        busy = sum(other.fast_until > now for other in self._watches.values())
        if servo.recorded or servo.state in _AWAY or watch.fast_until > now or busy >= MAX_FAST_POLLED:
            return
        watch.fast_until = now + FAST_POLL_S
        watch.fast_polls += 1
        self._polling.subscribe(
            servo, [key], FAST_POLL_HZ[watch.fast_polls % len(FAST_POLL_HZ)], owner="activity", ttl_s=FAST_POLL_S
        )

    def _poll_rate(self, watch: _Watch, now: Instant) -> None:
        """Poll the angle at RATE_POLL_HZ in place of the slower polls that proved the oscillation."""
        busy = sum(other.fast_until > now for other in self._watches.values() if other is not watch)
        if not watch.servo.recorded and busy < MAX_FAST_POLLED:
            watch.fast_until = now + RATE_POLL_S
            self._polling.subscribe(watch.servo, ["current_angle"], RATE_POLL_HZ, owner="activity", ttl_s=RATE_POLL_S)

    def _alarm(self, watch: _Watch, now: Instant) -> None:
        """Start an alarm with its activity. End it after CALM_S at rest without it, or when the output is off."""
        doing = watch.doing
        if doing in ALARMS:
            watch.calm_since = None
            if doing not in watch.alarms and not watch.servo.recorded:
                watch.alarms.add(doing)
                self._publish_alarm(watch, doing)
            return
        gone = doing in ("off", "brake", "released")
        if not watch.alarms or not (gone or doing in ("holding", "held_after_timeout")):
            watch.calm_since = None
            return
        watch.calm_since = now if watch.calm_since is None else watch.calm_since
        if gone or now - watch.calm_since >= CALM_S:
            for alarm in ALARMS:
                if alarm in watch.alarms:
                    self._publish_end(watch, alarm)
            watch.alarms.clear()

    def _publish_alarm(self, watch: _Watch, doing: Alarm) -> None:
        servo, found = watch.servo, self.of(watch.servo)
        params: dict[str, object] = {
            "servo": servo.title, "peak_to_peak_deg": found.peak_to_peak_deg, "torque_pct": found.torque_pct,
            "torque_limit_pct": found.torque_limit_pct,
        }  # fmt: skip
        if doing == "hunting":
            text = f"{servo.title} oscillates at rest by {found.peak_to_peak_deg:.1f}° peak to peak (hunting). "
            text += "Lower the angle P gain, raise the D gain, or widen the deadband."
        else:
            text = f"{servo.title} is at rest with {found.torque_pct:.0f} % torque, near its limit of "
            text += f"{found.torque_limit_pct:.0f} %. Check for a blocked horn or a load that is too heavy."
        self._hub.publish(LogEvent("warning", doing, text, servo.uid, params))

    def _publish_end(self, watch: _Watch, doing: Alarm) -> None:
        title = watch.servo.title
        text = f"{title} no longer oscillates at rest."
        if doing == "saturated":
            text = f"The torque of {title} is no longer near its limit."
        self._hub.publish(LogEvent("info", ENDED[doing], text, watch.servo.uid, {"servo": title}))


def torque_limit_pct(servo: Servo, pct: float) -> float:
    """Torque available at rest on the side of `pct`, % of maximum, from the last readings.

    Limited by 0x3C and 0x3D while speed and torque control (0x25) is on, by the overcurrent limit (0x2A) as a share of
    its default, and by a supply below nominal.
    """
    limit = 100.0
    if servo.raw("speed_torque_control") == 1:
        side = servo.raw("torque_limit_cw" if pct >= 0 else "torque_limit_ccw")
        limit = limit if side is None else min(limit, float(abs(side)))
    current = servo.registers.get("overcurrent_limit")
    if current is not None and current.raw is not None and current.parameter.default:
        limit = min(limit, 100.0 * current.raw / current.parameter.default)
    supply = servo.registers.get("current_voltage")
    if supply is not None and supply.raw is not None and servo.model is not None:
        limit = min(limit, 100.0 * supply.raw / supply.parameter.per_unit / servo.model.nominal_v)
    return round(limit, 1)


def _range(samples: deque[tuple[Instant, float]]) -> float:
    values = [value for _, value in samples]
    return max(values) - min(values)


def _differs(one: tuple[int, float], other: tuple[int, float]) -> bool:
    """Whether two ArrayCommand values of one type are different commands. Positions are in 100° or half turns."""
    return abs(one[1] - other[1]) * 100.0 > NEW_COMMAND_DEG

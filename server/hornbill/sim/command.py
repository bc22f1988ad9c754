"""The active command, and whether the motor may follow it (4.1 to 4.3, 4.13, 4.14, 4.19)."""

from random import Random
from typing import Final

from hornbill.schema.parameter import DUMMY
from hornbill.sim import address
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.mechanics.motion import HornMotion
from hornbill.sim.mechanics.plant import Plant
from hornbill.sim.memory import Memory
from hornbill.sim.orders import AngleFrame, orders_for
from hornbill.units import Instant, Raw

ON: Final = 0
OFF: Final = 1
BRAKE: Final = 2

_NEVER: Final = float("inf")
_AT_SPEED: Final = 1  # rpm: tolerance of a reached speed limit because of the speed deadband
_ARRIVED: Final = 10  # tenths of a degree: soft start ends within about 1° (4.14)


class CommandInput:
    """Converts commands, torque mode, timeout, soft start and protection to orders for the motor.

    The command registers 0x00 to 0x02 are in `memory`; `kind` is the address of the active one. The caller advances
    `motion` to `now` before calling a method with `now`, and updates the supply with `set_supply`.
    """

    def __init__(self, memory: Memory, motion: HornMotion, plant: Plant, behaviour: Behaviour, random: Random) -> None:
        """`random` is the noise of the angle sensor."""
        self.behaviour = behaviour
        self.kind = address.COMMAND_ANGLE
        self.timed_out = False
        self.soft_starting = False
        self.pulsed = False
        """Whether the PWM input has or just had a signal: then it takes over if no CAN command arrives (4.30)."""
        self._memory = memory
        self._motion = motion
        self._plant = plant
        self._random = random
        self._frame = AngleFrame()
        self._fed_at: Instant | None = None
        self._commanded = False
        self._mode = OFF
        self._halted = True
        self._protecting = False
        self._holding = True
        self._unshown: Raw | None = None
        self._frozen_tenths: Raw | None = None
        self._supply = 1.0
        self._pulse_counts_until: Instant = -_NEVER

    @property
    def output(self) -> int:
        """Motor output: ON, OFF or BRAKE. Protection has priority (4.13)."""
        if self._halted or self._protecting:
            return OFF
        if self.timed_out and not self.pulsed:
            action = self._memory.get(address.TIMEOUT_ACTION)
            if action != ON and (self._mode == ON or self.behaviour.timeout_changes == "any_output"):
                return action
        return self._mode

    @property
    def due(self) -> Instant:
        """Time of the communication timeout. Infinity while it is not running (4.19)."""
        if self._fed_at is None or self.timed_out:
            return _NEVER
        return self._fed_at + self._memory.get(address.TIMEOUT_TIME) / 1000.0

    @property
    def can_silent(self) -> bool:
        """Whether no CAN command has arrived, or not for so long that the PWM input takes over (4.30)."""
        return not self._commanded or self.timed_out

    @property
    def commanded(self) -> bool:
        """Whether a command has arrived since the start."""
        return self._commanded

    @property
    def angle(self) -> Raw:
        """Value of 0x08 without noise: turns are counted for angle commands, otherwise according to 0x24 (4.4)."""
        return self._read_angle(0.0)

    def noisy_angle(self) -> Raw:
        """A reading of 0x08 with the noise of the sensor."""
        noise = self._motion.constants.sensor_noise_deg
        return self._read_angle(self._random.gauss(0.0, noise) if noise else 0.0)

    def _read_angle(self, noise_deg: float) -> Raw:
        if self._frozen_tenths is not None:
            return self._frozen_tenths
        tenths = self._frame.tenths(self._motion.angle + noise_deg)
        if self.kind == address.COMMAND_ANGLE or self._memory.get(address.EXTENDED_ANGLE):
            return tenths
        return (tenths + 1800) % 3600 - 1800

    @property
    def speed(self) -> Raw:
        """Value of 0x09, rpm."""
        return min(max(round(self._frame.sign * self._motion.speed / 6.0), -300), 300)

    @property
    def torque(self) -> Raw:
        """Value of 0x0A, % of stall torque."""
        return min(max(round(self._frame.sign * self._motion.torque * 100.0), -150), 150)

    def start(self, now: Instant) -> None:
        """Power-on: discard turns and commands, then soft start, hold the present angle, or stay without output."""
        memory = self._memory
        self.kind = address.COMMAND_ANGLE
        self.timed_out = self._protecting = self._halted = self.pulsed = False
        self._pulse_counts_until = -_NEVER
        self._unshown = self._frozen_tenths = None
        self._fed_at = now if self.behaviour.timeout_from == "power_on" else None
        self._commanded = False
        self._mode = memory.get(address.TORQUE_MODE)
        self._update_frame()
        self._forget_turns()
        memory.put(address.COMMAND_SPEED, 0)
        memory.put(address.COMMAND_TORQUE, 0)
        self.soft_starting = self._mode == ON and memory.get(address.SOFT_START) == 1
        memory.apply_soft_start(self.soft_starting)
        self._holding = not self.soft_starting
        memory.put(address.COMMAND_ANGLE, 0 if self.soft_starting else self.angle)
        self.refresh()

    def freeze_angle(self, on: bool) -> None:
        """While the angle sensor cannot be read (4.12), keep the last reading. What 0x08 reads then is not documented;
        output is off."""
        if on != (self._frozen_tenths is not None):
            self._frozen_tenths = self.angle if on else None

    @property
    def halted(self) -> bool:
        """Whether the motor is stopped for a ROM write, an update, or for good."""
        return self._halted

    def halt(self, halted: bool) -> None:
        """Stop the motor for a ROM write or permanently, or resume."""
        self._halted = halted
        self.refresh()

    def command(self, kind: int, raw: Raw, now: Instant, *, counts: bool = True, shown: bool = True) -> bool:
        """Execute an angle, speed or torque within the range of its register. False if ignored: 0x25 is off (4.18).

        `counts`: whether it restarts the timeout; commands of the PWM input do not. Unless `shown`, it is executed but
        the registers keep their values.
        """
        memory = self._memory
        if kind != address.COMMAND_ANGLE and not self.cascade():
            return False  # 0x25 is on during soft start and may be off again after this command ends it (4.14)
        self._end_soft_start()
        self._begin_kind(kind)
        self._unshown = None if shown else raw
        if shown:
            for at in address.COMMANDS:
                memory.put(at, raw if at == kind else DUMMY)
        self._holding = False
        if counts:
            self._feed(now)
        self.refresh()
        return True

    def torque_mode(self, now: Instant) -> None:
        """Handle a write of 0x20. It counts as a command, and ON after OFF or BRAKE discards the last one (4.13)."""
        if self.soft_starting:
            self._end_soft_start()
            self._drop_command()
        self._feed(now)
        self._update_mode()

    def factory_reset(self) -> None:
        """After 0x10 reset the registers: commands are reset to 0, too, and a horn with torque moves there (4.9)."""
        self._mode = self._memory.get(address.TORQUE_MODE)
        self._end_soft_start()
        self._begin_kind(address.COMMAND_ANGLE)
        self._holding = False
        self._unshown = None
        for at in address.COMMANDS:
            self._memory.put(at, 0)
        self.refresh()

    def configured(self) -> None:
        """Handle a write or reset of registers other than the commands."""
        self._update_mode()

    def expire(self) -> None:
        """Handle the timeout of 0x27. The command is retained: the next one restores this state (4.19)."""
        self.timed_out = True
        if self.soft_starting and self._memory.get(address.TIMEOUT_ACTION) != ON:
            self._end_soft_start()
            self._drop_command()
        self.refresh()

    def protect(self, on: bool) -> None:
        """A limit is exceeded (`on`), or no longer. On return the last command is discarded (table in 4.7)."""
        if on == self._protecting:
            return
        self._protecting = on
        self._end_soft_start()
        if not on and self._mode == ON:
            self._drop_command()
        self.refresh()

    def set_supply(self, supply: float) -> None:
        """Set the supply relative to nominal voltage."""
        if supply != self._supply:
            self._supply = supply
            self._motion.obey(self._motion.orders._replace(volts=supply))

    def update_pulse(self, signal: bool, now: Instant) -> None:
        """Set whether the PWM input has a signal. A lost signal still counts for the time of 0x27 (4.30)."""
        if signal:
            self._pulse_counts_until = now + self._memory.get(address.TIMEOUT_TIME) / 1000.0
        before, self.pulsed = self.pulsed, now < self._pulse_counts_until
        if self.pulsed != before:
            self.refresh()

    def watch_soft_start(self) -> None:
        """End soft start when the horn has arrived (4.14)."""
        if self.soft_starting and abs(self.angle) <= _ARRIVED:
            self._end_soft_start()
            self.refresh()

    def cascade(self) -> bool:
        """Whether speed and torque control (0x25) is on, by soft start or by its setting."""
        if self.soft_starting:
            return True
        default = int(self.behaviour.cascade_without_switch)
        return self._memory.own(address.SPEED_TORQUE_CONTROL, default) == 1

    def plant_angle(self, tenths: Raw) -> float:
        """Angle of the horn in the plant's degrees at which 0x08 reads `tenths`."""
        return self._frame.degrees(tenths)

    def limits_reached(self) -> list[str]:
        """Keys of the notification bits for the present position, speed, torque and command (4.31 to 4.33)."""
        get, sign, motion = self._memory.get, int(self._frame.sign), self._motion
        watched = [("angle", address.COMMAND_ANGLE, self.angle, *self._angle_limits(), 0, 0)]
        if self.cascade() and not self.soft_starting:
            low, high, side = get(address.SPEED_LIMIT_CCW), get(address.SPEED_LIMIT_CW), motion.limited_speed * sign
            watched.append(("speed", address.COMMAND_SPEED, self.speed, low, high, side, _AT_SPEED))
            low, high, side = get(address.TORQUE_LIMIT_CCW), get(address.TORQUE_LIMIT_CW), motion.limited_torque * sign
            watched.append(("torque", address.COMMAND_TORQUE, self.torque, low, high, side, 0))
        followed = self.kind if not self._holding and self.output == ON else None
        found: list[str] = []
        for name, at, present, low, high, side, near in watched:
            wanted = self._wanted(at) if at == followed else None
            if present >= high or (wanted is not None and wanted > high) or (side > 0 and present >= high - near):
                found.append(f"{name}_limit_cw_reached")
            if present <= low or (wanted is not None and wanted < low) or (side < 0 and present <= low + near):
                found.append(f"{name}_limit_ccw_reached")
        return found

    def refresh(self) -> None:
        """Update the orders of the motor."""
        self._update_frame()
        target = self._wanted(self.kind)
        if self.kind == address.COMMAND_ANGLE and not self._holding:
            low, high = self._angle_limits()
            target = min(max(target, low), high)
        self._motion.obey(
            orders_for(
                self._memory,
                self._plant,
                self._frame,
                self.kind,
                target,
                output=self.output,
                cascade=self.cascade(),
                supply=self._supply,
            )
        )

    def _wanted(self, at: int) -> Raw:
        """The command in register `at`, or the one that registers do not show."""
        return self._memory.get(at) if self._unshown is None else self._unshown

    def _angle_limits(self) -> tuple[Raw, Raw]:
        """CCW and CW limit in the degrees of commands (4.31)."""
        get = self._memory.get
        moved = 0 if self.behaviour.limits_follow_origin else get(address.ORIGIN)
        return get(address.ANGLE_LIMIT_CCW) - moved, get(address.ANGLE_LIMIT_CW) - moved

    def _begin_kind(self, kind: int) -> None:
        """Switch to this kind of command. An angle after another kind counts turns only with 0x24 (4.17)."""
        before, self.kind = self.kind, kind
        if kind == address.COMMAND_ANGLE and before != kind and not self._memory.get(address.EXTENDED_ANGLE):
            self._forget_turns()

    def _feed(self, now: Instant) -> None:
        self._fed_at, self._commanded = now, True
        self.timed_out = False

    def _update_mode(self) -> None:
        before, self._mode = self._mode, self._memory.get(address.TORQUE_MODE)
        if before != ON and self._mode == ON:
            self._drop_command()
        self.refresh()

    def _update_frame(self) -> None:
        self._frame.update(self._memory)

    def _forget_turns(self) -> None:
        self._frame.forget_turns(self._motion.angle)

    def _end_soft_start(self) -> None:
        self.soft_starting = False
        self._memory.apply_soft_start(False)

    def _drop_command(self) -> None:
        """When output returns, hold the angle, or set speed and torque to 0 (4.7, 4.13)."""
        self._update_frame()
        angle = self.kind == address.COMMAND_ANGLE
        self._unshown = None
        self._memory.put(self.kind, self.angle if angle else 0)
        self._holding = angle

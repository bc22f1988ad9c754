"""Which command is in force, and whether the motor may follow it (4.1 to 4.3, 4.13, 4.14, 4.19)."""

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
_AT_SPEED: Final = 1  # rpm: what the speed loop's dead band leaves of a limit that holds it
_ARRIVED: Final = 10  # tenths of a degree: soft start is over within about 1° (4.14)


class CommandInput:
    """Turns commands, torque mode, time-out, soft start and protection into orders for the motor.

    The command registers 0x00 to 0x02 live in `memory`; `kind` is the address of the one in force. The caller
    brings `motion` up to `now` before it calls a method that takes `now`, and keeps `supply` and `load` (shares
    of nominal voltage and of stall torque) up to date with `surroundings`.
    """

    def __init__(self, memory: Memory, motion: HornMotion, plant: Plant, behaviour: Behaviour) -> None:
        self.behaviour = behaviour
        self.kind = address.COMMAND_ANGLE
        self.timed_out = False
        self.soft_starting = False
        self.pulsed = False
        """Whether the PWM input has or just had a signal: then it takes over where CAN is silent (4.30)."""
        self._memory = memory
        self._motion = motion
        self._plant = plant
        self._frame = AngleFrame()
        self._fed_at: Instant | None = None
        self._commanded = False
        self._mode = OFF
        self._halted = True
        self._protecting = False
        self._holding = True
        self._unshown: Raw | None = None
        self._blind_tenths: Raw | None = None
        self._supply = 1.0
        self._load = 0.0
        self._inertia = 0.0
        self._pulse_counts_until: Instant = -_NEVER

    @property
    def output(self) -> int:
        """What the motor gets: ON, OFF or BRAKE. Protection comes before all else (4.13)."""
        if self._halted or self._protecting:
            return OFF
        if self.timed_out and not self.pulsed:
            action = self._memory.get(address.TIMEOUT_ACTION)
            if action != ON and (self._mode == ON or self.behaviour.timeout_changes == "any_output"):
                return action
        return self._mode

    @property
    def due(self) -> Instant:
        """When the communication time-out strikes; infinity while its time does not run (4.19)."""
        if self._fed_at is None or self.timed_out:
            return _NEVER
        return self._fed_at + self._memory.get(address.TIMEOUT_TIME) / 1000.0

    @property
    def can_silent(self) -> bool:
        """Whether no command came over CAN, or none for so long that the PWM input counts (4.30)."""
        return not self._commanded or self.timed_out

    @property
    def angle(self) -> Raw:
        """What 0x08 reads: turns are counted for angle commands, else as 0x24 says (4.4)."""
        if self._blind_tenths is not None:
            return self._blind_tenths
        tenths = self._frame.tenths(self._motion.angle)
        if self.kind == address.COMMAND_ANGLE or self._memory.get(address.EXTENDED_ANGLE):
            return tenths
        return (tenths + 1800) % 3600 - 1800

    @property
    def speed(self) -> Raw:
        """What 0x09 reads, in rpm."""
        return min(max(round(self._frame.sign * self._motion.speed / 6.0), -300), 300)

    @property
    def torque(self) -> Raw:
        """What 0x0A reads, in % of stall torque."""
        return min(max(round(self._frame.sign * self._motion.torque * 100.0), -150), 150)

    def start(self, now: Instant) -> None:
        """Power-on: forget turns and commands, then soft start, hold the present angle, or stay without output."""
        memory = self._memory
        self.kind = address.COMMAND_ANGLE
        self.timed_out = self._protecting = self._halted = self.pulsed = False
        self._pulse_counts_until = -_NEVER
        self._unshown = self._blind_tenths = None
        self._fed_at = now if self.behaviour.timeout_from == "power_on" else None
        self._commanded = False
        self._mode = memory.get(address.TORQUE_MODE)
        self._look_at_frame()
        self._forget_turns()
        memory.put(address.COMMAND_SPEED, 0)
        memory.put(address.COMMAND_TORQUE, 0)
        self.soft_starting = self._mode == ON and memory.get(address.SOFT_START) == 1
        memory.soften(self.soft_starting)
        self._holding = not self.soft_starting
        memory.put(address.COMMAND_ANGLE, 0 if self.soft_starting else self.angle)
        self.refresh()

    def blind(self, on: bool) -> None:
        """The angle sensor cannot be read (4.12): the angle stays what it was read last. It is not documented what
        else 0x08 could tell; output is off meanwhile."""
        if on != (self._blind_tenths is not None):
            self._blind_tenths = self.angle if on else None

    @property
    def halted(self) -> bool:
        """Whether the motor is stopped for a ROM write, an update, or for good."""
        return self._halted

    def halt(self, halted: bool) -> None:
        """Stop the motor for a ROM write or for good, or go on as before."""
        self._halted = halted
        self.refresh()

    def command(self, kind: int, raw: Raw, now: Instant, *, counts: bool = True, shown: bool = True) -> bool:
        """A new angle, speed or torque, within the range of its register. False: ignored, 0x25 is off (4.18).

        `counts` is whether it feeds the time-out; what the PWM input asks for does not. Unless `shown`, it is
        obeyed and the registers read what they did before.
        """
        memory = self._memory
        if kind != address.COMMAND_ANGLE and not self.cascade():
            return False  # in soft start 0x25 is on; when this command has ended that, it may be off again (4.14)
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
        """0x20 was written. It counts as a command, and ON after OFF or BRAKE drops the last one (4.13)."""
        if self.soft_starting:
            self._end_soft_start()
            self._drop_command()
        self._feed(now)
        self._look_at_mode()

    def initialise(self) -> None:
        """After 0x10 reset the registers: commands go back to 0, too, and an energised horn moves there (4.9)."""
        self._mode = self._memory.get(address.TORQUE_MODE)
        self._end_soft_start()
        self._begin_kind(address.COMMAND_ANGLE)
        self._holding = False
        self._unshown = None
        for at in address.COMMANDS:
            self._memory.put(at, 0)
        self.refresh()

    def configured(self) -> None:
        """Registers other than the commands were written, or reset at once."""
        self._look_at_mode()

    def expire(self) -> None:
        """The time of 0x27 is over. The command is kept: the next one restores this state (4.19)."""
        self.timed_out = True
        if self.soft_starting and self._memory.get(address.TIMEOUT_ACTION) != ON:
            self._end_soft_start()
            self._drop_command()
        self.refresh()

    def protect(self, on: bool) -> None:
        """A limit was exceeded, or is kept again. On return the last command is dropped (table in 4.7)."""
        if on == self._protecting:
            return
        self._protecting = on
        self._end_soft_start()
        if not on and self._mode == ON:
            self._drop_command()
        self.refresh()

    def surroundings(self, supply: float, load: float, inertia: float) -> None:
        """Supply over nominal, a torque on the horn as a share of stall, + clockwise, and inertia as in Orders."""
        if (supply, load, inertia) != (self._supply, self._load, self._inertia):
            self._supply, self._load, self._inertia = supply, load, inertia
            self.refresh()

    def hear_pulse(self, signal: bool, now: Instant) -> None:
        """Whether the PWM input has a signal now. One that is lost counts for the time of 0x27 yet (4.30)."""
        if signal:
            self._pulse_counts_until = now + self._memory.get(address.TIMEOUT_TIME) / 1000.0
        before, self.pulsed = self.pulsed, now < self._pulse_counts_until
        if self.pulsed != before:
            self.refresh()

    def watch_soft_start(self) -> None:
        """End soft start where it has arrived (4.14)."""
        if self.soft_starting and abs(self.angle) <= _ARRIVED:
            self._end_soft_start()
            self.refresh()

    def cascade(self) -> bool:
        """Whether speed and torque control is on (0x25), as soft start has it or as it is set."""
        if self.soft_starting:
            return True
        default = int(self.behaviour.cascade_without_switch)
        return self._memory.own(address.SPEED_TORQUE_CONTROL, default) == 1

    def plant_angle(self, tenths: Raw) -> float:
        """Where the horn stands, in the plant's degrees, when 0x08 reads `tenths`."""
        return self._frame.degrees(tenths)

    def limits_reached(self) -> list[str]:
        """The notification bits, by key, that present position, speed, torque and command call for (4.31 to 4.33)."""
        get = self._memory.get
        asked = {at: self._asked(at) for at in address.COMMANDS}
        watched = [("angle", address.COMMAND_ANGLE, self.angle, address.ANGLE_LIMIT_CW)]
        if self.cascade() and not self.soft_starting:
            watched.append(("speed", address.COMMAND_SPEED, self.speed, address.SPEED_LIMIT_CW))
            watched.append(("torque", address.COMMAND_TORQUE, self.torque, address.TORQUE_LIMIT_CW))
        sign = int(self._frame.sign)
        held = {"speed": self._motion.limited_speed * sign, "torque": self._motion.limited_torque * sign}
        found: list[str] = []
        for name, at, present, limit_cw in watched:
            low, high = self._angle_limits() if name == "angle" else (get(limit_cw + 1), get(limit_cw))
            wanted, side = asked[at], held.get(name, 0)
            near = _AT_SPEED if name == "speed" else 0
            if present >= high or (wanted is not None and wanted > high) or (side > 0 and present >= high - near):
                found.append(f"{name}_limit_cw_reached")
            if present <= low or (wanted is not None and wanted < low) or (side < 0 and present <= low + near):
                found.append(f"{name}_limit_ccw_reached")
        return found

    def refresh(self) -> None:
        """Give the motor its orders anew."""
        self._look_at_frame()
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
                load=self._load,
                inertia=self._inertia,
            )
        )

    def _asked(self, at: int) -> Raw | None:
        """The command in register `at` while it is the one in force and the motor follows it."""
        return self._wanted(at) if at == self.kind and self.output == ON and not self._holding else None

    def _wanted(self, at: int) -> Raw:
        return self._memory.get(at) if self._unshown is None else self._unshown

    def _angle_limits(self) -> tuple[Raw, Raw]:
        """CCW and CW limit in the degrees of commands (4.31)."""
        get = self._memory.get
        moved = 0 if self.behaviour.limits_follow_origin else get(address.ORIGIN)
        return get(address.ANGLE_LIMIT_CCW) - moved, get(address.ANGLE_LIMIT_CW) - moved

    def _begin_kind(self, kind: int) -> None:
        """Commands are of this kind from now on; an angle after another kind counts turns only with 0x24 (4.17)."""
        before, self.kind = self.kind, kind
        if kind == address.COMMAND_ANGLE and before != kind and not self._memory.get(address.EXTENDED_ANGLE):
            self._forget_turns()

    def _feed(self, now: Instant) -> None:
        self._fed_at, self._commanded = now, True
        self.timed_out = False

    def _look_at_mode(self) -> None:
        before, self._mode = self._mode, self._memory.get(address.TORQUE_MODE)
        if before != ON and self._mode == ON:
            self._drop_command()
        self.refresh()

    def _look_at_frame(self) -> None:
        self._frame.look(self._memory)

    def _forget_turns(self) -> None:
        self._frame.forget_turns(self._motion.angle)

    def _end_soft_start(self) -> None:
        self.soft_starting = False
        self._memory.soften(False)

    def _drop_command(self) -> None:
        """What 4.7 and 4.13 say of a motor that gets its output back: hold the angle, or speed and torque 0."""
        self._look_at_frame()
        angle = self.kind == address.COMMAND_ANGLE
        self._unshown = None
        self._memory.put(self.kind, self.angle if angle else 0)
        self._holding = angle

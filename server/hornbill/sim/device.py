"""The servo without its bus connection: stages, supply and horn."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from random import Random
from typing import Final

from hornbill.schema.fault import FaultBit
from hornbill.schema.model import ServoModel
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.command import CommandInput
from hornbill.sim.faults import SimFaults
from hornbill.sim.mechanics.conditions import Conditions
from hornbill.sim.mechanics.motion import HornMotion
from hornbill.sim.mechanics.plant import plant_of
from hornbill.sim.memory import Memory
from hornbill.sim.protection import DEAD_BELOW_V, Protection
from hornbill.sim.pwm import read_pulse
from hornbill.sim.registers import Registers, Request
from hornbill.units import Instant, Raw

BOOT_S: Final = 0.1
"""Time from power-on or restart to the first message. Not documented."""
SAVE_S: Final = 0.05
"""Duration of a ROM write, without communication (4.11)."""
WATCH_S: Final = 0.05
"""How often the servo checks its supply, temperature and progress."""

_NEVER: Final = float("inf")


class ServoStage(Enum):
    """Stage of a servo."""

    OFF = "off"
    STARTING = "starting"
    RUNNING = "running"
    SAVING = "saving"


@dataclass(frozen=True, slots=True)
class ServoBuild:
    """Description of a servo, switched off.

    `firmware` is the integer of 0x52 (1300), `uid` 16 bytes, `faults` the bits of the model's table. `rom` are saved
    raw values by key; `angle_deg` is the angle of the horn, clockwise from the notch. Equal seeds give equal servos.
    """

    model: ServoModel
    firmware: int
    uid: bytes
    faults: Sequence[FaultBit]
    serial: int
    production: tuple[int, int, int, int, int]
    rom: Mapping[str, Raw]
    seed: int
    angle_deg: float
    behaviour: Behaviour


class SimDevice:
    """Power, start, ROM write, protection. `on_up` is called after a start, `on_down` when the servo stops."""

    def __init__(
        self, build: ServoBuild, random: Random, on_up: Callable[[Instant], None], on_down: Callable[[], None]
    ) -> None:
        model, behaviour = build.model, build.behaviour
        plant = plant_of(model)
        self.stage = ServoStage.OFF
        self.powered = False
        self.starts = 0
        self.started_at: Instant = 0.0
        self.memory = Memory(
            model, build.firmware, serial=build.serial, production=build.production, rom=build.rom
        )  # fmt: skip
        self.conditions = Conditions(voltage_v=model.nominal_v)
        self.faults = SimFaults(build.faults)
        self.faults.failures_latch = behaviour.failures_latch
        self.motion = HornMotion(plant, build.angle_deg)
        noise = Random(random.random())
        self.protection = Protection(plant, noise, self.conditions)
        self.commander = CommandInput(self.memory, self.motion, plant, behaviour, noise)
        self.registers = Registers(self.memory, self.commander, self.protection, self.faults, self._update_faults)
        self._on_up = on_up
        self._on_down = on_down
        self._until: Instant = _NEVER
        self._watch_at: Instant = _NEVER
        self._measured_at: Instant = 0.0
        self._restarts_after_save = False
        self._restart_faults: tuple[str, ...] = ()
        self._updating = False

    @property
    def running(self) -> bool:
        """Whether it can communicate and move."""
        return self.stage is ServoStage.RUNNING

    @property
    def due(self) -> Instant:
        """Time of the next `run_due`. Infinity once its supply is off and its horn is at rest."""
        if self.stage is not ServoStage.RUNNING:
            return self._until
        timeout = self.commander.due
        return timeout if timeout < self._watch_at else self._watch_at

    def run_due(self, now: Instant) -> None:
        """Process events due at `now`: the end of a stage, checks of supply and progress, the timeout."""
        self.motion.advance(now)
        if self.stage is not ServoStage.RUNNING:
            if self._until <= now:
                self._end_stage(now)
            return
        if self._watch_at <= now:
            self._watch(now)
        if self.commander.due <= now:
            self.commander.expire()

    def power_on(self, now: Instant) -> None:
        """Switch the supply on. Idempotent."""
        if not self.powered:
            self.powered = True
            self._restart(now)

    def power_off(self, now: Instant) -> None:
        """Switch the supply off. During a ROM write this corrupts ROM (4.11)."""
        self.powered = False
        self.motion.advance(now)
        self._go_down(ServoStage.OFF, now + WATCH_S)

    def carry_out(self, request: Request, now: Instant) -> None:
        """Restart, if requested after a ROM write."""
        if request is Request.RESTART:
            self._restart(now)
            return
        self.memory.save(self.commander.behaviour)
        self.memory.rom_sound = False
        self.stage, self._until = ServoStage.SAVING, now + SAVE_S
        self._restarts_after_save = request is Request.SAVE_AND_RESTART
        self.commander.halt(True)

    def _restart(self, now: Instant, *faults: str) -> None:
        self._restart_faults = faults
        self._go_down(ServoStage.STARTING, now + BOOT_S + self.conditions.restart_delay_s)

    def _go_down(self, stage: ServoStage, until: Instant) -> None:
        self.stage, self._until = stage, until
        self.commander.halt(True)
        self._on_down()

    def _end_stage(self, now: Instant) -> None:
        if self.stage is ServoStage.OFF:
            # A load may turn the horn: simulate it as it turns, not all at once when power returns.
            self._until = _NEVER if self.motion.asleep else now + WATCH_S
        elif self.stage is ServoStage.SAVING and self.conditions.voltage_v <= DEAD_BELOW_V:
            self._restart(now)  # the supply failed meanwhile: the write is incomplete (4.11)
        elif self.stage is ServoStage.SAVING:
            self.memory.rom_sound = True
            if self._restarts_after_save:
                self._restart(now)
            else:
                self.stage, self._watch_at = ServoStage.RUNNING, now
                self.commander.halt(False)
        elif self.conditions.voltage_v > DEAD_BELOW_V:
            self._start(now)
        else:
            self._until = now + WATCH_S

    def _start(self, now: Instant) -> None:
        self.stage = ServoStage.RUNNING
        self.starts += 1
        self.started_at = self._watch_at = now
        lost = () if self.memory.load() else ("rom_lost",)
        self.faults.start(*lost, *self._restart_faults)
        self._restart_faults = ()
        self._updating = self.conditions.software_update
        self.commander.start(now)
        self._on_up(now)

    def _watch(self, now: Instant) -> None:
        """Measure, protect, and check the end of soft start."""
        conditions, motion, commander = self.conditions, self.motion, self.commander
        self._watch_at = now + WATCH_S
        if conditions.voltage_v <= DEAD_BELOW_V:
            self._go_down(ServoStage.STARTING, now + BOOT_S)
            return
        if self.faults.crashed:
            self._restart(now, *self.faults.crashed)
            return
        if conditions.software_update != self._updating:
            self._updating = conditions.software_update
            if not self._updating:
                self._restart(now)  # the new firmware starts
                return
        if commander.halted != self._updating:
            commander.halt(self._updating)
        self.protection.measure(conditions, now - self._measured_at, motion.heat(), motion.torque)
        self._measured_at = now
        motion.constants = conditions.plant
        commander.set_supply(self.protection.supply)
        commander.watch_soft_start()
        pulse = read_pulse(self.memory, conditions.pwm_us)
        commander.update_pulse(pulse is not None and pulse.raw is not None, now)
        if pulse is not None and pulse.raw is not None and commander.can_silent:
            commander.command(pulse.kind, pulse.raw, now, counts=False)
        self._update_faults()

    def _update_faults(self) -> None:
        """Update the fault words and protection."""
        pulse = read_pulse(self.memory, self.conditions.pwm_us)
        bits = pulse.bits if pulse is not None else ()
        reached, beyond = self.protection.limits(self.memory)
        self.faults.show([*reached, *bits, *self.commander.limits_reached()], output_off=beyond)
        self.commander.freeze_angle("sensor_failure" in self.faults.active)
        self.commander.protect(self.faults.output_off)

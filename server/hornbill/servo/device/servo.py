"""What the host knows of one servo, and how old that knowledge is. Asks nothing of the bus."""

import asyncio
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final

from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS
from hornbill.schema.firmware import to_text
from hornbill.schema.model import ServoModel
from hornbill.schema.parameter import DUMMY, Parameter
from hornbill.servo.device import output
from hornbill.servo.device.output import OutputRecord, OutputState
from hornbill.servo.device.position_estimate import Estimate
from hornbill.units import Instant, NodeId, Raw, Uid
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus

STATUS_PERIOD_S = 0.1
"""A servo broadcasts its angle every 100 ms (table 2-2)."""

NO_TORQUE_PCT: Final = 2
"""What 0x0A may read of a motor without output."""


class State(StrEnum):
    """What a servo is doing, in the words of the API."""

    IDENTIFYING = "identifying"
    READY = "ready"
    SOFT_START = "soft_start"
    SAVING = "saving"
    RESTARTING = "restarting"
    UPDATING = "updating"
    PROTECTED = "protected"
    OFFLINE = "offline"


_MODES: Final = frozenset(int(mode) for mode in Mode)


def mode_name(mode: int) -> str:
    """Mode of a NodeStatus as a word (table 2-19); the reserved ones 4..6 as `reserved_n`."""
    return Mode(mode).name.lower() if mode in _MODES else f"reserved_{mode}"


@dataclass(slots=True)
class Register:
    """One parameter of one servo. `raw` is RAM as last read at `at`; `rom` is what is known to be in ROM.

    `written`: we wrote to it since the servo started, so that RAM no longer tells what ROM holds; last at `written_at`.
    `doubtful` are values that may have been written right after a start nobody had noticed.
    """

    parameter: Parameter
    raw: Raw | None = None
    at: Instant | None = None
    rom: Raw | None = None
    written: bool = False
    written_raw: Raw | None = None
    written_at: Instant = float("-inf")
    doubtful: frozenset[Raw | None] = frozenset()

    @property
    def reflects_rom(self) -> bool:
        """Whether RAM, once it is read after a start, is what ROM holds."""
        return not self.written and self.raw not in self.doubtful


@dataclass(slots=True)
class Servo:
    """One servo, keyed by its unique id; node id, servo id and label are facts about it, never keys."""

    uid: Uid
    catalog: Catalog
    node_id: NodeId | None = None
    name: str = ""
    label: str = ""
    model: ServoModel | None = None
    """Its own model, or the newest known of its series; None for an unknown series and while not identified."""
    model_number: int | None = None
    hardware_version: int | None = None
    firmware: int | None = None
    serial_number: int | None = None
    production_date: str | None = None
    identified: bool = False
    online: bool = False
    busy: State | None = None
    soft_start_since: Instant | None = None
    near_zero_at: Instant | None = None
    """When the horn was first seen near 0 degrees in the soft start of now."""
    status: NodeStatus | None = None
    status_at: Instant | None = None
    angle_deg: float | None = None
    angle_at: Instant | None = None
    angle_polled_at: Instant | None = None
    boot_count: int = 0
    recorded: bool = False
    """It is one of a recording: heard, never asked, moved or kept."""
    changing: asyncio.Lock = field(default_factory=asyncio.Lock, repr=False)
    registers: dict[str, Register] = field(default_factory=dict[str, Register])
    drift: dict[str, Raw] = field(default_factory=dict[str, Raw])
    temporary_values: dict[str, Raw] = field(default_factory=dict[str, Raw])
    """Own values of rows that hold others for a while, which `Borrowed` writes back: no configuration changes."""
    """What ROM was known to hold, by key, where it was found to hold something else that we did not save."""
    expected_rom: dict[str, Raw] | None = None
    """What a save of ours is about to put into ROM, by key: what is then found there is no drift."""
    output: OutputRecord = field(default_factory=OutputRecord, repr=False)
    position_unit: Estimate = field(default_factory=Estimate, repr=False)
    """What a position of Status and ArrayCommand means on this servo."""
    ram_before_restart: dict[str, Raw] | None = None
    """Since a restart and until its rows have been read again: what RAM held, by key, of rows that ROM did not hold
    alike."""
    discards_ram: bool = False
    """A restart or reset that was asked for is under way: what was only in RAM goes on purpose."""
    turns_lost_deg: float | None = None
    """Where it stood, beyond ±180°, when it last restarted; None once somebody has moved it knowing that."""
    changed: int = 0
    session: str = field(default_factory=lambda: secrets.token_hex(3))

    @property
    def of_unknown_series(self) -> bool:
        """Whether it said what it is, and no table has its series: it is read, and neither written nor moved."""
        return self.model is None and self.model_number is not None

    @property
    def treated_as(self) -> tuple[str | None, str | None]:
        """The model and the firmware it is treated as, each None where the tables have its own."""
        model, firmware = self.model, self.firmware
        if model is None:
            return None, None
        other = None if model.hardware_version == self.hardware_version else model.name
        return other, None if firmware is None else model.counts_as(firmware)

    @property
    def state(self) -> State:
        """The one word for what the servo is doing; a job's word comes before what the bus says."""
        if self.busy is not None:
            return self.busy
        if not self.online:
            return State.OFFLINE
        if self.status is not None and self.status.mode == Mode.SOFTWARE_UPDATE:
            return State.UPDATING
        if not self.identified:
            return State.IDENTIFYING
        if self.soft_start_since is not None:
            return State.SOFT_START
        if self.beyond_limits:
            return State.PROTECTED
        return State.READY

    def reports(self, fault: str) -> bool:
        """Whether this fault bit is set, as its word was last read (section 4.12)."""
        bit = self.catalog.fault_bits[fault]
        return bool((self.raw(bit.parameter) or 0) & bit.mask)

    @property
    def rom_lost(self) -> bool:
        """Whether it started on defaults because ROM could not be loaded, as its warnings were last read."""
        return self.reports("rom_lost")

    @property
    def protected(self) -> bool:
        """Whether it has its output off by itself, as its fault words were last read (sections 4.7, 4.8, 4.12)."""
        return bool(self.beyond_limits) or self.output_failed

    @property
    def output_failed(self) -> bool:
        """Whether a failure leaves its motor without output, as its fault words were last read (section 4.12)."""
        return any((self.raw(word) or 0) & mask for word, mask in self.catalog.stops_output.items())

    @property
    def beyond_limits(self) -> frozenset[int]:
        """The warning bits of the limits for which output is off and comes back by itself (sections 4.7, 4.8).

        A bit is set at the limit already, where output stays on: then the reading is the limit itself.
        """
        warning = self.raw("fault_warning")
        if not warning:
            return frozenset()
        return frozenset(
            bit
            for bit, (reading, limit) in self.catalog.protections.items()
            if warning >> bit & 1 and (self.raw(reading) is None or self.raw(reading) != self.raw(limit))
        )

    @property
    def output_state(self) -> OutputState:
        """What its motor gets, why, who made it so, and since when.

        "unknown" while 0x20 is not known now. Its own protection and time-out take the output of a servo whose 0x20
        is on; of the time-out nothing can be read, so it is what 0x26 and 0x27 say of the last command known.
        """
        known, register = self.output, self.registers.get(output.KEY)
        reason, by, since = known.reason, known.by, known.since
        if register is None or register.raw is None or register.at is None or not self.online:
            return OutputState("unknown", reason, by, since)
        state = output.STATES.get(register.raw, "unknown")
        if state == "on" and known.protected_at is not None:
            return OutputState("off", "protection", None, known.protected_at)
        action = output.STATES.get(self.raw("timeout_action") or 0, "on")
        if state == "on" and known.timed_out_at is not None and action != "on" and not self.commanded_by_pwm:
            return OutputState(action, "timeout", None, known.timed_out_at)
        if reason == "configured" and known.staged is None and register.rom not in (None, register.raw):
            return OutputState(state, "command", None, since)  # before anybody here looked
        return OutputState(state, reason, by, since)

    @property
    def was_commanded(self) -> bool:
        """Whether it was commanded since it started, as the dummies in 0x00 to 0x02 tell (sections 4.1 to 4.3), and no
        torque of its motor tells that it still is."""
        told = any(self.raw(key) == DUMMY for key in COMMANDS)
        return told and abs(self.raw("current_torque") or 0) <= NO_TORQUE_PCT

    @property
    def commanded_by_pwm(self) -> bool:
        """Whether a PWM signal may take over where CAN is silent (section 4.30)."""
        pwm = self.model is not None and self.model.pwm
        return pwm and not self.reports("pwm_missing")

    @property
    def soft_starting(self) -> bool:
        """Whether the horn is on its slow way to 0 degrees after a start (section 4.14)."""
        return self.soft_start_since is not None

    @property
    def health(self) -> NodeHealth | None:
        """Health of the last NodeStatus (table 2-18); notifications do not change it."""
        return NodeHealth(self.status.health) if self.status is not None else None

    @property
    def mode(self) -> str | None:
        """Mode of the last NodeStatus, as a word (table 2-19); the reserved ones as `reserved_n`."""
        return None if self.status is None else mode_name(self.status.mode)

    @property
    def title(self) -> str:
        """What to call it in a sentence."""
        return self.label or self.serial or f"servo {self.uid[:8]}"

    @property
    def revision(self) -> str:
        """Changes whenever the configuration is seen to change; never repeats over server restarts."""
        return f"{self.session}-{self.changed}"

    @property
    def serial(self) -> str | None:
        """Model number, dash, product number: unique over all models (section 4.41)."""
        if self.model_number is None or self.serial_number is None:
            return None
        return f"{self.model_number}-{self.serial_number:06d}"

    @property
    def firmware_text(self) -> str | None:
        """Firmware as the tables write it, 1300 as "1.300" (section 5)."""
        return None if self.firmware is None else to_text(self.firmware)

    @property
    def servo_id(self) -> int | None:
        """Parameter 0x45."""
        return self.raw("servo_id")

    def raw(self, key: str) -> Raw | None:
        """RAM's integer as last read, or None."""
        register = self.registers.get(key)
        return None if register is None else register.raw

    def raws(self) -> Mapping[str, Raw | None]:
        """RAM of every row, as last read."""
        return {key: register.raw for key, register in self.registers.items()}

    def rom(self) -> dict[str, Raw]:
        """What is known to be in ROM."""
        return {key: register.rom for key, register in self.registers.items() if register.rom is not None}

    def identify_as(self, model: ServoModel | None, firmware: int | None) -> None:
        """Fix model and firmware, and with them which rows exist; readings of rows that stay are kept.

        Of an unknown series every row is asked for: what it does not have, it refuses.
        """
        rows: Mapping[str, Parameter] = {} if self.model_number is None else self.catalog.readable
        if model is not None:
            rows = model.rows(firmware)
        self.model, self.firmware = model, firmware
        known = self.registers
        self.registers = {
            key: replace(known[key], parameter=row) if key in known else Register(row) for key, row in rows.items()
        }

    def note(self, key: str, raw: Raw, at: Instant) -> bool:
        """Remember what RAM held at an instant; true when it differs from what was known."""
        register = self.registers.get(key)
        if register is None:
            return False
        changed = register.raw != raw
        register.raw, register.at = raw, at
        if key == output.KEY:
            self.output.seen(raw, at, changed=changed)
        elif key in self.catalog.stops_output:
            self.output.set_protected(self.protected, at)
        elif key in COMMANDS and changed and self.output.commanded_at is not None:
            self.output.commanded(at)  # by whoever else is on the bus
        if changed and register.parameter.rom and key != output.KEY:
            self.changed += 1
        return changed

    def number(self, key: str) -> float | None:
        """What RAM holds in a row, in the row's unit; None while not known."""
        raw = self.raw(key)
        return None if raw is None else raw / self.registers[key].parameter.per_unit

    def stage_output(self, raw: Raw, by: str | None, at: Instant) -> None:
        """Take a value of 0x20 for configuration, whatever the servo's session makes of its output."""
        if self.configured(output.KEY) != raw:
            self.changed += 1
        self.output.stage(raw, by, at)

    def configured(self, key: str) -> Raw | None:
        """What a row is configured to, None while not known: RAM as last read.

        Of 0x20, whose RAM is session state, what was staged in this life of the servo, else what it starts with.
        """
        if key != output.KEY or key not in self.registers:
            return self.own(key)
        return self.starting_output if self.output.staged is None else self.output.staged

    @property
    def starting_output(self) -> Raw | None:
        """The 0x20 that a start brings: ROM's, or the default where ROM could not be loaded. None while not known."""
        register = self.registers.get(output.KEY)
        if register is None or register.rom is not None or not self.rom_lost:
            return None if register is None else register.rom
        return register.parameter.default

    def configuration(self) -> dict[str, Raw | None]:
        """`configured` of every row."""
        return {key: self.configured(key) for key in self.registers}

    def note_write(self, key: str, raw: Raw | None, at: Instant) -> None:
        """Remember that we are about to write a row; None when nobody knows what was written."""
        register = self.registers.get(key)
        if register is not None:
            register.written, register.written_raw, register.written_at = True, raw, at

    def clear_write_times(self) -> None:
        """Whatever was written so far was written before the restart that is about to be asked for."""
        for register in self.registers.values():
            register.written_at = float("-inf")

    def forget(self, key: str) -> None:
        """What RAM holds in a row is not known any more."""
        register = self.registers.get(key)
        if register is not None:
            register.at = None

    def invalidate_readings(self) -> None:
        """After silence nothing read before it is known of RAM; ROM changes only by a restart."""
        for register in self.registers.values():
            if register.parameter.access != "r" or register.parameter.rom:
                register.at = None

    def reset(self) -> None:
        """Reset to the undiscovered state. Existing references stay valid."""
        self.label, self.name, self.identified, self.angle_deg, self.status = "", "", False, None, None
        self.model = self.model_number = self.serial_number = self.production_date = None
        self.firmware = self.hardware_version = self.turns_lost_deg = None
        self.registers, self.drift, self.angle_at, self.status_at, self.temporary_values = {}, {}, None, None, {}
        self.position_unit, self.output, self.ram_before_restart = Estimate(), OutputRecord(), None

    def restarted(self, since: Instant = float("inf")) -> None:
        """The servo started anew: RAM is what ROM holds, and ROM may hold something else, for a save restarts.

        What was written at `since` or later may have been written after it started, before that was noticed.
        """
        if self.ram_before_restart is None:
            keys = () if self.discards_ram else filter(self._may_be_in_ram_only, self.registers)
            self.ram_before_restart = {key: raw for key in keys if (raw := self.own(key)) is not None}
        self.temporary_values = {}
        self.identified = False
        self.soft_start_since = self.near_zero_at = None
        self.boot_count += 1
        self.output.restarted()
        self.invalidate_readings()
        stored = self.registers.get(output.KEY)
        if stored is not None and stored.rom is not None:
            self.output.last_configured = stored.rom
        for register in self.registers.values():
            late = register.written and register.written_at >= since
            register.doubtful = frozenset((register.written_raw, register.raw)) if late else frozenset()
            register.rom, register.written = None, False

    def differs_from_rom(self, key: str) -> bool | None:
        """Whether a row is configured otherwise than ROM, so that a restart would lose it; None while not known."""
        one = self.registers[key]
        if not one.parameter.rom or one.rom is None or self.temporary(key):
            return None
        configured = self.configured(key)
        return None if configured is None else configured != one.rom

    @property
    def soft_start_rows(self) -> dict[str, Raw]:
        """Its rows that hold temporary values during soft start, so that what is read then proves nothing (4.14)."""
        rows = ((key, register.parameter.soft_start) for key, register in self.registers.items())
        return {key: raw for key, raw in rows if raw is not None}

    @property
    def before_restart(self) -> list[str]:
        """Its rows to read before a save, restart or reset: the live ones, then those that ROM keeps."""
        rows = [(key, register.parameter) for key, register in self.registers.items()]
        return [*(key for key, row in rows if row.live), *(key for key, row in rows if row.rom)]

    def temporary(self, key: str) -> bool:
        """Whether a row may hold the temporary value of a soft start now."""
        return self.soft_starting and self.registers[key].parameter.soft_start is not None

    def own(self, key: str) -> Raw | None:
        """What RAM holds in a row, or what it gets back where it is lent."""
        return self.temporary_values.get(key, self.raw(key))

    def _may_be_in_ram_only(self, key: str) -> bool:
        """Whether a restart may lose what RAM holds in a row: ROM holds something else, or is not known."""
        temporary = key == output.KEY or self.temporary(key)
        return self.registers[key].parameter.rom and not temporary and self.differs_from_rom(key) is not False

    def unsaved(self) -> list[str]:
        """Keys configured otherwise than what is known to be in ROM; rows of unknown ROM are not claimed."""
        return [key for key in self.registers if self.differs_from_rom(key)]

"""State of one servo as known to the host, with its age. Sends nothing."""

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
from hornbill.units import Instant, NodeId, Raw, Uid, serial_text
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus

STATUS_PERIOD_S = 0.1
"""A servo broadcasts its angle every 100 ms (table 2-2)."""

NO_TORQUE_PCT: Final = 2
"""Maximum reading of 0x0A for a motor without output, %."""


class State(StrEnum):
    """State of a servo, as in the API."""

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
    """Name of a NodeStatus mode (table 2-19); `reserved_n` for the reserved modes 4..6."""
    return Mode(mode).name.lower() if mode in _MODES else f"reserved_{mode}"


@dataclass(slots=True)
class Register:
    """One parameter of one servo. `raw`: value in RAM, read at `at`. `rom`: value known to be in ROM.

    `written`: this server wrote to it since the servo started, last at `written_at`, so RAM no longer shows ROM.
    `doubtful`: values that may have been written right after an unnoticed start.
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
        """Whether RAM, once read after a start, equals ROM."""
        return not self.written and self.raw not in self.doubtful


@dataclass(slots=True)
class Servo:
    """One servo, identified by its unique ID. Node ID, servo ID and label are attributes, never keys."""

    uid: Uid
    catalog: Catalog
    node_id: NodeId | None = None
    name: str = ""
    label: str = ""
    model: ServoModel | None = None
    """Its model, or the newest known model of its series. None for an unknown series and until identified."""
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
    """When the horn was first seen near 0° in the current soft start."""
    status: NodeStatus | None = None
    status_at: Instant | None = None
    angle_deg: float | None = None
    angle_at: Instant | None = None
    angle_polled_at: Instant | None = None
    boot_count: int = 0
    recorded: bool = False
    """Part of a replayed recording; read-only."""
    changing: asyncio.Lock = field(default_factory=asyncio.Lock, repr=False)
    registers: dict[str, Register] = field(default_factory=dict[str, Register])
    drift: dict[str, Raw] = field(default_factory=dict[str, Raw])
    """Previously known ROM values by key, where ROM was found to have another value that this server did not save."""
    overridden: dict[str, Raw] = field(default_factory=dict[str, Raw])
    """Original values of rows with a temporary value, by key. `OwedValues` restores them."""
    restoring: bool = False
    """The user of its temporary values has ended, and `OwedValues` restores what is left."""
    expected_rom: dict[str, Raw] | None = None
    """Values that a save of this server is about to write to ROM, by key. They are not drift."""
    output: OutputRecord = field(default_factory=OutputRecord, repr=False)
    position_unit: Estimate = field(default_factory=Estimate, repr=False)
    """Position unit of Status and ArrayCommand on this servo."""
    ram_before_restart: dict[str, Raw] | None = None
    """From a restart until its rows have been read again: previous RAM values, by key, that differed from ROM."""
    discards_ram: bool = False
    """A requested restart or reset is running: values only in RAM are discarded on purpose."""
    turns_lost_deg: float | None = None
    """Angle beyond ±180° at its last restart. None once a client has confirmed the loss and moved it."""
    broadcast_id: int | None = None
    """Servo ID in its last Status, which counts until 0x45 has been read."""
    changed: int = 0
    session: str = field(default_factory=lambda: secrets.token_hex(3))

    @property
    def of_unknown_series(self) -> bool:
        """Whether it is identified but its series is not in the tables. Such a servo is read, not written or moved."""
        return self.model is None and self.model_number is not None

    @property
    def treated_as(self) -> tuple[str | None, str | None]:
        """Model and firmware it is treated as. Each is None if the tables contain its own."""
        model, firmware = self.model, self.firmware
        if model is None:
            return None, None
        other = None if model.hardware_version == self.hardware_version else model.name
        return other, None if firmware is None else model.counts_as(firmware)

    @property
    def state(self) -> State:
        """State of the servo. A state set by a job takes precedence over the bus."""
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
        """Whether this fault bit is set, by its last reading (section 4.12)."""
        bit = self.catalog.fault_bits[fault]
        return bool((self.raw(bit.parameter) or 0) & bit.mask)

    @property
    def rom_lost(self) -> bool:
        """Whether it runs on defaults because ROM could not be loaded, by the last reading of its warnings."""
        return self.reports("rom_lost")

    @property
    def protected(self) -> bool:
        """Whether it has disabled its output itself, by its last fault words (sections 4.7, 4.8, 4.12)."""
        return bool(self.beyond_limits) or self.output_failed

    @property
    def output_failed(self) -> bool:
        """Whether a failure leaves its motor without output, by its last fault words (section 4.12)."""
        return any((self.raw(word) or 0) & mask for word, mask in self.catalog.stops_output.items())

    @property
    def beyond_limits(self) -> frozenset[int]:
        """Warning bits of exceeded limits that disable the output until back within (sections 4.7, 4.8).

        A bit is already set at the limit itself, where the output stays on: the reading then equals the limit.
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
        """State of its motor output, with reason, author and start.

        "unknown" while 0x20 is not known. Protection and the timeout disable the output while 0x20 is on. Whether the
        timeout did cannot be read; it is derived from 0x26, 0x27 and the last known command.
        """
        known, register = self.output, self.registers.get(output.KEY)
        reason, by, since = known.reason, known.by, known.since
        if register is None or register.raw is None or register.at is None or not self.online:
            return OutputState("unknown", reason, by, since)
        state = output.STATES.get(register.raw, "unknown")
        if state == "on" and known.protected_at is not None:
            return OutputState("off", "protection", None, known.protected_at)
        if state == "on" and (ended := self._by_timeout()) is not None:
            return ended
        if reason == "configured" and known.staged is None and register.rom not in (None, register.raw):
            return OutputState(state, "command", None, since)  # switched before this server first read it
        return OutputState(state, reason, by, since)

    def _by_timeout(self) -> OutputState | None:
        """What the timeout made of an output that 0x20 has on, None if nothing. "unknown" if that takes a row that is
        not known."""
        known = self.output
        action_row, time_row = (self.registers.get(key) for key in (output.TIMEOUT_ACTION, output.TIMEOUT_TIME))
        if known.commanded_at is None or action_row is None or self.commanded_by_pwm:
            return None
        action = "unknown" if action_row.at is None else output.STATES.get(action_row.raw or 0, "on")
        if action == "on":
            return None
        if known.timed_out_at is not None:
            return OutputState(action, "timeout", None, known.timed_out_at)
        if time_row is None or time_row.at is None:
            return OutputState("unknown", known.reason, known.by, known.since)
        return None

    @property
    def was_commanded(self) -> bool:
        """Whether it was commanded since it started, shown by dummies in 0x00 to 0x02 (sections 4.1 to 4.3), and its
        motor shows no torque that would indicate it still is."""
        commanded = any(self.raw(key) == DUMMY for key in COMMANDS)
        return commanded and abs(self.raw("current_torque") or 0) <= NO_TORQUE_PCT

    @property
    def commanded_by_pwm(self) -> bool:
        """Whether a PWM signal may take over when there are no CAN commands (section 4.30)."""
        pwm = self.model is not None and self.model.pwm
        return pwm and not self.reports("pwm_missing")

    @property
    def soft_starting(self) -> bool:
        """Whether the horn is moving slowly to 0° after a start (section 4.14)."""
        return self.soft_start_since is not None

    @property
    def health(self) -> NodeHealth | None:
        """Health of the last NodeStatus (table 2-18); notifications do not change it."""
        return NodeHealth(self.status.health) if self.status is not None else None

    @property
    def mode(self) -> str | None:
        """Mode name of the last NodeStatus (table 2-19); `reserved_n` for reserved modes."""
        return None if self.status is None else mode_name(self.status.mode)

    @property
    def title(self) -> str:
        """Name in text."""
        return self.label or self.serial or f"servo {self.uid[:8]}"

    @property
    def revision(self) -> str:
        """Revision of the configuration. Changes with every observed change; unique across server restarts."""
        return f"{self.session}-{self.changed}"

    @property
    def serial(self) -> str | None:
        """Model number, hyphen, product number; unique across all models (section 4.41)."""
        if self.model_number is None or self.serial_number is None:
            return None
        return serial_text(self.model_number, self.serial_number)

    @property
    def firmware_text(self) -> str | None:
        """Firmware as written in the tables: 1300 is "1.300" (section 5)."""
        return None if self.firmware is None else to_text(self.firmware)

    @property
    def servo_id(self) -> int | None:
        """Parameter 0x45, or the ID in its Status while that has not been read."""
        raw = self.raw("servo_id")
        return self.broadcast_id if raw is None else raw

    def raw(self, key: str) -> Raw | None:
        """Last raw value read from RAM, or None."""
        register = self.registers.get(key)
        return None if register is None else register.raw

    def raws(self) -> Mapping[str, Raw | None]:
        """Last raw values read from RAM, by key."""
        return {key: register.raw for key, register in self.registers.items()}

    def rom(self) -> dict[str, Raw]:
        """Values known to be in ROM, by key."""
        return {key: register.rom for key, register in self.registers.items() if register.rom is not None}

    def identify_as(self, model: ServoModel | None, firmware: int | None) -> None:
        """Set model and firmware, which determine its rows. Readings of rows that remain are retained.

        For an unknown series all rows are read; the servo refuses those it does not have.
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
        """Record a value read from RAM. True if it differs from the last one."""
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
            self.output.commanded(at)  # by another node
        if changed and register.parameter.rom and key != output.KEY:
            self.changed += 1
        return changed

    def number(self, key: str) -> float | None:
        """Last value in RAM, in the row's unit. None if unknown."""
        raw = self.raw(key)
        return None if raw is None else raw / self.registers[key].parameter.per_unit

    def stage_output(self, raw: Raw, by: str | None, at: Instant) -> None:
        """Record a value of 0x20 as configuration, independent of the session state of the output."""
        if self.configured(output.KEY) != raw:
            self.changed += 1
        self.output.stage(raw, by, at)

    def configured(self, key: str) -> Raw | None:
        """Configured value of a row, None if unknown: the last reading from RAM.

        For 0x20, whose value in RAM is session state: the value staged since the servo started, else the one it starts
        with.
        """
        if key != output.KEY or key not in self.registers:
            return self.own(key)
        return self.starting_output if self.output.staged is None else self.output.staged

    @property
    def starting_output(self) -> Raw | None:
        """The 0x20 after a start: from ROM, or the default if ROM could not be loaded. None if unknown."""
        register = self.registers.get(output.KEY)
        if register is None or register.rom is not None or not self.rom_lost:
            return None if register is None else register.rom
        return register.parameter.default

    def configuration(self) -> dict[str, Raw | None]:
        """Configured values of all rows, by key."""
        return {key: self.configured(key) for key in self.registers}

    def note_write(self, key: str, raw: Raw | None, at: Instant) -> None:
        """Record that this server is about to write a row. `raw` is None if the value written is unknown."""
        register = self.registers.get(key)
        if register is not None:
            register.written, register.written_raw, register.written_at = True, raw, at

    def acknowledged_since(self, key: str, at: Instant) -> bool:
        """Whether a write of a row has ended since `at` and its value in RAM is known."""
        register = self.registers.get(key)
        return register is not None and register.at is not None and at < register.written_at <= register.at

    def clear_write_times(self) -> None:
        """Mark all writes so far as older than the restart that is about to be requested."""
        for register in self.registers.values():
            register.written_at = float("-inf")

    def forget(self, key: str) -> None:
        """Mark the value in RAM as unknown."""
        register = self.registers.get(key)
        if register is not None:
            register.at = None

    def invalidate_readings(self) -> None:
        """Mark all values in RAM as unknown, after the servo was offline. ROM changes only with a restart."""
        for register in self.registers.values():
            if register.parameter.access != "r" or register.parameter.rom:
                register.at = None

    def reset(self) -> None:
        """Reset to the undiscovered state. Existing references stay valid."""
        self.label, self.name, self.identified, self.angle_deg, self.status = "", "", False, None, None
        self.model = self.model_number = self.serial_number = self.production_date = None
        self.firmware = self.hardware_version = self.turns_lost_deg = None
        self.registers, self.drift, self.angle_at, self.status_at, self.overridden = {}, {}, None, None, {}
        self.position_unit, self.output, self.ram_before_restart = Estimate(), OutputRecord(), None
        self.restoring = False

    def restarted(self, since: Instant) -> None:
        """Process a restart: RAM equals ROM, and ROM may have changed, because a save restarts the servo.

        Values written at `since` or later may have been written after the start, before it was noticed.
        """
        if self.ram_before_restart is None:
            keys = () if self.discards_ram else filter(self._may_be_in_ram_only, self.registers)
            self.ram_before_restart = {key: raw for key in keys if (raw := self.own(key)) is not None}
        self.overridden = {}
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
        """Whether the configured value differs from ROM, so that a restart would lose it. None if unknown."""
        one = self.registers[key]
        if not one.parameter.rom or one.rom is None or self.temporary(key):
            return None
        configured = self.configured(key)
        return None if configured is None else configured != one.rom

    @property
    def soft_start_rows(self) -> dict[str, Raw]:
        """Rows with temporary values during soft start, and those values: readings then prove nothing (4.14)."""
        rows = ((key, register.parameter.soft_start) for key, register in self.registers.items())
        return {key: raw for key, raw in rows if raw is not None}

    @property
    def before_restart(self) -> list[str]:
        """Rows to read before a save, restart or reset: live rows, then rows stored in ROM."""
        rows = [(key, register.parameter) for key, register in self.registers.items()]
        return [*(key for key, row in rows if row.live), *(key for key, row in rows if row.rom)]

    def temporary(self, key: str) -> bool:
        """Whether a row may currently have the temporary value of a soft start."""
        return self.soft_starting and self.registers[key].parameter.soft_start is not None

    @property
    def owed(self) -> list[str]:
        """Keys of rows whose temporary values could not be restored yet."""
        return [*self.overridden] if self.restoring else []

    def own(self, key: str) -> Raw | None:
        """Value of a row in RAM, or its original value while it is overridden."""
        return self.overridden.get(key, self.raw(key))

    def _may_be_in_ram_only(self, key: str) -> bool:
        """Whether a restart may lose the value in RAM, because ROM differs or is unknown."""
        temporary = key == output.KEY or self.temporary(key)
        return self.registers[key].parameter.rom and not temporary and self.differs_from_rom(key) is not False

    def unsaved(self) -> list[str]:
        """Keys of rows whose configured value differs from ROM. Rows with unknown ROM are not included."""
        return [key for key in self.registers if self.differs_from_rom(key)]

"""Owns Servo: what the host knows of one servo, and how old that knowledge is. Asks nothing of the bus."""

import asyncio
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final

from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import to_text
from hornbill.schema.model import ServoModel
from hornbill.schema.parameter import Parameter
from hornbill.servo.position_estimate import Estimate
from hornbill.units import Instant, NodeId, Raw, Uid
from hornbill.wire.messages import Health, Mode, NodeStatus

STATUS_PERIOD_S = 0.1
"""A servo broadcasts its angle every 100 ms (table 2-2)."""

SOFT_START_ROWS = frozenset(
    ("speed_torque_control", "speed_limit_cw", "speed_limit_ccw", "torque_limit_cw", "torque_limit_ccw")
)
"""Rows that hold temporary values during soft start, so that what is read then proves nothing (section 4.14)."""

ROM_LOST_BIT = 1 << 15
"""Warning bit: what was saved could not be loaded at the last start, and defaults are in use (section 4.12)."""

PROTECTION_BITS = 0b1111 << 8
"""Warning bits of temperature and voltage: output is off and comes back by itself (sections 4.7, 4.8, 4.12)."""


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
    def tells_rom(self) -> bool:
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
    boots: int = 0
    recorded: bool = False
    """It is one of a recording: heard, never asked, moved or kept."""
    changing: asyncio.Lock = field(default_factory=asyncio.Lock, repr=False)
    registers: dict[str, Register] = field(default_factory=dict[str, Register])
    drift: dict[str, Raw] = field(default_factory=dict[str, Raw])
    """What ROM was known to hold, by key, where it was found to hold something else that we did not save."""
    expected_rom: dict[str, Raw] | None = None
    """What a save of ours is about to put into ROM, by key: what is then found there is no drift."""
    position_unit: Estimate = field(default_factory=Estimate, repr=False)
    """What a position of Status and ArrayCommand means on this servo."""
    turns_lost_deg: float | None = None
    """Where it stood, beyond ±180°, when it last restarted; None once somebody has moved it knowing that."""
    changed: int = 0
    session: str = field(default_factory=lambda: secrets.token_hex(3))

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
        if (self.raw("fault_warning") or 0) & PROTECTION_BITS:
            return State.PROTECTED
        return State.READY

    @property
    def unit_confirmed(self) -> bool:
        """Whether its position unit is known, so that ArrayCommand may carry angles."""
        return self.position_unit.sure

    @property
    def rom_lost(self) -> bool:
        """Whether it started on defaults because ROM could not be loaded, as its warnings were last read."""
        return bool((self.raw("fault_warning") or 0) & ROM_LOST_BIT)

    @property
    def soft_starting(self) -> bool:
        """Whether the horn is on its slow way to 0 degrees after a start (section 4.14)."""
        return self.soft_start_since is not None

    @property
    def health(self) -> Health | None:
        """Health of the last NodeStatus (table 2-18); notifications do not change it."""
        return Health(self.status.health) if self.status is not None else None

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
        """Changes whenever a row that ROM keeps is seen to change in RAM; never repeats over server restarts."""
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
        """Fix model and firmware, and with them which rows exist; readings of rows that stay are kept."""
        rows: Mapping[str, Parameter] = {} if model is None else model.rows(firmware)
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
        if changed and register.parameter.rom:
            self.changed += 1
        return changed

    def note_write(self, key: str, raw: Raw | None, at: Instant) -> None:
        """Remember that we are about to write a row; None when nobody knows what was written."""
        register = self.registers.get(key)
        if register is not None:
            register.written, register.written_raw, register.written_at = True, raw, at

    def writes_are_over(self) -> None:
        """Whatever was written so far was written before the restart that is about to be asked for."""
        for register in self.registers.values():
            register.written_at = float("-inf")

    def forget(self, key: str) -> None:
        """What RAM holds in a row is not known any more."""
        register = self.registers.get(key)
        if register is not None:
            register.at = None

    def forget_readings(self) -> None:
        """After silence nothing read before it is known of RAM; ROM changes only by a restart."""
        for register in self.registers.values():
            if register.parameter.access != "r" or register.parameter.rom:
                register.at = None

    def forget_everything(self) -> None:
        """Be as one never met; whoever holds this object finds the servo in it again when it comes back."""
        self.label, self.model_number, self.identified, self.angle_deg, self.status = "", None, False, None, None
        self.registers, self.drift, self.angle_at, self.status_at = {}, {}, None, None
        self.position_unit = Estimate()

    def restarted(self, since: Instant = float("inf")) -> None:
        """The servo started anew: RAM is what ROM holds, and ROM may hold something else, for a save restarts.

        What was written at `since` or later may have been written after it started, before that was noticed.
        """
        self.identified = False
        self.soft_start_since = self.near_zero_at = None
        self.boots += 1
        self.forget_readings()
        for register in self.registers.values():
            late = register.written and register.written_at >= since
            register.doubtful = frozenset((register.written_raw, register.raw)) if late else frozenset()
            register.rom, register.written = None, False

    def differs_from_rom(self, key: str) -> bool | None:
        """Whether RAM of a row differs from ROM, so that a restart would lose it; None while either is not known."""
        one = self.registers[key]
        if not one.parameter.rom or one.rom is None or one.raw is None:
            return None
        if self.soft_starting and key in SOFT_START_ROWS:
            return None
        return one.raw != one.rom

    def unsaved(self) -> list[str]:
        """Keys whose RAM differs from what is known to be in ROM; rows of unknown ROM are not claimed."""
        return [key for key in self.registers if self.differs_from_rom(key)]

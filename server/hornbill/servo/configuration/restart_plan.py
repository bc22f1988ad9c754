"""Options of a save, restart or factory reset, and the plan of a save: the ROM changes row by row."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from hornbill.domain.change import Change, RomChange, SavePreview
from hornbill.schema import scale
from hornbill.servo.configuration.forecast import forecast
from hornbill.servo.device.output import KEY
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw, Uid

RestartKind: TypeAlias = Literal["save", "restart", "factory_reset"]


@dataclass(frozen=True, slots=True)
class RestartOptions:
    """Options of a save, restart or factory reset.

    `by`: the client authorized when the parent job was started; then no lease is needed. `confirm`, `torque_on`,
    `rom_was` and `values` (engineering, by key, written before the save): see `torque_in_rom.decide`. `raws`: the same
    values, raw, for the plan of a save. `written`: changes just made, to be saved; if the servo no longer has these
    values, nothing is saved. `leaving`: servos whose node IDs do not count as in use, because the same run moves them.
    `keep_identity`: a reset keeps origin, servo ID and node ID (0x44 to 0x46).
    """

    lease_id: str | None = None
    by: str | None = None
    confirm: Collection[str] = ()
    torque_on: bool = False
    rom_was: Raw | None = None
    values: Mapping[str, object] | None = None
    raws: Mapping[str, Raw] = field(default_factory=dict[str, Raw])
    written: Sequence[Change] = ()
    leaving: Collection[Uid] = ()
    keep_identity: bool = True


def saved_by(servo: Servo, torque: Raw | None, wanted: Mapping[str, Raw] | None = None) -> dict[str, Raw | None]:
    """Values that a save writes, raw by key: RAM as last read, updated by `wanted`, with `torque` as 0x20."""
    rows = {key: servo.raw(key) for key, one in servo.registers.items() if one.parameter.rom}
    return rows | dict(wanted or {}) | ({KEY: torque} if KEY in rows else {})


def save_plan(servo: Servo, saved: Mapping[str, Raw | None], named: Mapping[str, Raw]) -> SavePreview:
    """The plan of a save that writes `saved`. Rows in `named` are listed even if their ROM value is unknown."""
    stored = servo.rom()
    changes: list[RomChange] = []
    unknown: list[str] = []
    for key, raw in saved.items():
        row, rom = servo.registers[key].parameter, stored.get(key)
        if rom is None and key not in named:
            unknown.append(key)
        elif raw is not None and raw != rom:
            before = None if rom is None else scale.to_value(row, rom, stored)
            changes.append(RomChange(key, before, scale.to_value(row, raw, saved)))
    return SavePreview(rom_changes=changes, rom_unknown=unknown, restart=forecast(servo, saved))

"""Configuration changes: written rows, forecasts of restarts, comparisons and drift."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.by_key import ParameterKey
from hornbill.domain.fields import STRICT, Model, Param, Params
from hornbill.domain.note import Note, NoteCode
from hornbill.schema.scale import Value

Verdict = Literal["planned", "applied", "clamped", "refused", "no_response", "unchanged", "rolled_back"]
Code = Literal["no_torque", "brake", "holds", "unknown", "unknown_start", "stays", "moves"]
ChangeOutcome = TypeAliasType("ChangeOutcome", Literal["applied", "rolled_back", "planned"])
LineState = Literal[
    "ok", "unknown", "forbidden", "read_only", "identity", "out_of_range", "invalid", "not_in_this_model"
]


ReasonCode = TypeAliasType(
    "ReasonCode",
    Literal[
        "manual", "saving", "factory_reset", "drift_undone", "change", "commissioning", "matrix", "profile", "restore"
    ],
)
"""Reason why a snapshot was taken: manually, or before another operation."""


@dataclass(frozen=True, slots=True)
class Reason:
    """Reason for a snapshot or a write. Without a code: a user's text."""

    text: str
    code: ReasonCode | None = None
    params: dict[str, Param] = Field(default_factory=dict[str, Param])

    @property
    def notes(self) -> tuple[Note, ...]:
        """The reason as notes of the audit."""
        if self.code is None:
            return Note.words(self.text)
        return (Note(self.text, "reason", {"reason": self.code, **self.params}),)


@dataclass(frozen=True, slots=True, config=STRICT)
class Change:
    """Result of one key. For torque_mode, `before` and `after` are configured values."""

    key: ParameterKey = Field(description="Parameter key.")
    before: Value = Field(description="Value before.")
    requested: Value = Field(description="Requested value.")
    after: Value = Field(description="Value read back after writing. Null if the servo did not respond.")
    verdict: Verdict = Field(
        description="Result. planned: of a dry run, or torque_mode on, which the following save writes."
    )


@dataclass(frozen=True, slots=True, config=STRICT)
class RomChange:
    """A row whose ROM value will change."""

    key: ParameterKey = Field(description="Parameter key.")
    before: Value = Field(description="Value known to be in ROM. Null if unknown.")
    after: Value = Field(description="Value that the save writes.")


@dataclass(frozen=True, slots=True, config=STRICT)
class ForecastWarning:
    """A reason not to restart now."""

    code: str = Field(description="Code for programs. Stable.")
    text: str = Field(description="One sentence for users.")
    params: dict[str, float] = Field(description="Values in the text, by name. Empty for texts without values.")


@dataclass(frozen=True, slots=True, config=STRICT)
class Forecast:
    """Effect of a restart on the horn, and its risks."""

    code: Code = Field(description="Behaviour of the horn. unknown_start: it turns to 0° from an unknown angle.")
    moves: bool = Field(description="The horn turns at the restart, or may turn.")
    from_deg: float | None = Field(description="Current horn angle within ±180°, °. Null if unknown.")
    to_deg: float | None = Field(description="Angle after the restart, °. Null if the horn is not moved.")
    takes_s: float | None = Field(description="Approximate duration at the 30 rpm of soft start (section 4.14), s.")
    turn_count_lost: bool = Field(description="The turn count restarts from 0.")
    text: str = Field(description="One sentence for users.")
    warnings: list[str] = Field(description="Warnings, one sentence each.")
    coded_warnings: list[ForecastWarning] = Field(description="`warnings`, each with its code.")


class SavePreview(Model):
    """Effect of a save. Empty if nothing would be saved."""

    rom_changes: list[RomChange] = Field(
        default_factory=list[RomChange], description="Rows whose ROM value is known to differ, and requested rows."
    )
    rom_unknown: list[ParameterKey] = Field(
        default_factory=list[ParameterKey],
        description="Keys of rows that are saved unchanged and whose ROM value is unknown.",
    )
    restart: Forecast | None = Field(default=None, description="Effect of the save on the horn.")


@dataclass(frozen=True, slots=True, config=STRICT)
class ResetPreview:
    """Effect of a factory reset."""

    changes: list[Change] = Field(description="Rows that would change.")
    kept: dict[str, Value] = Field(description="Values of identity rows that stay, by key.")
    restart: Forecast = Field(description="Effect of the restart on the horn.")


@dataclass(frozen=True, slots=True, config=STRICT)
class LeftOut:
    """A row that was not written."""

    key: ParameterKey = Field(description="Parameter key.")
    why: str = Field(description="Reason, one sentence.")
    why_code: NoteCode = Field(description="Code of the reason.")
    why_params: Params = Field()


@dataclass(frozen=True, slots=True, config=STRICT)
class Difference:
    """A row that differs. A value is null if the side lacks the row (`*_has` false), or if it is unknown."""

    key: ParameterKey = Field(description="Parameter key.")
    left: Value = Field(description="Value on the left.")
    right: Value = Field(description="Value on the right.")
    left_unit: str = Field(description="Unit of the value on the left. 0x36 follows 0x37, so units may differ.")
    right_unit: str = Field(description="Unit of the value on the right.")
    left_has: bool = Field(description="The left side has this row.")
    right_has: bool = Field(description="The right side has this row.")
    identity: bool = Field(description="Part of the servo's identity: origin, servo ID, node ID (0x44 to 0x46).")


@dataclass(frozen=True, slots=True, config=STRICT)
class Comparison:
    """Two sides, row by row: `servo:UID`, `rom:UID`, `snapshot:ID`, `profile:NAME`, `default:MODEL[@FIRMWARE]`, …"""

    left: str = Field(description="Left side.")
    right: str = Field(description="Right side.")
    same: int = Field(description="Number of rows known to be equal on both sides.")
    differences: list[Difference] = Field(description="Rows that differ, by address.")


@dataclass(frozen=True, slots=True, config=STRICT)
class LineVerdict:
    """Verdict on one line of an imported file."""

    line: int = Field(description="Line number from 1. 0 if unknown.")
    key: str = Field(description="Parameter key.")
    value: Value = Field(description="Value in the file.")
    verdict: LineState = Field(description="ok: accepted. Any other verdict rejects the whole file.")
    text: str = Field(description="Problem and remedy, or for ok a note. May be empty.")
    code: NoteCode | None = Field(description="Code of the text. Null if the text is empty.")
    params: Params = Field()


@dataclass(frozen=True, slots=True, config=STRICT)
class DriftRow:
    """A row whose ROM value changed unexpectedly."""

    key: ParameterKey = Field(description="Parameter key.")
    was: Value = Field(description="Value known to have been in ROM.")
    now: Value = Field(description="Value found.")
    proved: bool = Field(description="false: found in RAM after an unobserved restart, so very likely in ROM.")

"""Effect rules: whether a parameter has an effect now, and if not, why (sections 4.13, 4.17 to 4.33)."""

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, Self, TypeAlias

from pydantic import ConfigDict, Field, model_validator
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.schema.parameter import DUMMY, Key, Row, Section, Text

if TYPE_CHECKING:
    from hornbill.schema.catalog import Catalog

CommandKind = TypeAliasType("CommandKind", Literal["angle", "speed", "torque"])
LastCommand: TypeAlias = Literal["angle", "speed", "torque", "none"]

COMMANDS: Mapping[str, CommandKind] = {
    "command_angle": "angle",
    "command_speed": "speed",
    "command_torque": "torque",
}
MODE = "speed_torque_control"
_LAST = "{last_command}"


@dataclass(
    frozen=True, slots=True, config=ConfigDict(json_schema_serialization_defaults_required=True, defer_build=True)
)
class Why:
    """A reason as a code, for programs and translations."""

    code: str = Field(description="Name of the reason.")
    params: dict[str, str] = Field(
        default_factory=dict[str, str], description="Values in the sentence. `parameter` is the row that decides."
    )


class Effect(NamedTuple):
    """`in_effect` is None while a required value has not been read. `why_not` is a sentence, `why` its code."""

    in_effect: bool | None
    why_not: str | None
    why: Why | None = None


class Condition(Row):
    """Met while `parameter` has one of the values `reads`, or while the last command was one of `last_command`.

    `absent` is its value on a servo whose model or firmware lacks `parameter`.
    """

    parameter: Key | None = Field(
        default=None, description="Key of the row to check. Null for conditions on the last command."
    )
    reads: Annotated[tuple[int, ...], Field(strict=False)] = Field(
        default=(), description="True while the row has one of these values, raw."
    )
    last_command: Annotated[tuple[CommandKind, ...], Field(strict=False)] = Field(
        default=(), description="True while the last command was one of these."
    )
    absent: bool = Field(default=False, description="Value to assume on a servo without that row, raw.")

    @model_validator(mode="after")
    def _one_thing(self) -> Self:
        on_parameter, on_command = self.parameter is not None, bool(self.last_command)
        if on_parameter == on_command or on_parameter != bool(self.reads):
            raise ValueError("a condition has either parameter and reads, or last_command")
        return self


class EffectRule(Row):
    """`parameters` have no effect while all conditions of `when` are met.

    `why` completes "No effect now: …"; `{last_command}` in it is the kind of the last command. `why_absent` replaces
    it if a condition is met because the servo lacks the row. The rule does not apply to servos with `unless_row`.
    """

    parameters: Annotated[tuple[Key, ...], Field(strict=False, min_length=1)] = Field(
        description="Keys of the rows without effect while every condition is met."
    )
    when: Annotated[tuple[Condition, ...], Field(strict=False, min_length=1)] = Field(
        description="Conditions, all of which must be met."
    )
    code: Key = Field(description="Reason by name. It ends in `_absent` where `why_absent` is the reason.")
    why: Text = Field(description="Reason, continuing “No effect now”.")
    section: Section = Field(description="Section of the specification.")
    why_absent: str = Field(default="", description="Reason on a servo without the row. Null for the same reason.")
    unless_row: Key | None = Field(
        default=None, description="The rule does not apply to servos with this row. Null if it always applies."
    )
    inferred: bool = Field(default=False, description="Follows from the specification without being stated in it.")


def rule_text(catalog: "Catalog", rule: EffectRule) -> str:
    """Sentence for a rule in the manual, with its section."""
    why = rule.why.replace("{last_command}", "speed or torque")
    where = "" if rule.unless_row is None else f", on a servo without {catalog.by_key[rule.unless_row].name}"
    return no_effect(why + where, f"inferred from § {rule.section}" if rule.inferred else f"§ {rule.section}")


def no_effect(why: str, origin: str) -> str:
    """Sentence "No effect: …", with its source."""
    return f"No effect: {why} ({origin})."


def commanded(values: Mapping[str, int | None]) -> LastCommand | None:
    """The active kind of command, from 0x00 to 0x02: the one that is not inactive (4.1 to 4.3).

    "none": no command since the start. None: unknown from these values. While 0x25 is off, only an angle can be
    active (4.18).
    """
    if values.get(MODE) == 0:
        return "angle"
    inactive = [key for key in COMMANDS if values.get(key) == DUMMY]
    active = [key for key in COMMANDS if values.get(key) is not None and key not in inactive]
    if len(active) == 1 and inactive:
        return COMMANDS[active[0]]
    if len(inactive) == 2 and not active:
        return next(kind for key, kind in COMMANDS.items() if key not in inactive)
    return "none" if len(active) == len(COMMANDS) else None


def in_force(values: Mapping[str, int | None], rows: Collection[str] | None = None) -> LastCommand | None:
    """As `commanded`, on a servo with only these `rows`: without 0x25 it counts as off (4.18)."""
    return "angle" if _lacks(rows, MODE) else commanded(values)


def why_not(
    catalog: "Catalog",
    key: str,
    values: Mapping[str, int | None],
    last_command: LastCommand | None = None,
    *,
    rows: Collection[str] | None = None,
) -> Effect:
    """Whether parameter `key` has an effect now.

    `values` are raw values by key; a missing key or None is a value not read yet. `last_command` is the last kind of
    command if known to the caller; otherwise it is derived from the values. `rows` are the keys this servo has
    (`ServoModel.rows`); by default all rows exist. Firmware without 0x25 counts as off (4.18).
    """
    rules = catalog.effects_of.get(key)
    if rules is None:
        return Effect(True, None)
    last = in_force(values, rows) if last_command is None else last_command
    missing: Effect | None = None
    for rule in rules:
        if rule.unless_row is not None and (rows is None or rule.unless_row in rows):
            continue
        verdicts = [_is_met(condition, values, last, rows) for condition in rule.when]
        if all(verdict is True for verdict in verdicts):
            sentence, why = _reason(rule, last, rows)
            return Effect(False, f"No effect now: {sentence}.", why)
        if missing is None and False not in verdicts:
            missing = _not_read(catalog, rule.when[verdicts.index(None)].parameter)
    return Effect(True, None) if missing is None else missing


def _is_met(
    condition: Condition,
    values: Mapping[str, int | None],
    last: LastCommand | None,
    rows: Collection[str] | None,
) -> bool | None:
    if condition.parameter is None:
        return None if last is None else last in condition.last_command
    if _lacks(rows, condition.parameter):
        return condition.absent
    raw = values.get(condition.parameter)
    return None if raw is None else raw in condition.reads


def _lacks(rows: Collection[str] | None, key: str) -> bool:
    return rows is not None and key not in rows


def _reason(rule: EffectRule, last: LastCommand | None, rows: Collection[str] | None) -> tuple[str, Why]:
    absent = any(one.parameter is not None and _lacks(rows, one.parameter) for one in rule.when)
    text, code = (rule.why_absent, f"{rule.code}_absent") if absent and rule.why_absent else (rule.why, rule.code)
    decides = next((one.parameter for one in rule.when if one.parameter is not None), None)
    params = {} if decides is None else {"parameter": decides}
    if _LAST in text:
        params["last_command"] = last or "none"
    return text.replace(_LAST, last or "none"), Why(code, params)


def _not_read(catalog: "Catalog", key: str | None) -> Effect:
    if key is None:
        return Effect(None, "Effect unknown: the last command is unknown.", Why("last_command_unknown"))
    row = catalog.by_key[key]
    sentence = f"Effect unknown: {row.label.lower()} ({row.name}) has not been read."
    return Effect(None, sentence, Why("not_read", {"parameter": key}))

"""Owns effect rules: whether a parameter has an effect now, and why not (sections 4.13, 4.17 to 4.33)."""

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, Self, TypeAlias

from pydantic import Field, model_validator

from hornbill.schema.parameter import DUMMY, Key, Row, Section, Text

if TYPE_CHECKING:
    from hornbill.schema.catalog import Catalog

CommandKind: TypeAlias = Literal["angle", "speed", "torque"]
LastCommand: TypeAlias = Literal["angle", "speed", "torque", "none"]

COMMANDS: Mapping[str, CommandKind] = {
    "command_angle": "angle",
    "command_speed": "speed",
    "command_torque": "torque",
}
MODE = "speed_torque_control"


class Effect(NamedTuple):
    """`in_effect` is None while a value that decides it has not been read; `why_not` is a sentence."""

    in_effect: bool | None
    why_not: str | None


class Condition(Row):
    """True while `parameter` reads one of `reads`, or while the last command was one of `last_command`.

    `absent` is what it counts as on a servo whose model or firmware lacks `parameter`.
    """

    parameter: Key | None = None
    reads: Annotated[tuple[int, ...], Field(strict=False)] = ()
    last_command: Annotated[tuple[CommandKind, ...], Field(strict=False)] = ()
    absent: bool = False

    @model_validator(mode="after")
    def _one_thing(self) -> Self:
        asks_parameter, asks_command = self.parameter is not None, bool(self.last_command)
        if asks_parameter == asks_command or asks_parameter != bool(self.reads):
            raise ValueError("a condition is either parameter and reads, or last_command")
        return self


class EffectRule(Row):
    """`parameters` have no effect while every condition of `when` holds.

    `why` completes "No effect now: …"; `{last_command}` in it is the last command's kind. `why_absent`
    replaces it when a condition holds because the servo lacks the row. The rule is void on a servo that has
    `unless_row`.
    """

    parameters: Annotated[tuple[Key, ...], Field(strict=False, min_length=1)]
    when: Annotated[tuple[Condition, ...], Field(strict=False, min_length=1)]
    why: Text
    section: Section
    why_absent: str = ""
    unless_row: Key | None = None
    inferred: bool = False
    """Follows from the document without being stated in it."""


def told(catalog: "Catalog", rule: EffectRule) -> str:
    """A rule as a sentence of a manual, with the section it is from."""
    why = rule.why.replace("{last_command}", "speed or torque")
    where = "" if rule.unless_row is None else f", on a servo without {catalog.by_key[rule.unless_row].name}"
    return no_effect(why + where, f"inferred from § {rule.section}" if rule.inferred else f"§ {rule.section}")


def no_effect(why: str, origin: str) -> str:
    """The sentence for what completes "No effect", and where that is from."""
    return f"No effect: {why} ({origin})."


def commanded(values: Mapping[str, int | None]) -> LastCommand | None:
    """The kind of command in force, read off 0x00 to 0x02: the one that is no dummy (4.1 to 4.3).

    "none" means nothing was commanded since the start; None means the values do not tell. While 0x25 is off
    only an angle can be in force (4.18).
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
    """As `commanded`, on a servo that has `rows` only: a firmware without 0x25 counts as off (4.18)."""
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

    `values` are raw values by key; a missing key or None is a value not read yet. `last_command` is the last
    kind of command where the caller knows it; otherwise it is read off the values. `rows` are the keys this
    servo really has (`ServoModel.rows`); without it every row is taken to exist. A firmware without 0x25
    counts as off (4.18).
    """
    rules = catalog.effects_of.get(key)
    if rules is None:
        return Effect(True, None)
    last = in_force(values, rows) if last_command is None else last_command
    missing: str | None = None
    for rule in rules:
        if rule.unless_row is not None and (rows is None or rule.unless_row in rows):
            continue
        verdicts = [_holds(condition, values, last, rows) for condition in rule.when]
        if all(verdict is True for verdict in verdicts):
            return Effect(False, f"No effect now: {_reason(rule, last, rows)}.")
        if missing is None and False not in verdicts:
            unknown = rule.when[verdicts.index(None)].parameter
            missing = "the last command is not known" if unknown is None else _not_read(catalog, unknown)
    if missing is not None:
        return Effect(None, f"Effect not known: {missing}.")
    return Effect(True, None)


def _holds(
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


def _reason(rule: EffectRule, last: LastCommand | None, rows: Collection[str] | None) -> str:
    absent = any(one.parameter is not None and _lacks(rows, one.parameter) for one in rule.when)
    words = rule.why_absent if absent and rule.why_absent else rule.why
    return words.replace("{last_command}", last or "none")


def _not_read(catalog: "Catalog", key: str) -> str:
    row = catalog.by_key[key]
    return f"{row.label.lower()} ({row.name}) has not been read"

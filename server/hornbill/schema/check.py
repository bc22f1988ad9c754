"""What must hold between rows: nothing twice, and nothing that names what is not there."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hornbill.schema.effect import EffectRule
from hornbill.schema.fault import OVERVIEW, FaultBit
from hornbill.schema.firmware import from_text
from hornbill.schema.parameter import Parameter
from hornbill.schema.tables import FaultsTable, ParametersTable, mistake

_PARAMETERS = "parameters.toml"
_FAULTS = "faults.toml"
_EFFECTS = "effects.toml"
_SLOT = re.compile(r"\{([^}]*)\}")

BOOT_LOADER = 0x49
"""The register whose row must be marked forbidden whatever else a table says (section 4.39)."""


def parameters(table: ParametersTable) -> dict[str, Parameter]:
    """The rows by key, in address order. Raises TableError."""
    steps = [step.version for step in table.firmware]
    versions = [from_text(step) for step in steps]
    if versions != sorted(set(versions)):
        raise mistake(_PARAMETERS, None, "`firmware`: list each version once, oldest first")
    _once(_PARAMETERS, "key", ((group.key, group.key) for group in table.group))
    _once(_PARAMETERS, "key", ((row.key, row.key) for row in table.parameter))
    _once(_PARAMETERS, "address", ((row.key, row.name) for row in table.parameter))
    rows = {row.key: row for row in sorted(table.parameter, key=lambda row: row.address)}
    groups = {group.key for group in table.group}
    for row in rows.values():
        problem = _row_problem(row, rows, groups, steps)
        if problem is not None:
            raise mistake(_PARAMETERS, row.key, problem)
    return rows


def faults(table: FaultsTable, rows: Mapping[str, Parameter]) -> None:
    """Raises TableError for a bit or key used twice, or a parameter that does not exist."""
    everything = (*table.overview, *table.fault)
    _once(_FAULTS, "key", ((bit.key, bit.key) for bit in everything))
    _once(_FAULTS, "bit", ((bit.key, f"{bit.bit} of {bit.parameter}") for bit in everything))
    for bit in everything:
        problem = _bit_problem(bit, bit in table.overview, rows)
        if problem is not None:
            raise mistake(_FAULTS, bit.key, problem)


def effects(rules: Sequence[EffectRule], rows: Mapping[str, Parameter]) -> None:
    """Raises TableError for a parameter that does not exist, or a value it can never read."""
    known: dict[str, tuple[str, str]] = {}
    for position, rule in enumerate(rules, start=1):
        problem = _rule_problem(rule, rows)
        if known.setdefault(rule.code, (rule.why, rule.why_absent)) != (rule.why, rule.why_absent):
            problem = f"`code`: {rule.code} stands for another sentence already"
        if problem is not None:
            raise mistake(_EFFECTS, f"{position} of [[effect]]", problem)


def _row_problem(row: Parameter, rows: Mapping[str, Parameter], groups: set[str], steps: Sequence[str]) -> str | None:
    if row.group not in groups:
        return f"there is no group {row.group}"
    if row.since not in steps:
        return f"`since`: {row.since} is not one of {', '.join(steps)}"
    if (row.address == BOOT_LOADER) != row.forbidden:
        return "0x49, and it alone, is marked forbidden"
    other = row.unit_when
    if other is not None and other.raw not in _values(rows.get(other.parameter)):
        return f"`unit_when`: {other.parameter} never reads {other.raw}"
    if row.limits is not None:
        for key in (row.limits.lower, row.limits.upper):
            limit = rows.get(key)
            if limit is None or not limit.writable or (limit.unit, limit.per_unit) != (row.unit, row.per_unit):
                return f"`limits`: {key} is no row that can be written in the unit of {row.key}"
    if row.unique is not None and not (row.minimum or 0) <= row.unique.lowest <= row.unique.highest <= (
        row.maximum or 0
    ):
        return "`unique`: lowest and highest must lie within minimum and maximum"
    stated = [number is not None for number in (row.default, row.minimum, row.maximum)]
    return row.range_problem(complete=any(stated))


def _bit_problem(bit: FaultBit, overview: bool, rows: Mapping[str, Parameter]) -> str | None:
    register = rows.get(bit.parameter)
    if register is None or register.kind != "bits":
        return f"there is no fault parameter {bit.parameter}"
    if overview != (bit.parameter == OVERVIEW):
        return f"bits of {OVERVIEW} stand under [[overview]], and only they"
    if bit.limit is not None and bit.limit not in rows:
        return f"`limit`: there is no parameter {bit.limit}"
    return None


def _rule_problem(rule: EffectRule, rows: Mapping[str, Parameter]) -> str | None:
    named = [*rule.parameters, *([rule.unless_row] if rule.unless_row else [])]
    for key in named:
        if key not in rows or not rows[key].readable:
            return f"there is no parameter {key}"
    slots = set(_SLOT.findall(rule.why + rule.why_absent))
    if slots - {"last_command"} or (slots and not any(condition.last_command for condition in rule.when)):
        return "`why`: the one slot is {last_command}, in a rule that asks for it"
    for condition in rule.when:
        if condition.parameter is None:
            continue
        row = rows.get(condition.parameter)
        if row is None or not row.readable:
            return f"there is no parameter {condition.parameter}"
        never = [raw for raw in condition.reads if raw not in _values(row)]
        if never:
            return f"{row.key} never reads {never[0]}"
    return None


def _values(row: Parameter | None) -> Iterable[int]:
    """The raw values a choice or switch can have, or a number whose range is the same everywhere."""
    if row is None:
        return ()
    if row.choices:
        return [choice.raw for choice in row.choices]
    if row.kind == "switch":
        return (0, 1)
    return range(row.minimum or 0, (row.maximum or 1_000_000) + 1)


def _once(file: str, what: str, rows: Iterable[tuple[str, Any]]) -> None:
    seen: dict[Any, str] = {}
    for row, value in rows:
        if value in seen:
            raise mistake(file, row, f"{what} {value} is already that of row {seen[value]}")
        seen[value] = row

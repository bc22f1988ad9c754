"""Consistency between rows: no duplicates and no references to missing rows."""

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
_PLACEHOLDER = re.compile(r"\{([^}]*)\}")

BOOT_LOADER = 0x49
"""The register whose row must be marked forbidden (section 4.39)."""


def parameters(table: ParametersTable) -> dict[str, Parameter]:
    """Check the rows and return them by key, in address order. Raises TableError."""
    steps = [step.version for step in table.firmware]
    versions = [from_text(step) for step in steps]
    if versions != sorted(set(versions)):
        raise mistake(_PARAMETERS, None, "`firmware`: list each version once, oldest first")
    _check_unique(_PARAMETERS, "key", ((group.key, group.key) for group in table.group))
    _check_unique(_PARAMETERS, "key", ((row.key, row.key) for row in table.parameter))
    _check_unique(_PARAMETERS, "address", ((row.key, row.name) for row in table.parameter))
    rows = {row.key: row for row in sorted(table.parameter, key=lambda row: row.address)}
    groups = {group.key for group in table.group}
    for row in rows.values():
        problem = _row_problem(row, rows, groups, steps)
        if problem is not None:
            raise mistake(_PARAMETERS, row.key, problem)
    return rows


def faults(table: FaultsTable, rows: Mapping[str, Parameter]) -> None:
    """Check fault bits. Raises TableError for a duplicate bit or key, or an unknown parameter."""
    everything = (*table.overview, *table.fault)
    _check_unique(_FAULTS, "key", ((bit.key, bit.key) for bit in everything))
    _check_unique(_FAULTS, "bit", ((bit.key, f"{bit.bit} of {bit.parameter}") for bit in everything))
    for bit in everything:
        problem = _bit_problem(bit, bit in table.overview, rows)
        if problem is not None:
            raise mistake(_FAULTS, bit.key, problem)


def effects(rules: Sequence[EffectRule], rows: Mapping[str, Parameter]) -> None:
    """Check effect rules. Raises TableError for an unknown parameter, or a value it can never have."""
    known: dict[str, tuple[str, str]] = {}
    for position, rule in enumerate(rules, start=1):
        problem = _rule_problem(rule, rows)
        if known.setdefault(rule.code, (rule.why, rule.why_absent)) != (rule.why, rule.why_absent):
            problem = f"`code`: {rule.code} is used for another sentence already"
        if problem is not None:
            raise mistake(_EFFECTS, f"{position} of [[effect]]", problem)


def _row_problem(row: Parameter, rows: Mapping[str, Parameter], groups: set[str], steps: Sequence[str]) -> str | None:
    if row.group not in groups:
        return f"unknown group {row.group}"
    if row.since not in steps:
        return f"`since`: {row.since} is not one of {', '.join(steps)}"
    if (row.address == BOOT_LOADER) != row.forbidden:
        return "only 0x49 must be marked forbidden"
    other = row.unit_when
    if other is not None and other.raw not in _values(rows.get(other.parameter)):
        return f"`unit_when`: {other.parameter} never has the value {other.raw}"
    if row.limits is not None:
        for key in (row.limits.lower, row.limits.upper):
            limit = rows.get(key)
            if limit is None or not limit.writable or (limit.unit, limit.per_unit) != (row.unit, row.per_unit):
                return f"`limits`: {key} must be a writable row in the unit of {row.key}"
    if row.unique is not None and not (row.minimum or 0) <= row.unique.lowest <= row.unique.highest <= (
        row.maximum or 0
    ):
        return "`unique`: lowest and highest must be within minimum and maximum"
    stated = [number is not None for number in (row.default, row.minimum, row.maximum)]
    return row.range_problem(complete=any(stated))


def _bit_problem(bit: FaultBit, overview: bool, rows: Mapping[str, Parameter]) -> str | None:
    register = rows.get(bit.parameter)
    if register is None or register.kind != "bits":
        return f"unknown fault parameter {bit.parameter}"
    if overview != (bit.parameter == OVERVIEW):
        return f"bits of {OVERVIEW}, and no others, belong under [[overview]]"
    if bit.limit is not None and bit.limit not in rows:
        return f"`limit`: unknown parameter {bit.limit}"
    return None


def _rule_problem(rule: EffectRule, rows: Mapping[str, Parameter]) -> str | None:
    named = [*rule.parameters, *([rule.unless_row] if rule.unless_row else [])]
    for key in named:
        if key not in rows or not rows[key].readable:
            return f"unknown parameter {key}"
    placeholders = set(_PLACEHOLDER.findall(rule.why + rule.why_absent))
    if placeholders - {"last_command"} or (placeholders and not any(condition.last_command for condition in rule.when)):
        return "`why`: the only placeholder is {last_command}, in a rule with that condition"
    for condition in rule.when:
        if condition.parameter is None:
            continue
        row = rows.get(condition.parameter)
        if row is None or not row.readable:
            return f"unknown parameter {condition.parameter}"
        never = [raw for raw in condition.reads if raw not in _values(row)]
        if never:
            return f"{row.key} never has the value {never[0]}"
    return None


def _values(row: Parameter | None) -> Iterable[int]:
    """Possible raw values of a choice, a switch, or a number with a range independent of the model."""
    if row is None:
        return ()
    if row.choices:
        return [choice.raw for choice in row.choices]
    if row.kind == "switch":
        return (0, 1)
    return range(row.minimum or 0, (row.maximum or 1_000_000) + 1)


def _check_unique(file: str, what: str, rows: Iterable[tuple[str, Any]]) -> None:
    seen: dict[Any, str] = {}
    for row, value in rows:
        if value in seen:
            raise mistake(file, row, f"{what} {value} is used by row {seen[value]} already")
        seen[value] = row

"""Files generated from the tables: the parameter manual, and the JSON Schema of the tables for editors."""

from collections.abc import Iterable, Iterator
from typing import Any

from pydantic.json_schema import models_json_schema

from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import rule_text
from hornbill.schema.fault import FaultBit
from hornbill.schema.model import ModelTable, Series
from hornbill.schema.parameter import Group, Parameter
from hornbill.schema.scale import number, to_text, with_unit
from hornbill.schema.tables import EffectsTable, FaultsTable, ParametersTable

_ACCESS = {"rw": "read, write", "r": "read", "w": "run"}


JSON_SCHEMA = "https://json-schema.org/draft/2020-12/schema"


def tables_json_schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of all five kinds of table files."""
    shapes = (ParametersTable, FaultsTable, EffectsTable, Series, ModelTable)
    places, definitions = models_json_schema(
        [(shape, "validation") for shape in shapes], ref_template="#/$defs/{model}"
    )
    return {
        "$schema": JSON_SCHEMA,
        "title": "hornbill parameter tables",
        "anyOf": [places[(shape, "validation")] for shape in shapes],
        **definitions,
    }


def parameters_markdown(catalog: Catalog) -> str:
    """Parameter manual in Markdown: models, rows by group with their effects, fault bits."""
    lines = [
        "# Parameters of BLA15, BLA21 and BLA34 servos",
        "",
        f"Generated from `schemas/` by `make generate`. Do not edit. Numbers follow the protocol specification, "
        f"{catalog.specification}; § refers to its sections.",
        "",
        *_models(catalog),
        "",
        *_firmware(catalog),
    ]
    for group in catalog.groups:
        lines += ["", *_group(catalog, group)]
    lines += ["", *_faults(catalog)]
    return "\n".join(lines) + "\n"


def _models(catalog: Catalog) -> Iterator[str]:
    yield "## Models"
    yield ""
    yield from _table(
        ["Model", "Supply", "PWM input", "0x50", "0x53", "Firmware"],
        (
            [
                model.name,
                model.voltage_class,
                "yes" if model.pwm else "no",
                str(model.model_number),
                str(model.hardware_version),
                ", ".join(model.firmware),
            ]
            for model in catalog.models.values()
        ),
    )


def _firmware(catalog: Catalog) -> Iterator[str]:
    yield "## Firmware"
    yield ""
    yield from _table(
        ["Version", "Models", "From", "Until", "Note"],
        (
            [
                step.version,
                ", ".join(model.name for model in catalog.models.values() if step.version in model.firmware),
                step.first,
                step.last or "",
                step.note,
            ]
            for step in catalog.firmware
        ),
    )
    yield ""
    yield "An unknown firmware or hardware version is treated as the newest known lower version of its series."


def _group(catalog: Catalog, group: Group) -> Iterator[str]:
    rows = [row for row in catalog.parameters.values() if row.group == group.key and not row.forbidden]
    yield f"## {group.label}"
    yield ""
    yield group.description
    yield ""
    yield from _table(
        ["Name", "Key", "Label", "Default", "Minimum", "Maximum", "Step", "Access", "Since", "§"],
        ([row.name, f"`{row.key}`", row.label, *_numbers(catalog, row), *_facts(row)] for row in rows),
    )
    yield from _by_model(catalog, rows)
    for row in rows:
        yield ""
        yield f"**{row.label}** (`{row.key}`, {row.name}). {row.description}"
        yield from _notes(catalog, row)


def _facts(row: Parameter) -> list[str]:
    step = with_unit(number(1, row.per_unit), row.unit) if row.kind == "number" and row.unit else ""
    if row.unit_when is not None:
        step += f" or {with_unit(number(1, row.unit_when.per_unit), row.unit_when.unit)}"
    return [step, _ACCESS[row.access], row.since, row.section]


def _numbers(catalog: Catalog, row: Parameter) -> list[str]:
    """Default, minimum and maximum if equal in all models, otherwise `by model`."""
    variants = {_triple(model.parameters[row.key]) for model in catalog.models.values() if _has(row, model.pwm)}
    return list(variants.pop()) if len(variants) == 1 else ["by model"] * 3


def _triple(row: Parameter) -> tuple[str, str, str]:
    default, minimum, maximum = (
        "" if raw is None else to_text(row, raw) for raw in (row.default, row.minimum, row.maximum)
    )
    return default, minimum, maximum


def _has(row: Parameter, pwm: bool) -> bool:
    return pwm or not row.pwm_only


def _by_model(catalog: Catalog, rows: Iterable[Parameter]) -> Iterator[str]:
    lines: list[list[str]] = []
    for row in rows:
        variants: dict[tuple[str, str, str], list[str]] = {}
        for model in catalog.models.values():
            if _has(row, model.pwm):
                variants.setdefault(_triple(model.parameters[row.key]), []).append(model.name)
        if len(variants) > 1:
            lines += [[f"`{row.key}`", *numbers, ", ".join(names)] for numbers, names in variants.items()]
    if lines:
        yield ""
        yield from _table(["Key", "Default", "Minimum", "Maximum", "Models"], lines)


def _notes(catalog: Catalog, row: Parameter) -> Iterator[str]:
    notes = [f"Values: {', '.join(f'`{one.key}` {one.raw}' for one in row.choices)}."] if row.choices else []
    if row.advice:
        notes.append(row.advice)
    if row.smallest is not None:
        least = with_unit(number(row.smallest, row.per_unit), row.unit)
        notes.append(f"Not usable between 0 and ±{least}.")
    if row.pwm_only:
        notes.append("Only in models with PWM input.")
    if row.after_restart:
        notes.append("Takes effect after a save and restart.")
    if row.identity:
        notes.append("Part of the servo's identity: excluded from profiles by default.")
    notes += [rule_text(catalog, rule) for rule in catalog.effects_of[row.key]]
    if notes:
        yield ""
        yield from (f"- {note}" for note in notes)


def _faults(catalog: Catalog) -> Iterator[str]:
    yield "## Fault bits"
    yield ""
    yield "Bits that are not listed are undocumented. The overview (0x18) summarises them by group and level."
    for register in [row for row in catalog.parameters.values() if row.kind == "bits"]:
        bits = [bit for bit in (*catalog.overview, *catalog.faults) if bit.parameter == register.key]
        yield ""
        yield f"### {register.label} ({register.name})"
        yield ""
        yield from _table(
            ["Bit", "Key", "Label", "What to do", "Notes"],
            ([str(bit.bit), f"`{bit.key}`", bit.label, bit.advice, _flags(bit)] for bit in bits),
        )


def _flags(bit: FaultBit) -> str:
    words = {
        "output off": bit.output_off,
        "stays until the next start": bit.latching,
        "a past event": bit.past_event,
        "PWM models only": bit.pwm_only,
        "reported by older firmware": bit.older_firmware,
    }
    return ", ".join(word for word, holds in words.items() if holds)


def _table(heads: list[str], rows: Iterable[list[str]]) -> Iterator[str]:
    yield f"| {' | '.join(heads)} |"
    yield f"| {' | '.join('---' for _ in heads)} |"
    for row in rows:
        yield f"| {' | '.join(row)} |"

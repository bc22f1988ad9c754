"""The generated manual and the JSON Schema of the tables."""

from typing import Any

from hornbill.schema.catalog import Catalog
from hornbill.schema.tables import EffectsTable, FaultsTable, ParametersTable
from tools.generate.manual import parameters_markdown, tables_json_schema

CATALOG = Catalog.load()
MANUAL = parameters_markdown(CATALOG)


def test_the_manual_describes_every_row_model_and_fault_bit_but_not_the_boot_loader() -> None:
    for row in CATALOG.parameters.values():
        assert (f"(`{row.key}`, {row.name}). {row.description}" in MANUAL) != row.forbidden
    assert "boot_loader" not in MANUAL
    for name in CATALOG.models:
        assert f"| {name} |" in MANUAL
    for bit in (*CATALOG.overview, *CATALOG.faults):
        assert f"| {bit.bit} | `{bit.key}` | {bit.label} | {bit.advice} |" in MANUAL


def test_the_manual_has_numbers_by_model_and_conditions_without_effect() -> None:
    assert "| `overcurrent_limit` | 6.3 A | 3.5 A | 7.0 A | BLA21-12U-A0, BLA21-12U-AB |" in MANUAL
    assert "| 0x27 | `timeout_time` | Timeout | 1000 ms | 1 ms | 60000 ms | 1 ms |" in MANUAL
    text = MANUAL[MANUAL.index("**Torque limit CW**") :]
    assert text.splitlines()[2] == "- Not usable between 0 and ±10 %."
    assert text.splitlines()[3] == "- No effect: speed and torque control (0x25) is off (§ 4.33)."


def test_the_json_schema_covers_every_table() -> None:
    schema: dict[str, Any] = tables_json_schema()
    names = {place["$ref"].removeprefix("#/$defs/") for place in schema["anyOf"]}
    assert names == {"ParametersTable", "FaultsTable", "EffectsTable", "Series", "ModelTable"}
    for table in (ParametersTable, FaultsTable, EffectsTable):
        assert set(schema["$defs"][table.__name__]["properties"]) == set(table.model_fields)
    parameter = schema["$defs"]["Parameter"]
    assert parameter["additionalProperties"] is False
    assert "name" not in parameter["properties"]
    assert {"key", "address", "description", "section"} <= set(parameter["required"])

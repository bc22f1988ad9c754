"""Combine tables: common rows, then series, then model (section 3.1)."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from hornbill.schema.model import ModelTable, Overlay, Series, ServoModel
from hornbill.schema.parameter import Parameter
from hornbill.schema.tables import mistake, read

_IDENTITY = {
    "model_number": "model_number in the series file",
    "hardware_version": "hardware_version in the model file",
}


def series(folder: Path, parameters: Mapping[str, Parameter]) -> dict[str, Series]:
    """Read all files of schemas/series, by series name. Raises TableError."""
    found: dict[str, Series] = {}
    for file in _files(folder, "series"):
        table = read(folder, file, Series)
        _check_rows(file, table.rows, parameters)
        for key, row in table.rows.items():
            problem = row.over(parameters[key]).range_problem(complete=False)
            if problem is not None:
                raise mistake(file, key, problem)
        for other in found.values():
            if other.name == table.name:
                raise mistake(file, None, f"series {table.name} is in two files")
            if other.model_number == table.model_number:
                raise mistake(file, None, f"model_number {table.model_number} is used by {other.name} already")
        found[table.name] = table
    return found


def models(
    folder: Path, parameters: Mapping[str, Parameter], known: Mapping[str, Series], steps: tuple[str, ...]
) -> dict[str, ServoModel]:
    """Read all files of schemas/models, by model name, with overlays applied and ranges checked. Raises TableError."""
    found: dict[str, ServoModel] = {}
    for file in _files(folder, "models"):
        model = _model(folder, file, parameters, known, steps)
        for other in found.values():
            if other.name == model.name:
                raise mistake(file, None, f"model {model.name} is in two files")
            if (other.model_number, other.hardware_version) == (model.model_number, model.hardware_version):
                raise mistake(file, None, f"{model.name} has the identity of {other.name}")
        found[model.name] = model
    return found


def _model(
    folder: Path,
    file: str,
    parameters: Mapping[str, Parameter],
    known: Mapping[str, Series],
    steps: tuple[str, ...],
) -> ServoModel:
    table = read(folder, file, ModelTable)
    above = known.get(table.series)
    if above is None:
        raise mistake(file, None, f"unknown series {table.series}")
    for version in table.firmware:
        if version not in steps:
            raise mistake(file, None, f"firmware {version} is not one of {', '.join(steps)}")
    if list(table.firmware) != [step for step in steps if step in table.firmware]:
        raise mistake(file, None, "`firmware`: list each version once, oldest first")
    _check_rows(file, table.rows, parameters)
    identity = {
        "model_number": Overlay(default=above.model_number),
        "hardware_version": Overlay(default=table.hardware_version),
    }
    rows: dict[str, Parameter] = {}
    for key, common in parameters.items():
        row = common
        for layer in (above.rows, table.rows, identity):
            row = layer[key].over(row) if key in layer else row
        problem = row.range_problem()
        if problem is None and row.pwm_only and not table.pwm and (row.minimum, row.maximum) != (0, 0):
            problem = "without PWM input, minimum and maximum must be 0"
        if problem is not None:
            raise mistake(file, key, f"{problem} (after series {above.name} and the common row)")
        rows[key] = row
    return ServoModel(
        name=table.name,
        series=table.series,
        section=table.section,
        model_number=above.model_number,
        hardware_version=table.hardware_version,
        voltage_class=table.voltage_class,
        pwm=table.pwm,
        firmware=table.firmware,
        parameters=MappingProxyType(rows),
        steps=steps[: steps.index(table.firmware[-1]) + 1],
    )


def _check_rows(file: str, rows: Mapping[str, Overlay], parameters: Mapping[str, Parameter]) -> None:
    for key in rows:
        if key not in parameters:
            raise mistake(file, key, "unknown parameter: not in parameters.toml")
        if key in _IDENTITY:
            raise mistake(file, key, f"this number is given by {_IDENTITY[key]}")
        if parameters[key].forbidden:
            raise mistake(file, key, "a forbidden row cannot be overridden")


def _files(folder: Path, kind: str) -> list[str]:
    files = sorted(f"{kind}/{path.name}" for path in (folder / kind).glob("*.toml"))
    if not files:
        raise mistake(kind, None, "the folder is missing or empty")
    return files

"""Read one table file: TOML to strict rows, with errors naming file and row."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast

from pydantic import BaseModel, Field, ValidationError

from hornbill.errors import TableError
from hornbill.schema.effect import EffectRule
from hornbill.schema.fault import FaultBit
from hornbill.schema.firmware import FirmwareStep
from hornbill.schema.parameter import Group, Parameter, Row, Text

Table = TypeVar("Table", bound=BaseModel)


class ParametersTable(Row):
    """schemas/parameters.toml: the document's revision, the firmware steps, groups and rows."""

    specification: Text
    firmware: Annotated[tuple[FirmwareStep, ...], Field(strict=False, min_length=1)]
    group: Annotated[tuple[Group, ...], Field(strict=False, min_length=1)]
    parameter: Annotated[tuple[Parameter, ...], Field(strict=False, min_length=1)]


class FaultsTable(Row):
    """schemas/faults.toml: the overview bits of 0x18 and the detail bits of 0x19 to 0x1B."""

    overview: Annotated[tuple[FaultBit, ...], Field(strict=False, min_length=1)]
    fault: Annotated[tuple[FaultBit, ...], Field(strict=False, min_length=1)]


class EffectsTable(Row):
    """schemas/effects.toml: when a parameter has no effect."""

    effect: Annotated[tuple[EffectRule, ...], Field(strict=False, min_length=1)]


def mistake(file: str, row: str | None, what: str) -> TableError:
    """The error for an invalid `file`, and `row` if known."""
    where = f"{file}, row {row}" if row else file
    return TableError(f"{where}: {what}", cause="table_invalid", file=file, row=row)


def read(folder: Path, file: str, shape: type[Table]) -> Table:
    """Read a file of `folder` as `shape`. Raises TableError with file and row."""
    try:
        text = (folder / file).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise mistake(file, None, "the file is missing") from None
    except (OSError, UnicodeDecodeError) as error:
        raise mistake(file, None, f"the file cannot be read: {error}") from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise mistake(file, None, f"not valid TOML: {error}") from error
    try:
        return shape.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        row, place = _where(data, first["loc"])
        raise mistake(file, row, _what(first["type"], first["msg"], place, first["loc"][0] == "rows")) from error


def _where(data: dict[str, Any], place: tuple[int | str, ...]) -> tuple[str | None, str]:
    """Row of a location in the file, and the rest of the location as a dotted path."""
    if len(place) >= 2 and place[0] == "rows":
        return str(place[1]), ".".join(map(str, place[2:]))
    if len(place) >= 2 and isinstance(place[1], int):
        rows = cast(list[Any], data.get(str(place[0]), []))
        row: Any = rows[place[1]] if place[1] < len(rows) else None
        named = cast(dict[str, Any], row).get("key") if isinstance(row, dict) else None
        name = named if isinstance(named, str) else f"{place[1] + 1} of [[{place[0]}]]"
        return name, ".".join(map(str, place[2:]))
    return None, ".".join(map(str, place))


def _what(kind: str, message: str, place: str, overlay: bool) -> str:
    if kind == "extra_forbidden" and overlay:
        return f"an overlay can change only default, minimum and maximum, not `{place}`"
    if kind == "missing":
        return f"`{place}` is missing"
    if kind == "extra_forbidden":
        return f"`{place}` is not a field of this table"
    message = message.removeprefix("Value error, ")
    return f"`{place}`: {message}" if place else message

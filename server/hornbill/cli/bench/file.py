"""Bench file: servos and their wanted values, with line numbers."""

import difflib
import json
import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from hornbill.errors import InvalidValue

if TYPE_CHECKING:
    from hornbill.client import responses

Value: TypeAlias = bool | int | float | str
NAMES = ("uid", "serial", "label")
ENTRY = {*NAMES, "profile", "save", "confirm", "values"}
LEFT_OUT = "torque_mode"
"""Not exported: applying a file must not switch torque."""

_HEAD = re.compile(r"\s*\[\[?\s*([\w.\s\"-]+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"\s*([\w.\"-]+)\s*=")


@dataclass(frozen=True, slots=True)
class BenchEntry:
    """Wanted values of one servo. `lines`: line number of every key, and of the entry itself under ""."""

    by: str
    name: str
    profile: str | None
    save: bool
    confirm: tuple[str, ...]
    values: Mapping[str, Value]
    lines: Mapping[str, int] = field(repr=False)

    @property
    def title(self) -> str:
        """Name of the entry for messages."""
        return f"{self.by} {self.name!r}"


class FileErrors:
    """Errors of a file with their lines, reported together."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._found: list[tuple[int, str]] = []

    def add(self, line: int, text: str) -> None:
        """Add an error."""
        self._found.append((line, text))

    def check(self) -> None:
        """Raises InvalidValue if there are errors."""
        if self._found:
            raise InvalidValue(
                "\n".join(f"{self._file}:{line}: {text}" for line, text in sorted(self._found)), cause=None
            )


def parse(file: Path, text: str) -> list[BenchEntry]:
    """Parse a bench file. Raises InvalidValue with all errors."""
    errors = FileErrors(file.name)
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"at line (\d+)", str(error))
        errors.add(int(found[1]) if found else text.count("\n") + 1, f"Invalid TOML: {error}.")
        errors.check()
        raise AssertionError from error
    lines = _lines(text)
    for key in document.keys() - {"save", "servo"}:
        errors.add(lines[0].get(key, 1), _unknown(key, ("save", "servo")))
    save = document.get("save", False)
    if not isinstance(save, bool):
        errors.add(lines[0].get("save", 1), "save must be true or false.")
    servos = document.get("servo", [])
    if not isinstance(servos, list) or not all(isinstance(one, dict) for one in cast("list[object]", servos)):
        errors.add(lines[0].get("servo", 1), "Each servo must be a table. Write [[servo]].")
        servos = []
    entries = [
        _entry(one, lines[place] if place < len(lines) else {}, save is True, errors)
        for place, one in enumerate(cast("list[dict[str, Any]]", servos), start=1)
    ]
    errors.check()
    if not entries:
        raise InvalidValue(
            f"{file.name}: The file contains no servos. 'hornbill export' writes a file to start with.", cause=None
        )
    return [one for one in entries if one is not None]


def configuration(rows: "Sequence[responses.Parameter]") -> "list[responses.Parameter]":
    """Rows allowed in a bench file: those that are writable and stored in ROM (0x20 to 0x4F, section 4.11)."""
    return [row for row in rows if row["access"] == "rw" and row["rom"] and not row["forbidden"]]


def check_keys(entries: Sequence[BenchEntry], known: Collection[str], errors: FileErrors) -> None:
    """Report every key that is not a writable parameter."""
    for entry in entries:
        for key in entry.values:
            if key not in known:
                errors.add(entry.lines.get(f"values.{key}", entry.lines[""]), _unknown(key, known))


def write(
    servos: "Sequence[tuple[responses.Servo, responses.Parameters]]", rows: "Sequence[responses.Parameter]"
) -> str:
    """Bench file with the values of these servos. `rows`: rows of the schema to include, in order.

    `save` is true if all values are known to be in ROM, so that applying the file to the same bench changes nothing.
    """
    text = [
        "# Bench file of hornbill. Apply it with 'hornbill apply FILE', compare with 'hornbill apply --check FILE'."
    ]
    for known, found in servos:
        readings = found["parameters"]
        present = [row for row in rows if row["key"] in readings and readings[row["key"]]["value"] is not None]
        unsaved = [row["key"] for row in present if readings[row["key"]]["rom"] != readings[row["key"]]["value"]]
        name = ", ".join(filter(None, (known["label"], known["model"], known["serial"])))
        text += ["", "[[servo]]", f'uid = "{known["uid"]}"  # {_plain(name)}']
        only = f"  # only in RAM: {', '.join(unsaved)}" if unsaved else ""
        text += [f"save = {'false' if unsaved else 'true'}{only}"]
        text += ["", "[servo.values]"]
        for row in present:
            reading = readings[row["key"]]
            unit = f", {reading['unit']}" if reading["unit"] else ""
            text.append(f"{row['key']} = {literal(reading['value'])}  # {_plain(row['label'])}{unit}")
    return "\n".join(text) + "\n"


def _entry(found: dict[str, Any], lines: Mapping[str, int], save: bool, errors: FileErrors) -> BenchEntry | None:
    here = lines.get("", 1)

    def wrong(key: str, text: str) -> None:
        errors.add(lines.get(key, here), text)

    for key in found.keys() - ENTRY:
        wrong(key, _unknown(key, ENTRY))
    named = [key for key in NAMES if key in found]
    if len(named) != 1 or not isinstance(found[named[0]], str) or not found[named[0]]:
        errors.add(here, "Name each servo by exactly one of uid, serial and label, as a string.")
        return None
    if not isinstance(found.get("save", save), bool):
        wrong("save", "save must be true or false.")
    if not isinstance(found.get("profile", ""), str):
        wrong("profile", "profile must be the name of a profile, as a string.")
    confirm: Any = found.get("confirm", [])
    if not isinstance(confirm, list) or not all(isinstance(word, str) for word in cast("list[object]", confirm)):
        wrong("confirm", 'confirm must be a list of codes, for example ["supply"].')
        confirm = []
    values: Any = found.get("values", {})
    if not isinstance(values, dict):
        wrong("values", "values must be a table. Write [servo.values].")
        values = {}
    for key, value in cast("dict[str, object]", values).items():
        if not isinstance(value, (bool, int, float, str)):
            wrong(f"values.{key}", f"{key} must be a number, true, false or a string.")
    checked = cast("dict[str, Value]", values)
    words = tuple(str(word) for word in cast("list[object]", confirm))
    if not checked and "profile" not in found:
        errors.add(here, "The servo has neither values nor a profile. Add at least one.")
    return BenchEntry(named[0], found[named[0]], found.get("profile"), found.get("save", save), words, checked, lines)


def _lines(text: str) -> list[dict[str, int]]:
    """Line numbers of keys: of the file first, then of each [[servo]]. For keys that share a line, the line of the
    enclosing table counts."""
    found: list[dict[str, int]] = [{"": 1}]
    within = ""
    for number, line in enumerate(text.splitlines(), start=1):
        head = _HEAD.match(line)
        if head is not None:
            path = re.sub(r'[\s"]', "", head[1])
            if line.lstrip().startswith("[[servo]]") or (line.lstrip().startswith("[[") and path == "servo"):
                found.append({"": number})
                within = ""
            else:
                within = path.removeprefix("servo.") + "."
                found[-1].setdefault(within[:-1], number)
            continue
        key = _KEY.match(line)
        if key is not None:
            found[-1].setdefault(within + key[1].replace('"', ""), number)
    return found


def _unknown(key: str, known: Collection[str]) -> str:
    near = difflib.get_close_matches(key, sorted(known), 1)
    return f"Unknown key {key!r}.{f' Did you mean {near[0]}?' if near else ''}"


def literal(value: object) -> str:
    """Value in TOML syntax."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _plain(text: str) -> str:
    """Text for a comment, without line breaks and control characters."""
    return "".join(char if char.isprintable() else " " for char in text)

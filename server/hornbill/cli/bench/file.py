"""The bench file: which servos a bench has and what they shall hold, with the line of everything it says."""

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
    from hornbill.client import answers

Value: TypeAlias = bool | int | float | str
NAMES = ("uid", "serial", "label")
ENTRY = {*NAMES, "profile", "save", "confirm", "values"}
LEFT_OUT = "torque_mode"
"""Not exported: bringing a bench to a file shall not switch torque by the way."""

_HEAD = re.compile(r"\s*\[\[?\s*([\w.\s\"-]+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"\s*([\w.\"-]+)\s*=")


@dataclass(frozen=True, slots=True)
class BenchEntry:
    """What one servo shall hold. `lines` has the line of every key, and of the entry itself under ""."""

    by: str
    name: str
    profile: str | None
    save: bool
    confirm: tuple[str, ...]
    values: Mapping[str, Value]
    lines: Mapping[str, int] = field(repr=False)

    @property
    def title(self) -> str:
        """How people find it in the file."""
        return f"{self.by} {self.name!r}"


class Complaints:
    """What is wrong with a file, each with its line, told all at once."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._found: list[tuple[int, str]] = []

    def add(self, line: int, text: str) -> None:
        """One more."""
        self._found.append((line, text))

    def tell(self) -> None:
        """Raises InvalidValue when there are any; nothing is written then."""
        if self._found:
            raise InvalidValue(
                "\n".join(f"{self._file}:{line}: {text}" for line, text in sorted(self._found)), cause=None
            )


def parse(file: Path, text: str) -> list[BenchEntry]:
    """The entries of a bench file. Raises InvalidValue with every complaint about its form."""
    complaints = Complaints(file.name)
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"at line (\d+)", str(error))
        complaints.add(int(found[1]) if found else text.count("\n") + 1, f"This is no TOML: {error}.")
        complaints.tell()
        raise AssertionError from error
    lines = _lines(text)
    for key in document.keys() - {"save", "servo"}:
        complaints.add(lines[0].get(key, 1), _unknown(key, ("save", "servo")))
    save = document.get("save", False)
    if not isinstance(save, bool):
        complaints.add(lines[0].get("save", 1), "save is true or false.")
    servos = document.get("servo", [])
    if not isinstance(servos, list) or not all(isinstance(one, dict) for one in cast("list[object]", servos)):
        complaints.add(lines[0].get("servo", 1), "A servo is a table of its own: write [[servo]].")
        servos = []
    entries = [
        _entry(one, lines[place] if place < len(lines) else {}, save is True, complaints)
        for place, one in enumerate(cast("list[dict[str, Any]]", servos), start=1)
    ]
    complaints.tell()
    if not entries:
        raise InvalidValue(
            f"{file.name}: There is no servo in it. 'hornbill export' writes a file to begin with.", cause=None
        )
    return [one for one in entries if one is not None]


def configuration(rows: "Sequence[answers.Parameter]") -> "list[answers.Parameter]":
    """The rows a bench file can hold: what can be written, and what ROM keeps (0x20 to 0x4F, section 4.11)."""
    return [row for row in rows if row["access"] == "rw" and row["rom"] and not row["forbidden"]]


def check_keys(entries: Sequence[BenchEntry], known: Collection[str], complaints: Complaints) -> None:
    """Complain about every key that is no parameter which can be written."""
    for entry in entries:
        for key in entry.values:
            if key not in known:
                complaints.add(entry.lines.get(f"values.{key}", entry.lines[""]), _unknown(key, known))


def write(servos: "Sequence[tuple[answers.Servo, answers.Parameters]]", rows: "Sequence[answers.Parameter]") -> str:
    """A file that says what these servos hold. `rows`: those of the schema that are wanted, in its order.

    `save` is true where all of it is known to be in ROM, so that applying the file to the same bench does nothing.
    """
    text = [
        "# A bench file of hornbill: 'hornbill apply FILE' brings servos to it, 'hornbill apply --check FILE' compares."
    ]
    for known, found in servos:
        readings = found["parameters"]
        held = [row for row in rows if row["key"] in readings and readings[row["key"]]["value"] is not None]
        loose = [row["key"] for row in held if readings[row["key"]]["rom"] != readings[row["key"]]["value"]]
        told = ", ".join(filter(None, (known["label"], known["model"], known["serial"])))
        text += ["", "[[servo]]", f'uid = "{known["uid"]}"  # {_plain(told)}']
        only = f"  # only in RAM: {', '.join(loose)}" if loose else ""
        text += [f"save = {'false' if loose else 'true'}{only}"]
        text += ["", "[servo.values]"]
        for row in held:
            reading = readings[row["key"]]
            unit = f", {reading['unit']}" if reading["unit"] else ""
            text.append(f"{row['key']} = {literal(reading['value'])}  # {_plain(row['label'])}{unit}")
    return "\n".join(text) + "\n"


def _entry(found: dict[str, Any], lines: Mapping[str, int], save: bool, complaints: Complaints) -> BenchEntry | None:
    here = lines.get("", 1)

    def wrong(key: str, text: str) -> None:
        complaints.add(lines.get(key, here), text)

    for key in found.keys() - ENTRY:
        wrong(key, _unknown(key, ENTRY))
    named = [key for key in NAMES if key in found]
    if len(named) != 1 or not isinstance(found[named[0]], str) or not found[named[0]]:
        complaints.add(here, "A servo is named once: by uid, serial or label, each a text.")
        return None
    if not isinstance(found.get("save", save), bool):
        wrong("save", "save is true or false.")
    if not isinstance(found.get("profile", ""), str):
        wrong("profile", "profile is the name of one: a text.")
    confirm: Any = found.get("confirm", [])
    if not isinstance(confirm, list) or not all(isinstance(word, str) for word in cast("list[object]", confirm)):
        wrong("confirm", 'confirm is a list of words, for example ["supply"].')
        confirm = []
    values: Any = found.get("values", {})
    if not isinstance(values, dict):
        wrong("values", "values is a table: write [servo.values].")
        values = {}
    for key, value in cast("dict[str, object]", values).items():
        if not isinstance(value, (bool, int, float, str)):
            wrong(f"values.{key}", f"{key} is a number, true, false or a word.")
    kept = cast("dict[str, Value]", values)
    words = tuple(str(word) for word in cast("list[object]", confirm))
    if not kept and "profile" not in found:
        complaints.add(here, "Nothing is wanted of this servo: give it values or a profile.")
    return BenchEntry(named[0], found[named[0]], found.get("profile"), found.get("save", save), words, kept, lines)


def _lines(text: str) -> list[dict[str, int]]:
    """Line of every key: of the whole file first, then of each [[servo]]. Where a key is written in another way than
    one a line, that of what it stands in is told instead."""
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
    return f"{key!r} is not known here.{f' Did you mean {near[0]}?' if near else ''}"


def literal(value: object) -> str:
    """A value as TOML writes it."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _plain(text: str) -> str:
    """What a comment can hold: a line break in it would be a line of the file."""
    return "".join(sign if sign.isprintable() else " " for sign in text)

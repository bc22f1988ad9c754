"""The files of profiles: readable TOML and JSON, and a verdict on every line of one somebody has edited."""

import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Literal, TypeAlias, cast

from hornbill.domain.change import LineVerdict
from hornbill.domain.fields import Param
from hornbill.domain.note import Note
from hornbill.domain.profile import Profile
from hornbill.errors import InvalidValue
from hornbill.schema import scale
from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.profiles.profiles import Draft, Profiles

Form: TypeAlias = Literal["toml", "json"]

_TEXTS = ("name", "description", "model", "firmware", "schema_revision")
_TABLES = ("values", "units")
_LONGEST = {"description": 1000}

MOST_DOTS = 2000
"""The time the standard library takes for a TOML key grows with the square of its dots: 0.1 s for so many, minutes for
a file full of them. A description may have 1000, numbers and comments some more."""

MOST_ENTRIES = 200
"""A profile of every row has about 70, units among them."""

_MANY_LINES = re.compile(r'("""|\'\'\')(?:.|\n)*?\1')
_HEADING = re.compile(r"\[([^\]]*)\]\s*(?:#.*)?")
_KEY = re.compile(r"([A-Za-z0-9_.\-\"' \t]+)=")
_JSON_TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"(\s*:)?')
# None of these may try one character in two ways: a file could hold up the loop, and with it Stop, for minutes.
_AT_LINE = re.compile(r"\(at line (\d+)")


@dataclass(frozen=True, slots=True)
class Found:
    """What a file says; `draft` is None unless every line is ok."""

    draft: Draft | None
    lines: list[LineVerdict]


def to_toml(profile: Profile, catalog: Catalog) -> str:
    """The profile as TOML: the same text for the same profile; rows in chapters, each with label and unit."""
    head = {
        "name": profile.name, "description": profile.description, "model": profile.model,
        "firmware": profile.firmware, "schema_revision": profile.schema_revision,
    }  # fmt: skip
    text = [
        "# A profile of hornbill: values to write into servos of Futaba's BLA15 and BLA21 series.",
        "# Numbers are in the unit their line names. Rows a servo lacks are left out when it is applied.",
        "",
        *(f"{key} = {_toml(value)}" for key, value in head.items() if value is not None),
        "",
        "[values]",
    ]
    rows = [catalog.parameters[key] for key in profile.values if key in catalog.parameters]
    labels = {group.key: group.label for group in catalog.groups}
    places = {group.key: place for place, group in enumerate(catalog.groups)}
    rows.sort(key=lambda row: (places[row.group], row.address))
    for group, members in groupby(rows, key=lambda row: row.group):
        text += ["", f"# {labels[group]}"]
        text += [f"{row.key} = {_toml(profile.values[row.key])}  # {_said(row, profile)}" for row in members]
    text += [
        "",
        "[units]",
        *(f"{row.key} = {_toml(profile.units[row.key])}" for row in rows if row.key in profile.units),
    ]
    return "\n".join(text) + "\n"


def to_json(profile: Profile) -> str:
    """The profile as JSON with one value a line, the same text for the same profile."""
    shown = {
        "name": profile.name, "description": profile.description, "model": profile.model,
        "firmware": profile.firmware, "schema_revision": profile.schema_revision,
        "values": dict(profile.values), "units": dict(profile.units),
    }  # fmt: skip
    return json.dumps(shown, indent=2, ensure_ascii=False) + "\n"


def read(text: str, form: Form, profiles: Profiles, catalog: Catalog, *, identity: bool = False) -> Found:
    """A verdict on every line of a file, and when all are ok what it says. Never raises, whatever the text is.

    Tables of another revision than ours are told of, not refused: every value is checked against ours. Identity rows
    (0x44 to 0x46) are refused unless `identity`. The file's `name` is for people; the caller chooses the profile's.
    """
    if form == "toml" and text.count(".") > MOST_DOTS:
        told = f"There are more than {MOST_DOTS} dots in this file. A profile has no such keys; shorten its texts."
        return Found(None, [_wrong(0, "", None, Note(told, "too_many_dots", {"most": MOST_DOTS}))])
    try:
        document = tomllib.loads(text) if form == "toml" else json.loads(text, object_pairs_hook=_once)
    except (ValueError, RecursionError) as error:
        return Found(None, [_wrong(_line_of(error), "", None, _syntax(error, form))])
    if not isinstance(document, dict):
        return Found(None, [_wrong(1, "", None, Note("This is no object. A profile begins with {.", "no_object"))])
    return _judge(cast("dict[str, Any]", document), _Places(text, form), profiles, catalog, identity=identity)


def _judge(
    document: dict[str, Any], places: "_Places", profiles: Profiles, catalog: Catalog, *, identity: bool
) -> Found:
    lines = [_field(key, value, places.of("", key), catalog) for key, value in document.items() if key not in _TABLES]
    texts = {key: document[key] for key in _TEXTS if isinstance(document.get(key), str)}
    tables = {key: document.get(key) for key in _TABLES}
    for key, table in tables.items():
        if table is not None and not isinstance(table, dict):
            told = f"{key} is a table. Write one row a line in it."
            lines.append(_wrong(places.of("", key), key, None, Note(told, "no_table", {"field": key})))
    values, units = (cast("dict[str, Any]", one) if isinstance(one, dict) else {} for one in tables.values())
    entries = len(document) + len(values) + len(units)
    if entries > MOST_ENTRIES:
        told = f"There are {entries} entries; a profile has at most {MOST_ENTRIES}. Take out what is none of its rows."
        note = Note(told, "too_many_entries", {"entries": entries, "most": MOST_ENTRIES})
        return Found(None, [_wrong(0, "", None, note)])
    if not values:
        note = Note("There is no value. Give at least one.", "no_value")
        lines.append(_wrong(places.of("", "values"), "values", None, note))
    lines += _units(values, units, places)
    stated = {key: unit for key, unit in units.items() if isinstance(unit, str)}
    draft = Draft(values, texts.get("description", ""), texts.get("model"), texts.get("firmware"), stated)
    try:
        checked = profiles.check(draft, identity=identity)
    except InvalidValue as error:  # of the model or the firmware; the values are judged all the same
        key = "firmware" if draft.model is None or draft.model in catalog.models else "model"
        lines.append(_wrong(places.of("", key), key, texts[key], Note(error.detail, "problem", error.told)))
        checked = profiles.check(Draft(values, units=stated), identity=identity)
    for one in checked:
        line, error = places.of("values", one.key), one.error
        if error is None:
            lines.append(LineVerdict(line, one.key, one.value, one.verdict, "", None, {}))
        else:
            lines.append(LineVerdict(line, one.key, one.value, one.verdict, error.detail, "problem", error.told))
    lines.sort(key=lambda one: one.line)
    return Found(draft if all(one.verdict == "ok" for one in lines) else None, lines)


def _field(key: str, value: object, line: int, catalog: Catalog) -> LineVerdict:
    """The verdict on what stands outside the tables."""
    shown = value if isinstance(value, bool | int | float | str) else None
    field: dict[str, Param] = {"field": key}
    if key not in _TEXTS:
        known = ", ".join((*_TEXTS, *_TABLES))
        told = f"A profile has {known}. Take this out, or write it under [values]."
        return LineVerdict(line, key, shown, "unknown", told, "unknown_field", {"known": known})
    if value is None and key in ("model", "firmware"):
        return LineVerdict(line, key, None, "ok", "", None, {})
    if not isinstance(value, str):
        return _wrong(line, key, shown, Note(f"{key} is a text. Write it in quotation marks.", "no_text", field))
    longest = _LONGEST.get(key, 80)
    if len(value) > longest:
        told = f"{key} has {len(value)} characters; {longest} are allowed."
        params: dict[str, Param] = {**field, "characters": len(value), "most": longest}
        return _wrong(line, key, value[:80], Note(told, "too_long", params))
    if not value.isascii() and re.search("[\ud800-\udfff]", value):
        return _wrong(line, key, None, Note(f"{key} holds half a character. Write it anew.", "half_character", field))
    if key == "schema_revision" and value != catalog.revision:
        told = f"Written with other tables than ours ({catalog.revision}); every value was checked against ours."
        return LineVerdict(line, key, value, "ok", told, "other_tables", {"revision": catalog.revision})
    return LineVerdict(line, key, value, "ok", "", None, {})


def _wrong(line: int, key: str, value: Value, why: Note) -> LineVerdict:
    return LineVerdict(line, key, value, "invalid", why.text, why.code, why.params)


def _units(values: Mapping[str, Any], units: Mapping[str, Any], places: "_Places") -> list[LineVerdict]:
    """What is wrong with the table of units as such; whether each fits its row is told at the row."""
    wrong: list[LineVerdict] = []
    for key, unit in units.items():
        line = places.of("units", key)
        if not isinstance(unit, str):
            wrong.append(_wrong(line, key, None, Note('A unit is a text, such as "ms".', "unit_no_text")))
        elif key not in values:
            told = f"There is a unit for {key[:60]}, but no value. Take it out."
            wrong.append(_wrong(line, key, unit, Note(told, "unit_without_value", {"key": key[:60]})))
    return wrong


class _Places:
    """On which line each key stands. Where a file is laid out in a way it does not know, 0."""

    def __init__(self, text: str, form: Form) -> None:
        self._text = text
        self._toml = _toml_places(text) if form == "toml" else None
        self._json = _json_places(text) if form == "json" else {}

    def of(self, table: str, key: str) -> int:
        """The line of `key` in `table` ("" for the top), from 1."""
        if self._toml is not None:
            return self._toml.get((table, key)) or self._toml.get(("", table)) or 0
        start = 0
        if table:
            start = self._json_key(table, 0) or 0
        found = self._json_key(key, start)
        return 0 if found is None else self._text.count("\n", 0, found) + 1

    def _json_key(self, key: str, start: int) -> int | None:
        return next((place for place in self._json.get(key, ()) if place >= start), None)


def _json_places(text: str) -> dict[str, list[int]]:
    """Where each key stands: texts follow one another, and a colon makes one a key."""
    places: dict[str, list[int]] = {}
    for found in _JSON_TEXT.finditer(text):
        if found[2] is not None:
            places.setdefault(json.loads(f'"{found[1]}"'), []).append(found.start())
    return places


def _toml_places(text: str) -> dict[tuple[str, str], int]:
    """Lines of (table, key), of keys before any table ("", key), and of tables themselves ("", table)."""
    plain = _MANY_LINES.sub(lambda found: '""' + "\n" * found[0].count("\n"), text)
    places: dict[tuple[str, str], int] = {}
    table = ""
    for number, line in enumerate(plain.split("\n"), start=1):
        heading = _HEADING.fullmatch(line.strip())
        if heading is not None:
            table = heading[1].strip().strip("\"'")
            places.setdefault(("", table), number)
            continue
        key = _KEY.match(line.strip())
        if key is None:
            continue
        parts = [part.strip().strip("\"'") for part in key[1].split(".")]
        where = table if len(parts) == 1 else ".".join(filter(None, (table, *parts[:-1])))
        places.setdefault((where, parts[-1]), number)
    return places


def _said(row: Parameter, profile: Profile) -> str:
    unit = profile.units.get(row.key)
    if row.choices:
        return f"{row.label}: {scale.allowed(row)}"
    return f"{row.label}, {unit}" if unit else row.label


def _toml(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):  # JSON's escapes are TOML's, but for delete, which JSON leaves as it is
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"{key[:60]} is there twice. Keep one")
        found[key] = value
    return found


def _syntax(error: Exception, form: Form) -> Note:
    if isinstance(error, RecursionError):
        return Note("This is nested too deeply for a profile. Write one value a line.", "nested_too_deeply")
    name, why = form.upper(), str(error)[:200]
    return Note(f"This is not {name}: {why}.", "no_syntax", {"format": name, "why": why})


def _line_of(error: Exception) -> int:
    if isinstance(error, json.JSONDecodeError):
        return error.lineno
    found = _AT_LINE.search(str(error))
    return 0 if found is None else int(found[1])

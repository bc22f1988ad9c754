"""Profile files: readable TOML and JSON, and a verdict on each line of an imported file."""

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
"""Maximum number of dots in a TOML file. The standard library's time for a TOML key grows with the square of its dots:
0.1 s for this many, minutes for a file full of them. A description may have 1000, numbers and comments some more."""

MOST_ENTRIES = 200
"""Maximum number of entries. A profile of all rows has about 70, including units."""

_MANY_LINES = re.compile(r'("""|\'\'\')(?:.|\n)*?\1')
_HEADING = re.compile(r"\[([^\]]*)\]\s*(?:#.*)?")
_KEY = re.compile(r"([A-Za-z0-9_.\-\"' \t]+)=")
_JSON_TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"(\s*:)?')
# Avoid ambiguous repetition here: backtracking on a hostile file could block the event loop, and Stop, for minutes.
_AT_LINE = re.compile(r"\(at line (\d+)")


@dataclass(frozen=True, slots=True)
class Found:
    """Result of reading a file. `draft` is None unless every line is ok."""

    draft: Draft | None
    lines: list[LineVerdict]


def to_toml(profile: Profile, catalog: Catalog) -> str:
    """The profile as TOML, deterministic, with rows by group and a comment with label and unit."""
    head = {
        "name": profile.name, "description": profile.description, "model": profile.model,
        "firmware": profile.firmware, "schema_revision": profile.schema_revision,
    }  # fmt: skip
    text = [
        "# hornbill profile: values for Futaba servos of the BLA15 and BLA21 series.",
        "# Numbers are in the unit given in their line. Rows that a servo lacks are skipped.",
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
        text += [f"{row.key} = {_toml(profile.values[row.key])}  # {_comment(row, profile)}" for row in members]
    text += [
        "",
        "[units]",
        *(f"{row.key} = {_toml(profile.units[row.key])}" for row in rows if row.key in profile.units),
    ]
    return "\n".join(text) + "\n"


def to_json(profile: Profile) -> str:
    """The profile as JSON, deterministic, with one value per line."""
    shown = {
        "name": profile.name, "description": profile.description, "model": profile.model,
        "firmware": profile.firmware, "schema_revision": profile.schema_revision,
        "values": dict(profile.values), "units": dict(profile.units),
    }  # fmt: skip
    return json.dumps(shown, indent=2, ensure_ascii=False) + "\n"


def read(text: str, form: Form, profiles: Profiles, catalog: Catalog, *, identity: bool = False) -> Found:
    """Parse and check a file: a verdict on each line, and a draft if all are ok. Never raises.

    Another revision of the tables is noted, not refused: all values are checked against the present tables. Identity
    rows (0x44 to 0x46) are refused unless `identity`. The file's `name` is informative; the caller sets the profile's
    name.
    """
    if form == "toml" and text.count(".") > MOST_DOTS:
        detail = f"The file has more than {MOST_DOTS} dots. Shorten its texts and keys."
        return Found(None, [_wrong(0, "", None, Note(detail, "too_many_dots", {"most": MOST_DOTS}))])
    try:
        document = tomllib.loads(text) if form == "toml" else json.loads(text, object_pairs_hook=_once)
    except (ValueError, RecursionError) as error:
        return Found(None, [_wrong(_line_of(error), "", None, _syntax(error, form))])
    if not isinstance(document, dict):
        return Found(None, [_wrong(1, "", None, Note("The file is not a JSON object. Begin with {.", "not_an_object"))])
    return _judge(cast("dict[str, Any]", document), _Places(text, form), profiles, catalog, identity=identity)


def _judge(
    document: dict[str, Any], places: "_Places", profiles: Profiles, catalog: Catalog, *, identity: bool
) -> Found:
    lines = [_field(key, value, places.of("", key), catalog) for key, value in document.items() if key not in _TABLES]
    texts = {key: document[key] for key in _TEXTS if isinstance(document.get(key), str)}
    tables = {key: document.get(key) for key in _TABLES}
    for key, table in tables.items():
        if table is not None and not isinstance(table, dict):
            detail = f"{key} must be a table with one row per line."
            lines.append(_wrong(places.of("", key), key, None, Note(detail, "not_a_table", {"field": key})))
    values, units = (cast("dict[str, Any]", one) if isinstance(one, dict) else {} for one in tables.values())
    entries = len(document) + len(values) + len(units)
    if entries > MOST_ENTRIES:
        detail = f"The file has {entries} entries; at most {MOST_ENTRIES} are allowed. Remove those that are not rows."
        note = Note(detail, "too_many_entries", {"entries": entries, "most": MOST_ENTRIES})
        return Found(None, [_wrong(0, "", None, note)])
    if not values:
        note = Note("The file has no values. Add at least one.", "values_missing")
        lines.append(_wrong(places.of("", "values"), "values", None, note))
    lines += _units(values, units, places)
    stated = {key: unit for key, unit in units.items() if isinstance(unit, str)}
    draft = Draft(values, texts.get("description", ""), texts.get("model"), texts.get("firmware"), stated)
    try:
        checked = profiles.check(draft, identity=identity)
    except InvalidValue as error:  # invalid model or firmware; the values are checked anyway
        key = "firmware" if draft.model is None or draft.model in catalog.models else "model"
        lines.append(_wrong(places.of("", key), key, texts[key], Note(error.detail, "problem", error.note_params)))
        checked = profiles.check(Draft(values, units=stated), identity=identity)
    for one in checked:
        line, error = places.of("values", one.key), one.error
        if error is None:
            lines.append(LineVerdict(line, one.key, one.value, one.verdict, "", None, {}))
        else:
            lines.append(LineVerdict(line, one.key, one.value, one.verdict, error.detail, "problem", error.note_params))
    lines.sort(key=lambda one: one.line)
    return Found(draft if all(one.verdict == "ok" for one in lines) else None, lines)


def _field(key: str, value: object, line: int, catalog: Catalog) -> LineVerdict:
    """Verdict on a field outside the tables."""
    shown = value if isinstance(value, bool | int | float | str) else None
    field: dict[str, Param] = {"field": key}
    if key not in _TEXTS:
        known = ", ".join((*_TEXTS, *_TABLES))
        detail = f"Unknown field. Known fields: {known}. Remove it, or move it to [values]."
        return LineVerdict(line, key, shown, "unknown", detail, "unknown_field", {"known": known})
    if value is None and key in ("model", "firmware"):
        return LineVerdict(line, key, None, "ok", "", None, {})
    if not isinstance(value, str):
        return _wrong(line, key, shown, Note(f"{key} must be text in quotation marks.", "not_text", field))
    longest = _LONGEST.get(key, 80)
    if len(value) > longest:
        detail = f"{key} has {len(value)} characters; at most {longest} are allowed."
        params: dict[str, Param] = {**field, "characters": len(value), "most": longest}
        return _wrong(line, key, value[:80], Note(detail, "too_long", params))
    if not value.isascii() and re.search("[\ud800-\udfff]", value):
        detail = f"{key} contains an incomplete character. Enter the text again."
        return _wrong(line, key, None, Note(detail, "lone_surrogate", field))
    if key == "schema_revision" and value != catalog.revision:
        detail = f"Written with other parameter tables. All values were checked against {catalog.revision}."
        return LineVerdict(line, key, value, "ok", detail, "other_tables", {"revision": catalog.revision})
    return LineVerdict(line, key, value, "ok", "", None, {})


def _wrong(line: int, key: str, value: Value, why: Note) -> LineVerdict:
    return LineVerdict(line, key, value, "invalid", why.text, why.code, why.params)


def _units(values: Mapping[str, Any], units: Mapping[str, Any], places: "_Places") -> list[LineVerdict]:
    """Problems of the units table itself. Mismatches with a row are reported at the row."""
    wrong: list[LineVerdict] = []
    for key, unit in units.items():
        line = places.of("units", key)
        if not isinstance(unit, str):
            wrong.append(_wrong(line, key, None, Note('A unit must be text, such as "ms".', "unit_not_text")))
        elif key not in values:
            detail = f"{key[:60]} has a unit but no value. Remove the unit."
            wrong.append(_wrong(line, key, unit, Note(detail, "unit_without_value", {"key": key[:60]})))
    return wrong


class _Places:
    """Line number of each key. 0 if the layout of the file is not understood."""

    def __init__(self, text: str, form: Form) -> None:
        self._text = text
        self._toml = _toml_places(text) if form == "toml" else None
        self._json = _json_places(text) if form == "json" else {}

    def of(self, table: str, key: str) -> int:
        """Line of `key` in `table` ("" for the top level), from 1."""
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
    """Position of each key: a string followed by a colon."""
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


def _comment(row: Parameter, profile: Profile) -> str:
    unit = profile.units.get(row.key)
    if row.choices:
        return f"{row.label}: {scale.allowed(row)}"
    return f"{row.label}, {unit}" if unit else row.label


def _toml(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):  # TOML uses the escapes of JSON, but also requires DEL to be escaped
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"duplicate key {key[:60]}")
        found[key] = value
    return found


def _syntax(error: Exception, form: Form) -> Note:
    if isinstance(error, RecursionError):
        return Note("The file is nested too deeply. Write one value per line.", "nested_too_deeply")
    name, why = form.upper(), str(error)[:200]
    return Note(f"The file is not valid {name}: {why}.", "invalid_syntax", {"format": name, "why": why})


def _line_of(error: Exception) -> int:
    if isinstance(error, json.JSONDecodeError):
        return error.lineno
    found = _AT_LINE.search(str(error))
    return 0 if found is None else int(found[1])

"""The format of the bench file; all errors are reported at once, each with its line."""

import tomllib
from pathlib import Path
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.cli.bench.file import FileErrors, check_keys, parse, write
from hornbill.errors import InvalidValue

FILE = Path("bench.toml")


def errors_of(text: str) -> list[str]:
    with pytest.raises(InvalidValue) as caught:
        parse(FILE, text)
    return caught.value.detail.splitlines()


def test_a_file_contains_servos_values_profile_and_save() -> None:
    text = """save = true

[[servo]]
serial = "61-466861"
profile = "aileron"
[servo.values]
angle_p_gain = 40
smoothing = false

[[servo]]
label = "Elevator L"
save = false
confirm = ["supply"]
values = { timeout_action = "brake" }
"""
    first, second = parse(FILE, text)
    assert (first.by, first.name, first.profile, first.save) == ("serial", "61-466861", "aileron", True)
    assert first.values == {"angle_p_gain": 40, "smoothing": False}
    assert (first.lines[""], first.lines["serial"], first.lines["values.angle_p_gain"]) == (3, 4, 7)
    assert (second.by, second.save, second.confirm) == ("label", False, ("supply",))
    assert second.values == {"timeout_action": "brake"}
    assert second.lines[""] == 10


def test_all_errors_are_reported_with_their_lines() -> None:
    text = """sav = true
[[servo]]
uid = "a"
serial = "b"

[[servo]]
uid = "c"
colour = "red"
save = 1
[servo.values]
angle_p_gain = [1]
"""
    found = errors_of(text)
    assert [line.split(": ")[0] for line in found] == [f"bench.toml:{n}" for n in (1, 2, 8, 9, 11)]
    assert "Did you mean save?" in found[0]
    assert "one of uid, serial and label" in found[1]


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "The file contains no servos"),
        ('[[servo]]\nuid = "a"\n', "bench.toml:1: The servo has neither values nor a profile"),
        ("[[servo]]\nuid = \n", "bench.toml:2: Invalid TOML"),
        ("servo = 3\n", "bench.toml:1: Each servo must be a table"),
        ('[[servo]]\nuid = ""\nprofile = "x"\n', "exactly one of"),
    ],
)
def test_an_invalid_file_is_an_error(text: str, error: str) -> None:
    assert error in errors_of(text)[0]


def test_an_unknown_key_is_reported_with_its_line_and_a_suggestion() -> None:
    entries = parse(FILE, '[[servo]]\nuid = "a"\n[servo.values]\nsmoothing = true\nangle_pgain = 4\n')
    errors = FileErrors("bench.toml")
    check_keys(entries, ["angle_p_gain", "smoothing"], errors)
    with pytest.raises(InvalidValue) as caught:
        errors.check()
    assert caught.value.detail == "bench.toml:5: Unknown key 'angle_pgain'. Did you mean angle_p_gain?"


@given(st.text(max_size=200))
def test_any_text_is_parsed_or_an_error(text: str) -> None:
    try:
        found = parse(FILE, text)
    except InvalidValue as error:
        found = error.detail
    assert found
    assert isinstance(found, list) or "bench.toml" in found


@given(
    label=st.text(max_size=30),
    word=st.text(min_size=1, max_size=10),
    number=st.one_of(st.integers(-9999, 9999), st.floats(-1e4, 1e4)),
    rom=st.booleans(),
)
def test_a_written_file_is_read_as_written(label: str, word: str, number: float, rom: bool) -> None:
    values: dict[str, Any] = {"a": number, "b": True, "c": word}
    readings = {key: {"value": value, "rom": value if rom else None, "unit": "°"} for key, value in values.items()}
    known: Any = {"uid": "0" * 32, "label": label, "model": "M", "serial": None}
    rows: Any = [{"key": key, "label": label} for key in values]
    text = write([(known, cast("Any", {"parameters": readings}))], rows)
    tomllib.loads(text)
    (entry,) = parse(FILE, text)
    assert (entry.by, entry.name, entry.save, entry.values) == ("uid", "0" * 32, rom, values)

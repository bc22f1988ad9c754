"""The tests of the bench file's form: every complaint has its line, and all come at once."""

import tomllib
from pathlib import Path
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.cli.bench.file import FileErrors, check_keys, parse, write
from hornbill.errors import InvalidValue

FILE = Path("bench.toml")


def wrong(text: str) -> list[str]:
    with pytest.raises(InvalidValue) as caught:
        parse(FILE, text)
    return caught.value.detail.splitlines()


def test_a_file_names_servos_values_profile_and_whether_to_save() -> None:
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


def test_every_complaint_has_its_line_and_all_come_at_once() -> None:
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
    found = wrong(text)
    assert [line.split(": ")[0] for line in found] == [f"bench.toml:{n}" for n in (1, 2, 8, 9, 11)]
    assert "Did you mean save?" in found[0]
    assert "one of uid, serial and label" in found[1]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "The file contains no servos"),
        ('[[servo]]\nuid = "a"\n', "bench.toml:1: The servo has neither values nor a profile"),
        ("[[servo]]\nuid = \n", "bench.toml:2: Invalid TOML"),
        ("servo = 3\n", "bench.toml:1: Each servo must be a table"),
        ('[[servo]]\nuid = ""\nprofile = "x"\n', "exactly one of"),
    ],
)
def test_what_cannot_be_meant_is_told(text: str, said: str) -> None:
    assert said in wrong(text)[0]


def test_a_key_that_is_none_is_told_with_its_line_and_the_nearest() -> None:
    entries = parse(FILE, '[[servo]]\nuid = "a"\n[servo.values]\nsmoothing = true\nangle_pgain = 4\n')
    errors = FileErrors("bench.toml")
    check_keys(entries, ["angle_p_gain", "smoothing"], errors)
    with pytest.raises(InvalidValue) as caught:
        errors.check()
    assert caught.value.detail == "bench.toml:5: Unknown key 'angle_pgain'. Did you mean angle_p_gain?"


@given(st.text(max_size=200))
def test_any_text_is_read_or_complained_about(text: str) -> None:
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
def test_what_is_written_is_what_is_read(label: str, word: str, number: float, rom: bool) -> None:
    values: dict[str, Any] = {"a": number, "b": True, "c": word}
    readings = {key: {"value": value, "rom": value if rom else None, "unit": "°"} for key, value in values.items()}
    known: Any = {"uid": "0" * 32, "label": label, "model": "M", "serial": None}
    rows: Any = [{"key": key, "label": label} for key in values]
    text = write([(known, cast("Any", {"parameters": readings}))], rows)
    tomllib.loads(text)
    (entry,) = parse(FILE, text)
    assert (entry.by, entry.name, entry.save, entry.values) == ("uid", "0" * 32, rom, values)

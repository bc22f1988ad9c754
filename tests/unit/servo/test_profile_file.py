"""Profile files: a written file reads back as the same profile, and every line of an edited one has a verdict."""

import asyncio
import json
import time
import tomllib
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hornbill.domain.change import LineVerdict
from hornbill.domain.profile import Profile
from hornbill.schema.catalog import Catalog
from hornbill.schema.model import ServoModel
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value, to_value
from hornbill.servo.profiles import profile_file
from hornbill.servo.profiles.profile_file import Form
from hornbill.servo.profiles.profiles import Draft, Profiles
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub
from hornbill.store.store import Store

CATALOG = Catalog.load()
STORE = Store("sqlite://")
PROFILES = Profiles(STORE, CATALOG, Audit(STORE.audit, Hub()))
FORMS: list[Form] = ["toml", "json"]


def put(name: str, draft: Draft, *, identity: bool = False, by: str) -> Profile:
    return asyncio.run(PROFILES.put(name, draft, identity=identity, by=by))


GRIPPER = put(
    "Gripper",
    Draft(
        {"timeout_action": "off", "angle_limit_cw": 60, "angle_limit_ccw": -60.5, "soft_start": False,
         "pwm_mode": "speed", "pwm_output_range": 90},
        description="Left hand", model="BLA21-06U-AB", firmware="1.300",
    ),
    by="test",
)  # fmt: skip

GRIPPER_TOML = f"""\
# hornbill profile: values for Futaba servos of the BLA15 and BLA21 series.
# Numbers are in the unit given in their line. Rows that a servo lacks are skipped.

name = "Gripper"
description = "Left hand"
model = "BLA21-06U-AB"
firmware = "1.300"
schema_revision = "{CATALOG.revision}"

[values]

# Configuration
soft_start = false  # Soft start
timeout_action = "off"  # Timeout action: hold, off or brake

# PWM input
pwm_output_range = 90  # Output at full pulse, rpm
pwm_mode = "speed"  # PWM mode: angle or speed

# Limits
angle_limit_cw = 60.0  # Angle limit CW, °
angle_limit_ccw = -60.5  # Angle limit CCW, °

[units]
pwm_output_range = "rpm"
angle_limit_cw = "°"
angle_limit_ccw = "°"
"""


def read(text: str, form: Form = "toml", *, identity: bool = False) -> profile_file.Found:
    return profile_file.read(text, form, PROFILES, CATALOG, identity=identity)


def edited(*changes: tuple[str, str]) -> list[LineVerdict]:
    """The lines that are not ok after these replacements in the file."""
    text = GRIPPER_TOML
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    found = read(text)
    wrong = [one for one in found.lines if one.verdict != "ok"]
    assert (found.draft is None) == bool(wrong)
    return wrong


def _raws(row: Parameter) -> st.SearchStrategy[int]:
    return st.integers(row.minimum or 0, row.maximum or 0)


@st.composite
def profiles(draw: st.DrawFn) -> Profile:
    """Any set of legal values of any model and firmware, with any texts around it."""
    model: ServoModel = draw(st.sampled_from(list(CATALOG.models.values())))
    firmware = draw(st.sampled_from([*CATALOG.firmware_steps, None]))
    rows = model.rows(None if firmware is None else int(firmware.replace(".", "")))
    writable = [row for row in rows.values() if row.writable and row.group != "command"]
    chosen = draw(st.lists(st.sampled_from(writable), min_size=1, unique_by=lambda row: row.key))
    raws = {row.key: draw(_raws(row)) for row in chosen}
    values: dict[str, Value] = {row.key: to_value(row, raws[row.key], raws) for row in chosen}
    name = draw(
        st.text(st.characters(blacklist_categories=["Cs", "Cc"], blacklist_characters="/\\"), min_size=1, max_size=80)
    )
    text = draw(st.text(st.characters(blacklist_categories=["Cs"]), max_size=1000))
    return put(name, Draft(values, text, model.name, firmware), identity=True, by="hypothesis")


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])  # every profile is checked and kept on its way
@given(profiles(), st.sampled_from(FORMS))
def test_a_written_profile_reads_back_as_the_same_with_a_verdict_on_each_line(profile: Profile, form: Form) -> None:
    text = profile_file.to_toml(profile, CATALOG) if form == "toml" else profile_file.to_json(profile)
    found, written = read(text, form, identity=True), text.split("\n")
    assert found.draft is not None, found.lines
    assert all(written[one.line - 1].strip().strip('"').startswith(one.key) for one in found.lines), found.lines
    again = put(profile.name, found.draft, identity=True, by="hypothesis")
    assert (again.values, again.units) == (profile.values, profile.units)
    assert {key: type(one) for key, one in again.values.items()} == {
        key: type(one) for key, one in profile.values.items()
    }
    assert (again.description, again.model, again.firmware) == (profile.description, profile.model, profile.firmware)
    assert text == (profile_file.to_toml(again, CATALOG) if form == "toml" else profile_file.to_json(again))


@given(
    st.text() | st.from_regex(r'(\[values\]\n|"?[a-z_]+"? ?[=:] ?[-0-9.a-z"{}\[\]]+,?\n?){1,5}'), st.sampled_from(FORMS)
)
def test_any_text_has_a_verdict(text: str, form: Form) -> None:
    found = read(text, form)
    assert found.lines
    assert found.draft is None or all(one.verdict == "ok" for one in found.lines)


@pytest.mark.parametrize(
    ("text", "form"),
    [("[" * 100_000, "json"), ("a = " + "[" * 10_000, "toml"), ('{"values": {"servo_id": ' + "9" * 5000 + "}}", "json"),
     ('{"description": "\\ud800", "values": {"smoothing": true}}', "json"),
     ("[values]\nangle_limit_cw = nan\n", "toml"),
     ("[values]\ntimeout_time = " + "9" * 4000 + "\n", "toml"), ("[values]\nsmoothing = 1979-05-27\n", "toml")],
    ids=["deep JSON", "deep TOML", "long number", "half a character", "NaN", "large number", "a date"],
)  # fmt: skip
def test_a_hostile_file_is_refused_with_a_reason(text: str, form: Form) -> None:
    found = read(text, form)
    assert found.draft is None
    assert any(one.verdict in ("invalid", "out_of_range") and one.text for one in found.lines)


def test_the_file_has_groups_labels_and_units() -> None:
    assert profile_file.to_toml(GRIPPER, CATALOG) == GRIPPER_TOML
    assert tomllib.loads(GRIPPER_TOML)["values"] == dict(GRIPPER.values)
    assert json.loads(profile_file.to_json(GRIPPER))["values"] == dict(GRIPPER.values)


@pytest.mark.parametrize(
    ("old", "new", "key", "line", "verdict"),
    [
        ("soft_start = false", "soft_stert = false", "soft_stert", 13, "unknown"),
        ("soft_start = false", "soft_start = 0", "soft_start", 13, "invalid"),
        ("soft_start = false", "boot_loader = 1", "boot_loader", 13, "forbidden"),
        ("soft_start = false", '"0x49" = 1', "0x49", 13, "forbidden"),
        ("soft_start = false", '"0x47" = 1', "0x47", 13, "forbidden"),
        ("soft_start = false", "initialize = 1", "initialize", 13, "forbidden"),
        ("soft_start = false", "command_angle = 10.0", "command_angle", 13, "forbidden"),
        ("soft_start = false", "current_angle = 10.0", "current_angle", 13, "read_only"),
        ("soft_start = false", "servo_id = 7", "servo_id", 13, "identity"),
        ('"off"', '"limp"', "timeout_action", 14, "invalid"),
        ("angle_limit_cw = 60.0", "angle_limit_cw = 60.05", "angle_limit_cw", 21, "invalid"),
        ("angle_limit_cw = 60.0", "angle_limit_cw = 1e9", "angle_limit_cw", 21, "out_of_range"),
        ("angle_limit_cw = 60.0", "angle_limit_cw = [1]", "angle_limit_cw", 21, "invalid"),
        ('"BLA21-06U-AB"', '"BLA21-06U-A0"', "pwm_mode", 18, "not_in_this_model"),
        ('"1.300"', '"1.010"', "pwm_mode", 18, "not_in_this_model"),
        ('"BLA21-06U-AB"', '"BLA99"', "model", 6, "invalid"),
        ('"1.300"', '"new"', "firmware", 7, "invalid"),
        ('model = "BLA', 'modell = "BLA', "modell", 6, "unknown"),
        ('"Left hand"', "3", "description", 5, "invalid"),
        ('angle_limit_ccw = "°"', 'angle_limit_ccw = "rad"', "angle_limit_ccw", 22, "invalid"),
        ('angle_limit_ccw = "°"', 'torque_limit_cw = "%"', "torque_limit_cw", 27, "invalid"),
        ('pwm_mode = "speed"', 'pwm_mode = "angle"', "pwm_output_range", 17, "invalid"),
        ("[values]", "[value]", "values", 0, "invalid"),
        ("soft_start = false", "soft_start == false", "", 13, "invalid"),
        ("soft_start = false", 'timeout_action = "off"', "", 14, "invalid"),
    ],
)  # fmt: skip
def test_each_mistake_has_a_verdict_on_its_line(old: str, new: str, key: str, line: int, verdict: str) -> None:
    wrong = edited((old, new))
    assert (key, line, verdict) in [(one.key, one.line, one.verdict) for one in wrong]
    assert all(len(one.text) > 15 for one in wrong)


def test_two_mistakes_have_two_verdicts() -> None:
    wrong = edited(("= false", "= 3"), ("= 90 ", "= 900000 "))
    assert [(one.key, one.verdict) for one in wrong] == [
        ("soft_start", "invalid"),
        ("pwm_output_range", "out_of_range"),
    ]


def test_another_schema_revision_is_noted_and_accepted() -> None:
    found = read(GRIPPER_TOML.replace(CATALOG.revision, "0123456789ab"))
    assert found.draft is not None
    (line,) = [one for one in found.lines if one.key == "schema_revision"]
    assert (line.verdict, line.line) == ("ok", 8)
    assert CATALOG.revision in line.text


@pytest.mark.parametrize(
    "text",
    ["values = { smoothing = true, timeout_time = 500 }\n", "values.smoothing = true\nvalues.timeout_time = 500\n",
     '[ "values" ]\n  smoothing=true\n"timeout_time" = 5_00\n',
     "[values]\r\nsmoothing = true\r\ntimeout_time = 500\r\n"],
)  # fmt: skip
def test_toml_in_another_layout_is_read(text: str) -> None:
    found = read(text)
    assert found.draft is not None
    assert dict(found.draft.values) == {"smoothing": True, "timeout_time": 500}
    assert all(one.line > 0 for one in found.lines)


def test_a_key_inside_a_multi_line_text_is_ignored() -> None:
    found = read('description = """\n[values]\nsmoothing = 1\n"""\n[values]\nsmoothing = 2\n')
    (line,) = [one for one in found.lines if one.key == "smoothing"]
    assert (line.line, line.verdict) == (6, "invalid")


def test_json_with_a_duplicate_key_is_refused() -> None:
    found = read('{"values": {"smoothing": true, "smoothing": false}}', "json")
    assert found.draft is None
    assert "duplicate" in found.lines[0].text


def test_without_a_model_a_value_must_be_valid_for_at_least_one() -> None:
    def verdict(values: dict[str, Any], **more: Any) -> str:
        (one,) = PROFILES.check(Draft(values, **more))
        return one.verdict

    lower = CATALOG.models["BLA21-28U-A0"].rows()["voltage_limit_lower"]
    high = (lower.maximum or 0) / lower.per_unit
    assert verdict({"voltage_limit_lower": high}) == "ok"
    assert verdict({"voltage_limit_lower": high}, model="BLA21-06U-A0") == "out_of_range"
    assert verdict({"voltage_limit_lower": high + 1}) == "out_of_range"


@pytest.mark.parametrize(
    ("text", "form"),
    [
        ("[values]\nsmoothing = true\n" + " " * 200_000 + "\n", "toml"),
        ("[values]\nsmoothing = [\n[" + " " * 200_000 + "\n]]\n", "toml"),
        ("a." * 100_000 + "a = 1", "toml"),
        ("[values]\n" + "".join(f"a{n} = 1\n" for n in range(20_000)), "toml"),
        ('{"values": {' + ",".join(f'"a{n}":1' for n in range(20_000)) + "}}", "json"),
        ('{"values": {"a": [' + '"a"  ,' * 40_000 + "1]}}", "json"),
    ],
    ids=["blanks", "blanks in a bracket", "dots", "many keys", "many keys in JSON", "many texts in JSON"],
)
def test_no_file_blocks_the_loop(text: str, form: Form) -> None:
    assert len(text) < 256 * 1024
    began = time.process_time()
    assert read(text, form).lines
    assert time.process_time() - began < 2.0  # most take some ms

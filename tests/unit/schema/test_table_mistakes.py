"""A mistake in a table is refused on loading, with the file and the row."""

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hornbill import resources
from hornbill.errors import TableError
from hornbill.schema.catalog import Catalog

Refusal = Callable[[str, str, str], TableError]
Case = tuple[str, str, str, str, str | None, str]
"""File, pattern in it, replacement, reported file and row, words of the message."""
FILE = "parameters.toml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the tables."""
    return shutil.copytree(resources.schemas(), tmp_path / "schemas")


@pytest.fixture
def refusal(folder: Path) -> Refusal:
    """Replaces a pattern once in a file of a copy of the tables. Returns the error of loading it."""

    def spoil(file: str, pattern: str, replacement: str) -> TableError:
        before = (folder / file).read_text(encoding="utf-8")
        after, count = re.subn(pattern, replacement, before, count=1)
        assert count == 1
        assert after != before
        (folder / file).write_text(after, encoding="utf-8")
        with pytest.raises(TableError) as caught:
            Catalog.load(folder)
        return caught.value

    return spoil


PWM_MODE = 'parameter = "pwm_mode", raw = 1'
UNIT_WHEN = f'unit_when = {{ {PWM_MODE}, unit = "", per_unit = 1 }}'

# row, text in it, replacement, message
ROWS = [
    ("soft_start", "default = 1", "default = 1.0", "`default`: Input should be a valid integer"),
    ("soft_start", "default = 1", 'default = "1"', "`default`: Input should be a valid integer"),
    ("soft_start", "default = 1", "default = true", "`default`: Input should be a valid integer"),
    ("soft_start", "default = 1", "colour = 1", "`colour` is not a field of this table"),
    ("soft_start", "default = 1", "default = 2", "default 2 is outside 0 to 1"),
    ("soft_start", "maximum = 1", "maximum = 2", "a switch must have the range 0 to 1"),
    ("soft_start", 'label = "Soft start"', "", "`label` is missing"),
    ("soft_start", 'label = "Soft start"', 'label = ""', "`label`"),
    ("soft_start", 'kind = "switch"', 'kind = "toggle"', "`kind`"),
    ("soft_start", 'access = "rw"', 'access = "wr"', "`access`"),
    ("soft_start", 'section = "4.14"', 'section = "p. 22"', "`section`"),
    ("soft_start", 'group = "configuration"', 'group = "start"', "unknown group start"),
    ("pwm", 'label = "PWM input"', 'title = "PWM input"', "`label` is missing"),
    ("angle_boost", 'since = "1.200"', 'since = "1.250"', "1.250 is not one of 1.010, 1.100, 1.200, 1.300"),
    ("angle_boost", 'since = "1.200"', 'since = "1.2"', "`since`"),
    ("angle_boost", "per_unit = 10", "per_unit = 0", "`per_unit`"),
    ("timeout_time", "minimum = 1\n", "", "needs default, minimum and maximum"),
    ("timeout_time", "default = 1_000\n", "", "needs default, minimum and maximum"),
    ("timeout_time", "minimum = 1\n", "minimum = 70_000\n", "minimum 70000 is above maximum 60000"),
    ("current_speed", "minimum = -300\n", "", "minimum and maximum require each other"),
    ("torque_mode", "maximum = 2", "maximum = 3", "not every value from 0 to 3 has a choice"),
    ("torque_mode", '"Brake", raw = 2', '"Brake", raw = 1', "two choices share"),
    ("torque_mode", '"brake", label', '"off", label', "two choices share"),
    ("torque_mode", 'kind = "choice"\n', "", "choices are required for"),
    ("reverse", 'kind = "switch"\n', 'kind = "choice"\n', "choices are required for"),
    ("reverse", 'kind = "switch"\n', f'kind = "switch"\n{UNIT_WHEN}\n', "unit_when is allowed only for numbers"),
    ("pwm_output_range", PWM_MODE, 'parameter = "pwm_mood", raw = 1', "pwm_mood never has the value 1"),
    ("pwm_output_range", PWM_MODE, 'parameter = "pwm_mode", raw = 2', "pwm_mode never has the value 2"),
    ("speed_p_gain", "expert = true\n", "", "advice is required for expert rows"),
    ("angle_p_gain", 'label = "Angle P gain"\n', 'label = "Gain"\nexpert = true\n', "advice is required for expert"),
    ("boot_loader", "forbidden = true\n", "", "only 0x49 must be marked forbidden"),
    ("boot_loader", "address = 0x49\n", "address = 0x4A\n", "only 0x49 must be marked forbidden"),
    ("node_id", "identity = true\n", "forbidden = true\n", "only 0x49 must be marked forbidden"),
]  # fmt: skip

# pattern, replacement, row, message
PLACES = [
    ('key = "soft_start"', 'key = "Soft start"', "Soft start", "`key`"),
    ('key = "soft_start"', "", "17 of [[parameter]]", "`key` is missing"),
    ('key = "soft_start"', 'key = "smoothing"', "smoothing", "key smoothing is used by row smoothing already"),
    ("address = 0x21", "address = 0x22", "smoothing", "address 0x22 is used by row soft_start already"),
    ("address = 0x5C", "address = 0x60", "production_minute", "`address`"),
    ('key = "pwm"', 'key = "limit"', "limit", "key limit is used by row limit already"),
    ("(?m)^specification.*$", "", None, "`specification` is missing"),
    ("(?m)^specification =", "spec = 1\nspecification =", None, "`spec` is not a field of this table"),
    ("specification = ", "specification == ", None, "not valid TOML"),
    ('version = "1.300"', 'version = "1.600"', None, "oldest first"),
    ('version = "1.300"', 'version = "1.200"', None, "list each version once"),
    ('first = "2024-01"', 'first = "2024-13"', "4 of [[firmware]]", "`first`"),
]


# Series and models.

SERIES, MODEL, PLAIN = "series/bla21.toml", "models/bla21-06u-ab.toml", "models/bla21-06u-a0.toml"

# row of the overlay, its replacement, reported row, message
OVERLAYS = [
    ("angle_p_gain", "angle_q_gain = { default = 40 }", "angle_q_gain", "unknown parameter"),
    ("angle_p_gain", 'angle_p_gain = { unit = "Nm" }', "angle_p_gain", "maximum, not `unit`"),
    ("angle_p_gain", "angle_p_gain = { address = 0x2D }", "angle_p_gain", "not `address`"),
    ("angle_p_gain", 'angle_p_gain = { key = "p_gain" }', "angle_p_gain", "not `key`"),
    ("angle_p_gain", "angle_p_gain = { default = 400, minimum = 1, maximum = 100 }", "angle_p_gain", "default 400"),
    ("angle_p_gain", "angle_p_gain = { default = 40.0 }", "angle_p_gain", "`default`"),
    ("angle_p_gain", "angle_p_gain = 40", "angle_p_gain", "valid dictionary"),
    ("angle_p_gain", "torque_limit_cw = { default = 101 }", "torque_limit_cw", "default 101 is outside 0 to 100"),
    ("angle_p_gain", "model_number = { default = 63 }", "model_number", "given by model_number in the series file"),
    ("angle_p_gain", "boot_loader = { default = 1 }", "boot_loader", "a forbidden row cannot be overridden"),
]  # fmt: skip

# file, pattern, replacement, reported file and row, message
IDENTITIES = [
    (SERIES, "model_number = 61\n", "", SERIES, None, "`model_number` is missing"),
    (SERIES, "model_number = 61", "model_number = 62", SERIES, None, "model_number 62 is used by BLA15"),
    (SERIES, 'name = "BLA21"', 'name = "BLA15"', SERIES, None, "series BLA15 is in two files"),
    (MODEL, "hardware_version = 6050\n", "", MODEL, None, "`hardware_version` is missing"),
    (MODEL, "hardware_version = 6050", "hardware_version = 6010", MODEL, None, "has the identity of BLA21-06U-A0"),
    (MODEL, '"BLA21-06U-AB"', '"BLA21-06U-A0"', MODEL, None, "model BLA21-06U-A0 is in two files"),
    (MODEL, 'series = "BLA21"', 'series = "BLA22"', MODEL, None, "unknown series BLA22"),
    (MODEL, '"7.4 V"', '"8 V"', MODEL, None, "`voltage_class`"),
    (MODEL, "pwm = true", "pwm = 1", MODEL, None, "`pwm`"),
    (MODEL, "pwm = true", "pwm = false", MODEL, "pwm_neutral", "without PWM input, minimum and maximum must be 0"),
    (PLAIN, "(?m)^pwm_mode .*$", "", PLAIN, "pwm_mode", "without PWM input, minimum and maximum must be 0"),
    (MODEL, '"1.100", "1.200"', '"1.100", "1.250"', MODEL, None, "firmware 1.250 is not one of"),
    (MODEL, '"1.100", "1.200"', '"1.200", "1.100"', MODEL, None, "oldest first"),
    (MODEL, r"firmware = \[.*\]", "firmware = []", MODEL, None, "`firmware`"),
    (MODEL, "(?m)^overcurrent_limit .*$", "", MODEL, "overcurrent_limit", "needs default, minimum and maximum"),
    (MODEL, "default = 120, minimum = 60", "default = 59, minimum = 60", MODEL, "overcurrent_limit", "default 59"),
    (MODEL, r"\[rows\]", "[rows]\nhardware_version = { default = 1 }", MODEL, "hardware_version", "given by"),
    (MODEL, r"\[rows\]", "[rows]\norigin = { maximum = 1_800, step = 2 }", MODEL, "origin", "not `step`"),
    (SERIES, "(?m)^angle_p_gain .*$", "", PLAIN, "angle_p_gain", "after series BLA21 and the common row"),
]  # fmt: skip


# Fault bits and effect rules.

# text in faults.toml (first occurrence), replacement, row, message
FAULTS = [
    ('parameter = "fault_warning"', 'parameter = "fault_caution"', "sensor_weak", "does not contain warning bits"),
    ('parameter = "fault_overview"', 'parameter = "fault_notification"', "hardware_notification", "[[overview]]"),
    ('limit = "angle_limit_cw"', 'limit = "angle_limit"', "angle_limit_cw_reached", "unknown parameter angle_limit"),
    ("bit = 15", "bit = 11", "rom_lost", "bit 11 of fault_warning is used by row voltage_low already"),
    ("bit = 15", "bit = 16", "rom_lost", "bit 16 belongs to communication, not software"),
    ("bit = 15", "bit = 32", "rom_lost", "`bit`"),
    ("bit = 26", "bit = 25", "other_failure", "overview bit 25 does not summarize failure bits"),
    ("bit = 26", "bit = 27", "other_failure", "overview bit 27 does not summarize failure bits"),
    ('level = "failure"\ngroup = "other"', 'level = "fatal"\ngroup = "other"', "other_failure", "`level`"),
    ('key = "rom_lost"', 'key = "voltage_low"', "voltage_low", "key voltage_low is used by row voltage_low already"),
    ('key = "rom_lost"', 'key = "rom_lost"\nsticky = true', "rom_lost", "`sticky` is not a field of this table"),
    ("latching = true", "latching = 1", "rom_lost", "`latching`"),
]  # fmt: skip

TIMEOUT = 'parameter = "timeout_action", reads = [0]'

# text in effects.toml, replacement, message
EFFECTS = [
    ('["angle_dead_band"]', '["dead_band"]', "unknown parameter dead_band"),
    ('["angle_dead_band"]', '["reboot"]', "unknown parameter reboot"),
    ('["angle_dead_band"]', '["boot_loader"]', "unknown parameter boot_loader"),
    ('["angle_dead_band"]', "[]", "`parameters`"),
    (TIMEOUT, 'parameter = "timeout", reads = [0]', "unknown parameter timeout"),
    (TIMEOUT, 'parameter = "timeout_action", reads = [3]', "timeout_action never has the value 3"),
    (TIMEOUT, 'parameter = "speed_torque_control", reads = [2]', "speed_torque_control never has the value 2"),
    (TIMEOUT, 'parameter = "speed_i_gain", reads = [-1]', "speed_i_gain never has the value -1"),
    (TIMEOUT, 'parameter = "timeout_action"', "either parameter and reads, or last_command"),
    (TIMEOUT, f'{TIMEOUT}, last_command = ["angle"]', "either parameter and reads, or last_command"),
    (TIMEOUT, "reads = [0]", "either parameter and reads, or last_command"),
    ('last_command = ["angle"]', 'last_command = ["pwm"]', "last_command"),
    ('unless_row = "pwm_neutral"', 'unless_row = "pwm"', "unknown parameter pwm"),
    ("the timeout action", "{action}", "the only placeholder is {last_command}"),
    ("the timeout action", "{last_command}", "the only placeholder is {last_command}"),
]


def cases() -> Iterator[Case]:
    """All mistakes that are reported with their row."""
    for row, old, new, words in ROWS:
        inside = rf'(?s)(\nkey = "{row}"\n(?:(?!\n\[\[).)*?){re.escape(old)}'
        yield FILE, inside, rf"\g<1>{new}", FILE, row, words
    for pattern, replacement, named, words in PLACES:
        yield FILE, pattern, replacement, FILE, named, words
    for row, line, named, words in OVERLAYS:
        yield SERIES, rf"(?m)^{row} .*$", line, SERIES, named, words
        yield MODEL, r"\[rows\]", f"[rows]\n{line}", MODEL, named, words
    yield from IDENTITIES
    for old, new, row, words in FAULTS:
        yield "faults.toml", re.escape(old), new, "faults.toml", row, words
    no_bits = r'(key = "fault_warning"\n(?:.+\n)*?)kind = "bits"'
    yield FILE, no_bits, r'\g<1>kind = "number"', "faults.toml", "sensor_weak", "unknown fault parameter fault_warning"


@pytest.mark.parametrize(("file", "pattern", "replacement", "blamed", "row", "words"), [*cases()])
def test_a_mistake_is_refused_with_its_file_and_row(
    refusal: Refusal, file: str, pattern: str, replacement: str, blamed: str, row: str | None, words: str
) -> None:
    error = refusal(file, pattern, replacement)
    assert error.facts == {"cause": "table_invalid", "file": blamed, "row": row}
    assert error.detail.startswith(f"{blamed}, row {row}: " if row else f"{blamed}: ")
    assert words in error.detail


@pytest.mark.parametrize(("old", "new", "words"), EFFECTS)
def test_a_mistake_in_an_effect_rule_is_refused_with_its_number(
    refusal: Refusal, old: str, new: str, words: str
) -> None:
    error = refusal("effects.toml", re.escape(old), new)
    assert error.facts["file"] == "effects.toml"
    assert re.fullmatch(r"\d+ of \[\[effect\]\]", str(error.facts["row"]))
    assert words in error.detail


@pytest.mark.parametrize(
    ("name", "message"),
    [(name, "the file is missing") for name in ("parameters.toml", "faults.toml", "effects.toml")]
    + [(name, "the folder is missing or empty") for name in ("series", "models")],
)
def test_a_missing_file_or_folder(folder: Path, name: str, message: str) -> None:
    (folder / name).rename(folder.parent / name)
    with pytest.raises(TableError, match=f"{name}: {message}"):
        Catalog.load(folder)


def test_a_file_that_is_not_text(folder: Path) -> None:
    (folder / "faults.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TableError, match=r"faults\.toml: the file cannot be read"):
        Catalog.load(folder)

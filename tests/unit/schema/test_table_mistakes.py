"""A mistake in parameters.toml is refused when the tables are loaded, with the row it is in."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from hornbill import resources
from hornbill.errors import TableError
from hornbill.schema.catalog import Catalog

Refusal = Callable[[str, str, str], TableError]
FILE = "parameters.toml"

PWM_MODE = 'parameter = "pwm_mode", raw = 1'
UNIT_WHEN = f'unit_when = {{ {PWM_MODE}, unit = "", per_unit = 1 }}'

# row, what stands in it, what stands there instead, what the message says
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

# pattern, replacement, row, what the message says
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


@pytest.mark.parametrize(("row", "old", "new", "words"), ROWS)
def test_a_mistake_in_a_row(refusal: Refusal, row: str, old: str, new: str, words: str) -> None:
    inside = rf'(?s)(\nkey = "{row}"\n(?:(?!\n\[\[).)*?){re.escape(old)}'
    error = refusal(FILE, inside, rf"\g<1>{new}")
    assert error.facts == {"cause": "table_invalid", "file": FILE, "row": row}
    assert error.detail.startswith(f"{FILE}, row {row}: ")
    assert words in error.detail


@pytest.mark.parametrize(("pattern", "replacement", "row", "words"), PLACES)
def test_a_mistake_in_the_file(refusal: Refusal, pattern: str, replacement: str, row: str | None, words: str) -> None:
    error = refusal(FILE, pattern, replacement)
    assert error.facts == {"cause": "table_invalid", "file": FILE, "row": row}
    assert error.detail.startswith(f"{FILE}, row {row}: " if row else f"{FILE}: ")
    assert words in error.detail


@pytest.mark.parametrize(
    ("name", "message"),
    [(name, "the file is missing") for name in ("parameters.toml", "faults.toml", "effects.toml")]
    + [(name, "the folder is missing or empty") for name in ("series", "models")],
)
def test_a_missing_file_or_folder(tmp_path: Path, name: str, message: str) -> None:
    folder = tmp_path / "schemas"
    shutil.copytree(resources.schemas(), folder, ignore=shutil.ignore_patterns(name))
    with pytest.raises(TableError, match=f"{name}: {message}"):
        Catalog.load(folder)


def test_a_file_that_is_not_text(tmp_path: Path) -> None:
    folder = tmp_path / "schemas"
    shutil.copytree(resources.schemas(), folder)
    (folder / "faults.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TableError, match=r"faults\.toml: the file cannot be read"):
        Catalog.load(folder)

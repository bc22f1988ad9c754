"""A mistake in a series or a model is refused when the tables are loaded, with file and row."""

from collections.abc import Callable

import pytest

from hornbill.errors import TableError

Refusal = Callable[[str, str, str], TableError]
SERIES, MODEL, PLAIN = "series/bla21.toml", "models/bla21-06u-ab.toml", "models/bla21-06u-a0.toml"

# row of the overlay, what it is made into, row named, what the message says
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

# file, pattern, replacement, file and row blamed, what the message says
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


@pytest.mark.parametrize(("row", "line", "named", "words"), OVERLAYS)
@pytest.mark.parametrize("file", [SERIES, MODEL])
def test_a_mistake_in_an_overlay(refusal: Refusal, file: str, row: str, line: str, named: str, words: str) -> None:
    places = {SERIES: (rf"(?m)^{row} .*$", line), MODEL: (r"\[rows\]", f"[rows]\n{line}")}
    error = refusal(file, *places[file])
    assert error.facts == {"cause": "table_invalid", "file": file, "row": named}
    assert error.detail.startswith(f"{file}, row {named}: ")
    assert words in error.detail


@pytest.mark.parametrize(("file", "pattern", "replacement", "blamed", "row", "words"), IDENTITIES)
def test_a_mistake_in_the_identity_of_a_model(
    refusal: Refusal, file: str, pattern: str, replacement: str, blamed: str, row: str | None, words: str
) -> None:
    error = refusal(file, pattern, replacement)
    assert error.facts == {"cause": "table_invalid", "file": blamed, "row": row}
    assert words in error.detail

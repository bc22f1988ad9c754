"""A mistake in a fault bit or an effect rule is refused when the tables are loaded, with the row it is in."""

import re
from collections.abc import Callable

import pytest

from hornbill.errors import TableError

Refusal = Callable[[str, str, str], TableError]

# what stands in faults.toml (its first place), what stands there instead, row, what the message says
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

# what stands in effects.toml, what stands there instead, what the message says
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


@pytest.mark.parametrize(("old", "new", "row", "words"), FAULTS)
def test_a_mistake_in_a_fault_bit(refusal: Refusal, old: str, new: str, row: str, words: str) -> None:
    error = refusal("faults.toml", re.escape(old), new)
    assert error.facts == {"cause": "table_invalid", "file": "faults.toml", "row": row}
    assert words in error.detail


def test_a_detail_bit_of_a_register_without_bits(refusal: Refusal) -> None:
    error = refusal("parameters.toml", r'(key = "fault_warning"\n(?:.+\n)*?)kind = "bits"', r'\g<1>kind = "number"')
    assert error.facts == {"cause": "table_invalid", "file": "faults.toml", "row": "sensor_weak"}
    assert "unknown fault parameter fault_warning" in error.detail


@pytest.mark.parametrize(("old", "new", "words"), EFFECTS)
def test_a_mistake_in_an_effect_rule(refusal: Refusal, old: str, new: str, words: str) -> None:
    error = refusal("effects.toml", re.escape(old), new)
    assert error.facts["file"] == "effects.toml"
    assert re.fullmatch(r"\d+ of \[\[effect\]\]", str(error.facts["row"]))
    assert words in error.detail

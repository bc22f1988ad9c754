"""The numbers of the specification, copied manually from its tables, compared with the loaded tables."""

import pytest

from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter

CATALOG = Catalog.load()

NONE = None
ANGLE = 360_000_000
ALL_BITS = 2**32 - 1

# Tables 3-1 to 3-11: address, access, unit, counts per unit, default, minimum, maximum.
# "model" stands where the specification refers to the model tables at the end of section 3.1.
LISTS = {
    "command_angle": (0x00, "rw", "°", 10, 0, -ANGLE, ANGLE),
    "command_speed": (0x01, "rw", "rpm", 1, "model"),
    "command_torque": (0x02, "rw", "%", 1, 0, -100, 100),
    "current_angle": (0x08, "r", "°", 10, NONE, -ANGLE, ANGLE),
    "current_speed": (0x09, "r", "rpm", 1, NONE, -300, 300),
    "current_torque": (0x0A, "r", "%", 1, NONE, -150, 150),
    "current_temperature": (0x0B, "r", "°C", 1, NONE, -40, 120),
    "current_voltage": (0x0C, "r", "V", 10, NONE, 0, 500),
    "initialize": (0x10, "w", "", 1, 0, 0, 1),
    "reboot": (0x11, "w", "", 1, 0, 0, 1),
    "write_rom": (0x12, "w", "", 1, 0, 0, 1),
    "fault_overview": (0x18, "r", "", 1, 0, 0, ALL_BITS),
    "fault_notification": (0x19, "r", "", 1, 0, 0, ALL_BITS),
    "fault_warning": (0x1A, "r", "", 1, 0, 0, ALL_BITS),
    "fault_failure": (0x1B, "r", "", 1, 0, 0, ALL_BITS),
    "torque_mode": (0x20, "rw", "", 1, 0, 0, 2),
    "soft_start": (0x21, "rw", "", 1, 1, 0, 1),
    "smoothing": (0x22, "rw", "", 1, 1, 0, 1),
    "reverse": (0x23, "rw", "", 1, 0, 0, 1),
    "extended_angle": (0x24, "rw", "", 1, 0, 0, 1),
    "speed_torque_control": (0x25, "rw", "", 1, 0, 0, 1),
    "timeout_action": (0x26, "rw", "", 1, 1, 0, 2),
    "timeout_time": (0x27, "rw", "ms", 1, 1_000, 1, 60_000),
    "overcurrent_limit": (0x2A, "rw", "A", 10, "model"),
    "angle_p_gain": (0x2C, "rw", "", 1, "model"),
    "angle_d_gain": (0x2D, "rw", "", 1, "model"),
    "angle_dead_band": (0x2E, "rw", "°", 10, "model"),
    "angle_boost": (0x2F, "rw", "%", 10, "model"),
    "speed_p_gain": (0x30, "rw", "", 1, "model"),
    "speed_i_gain": (0x31, "rw", "", 1, "model"),
    "speed_dead_band": (0x32, "rw", "", 1, "model"),
    "speed_i_limit": (0x33, "rw", "", 1, "model"),
    "pwm_neutral": (0x34, "rw", "µs", 1, "model"),
    "pwm_range": (0x35, "rw", "µs", 1, "model"),
    "pwm_output_range": (0x36, "rw", "°", 10, "model"),
    "pwm_mode": (0x37, "rw", "", 1, "model"),
    "angle_limit_cw": (0x38, "rw", "°", 10, 1_799, 0, ANGLE),
    "angle_limit_ccw": (0x39, "rw", "°", 10, -1_800, -ANGLE, 0),
    "speed_limit_cw": (0x3A, "rw", "rpm", 1, "model"),
    "speed_limit_ccw": (0x3B, "rw", "rpm", 1, "model"),
    "torque_limit_cw": (0x3C, "rw", "%", 1, 100, 0, 100),
    "torque_limit_ccw": (0x3D, "rw", "%", 1, -100, -100, 0),
    "temperature_limit_upper": (0x3E, "rw", "°C", 1, 80, 20, 80),
    "temperature_limit_lower": (0x3F, "rw", "°C", 1, -40, -40, 20),
    "voltage_limit_upper": (0x40, "rw", "V", 10, "model"),
    "voltage_limit_lower": (0x41, "rw", "V", 10, "model"),
    "origin": (0x44, "rw", "°", 10, 0, -1_800, 1_799),
    "servo_id": (0x45, "rw", "", 1, 0, 0, 254),
    "node_id": (0x46, "rw", "", 1, 0, 0, 127),
    "boot_loader": (0x49, "rw", "", 1, 0, NONE, NONE),
    "model_number": (0x50, "r", "", 1, "model"),
    "product_number": (0x51, "r", "", 1, NONE, NONE, NONE),
    "firmware_version": (0x52, "r", "", 1, 1000, NONE, NONE),
    "hardware_version": (0x53, "r", "", 1, "model"),
    "production_year": (0x58, "r", "", 1, NONE, NONE, NONE),
    "production_month": (0x59, "r", "", 1, NONE, NONE, NONE),
    "production_day": (0x5A, "r", "", 1, NONE, NONE, NONE),
    "production_hour": (0x5B, "r", "", 1, NONE, NONE, NONE),
    "production_minute": (0x5C, "r", "", 1, NONE, NONE, NONE),
}

Numbers = tuple[int | None, int | None, int | None]

# The unnumbered tables after 3-11. Default, minimum, maximum.
BLA21: dict[int, Numbers] = {
    0x01: (0, -300, 300),
    0x2C: (40, 1, 100),
    0x2D: (40, 0, 100),
    0x2E: (3, 0, 3600),
    0x2F: (0, 0, 100),
    0x30: (50, 1, 100),
    0x31: (1, 0, 100),
    0x32: (600, 0, 2000),
    0x33: (2000, 1, 500000),
    0x3A: (300, 0, 300),
    0x3B: (-300, -300, 0),
    0x50: (61, NONE, NONE),
}
BLA15: dict[int, Numbers] = {
    0x01: (0, -150, 150),
    0x2C: (60, 1, 100),
    0x2D: (30, 0, 100),
    0x2E: (3, 0, 3600),
    0x2F: (30, 0, 100),
    0x30: (15, 1, 100),
    0x31: (1, 0, 100),
    0x32: (300, 0, 2000),
    0x33: (25000, 1, 500000),
    0x3A: (150, 0, 300),
    0x3B: (-150, -300, 0),
    0x50: (62, NONE, NONE),
}
# Revision 1.11. Register, BLA34-12U-AB, BLA34-28U-AB; default / minimum / maximum.
BLA34 = """
01   0/-80/80           0/-80/80
2A   63/35/63           24/16/24
2C   50/1/100           50/1/100
2D   1/0/100            1/0/100
2E   3/0/3600           3/0/3600
2F   0/0/100            0/0/100
30   25/1/100           10/1/100
31   50/0/100           10/0/100
32   600/0/2000         600/0/2000
33   300/1/500000       680/1/500000
34   1520/100/10000     1520/100/10000
35   1100/10/10000      1100/10/10000
36   1100/0/3600        1100/0/3600
37   0/0/1              0/0/1
3A   80/0/80            80/0/80
3B   -80/-80/0          -80/-80/0
40   200/120/240        400/280/400
41   40/35/120          40/35/280
"""


def bla34(column: int, hardware: int) -> dict[int, Numbers]:
    """One column of that table, with the identity of the servo."""
    lines = [line.split() for line in BLA34.strip().splitlines()]
    found: dict[int, Numbers] = {0x50: (86, NONE, NONE), 0x53: (hardware, NONE, NONE)}
    for line in lines:
        default, low, high = map(int, line[column].split("/"))
        found[int(line[0], 16)] = default, low, high
    return found


PWM: dict[int, Numbers] = {
    0x34: (1520, 100, 10000),
    0x35: (700, 10, 10000),
    0x36: (700, 0, 3600),
    0x37: (0, 0, 1),
}
NO_PWM: dict[int, Numbers] = {0x34: (0, 0, 0), 0x35: (0, 0, 0), 0x36: (0, 0, 0), 0x37: (0, 0, 0)}

BLA21_06: dict[int, Numbers] = {0x2A: (120, 60, 120), 0x40: (100, 74, 120), 0x41: (40, 35, 74)}
BLA21_12: dict[int, Numbers] = {0x2A: (63, 35, 70), 0x40: (200, 120, 240), 0x41: (40, 35, 120)}
BLA21_28: dict[int, Numbers] = {0x2A: (24, 16, 32), 0x40: (400, 280, 500), 0x41: (40, 35, 280)}
BLA15_06: dict[int, Numbers] = {0x2A: (21, 10, 30), 0x40: (100, 74, 120), 0x41: (40, 35, 74)}
BLA15_12: dict[int, Numbers] = {0x2A: (10, 7, 15), 0x40: (200, 120, 240), 0x41: (40, 35, 120)}

MODELS: dict[str, dict[int, Numbers]] = {
    "BLA21-06U-A0": {**BLA21, **NO_PWM, **BLA21_06, 0x53: (6010, NONE, NONE)},
    "BLA21-06U-AB": {**BLA21, **PWM, **BLA21_06, 0x53: (6050, NONE, NONE)},
    "BLA21-12U-A0": {**BLA21, **NO_PWM, **BLA21_12, 0x53: (12010, NONE, NONE)},
    "BLA21-12U-AB": {**BLA21, **PWM, **BLA21_12, 0x53: (12050, NONE, NONE)},
    "BLA21-28U-A0": {**BLA21, **NO_PWM, **BLA21_28, 0x53: (28010, NONE, NONE)},
    "BLA21-28U-AB": {**BLA21, **PWM, **BLA21_28, 0x53: (28050, NONE, NONE)},
    "BLA15-06U-A0": {**BLA15, **NO_PWM, **BLA15_06, 0x53: (6010, NONE, NONE)},
    "BLA15-12U-A0": {**BLA15, **NO_PWM, **BLA15_12, 0x53: (12010, NONE, NONE)},
    "BLA34-12U-AB": bla34(1, 12050),
    "BLA34-28U-AB": bla34(2, 28050),
}

# Section 5: the registers that each version added.
ADDED: dict[int, set[int]] = {
    1010: set(), 1100: {0x25, 0x2A, 0x34, 0x35, 0x36, 0x37}, 1200: {0x2F}, 1300: set(), 1400: set(), 1500: set(),
}  # fmt: skip
# Which models were built with which, and from when until when.
A0 = {"BLA21-06U-A0", "BLA21-12U-A0", "BLA21-28U-A0", "BLA15-06U-A0"}
AB = {"BLA21-06U-AB", "BLA21-12U-AB", "BLA21-28U-AB"}
SHIPPED = {
    "1.010": A0, "1.100": AB, "1.200": AB | {"BLA15-12U-A0"}, "1.300": A0 | AB | {"BLA15-12U-A0"},
    "1.400": A0 | AB | {"BLA15-12U-A0"}, "1.500": {"BLA34-12U-AB", "BLA34-28U-AB"},
}  # fmt: skip
MONTHS = {
    "1.010": ("2021-05", "2023-12"), "1.100": ("2021-10", "2022-04"), "1.200": ("2022-09", "2023-12"),
    "1.300": ("2024-01", "2024-05"), "1.400": ("2024-06", None), "1.500": ("2025-05", None),
}  # fmt: skip
LATE = {0x25, 0x2A, 0x2F, 0x34, 0x35, 0x36, 0x37}
NEVER_ROWS = {0x10, 0x11, 0x12, 0x49}

# Section 4.12, by register: bit numbers with a meaning.
BITS = {
    "fault_overview": {0, 1, 2, 8, 9, 10, 16, 17, 18, 24, 25, 26},
    "fault_notification": {8, 9, 10, 11, 12, 13, 20, 21, 22},
    "fault_warning": {4, 5, 8, 9, 10, 11, 15},
    "fault_failure": {0, 1, 5, 8, 9, 11},
}
# Not in the specification, but named in the maker's program.
OLDER_BITS = {"fault_warning": {6, 14}, "fault_failure": {4, 10}}


def numbers(row: Parameter) -> Numbers:
    """Default, minimum and maximum of a row."""
    return row.default, row.minimum, row.maximum


def test_every_register_in_use_has_one_row() -> None:
    assert {key: row.address for key, row in CATALOG.parameters.items()} == {
        key: line[0] for key, line in LISTS.items()
    }
    assert (len(CATALOG.parameters), len(CATALOG.readable)) == (59, 55)


@pytest.mark.parametrize("key", LISTS)
def test_access_unit_and_scale(key: str) -> None:
    row = CATALOG.parameters[key]
    assert (row.access, row.unit, row.per_unit) == LISTS[key][1:4]
    assert row.name == f"0x{LISTS[key][0]:02X}"


def test_the_models_are_the_ten_of_the_specification() -> None:
    assert set(CATALOG.models) == set(MODELS)
    assert CATALOG.specification == "Rev 1.11"


def test_models_and_months_of_each_firmware() -> None:
    assert {
        step: {model.name for model in CATALOG.models.values() if step in model.firmware}
        for step in CATALOG.firmware_steps
    } == SHIPPED
    assert {step.version: (step.first, step.last) for step in CATALOG.firmware} == MONTHS


def test_0x50_and_0x53_distinguish_a_bla34_from_a_bla21() -> None:
    for hardware, supply in ((12050, "12U"), (28050, "28U")):
        found = [CATALOG.model(series, hardware) for series in (61, 86)]
        assert [one and one.name for one in found] == [f"BLA21-{supply}-AB", f"BLA34-{supply}-AB"]


@pytest.mark.parametrize("model", MODELS)
def test_numbers_of_every_row(model: str) -> None:
    rows = CATALOG.models[model].parameters
    expected = {key: MODELS[model][line[0]] if line[4] == "model" else tuple(line[4:]) for key, line in LISTS.items()}
    assert {key: numbers(row) for key, row in rows.items()} == expected


@pytest.mark.parametrize("model", MODELS)
def test_a_model_is_found_by_its_identity(model: str) -> None:
    number, hardware = MODELS[model][0x50][0], MODELS[model][0x53][0]
    assert number is not None
    assert hardware is not None
    found = CATALOG.model(number, hardware)
    assert found is not None
    assert found.name == model


def test_unknown_identities_name_no_model() -> None:
    assert CATALOG.model(62, 6050) is None
    assert CATALOG.model(62, 28010) is None
    assert CATALOG.model(60, 6010) is None


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("firmware", ADDED)
def test_rows_of_every_model_and_firmware(model: str, firmware: int) -> None:
    everything = {line[0] for line in LISTS.values()} - NEVER_ROWS
    expected = everything - LATE
    for version, added in ADDED.items():
        if version <= firmware:
            expected |= added
    if not model.endswith("-AB"):
        expected -= {0x34, 0x35, 0x36, 0x37}
    rows = CATALOG.models[model].rows(firmware)
    assert [row.address for row in rows.values()] == sorted(expected)


@pytest.mark.parametrize("model", MODELS)
def test_rows_of_other_firmware_versions(model: str) -> None:
    servo = CATALOG.models[model]
    assert servo.rows(1301) == servo.rows(9999) == servo.rows(None) == servo.rows(1300) == servo.rows(1500)
    assert servo.rows(1199) == servo.rows(1100)
    assert servo.rows(1000) == servo.rows(1010)


def test_choices_have_the_numbers_of_the_specification() -> None:
    choices = {
        key: {choice.key: choice.raw for choice in row.choices}
        for key, row in CATALOG.parameters.items()
        if row.choices
    }
    assert choices == {
        "torque_mode": {"on": 0, "off": 1, "brake": 2},
        "timeout_action": {"hold": 0, "off": 1, "brake": 2},
        "pwm_mode": {"angle": 0, "speed": 1},
    }


def test_switches_are_the_registers_that_are_on_or_off() -> None:
    switches = {row.address for row in CATALOG.parameters.values() if row.kind == "switch"}
    assert switches == {0x21, 0x22, 0x23, 0x24, 0x25}


def test_rows_stored_in_rom() -> None:
    stored = {row.address for row in CATALOG.parameters.values() if row.rom}
    assert stored == {line[0] for line in LISTS.values() if 0x20 <= line[0] <= 0x46}


def test_flags() -> None:
    rows = CATALOG.parameters.values()
    assert {row.address for row in rows if row.identity} == {0x44, 0x45, 0x46}
    assert {row.address for row in rows if row.dummy} == {0x00, 0x01, 0x02}
    assert {row.address for row in rows if row.expert} == {0x30, 0x31, 0x32, 0x33}
    assert {row.address for row in rows if row.pwm_only} == {0x34, 0x35, 0x36, 0x37}
    assert {row.address for row in rows if row.action} == {0x10, 0x11, 0x12}
    assert {row.address for row in rows if row.forbidden} == {0x49}


@pytest.mark.parametrize("register", BITS)
def test_fault_bits(register: str) -> None:
    everything = [bit for bit in (*CATALOG.overview, *CATALOG.faults) if bit.parameter == register]
    assert {bit.bit for bit in everything if bit.older_firmware} == OLDER_BITS.get(register, set())
    bits = [bit for bit in everything if not bit.older_firmware]
    assert {bit.bit for bit in bits} == BITS[register]
    assert len(bits) == len(BITS[register])


def test_properties_of_fault_bits() -> None:
    named = {(bit.parameter, bit.bit): bit for bit in CATALOG.faults}
    past = {("fault_warning", 15), ("fault_failure", 8), ("fault_failure", 9), ("fault_failure", 11)}
    assert {place for place, bit in named.items() if bit.past_event} == past
    assert {place for place, bit in named.items() if bit.pwm_only} == {
        ("fault_notification", bit) for bit in (20, 21, 22)
    }
    protections = {("fault_warning", bit) for bit in (8, 9, 10, 11)}
    assert protections <= {place for place, bit in named.items() if bit.output_off}
    limits = {place: bit.limit for place, bit in named.items() if bit.limit and place[1] < 20}
    addresses = {place: CATALOG.parameters[key].address for place, key in limits.items()}
    assert addresses == {
        ("fault_notification", 8): 0x38,
        ("fault_notification", 9): 0x39,
        ("fault_notification", 10): 0x3A,
        ("fault_notification", 11): 0x3B,
        ("fault_notification", 12): 0x3C,
        ("fault_notification", 13): 0x3D,
        ("fault_warning", 8): 0x3E,
        ("fault_warning", 9): 0x3F,
        ("fault_warning", 10): 0x40,
        ("fault_warning", 11): 0x41,
    }


def test_every_row_has_its_section() -> None:
    section = {
        0x00: "4.1", 0x01: "4.2", 0x02: "4.3", 0x08: "4.4", 0x09: "4.5", 0x0A: "4.6", 0x0B: "4.7", 0x0C: "4.8",
        0x10: "4.9", 0x11: "4.10", 0x12: "4.11", 0x18: "4.12", 0x19: "4.12", 0x1A: "4.12", 0x1B: "4.12",
        0x20: "4.13", 0x21: "4.14", 0x22: "4.15", 0x23: "4.16", 0x24: "4.17", 0x25: "4.18", 0x26: "4.19",
        0x27: "4.19", 0x2A: "4.20", 0x2C: "4.21", 0x2D: "4.22", 0x2E: "4.23", 0x2F: "4.24", 0x30: "4.25",
        0x31: "4.26", 0x32: "4.27", 0x33: "4.28", 0x34: "4.29", 0x35: "4.29", 0x36: "4.30", 0x37: "4.30",
        0x38: "4.31", 0x39: "4.31", 0x3A: "4.32", 0x3B: "4.32", 0x3C: "4.33", 0x3D: "4.33", 0x3E: "4.34",
        0x3F: "4.34", 0x40: "4.35", 0x41: "4.35", 0x44: "4.36", 0x45: "4.37", 0x46: "4.38", 0x49: "4.39",
        0x50: "4.40", 0x51: "4.41", 0x52: "4.42", 0x53: "4.43", 0x58: "4.44", 0x59: "4.44", 0x5A: "4.44",
        0x5B: "4.44", 0x5C: "4.44",
    }  # fmt: skip
    assert {row.address: row.section for row in CATALOG.parameters.values()} == section


def test_rows_whose_sign_is_a_direction() -> None:
    sided = {row.address for row in CATALOG.parameters.values() if row.sided}
    assert sided == {0x00, 0x01, 0x02, 0x08, 0x09, 0x0A, 0x38, 0x39, 0x3C, 0x3D, 0x44}


def test_notifications_of_limits_are_those_of_angle_speed_and_torque() -> None:
    limits = [bit for bit in CATALOG.faults_of(pwm=False) if bit.level == "notification" and bit.limit]
    assert sum(bit.mask for bit in limits) == 0b111111 << 8

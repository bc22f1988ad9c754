"""Sections 3.1 and 5: registers of each model and firmware, their defaults and their ranges.

The numbers are those of the document, independent of the tables that the simulated servo uses.
"""

from dataclasses import replace

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.wire.services import EMPTY, GetSetRequest
from unit.sim.desk import FIRMWARE, MODELS, START, Desk
from unit.sim.response import step

ALWAYS = {
    *range(0x03), *range(0x08, 0x0D), *range(0x18, 0x1C), *range(0x20, 0x25), 0x26, 0x27,
    *range(0x2C, 0x2F), *range(0x30, 0x34), *range(0x38, 0x42), *range(0x44, 0x47), 0x49,
    *range(0x50, 0x54), *range(0x58, 0x5D),
}  # fmt: skip
FROM_1_100 = {0x25, 0x2A}
PWM_FROM_1_100 = set(range(0x34, 0x38))
FROM_1_200 = {0x2F}
WRITE_ONLY = {0x10, 0x11, 0x12}
RESERVED = {
    *range(0x03, 0x08), *range(0x0D, 0x10), *range(0x13, 0x18), *range(0x1C, 0x20), 0x28, 0x29, 0x2B, 0x42, 0x43,
    0x47, 0x48, *range(0x4A, 0x50), *range(0x54, 0x58), *range(0x5D, 0x60),
}  # fmt: skip

BLA21 = {0x2C: 40, 0x2D: 40, 0x2E: 3, 0x2F: 0, 0x30: 50, 0x31: 1, 0x32: 600, 0x33: 2_000, 0x3A: 300, 0x3B: -300}
BLA15 = {0x2C: 60, 0x2D: 30, 0x2E: 3, 0x2F: 30, 0x30: 15, 0x31: 1, 0x32: 300, 0x33: 25_000, 0x3A: 150, 0x3B: -150}
BLA34 = {0x2C: 50, 0x2D: 1, 0x2E: 3, 0x2F: 0, 0x32: 600, 0x3A: 80, 0x3B: -80}
SERIES = {"BLA21": BLA21, "BLA15": BLA15, "BLA34": BLA34}
COMMON = {
    0x20: 0, 0x21: 1, 0x22: 1, 0x23: 0, 0x24: 0, 0x25: 0, 0x26: 1, 0x27: 1_000, 0x38: 1_799, 0x39: -1_800,
    0x3C: 100, 0x3D: -100, 0x3E: 80, 0x3F: -40, 0x44: 0, 0x45: 0, 0x46: 0, 0x49: 0, 0x00: 0, 0x01: 0, 0x02: 0,
}  # fmt: skip
MODEL = {
    "BLA21-06U": {0x2A: 120, 0x40: 100, 0x41: 40},
    "BLA21-12U": {0x2A: 63, 0x40: 200, 0x41: 40},
    "BLA21-28U": {0x2A: 24, 0x40: 400, 0x41: 40},
    "BLA15-06U": {0x2A: 21, 0x40: 100, 0x41: 40},
    "BLA15-12U": {0x2A: 10, 0x40: 200, 0x41: 40},
    "BLA34-12U": {0x2A: 63, 0x30: 25, 0x31: 50, 0x33: 300, 0x40: 200, 0x41: 40},
    "BLA34-28U": {0x2A: 24, 0x30: 10, 0x31: 10, 0x33: 680, 0x40: 400, 0x41: 40},
}
PWM = {
    "BLA21": {0x34: 1_520, 0x35: 700, 0x36: 700, 0x37: 0}, "BLA34": {0x34: 1_520, 0x35: 1_100, 0x36: 1_100, 0x37: 0},
}  # fmt: skip

FURTHEST = 360_000_000
COMMON_RANGES = {
    0x00: (-FURTHEST, FURTHEST), 0x02: (-100, 100), 0x20: (0, 2), 0x21: (0, 1), 0x22: (0, 1), 0x23: (0, 1),
    0x24: (0, 1), 0x25: (0, 1), 0x26: (0, 2), 0x27: (1, 60_000), 0x2C: (1, 100), 0x2D: (0, 100), 0x2E: (0, 3_600),
    0x2F: (0, 100), 0x30: (1, 100), 0x31: (0, 100), 0x32: (0, 2_000), 0x33: (1, 500_000), 0x38: (0, FURTHEST),
    0x39: (-FURTHEST, 0), 0x3A: (0, 300), 0x3B: (-300, 0), 0x3C: (0, 100), 0x3D: (-100, 0), 0x3E: (20, 80),
    0x3F: (-40, 20), 0x44: (-1_800, 1_799), 0x45: (0, 254), 0x46: (0, 127),
}  # fmt: skip
MODEL_RANGES = {
    "BLA21-06U": {0x01: (-300, 300), 0x2A: (60, 120), 0x40: (74, 120), 0x41: (35, 74)},
    "BLA21-12U": {0x01: (-300, 300), 0x2A: (35, 70), 0x40: (120, 240), 0x41: (35, 120)},
    "BLA21-28U": {0x01: (-300, 300), 0x2A: (16, 32), 0x40: (280, 500), 0x41: (35, 280)},
    "BLA15-06U": {0x01: (-150, 150), 0x2A: (10, 30), 0x40: (74, 120), 0x41: (35, 74)},
    "BLA15-12U": {0x01: (-150, 150), 0x2A: (7, 15), 0x40: (120, 240), 0x41: (35, 120)},
    "BLA34-12U": {
        0x01: (-80, 80), 0x3A: (0, 80), 0x3B: (-80, 0), 0x2A: (35, 63), 0x40: (120, 240), 0x41: (35, 120),
    },
    "BLA34-28U": {
        0x01: (-80, 80), 0x3A: (0, 80), 0x3B: (-80, 0), 0x2A: (16, 24), 0x40: (280, 400), 0x41: (35, 280),
    },
}  # fmt: skip
PWM_RANGES = {0x34: (100, 10_000), 0x35: (10, 10_000), 0x36: (0, 3_600), 0x37: (0, 1)}

NO_VALUE = Behaviour(pwm_rows="empty", later_rows="empty")
"""Missing rows have no value."""

every_model = pytest.mark.parametrize("model", MODELS)
every_firmware = pytest.mark.parametrize("firmware", FIRMWARE)


def rows(model: str, firmware: str) -> set[int]:
    """The registers that can be read."""
    found = set(ALWAYS)
    if firmware >= "1.100":
        found |= FROM_1_100
        if model.endswith("AB"):
            found |= PWM_FROM_1_100
    if firmware >= "1.200":
        found |= FROM_1_200
    return found


def ranges(model: str, firmware: str) -> dict[int, tuple[int, int]]:
    """The registers that can be written, except the actions and 0x49."""
    found = COMMON_RANGES | MODEL_RANGES[model[:9]] | (PWM_RANGES if model.endswith("AB") else {})
    return {at: limits for at, limits in found.items() if at in rows(model, firmware)}


def commanded(model: str, firmware: str) -> Desk:
    """A servo that accepts speed and torque, with 0x25 or without."""
    rom = {"soft_start": 0} | ({} if firmware == "1.010" else {"speed_torque_control": 1})
    return Desk(model, firmware, rom=rom, behaviour=Behaviour(cascade_without_switch=True))


@pytest.mark.states("B14", "B75", "B83", "B101", "B105")
@every_firmware
@every_model
def test_every_model_has_exactly_its_rows_and_their_defaults(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, behaviour=NO_VALUE)
    desk.settle()
    found = {at: desk.read(f"0x{at:02X}") for at in range(0x60)}
    assert {at for at, raw in found.items() if raw is not None} == rows(model, firmware)
    series = SERIES[model[:5]]
    pwm = PWM[model[:5]] if model.endswith("AB") else {}
    identity = {0x45: 7, 0x46: 42}
    for at, default in (COMMON | series | MODEL[model[:9]] | pwm | identity).items():
        if at in rows(model, firmware):
            assert found[at] == default, hex(at)


@pytest.mark.states("B02", "B22", "B105")
@every_model
def test_as_delivered_there_is_no_servo_id_and_no_node_id(model: str) -> None:
    desk = Desk(model, servo_id=0, node_id=0, up=False)
    desk.servo.power_on(START)
    desk.wait(0.2)
    assert (desk.servo.register(0x45), desk.servo.register(0x46), desk.servo.node_id) == (0, 0, 0)


@pytest.mark.states("B14", "B101")
@every_firmware
@every_model
def test_a_missing_row_refuses_writes_too(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, behaviour=NO_VALUE)
    lacking = set(range(0x60)) - rows(model, firmware) - WRITE_ONLY
    assert lacking >= RESERVED
    for at in lacking:
        for raw in (0, 1, -1, 100):
            assert desk.write(f"0x{at:02X}", raw) is None, hex(at)


@pytest.mark.states("B83", "B101")
@every_firmware
@every_model
def test_a_row_of_later_firmware_or_of_the_pwm_input_reads_0_and_ignores_writes(model: str, firmware: str) -> None:
    desk = Desk(model, firmware)
    for at in (FROM_1_100 | PWM_FROM_1_100 | FROM_1_200) - rows(model, firmware):
        name = f"0x{at:02X}"
        assert (desk.read(name), desk.write(name, 1), desk.read(name)) == (0, 0, 0)


@pytest.mark.states("B83", "B101")
@pytest.mark.switch("pwm_rows", "later_rows")
@pytest.mark.parametrize(
    ("model", "firmware", "switch", "row"),
    [
        ("BLA21-06U-A0", "1.300", "pwm_rows", "0x35"),
        ("BLA21-06U-A0", "1.010", "pwm_rows", "0x35"),
        ("BLA21-06U-AB", "1.010", "later_rows", "0x35"),
        ("BLA21-06U-A0", "1.010", "later_rows", "0x25"),
        ("BLA21-06U-A0", "1.100", "later_rows", "0x2F"),
    ],
)
def test_by_a_switch_such_a_row_reads_0_has_no_value_or_does_not_respond(
    model: str, firmware: str, switch: str, row: str
) -> None:
    zero, empty, silent = (
        Desk(model, firmware, behaviour=replace(Behaviour(), **{switch: setting}))  # pyright: ignore[reportArgumentType]
        for setting in ("zero", "empty", "silent")
    )
    assert (zero.read(row), zero.write(row, 3)) == (0, 0)
    assert (empty.read(row), empty.write(row, 3)) == (None, None)
    assert (silent.get_set(row), silent.send_write(row, 3)) == (None, [])
    assert silent.send(GetSetRequest(0, EMPTY, row)) == []
    assert silent.read("0x2C") == zero.read("0x2C")


@pytest.mark.states("B11", "B105")
@every_firmware
@every_model
def test_both_ends_of_every_range_are_accepted_and_values_beyond_are_refused(model: str, firmware: str) -> None:
    desk = commanded(model, firmware)
    for at, (low, high) in ranges(model, firmware).items():
        name = f"0x{at:02X}"
        assert (desk.write(name, low), desk.read(name)) == (low, low), name
        assert (desk.write(name, high), desk.read(name)) == (high, high), name
        for beyond in (low - 1, high + 1, -(2**63), 2**63 - 1):
            assert desk.write(name, beyond) is None, (name, beyond)
        assert desk.read(name) == high, name


@pytest.mark.states("B14")
@every_firmware
@every_model
def test_read_only_rows_refuse_every_write(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, rom={"soft_start": 0})
    readable_only = rows(model, firmware) - set(ranges(model, firmware)) - {0x49}
    assert readable_only == {*range(0x08, 0x0D), *range(0x18, 0x1C), *range(0x50, 0x54), *range(0x58, 0x5D)}
    for at in readable_only:
        name, before = f"0x{at:02X}", desk.value(f"0x{at:02X}")
        assert (desk.write(name, before), desk.write(name, 0 if before else 1)) == (None, None)
        assert desk.read(name) == before


@pytest.mark.states("B11", "B105")
@pytest.mark.switch("out_of_range")
@every_model
def test_a_switch_clamps_values_out_of_range(model: str) -> None:
    desk = commanded(model, "1.300")
    desk.servo.behaviour = Behaviour(out_of_range="clamp")
    for at, (low, high) in ranges(model, "1.300").items():
        name = f"0x{at:02X}"
        assert (desk.write(name, low - 1), desk.write(name, 2**62)) == (low, high), name
    desk.servo.behaviour = Behaviour(out_of_range="refuse")
    assert desk.write("0x3E", 200) is None


@pytest.mark.states("B44")
@pytest.mark.parametrize("name", ["0x10", "0x11", "0x12"])
def test_write_only_rows_cannot_be_read_and_0_has_no_effect(name: str) -> None:
    desk = Desk()
    desk.write("0x2C", 77)
    assert (desk.read(name), desk.write(name, 0), desk.write(name, 2), desk.write(name, -1)) == (None, 0, None, None)
    desk.wait(0.5)
    assert (desk.read("0x2C"), desk.servo.starts) == (77, 1)


@pytest.mark.states("B32")
def test_the_dummy_is_out_of_range_when_written() -> None:
    assert Desk().write("0x00", 555_555_555) is None


@pytest.mark.states("B101", "B75")
@every_firmware
@every_model
def test_every_firmware_of_every_model_reaches_an_angle_and_saves_settings(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, rom={"soft_start": 0, "timeout_action": 0})
    assert step(desk, 450, 1.5).left <= 3
    assert desk.write("0x3E", 70) == 70
    desk.save()
    assert desk.reads("0x3E", "0x52") == [70, round(float(firmware) * 1000)]

"""Section 3.1 and 5: which registers each model and firmware has, what they hold, and what they let in.

The numbers stand here as the document prints them, not taken from the tables the servo is made of.
"""

import pytest

from hornbill.sim.behaviour import Behaviour
from unit.sim.desk import FIRMWARE, MODELS, Desk, integer

ALWAYS = {
    *range(0x03), *range(0x08, 0x0D), *range(0x18, 0x1C), *range(0x20, 0x25), 0x26, 0x27,
    *range(0x2C, 0x2F), *range(0x30, 0x34), *range(0x38, 0x42), *range(0x44, 0x47), 0x49,
    *range(0x50, 0x54), *range(0x58, 0x5D),
}  # fmt: skip
FROM_1_100 = {0x25, 0x2A}
PWM_FROM_1_100 = set(range(0x34, 0x38))
FROM_1_200 = {0x2F}
WRITE_ONLY = {0x10, 0x11, 0x12}

BLA21 = {0x2C: 40, 0x2D: 40, 0x2E: 3, 0x2F: 0, 0x30: 50, 0x31: 1, 0x32: 600, 0x33: 2_000, 0x3A: 300, 0x3B: -300}
BLA15 = {0x2C: 60, 0x2D: 30, 0x2E: 3, 0x2F: 30, 0x30: 15, 0x31: 1, 0x32: 300, 0x33: 25_000, 0x3A: 150, 0x3B: -150}
COMMON = {
    0x20: 0, 0x21: 1, 0x22: 1, 0x23: 0, 0x24: 0, 0x25: 0, 0x26: 1, 0x27: 1_000, 0x38: 1_799, 0x39: -1_800,
    0x3C: 100, 0x3D: -100, 0x3E: 80, 0x3F: -40, 0x44: 0,
}  # fmt: skip
MODEL = {
    "BLA21-06U": {0x2A: 120, 0x40: 100, 0x41: 40},
    "BLA21-12U": {0x2A: 63, 0x40: 200, 0x41: 40},
    "BLA21-28U": {0x2A: 24, 0x40: 400, 0x41: 40},
    "BLA15-06U": {0x2A: 21, 0x40: 100, 0x41: 40},
    "BLA15-12U": {0x2A: 10, 0x40: 200, 0x41: 40},
}
PWM = {0x34: 1_520, 0x35: 700, 0x36: 700, 0x37: 0}
RANGES = {
    "BLA21-06U-A0": {0x2A: (60, 120), 0x40: (74, 120), 0x41: (35, 74), 0x01: (-300, 300), 0x33: (1, 500_000)},
    "BLA21-12U-AB": {0x2A: (35, 70), 0x40: (120, 240), 0x41: (35, 120), 0x34: (100, 10_000), 0x36: (0, 3_600)},
    "BLA21-28U-A0": {0x2A: (16, 32), 0x40: (280, 500), 0x41: (35, 280), 0x2C: (1, 100), 0x2E: (0, 3_600)},
    "BLA15-06U-A0": {0x2A: (10, 30), 0x40: (74, 120), 0x01: (-150, 150), 0x3A: (0, 300), 0x3B: (-300, 0)},
    "BLA15-12U-A0": {0x2A: (7, 15), 0x41: (35, 120), 0x32: (0, 2_000), 0x27: (1, 60_000), 0x44: (-1_800, 1_799)},
}


def rows(model: str, firmware: str) -> set[int]:
    found = set(ALWAYS)
    if firmware >= "1.100":
        found |= FROM_1_100
        if model.endswith("AB"):
            found |= PWM_FROM_1_100
    if firmware >= "1.200":
        found |= FROM_1_200
    return found


@pytest.mark.parametrize("firmware", FIRMWARE)
@pytest.mark.parametrize("model", MODELS)
def test_a_servo_answers_exactly_the_rows_it_has_and_their_defaults(model: str, firmware: str) -> None:
    desk = Desk(model, firmware)
    desk.settle()
    answers = {at: desk.read(f"0x{at:02X}") for at in range(0x60)}
    assert {at for at, raw in answers.items() if raw is not None} == rows(model, firmware)
    series = BLA21 if model.startswith("BLA21") else BLA15
    pwm = PWM if model.endswith("AB") else {}
    for at, default in (COMMON | series | MODEL[model[:9]] | pwm).items():
        if at in rows(model, firmware):
            assert answers[at] == default, hex(at)


@pytest.mark.parametrize("firmware", FIRMWARE)
@pytest.mark.parametrize("model", MODELS)
def test_a_row_it_lacks_is_refused_when_written_too(model: str, firmware: str) -> None:
    desk = Desk(model, firmware)
    for at in set(range(0x60)) - rows(model, firmware) - WRITE_ONLY:
        assert desk.write(f"0x{at:02X}", 0) is None, hex(at)
        assert desk.write(f"0x{at:02X}", 1) is None, hex(at)


@pytest.mark.parametrize("model", MODELS)
def test_model_and_hardware_version_name_the_model(model: str) -> None:
    desk = Desk(model, "1.300")
    assert desk.read("0x50") == (61 if model.startswith("BLA21") else 62)
    voltage = {"06U": 6_000, "12U": 12_000, "28U": 28_000}[model[6:9]]
    assert desk.read("0x53") == voltage + (50 if model.endswith("AB") else 10)
    assert desk.read("0x52") == 1_300


@pytest.mark.parametrize("model", RANGES)
def test_ranges_are_those_of_the_model(model: str) -> None:
    desk = Desk(model, rom={"speed_torque_control": 1})
    for at, (low, high) in RANGES[model].items():
        name = f"0x{at:02X}"
        assert (desk.write(name, low), desk.write(name, high)) == (low, high), name
        assert (desk.write(name, low - 1), desk.write(name, high + 1)) == (None, None), name
        assert desk.read(name) == high, name


def test_a_switch_clamps_instead() -> None:
    desk = Desk(behaviour=Behaviour(out_of_range="clamp"))
    assert (desk.write("0x3E", 200), desk.write("0x3E", -200), desk.write("0x00", 2**62)) == (80, 20, 360_000_000)


@pytest.mark.parametrize("at", [*range(0x08, 0x0D), *range(0x18, 0x1C), *range(0x50, 0x54), *range(0x58, 0x5D)])
def test_read_only_rows_refuse_every_write(at: int) -> None:
    desk = Desk(rom={"soft_start": 0})
    name = f"0x{at:02X}"
    before = desk.read(name)
    assert desk.write(name, 0 if before else 1) is None
    assert desk.read(name) == before


@pytest.mark.parametrize("name", ["0x10", "0x11", "0x12"])
def test_write_only_rows_cannot_be_read_and_a_0_does_nothing(name: str) -> None:
    desk = Desk()
    desk.write("0x2C", 77)
    assert desk.read(name) is None
    assert desk.write(name, 0) == 0
    assert desk.write(name, 2) is None
    desk.wait(0.3)
    assert (desk.read("0x2C"), desk.servo.starts) == (77, 1)


def test_switches_answer_0_for_registers_without_a_row() -> None:
    desk = Desk(firmware="1.100", behaviour=Behaviour(reserved="zero", write_only="zero", pwm_rows="zero"))
    for name in ("0x03", "0x28", "0x4F", "0x5F", "0x10", "0x34", "0x37"):
        assert desk.read(name) == 0
    assert desk.write("0x03", 5) == 0
    assert desk.read("0x03") == 0
    # 0x2F is no reserved register: this firmware does not know it yet.
    assert desk.read("0x2F") is None
    assert desk.get_set("", index=0x60) == desk.get_set("0x2F")


def test_0x49_reads_and_never_acts_but_every_write_to_it_is_recorded() -> None:
    desk = Desk()
    before = desk.read("0x49")
    assert desk.servo.boot_loader_writes == []
    desk.write("0x49", 1)
    desk.get_set("", integer(2), index=0x49)
    assert [raw for _, raw in desk.servo.boot_loader_writes] == [1, 2]
    assert desk.read("0x49") == before
    assert desk.wait(0.5)
    assert desk.servo.starts == 1


def test_the_dummy_is_out_of_range_when_written() -> None:
    assert Desk().write("0x00", 555_555_555) is None


def test_product_rows_are_those_of_the_one_servo() -> None:
    one, other = Desk(seed=1), Desk(seed=2)
    assert one.read("0x51") != other.read("0x51")
    assert 2020 <= (one.read("0x58") or 0) <= 2030
    assert 1 <= (one.read("0x59") or 0) <= 12
    assert 1 <= (one.read("0x5A") or 0) <= 31
    assert 0 <= (one.read("0x5B") or 0) <= 23
    assert 0 <= (one.read("0x5C") or 0) <= 59

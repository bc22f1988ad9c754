"""Sections 3.1 and 5: registers of each model and firmware, their defaults and their ranges.

The numbers are those of the tables, which tests/contract/test_tables.py compares with the document.
"""

from dataclasses import replace

import pytest

from behaviour.servo_story import follow, near, refused
from hornbill.schema.parameter import Parameter
from hornbill.sim.behaviour import Behaviour
from hornbill.wire.services import EMPTY, GetSetRequest
from unit.sim.desk import FIRMWARE, MODELS, QUIET, START, Desk, catalog

LATER = {0x25, 0x2A, 0x2F, *range(0x34, 0x38)}
"""Added by firmware 1.100 and 1.200, some with the PWM input only."""
READ_ONLY = {*range(0x08, 0x0D), *range(0x18, 0x1C), *range(0x50, 0x54), *range(0x58, 0x5D)}
WRITE_ONLY = {0x10, 0x11, 0x12}
BOOT_LOADER = 0x49
RESERVED = {
    *range(0x03, 0x08), *range(0x0D, 0x10), *range(0x13, 0x18), *range(0x1C, 0x20), 0x28, 0x29, 0x2B, 0x42, 0x43,
    0x47, 0x48, *range(0x4A, 0x50), *range(0x54, 0x58), *range(0x5D, 0x60),
}  # fmt: skip
NO_VALUE = Behaviour(pwm_rows="empty", later_rows="empty")
"""Missing rows have no value."""

every_model = pytest.mark.parametrize("model", MODELS)
every_firmware = pytest.mark.parametrize("firmware", FIRMWARE)


def rows(model: str, firmware: str) -> dict[int, Parameter]:
    """The rows that can be read, except the actions and 0x49."""
    found = catalog().models[model].rows(round(float(firmware) * 1000))
    return {row.address: row for row in found.values()}


def ranges(model: str, firmware: str) -> dict[str, tuple[int, int]]:
    """The registers that can be written, except the actions and 0x49."""
    found: dict[str, tuple[int, int]] = {}
    for row in rows(model, firmware).values():
        if row.access == "rw":
            assert row.minimum is not None
            assert row.maximum is not None
            found[row.name] = row.minimum, row.maximum
    return found


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
    expected = rows(model, firmware)
    assert {at for at, raw in found.items() if raw is not None} == {*expected, BOOT_LOADER}
    identity = {0x45: 7, 0x46: 42}
    for at, row in expected.items():
        if row.access == "rw":
            assert found[at] == identity.get(at, row.default), row.key


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
    lacking = set(range(0x60)) - set(rows(model, firmware)) - WRITE_ONLY - {BOOT_LOADER}
    assert lacking >= RESERVED
    follow(desk, *(refused(f"0x{at:02X}", 0, 1, -1, 100) for at in lacking))


@pytest.mark.states("B83", "B101")
@every_firmware
@every_model
def test_a_row_of_later_firmware_or_of_the_pwm_input_reads_0_and_ignores_writes(model: str, firmware: str) -> None:
    desk = Desk(model, firmware)
    for at in LATER - set(rows(model, firmware)):
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


@pytest.mark.states("B11", "B92", "B93", "B95", "B96", "B104", "B105")
@every_firmware
@every_model
def test_both_ends_of_every_range_are_accepted_and_values_beyond_are_refused(model: str, firmware: str) -> None:
    desk = commanded(model, firmware)
    for name, (low, high) in ranges(model, firmware).items():
        follow(desk, (name, low, 0), {name: low}, (name, high, 0), {name: high})
        follow(desk, refused(name, low - 1, high + 1, -(2**63), 2**63 - 1), {name: high})


@pytest.mark.states("B14")
@every_firmware
@every_model
def test_read_only_rows_refuse_every_write(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, rom={"soft_start": 0})
    assert {at for at, row in rows(model, firmware).items() if row.access == "r"} == READ_ONLY
    for at in READ_ONLY:
        name, before = f"0x{at:02X}", desk.value(f"0x{at:02X}")
        follow(desk, refused(name, before, 0 if before else 1), {name: before})


@pytest.mark.states("B11", "B105")
@pytest.mark.switch("out_of_range")
@every_model
def test_a_switch_clamps_values_out_of_range(model: str) -> None:
    desk = commanded(model, "1.300")
    desk.servo.behaviour = Behaviour(out_of_range="clamp")
    for name, (low, high) in ranges(model, "1.300").items():
        assert (desk.write(name, low - 1), desk.write(name, 2**62)) == (low, high), name
    desk.servo.behaviour = Behaviour(out_of_range="refuse")
    follow(desk, refused("0x3E", 200))


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
    follow(Desk(), refused("0x00", 555_555_555))


@pytest.mark.states("B101", "B75")
@every_firmware
@every_model
def test_every_firmware_of_every_model_reaches_an_angle_and_saves_settings(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, rom=QUIET)
    follow(desk, ("0x00", 450, 1.5), {"0x08": near(450)}, ("0x3E", 70, 0), Desk.save, {"0x3E": 70})
    assert desk.read("0x52") == round(float(firmware) * 1000)

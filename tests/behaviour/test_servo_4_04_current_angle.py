"""Section 4.4: what 0x08 reads, after which kind of command, with and without extended angle."""

import pytest

from unit.sim.desk import FREE, Desk


def turned_to_270(extended: int) -> Desk:
    desk = Desk(rom=FREE | {"extended_angle": extended, "angle_limit_cw": 7_200})
    desk.write("0x00", 2_700)
    desk.settle()
    return desk


@pytest.mark.states("B39")
@pytest.mark.parametrize("extended", [0, 1])
def test_after_an_angle_command_turns_are_counted_whatever_0x24_says(extended: int) -> None:
    assert turned_to_270(extended).read("0x08") == pytest.approx(2_700, abs=3)


@pytest.mark.states("B39")
@pytest.mark.parametrize(("extended", "reading"), [(0, -900), (1, 2_700)])
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_after_speed_or_torque_0x24_decides(name: str, extended: int, reading: int) -> None:
    desk = turned_to_270(extended)
    desk.write(name, 0)
    desk.wait(0.5)
    assert desk.read("0x08") == pytest.approx(reading, abs=4)


@pytest.mark.states("B39")
def test_0x24_is_looked_at_with_every_reading() -> None:
    desk = turned_to_270(1)
    desk.write("0x01", 0)
    counted = desk.read("0x08") or 0
    desk.write("0x24", 0)
    assert desk.read("0x08") == counted - 3_600
    desk.write("0x24", 1)
    assert desk.read("0x08") == counted


@pytest.mark.states("B39", "B33")
@pytest.mark.parametrize(("turned_deg", "reading"), [(179.9, 1_799), (180.0, -1_800), (-180.0, -1_800), (720.5, 5)])
def test_the_absolute_angle_goes_from_minus_180_0_to_179_9(turned_deg: float, reading: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 0)
    desk.write("0x20", 1)
    assert desk.servo.turn_manually(turned_deg, desk.now)
    assert desk.read("0x08") == reading


@pytest.mark.states("B30")
def test_the_reading_has_tenths_of_a_degree() -> None:
    desk = Desk(rom=FREE | {"torque_mode": 1})
    for degrees, tenths in ((12.3, 123), (-0.1, -1), (179.9, 1_799)):
        assert desk.servo.turn_manually(degrees, desk.now)
        assert desk.read("0x08") == tenths


@pytest.mark.states("B39")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_it_can_be_read_while_the_horn_turns(name: str) -> None:
    desk = Desk(rom=FREE | {"extended_angle": 1})
    desk.write(name, 30)
    readings: list[int] = []
    for _ in range(20):
        desk.wait(0.1)
        readings.append(desk.read("0x08") or 0)
        assert readings[-1] == pytest.approx(desk.servo.angle_deg * 10, abs=1)
    assert readings == sorted(readings)
    assert readings[-1] > 1_800

"""Section 4.2: the speed command: kept for ever, 0 brakes, and how fast is fastest."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, Desk


@pytest.mark.states("B37")
@pytest.mark.parametrize("rpm", [10, 60, -120])
def test_a_speed_is_kept_for_ever(rpm: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", rpm)
    desk.wait(1.0)
    for _ in range(5):
        desk.wait(0.5)
        assert desk.read("0x09") == pytest.approx(rpm, abs=1)


@pytest.mark.states("B37")
def test_about_150_rpm_is_the_most_a_bla21_06u_does_at_its_nominal_voltage() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 300)
    desk.wait(2.0)
    assert desk.read("0x09") == pytest.approx(150, abs=5)
    desk.servo.conditions.voltage_v = 6.0
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(150 * 6.0 / 7.4, abs=6)


@pytest.mark.states("B37")
def test_a_load_takes_from_the_greatest_speed_and_not_from_a_lower_one() -> None:
    def speed(rpm: int, load_pct: float) -> int:
        desk = Desk(rom=FREE | {"speed_i_gain": 20}).under(load_pct=load_pct)
        desk.write("0x01", rpm)
        desk.wait(4.0)
        return desk.read("0x09") or 0

    assert speed(300, -30.0) < speed(300, 0.0) - 20
    assert speed(60, -8.0) == speed(60, 0.0) == 60


@pytest.mark.states("B37")
def test_one_rpm_makes_a_difference() -> None:
    desk = Desk(rom=FREE | {"speed_dead_band": 0})
    speeds: list[float] = []
    for rpm in (40, 41, 42):
        desk.write("0x01", rpm)
        desk.wait(2.0)
        speeds.append(desk.servo.speed_rpm)
    assert speeds == pytest.approx([40, 41, 42], abs=0.3)


@pytest.mark.states("B37", "B38")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_speed_or_torque_0_brakes(name: str) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 100)
    desk.wait(1.0)
    desk.write(name, 0)
    desk.wait(0.5)
    assert desk.read("0x09") == 0


@pytest.mark.states("B37")
def test_speed_0_brakes_a_horn_that_a_load_pushes() -> None:
    def pushed_to(name: str, raw: int) -> float:
        desk = Desk(rom=FREE)
        desk.write(name, raw)
        desk.under(load_pct=20.0).wait(1.0)
        return desk.servo.angle_deg

    assert pushed_to("0x01", 0) < 0.8 * pushed_to("0x20", 1)


@pytest.mark.states("B32")
@pytest.mark.parametrize("between", ["0x00", "0x02"])
def test_the_same_speed_entered_again_after_another_kind_turns_it_again(between: str) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 50)
    desk.wait(0.5)
    desk.write(between, 0)
    assert desk.read("0x01") == DUMMY
    desk.wait(1.5)
    assert desk.read("0x09") == 0
    assert desk.write("0x01", 50) == 50
    desk.wait(0.5)
    assert desk.read("0x09") == pytest.approx(50, abs=1)

"""Sections 4.1 to 4.6, 4.16 to 4.18 and 4.36: angle, speed and torque commands, and what can be read of them."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import MODELS, Desk

FREE = {"speed_torque_control": 1, "timeout_action": 0, "soft_start": 0}


def commands(desk: Desk) -> tuple[int | None, ...]:
    return tuple(desk.read(name) for name in ("0x00", "0x01", "0x02"))


@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("model", MODELS)
def test_every_model_settles_within_its_dead_band_and_rests(model: str, cascade: int) -> None:
    desk = Desk(model, rom={"timeout_action": 0, "speed_torque_control": cascade})
    desk.settle()
    for target in (900, -1_700, -1_690, 3, 0):
        desk.write("0x00", target)
        desk.settle(2.0)
        assert abs((desk.read("0x08") or 0) - target) <= 3
        assert desk.read("0x09") == 0


def test_positive_is_clockwise() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 450)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(45.0, abs=0.4)
    for name, raw in (("0x01", 60), ("0x02", 20)):
        before = desk.servo.angle_deg
        desk.write(name, raw)
        desk.wait(0.5)
        assert desk.servo.angle_deg > before + 10
        assert (desk.read("0x09") or 0) > 0


def test_a_command_of_one_kind_puts_the_dummy_into_the_others() -> None:
    desk = Desk(rom=FREE)
    assert commands(desk) == (0, 0, 0)
    desk.write("0x01", 50)
    assert commands(desk) == (DUMMY, 50, DUMMY)
    desk.write("0x02", -10)
    assert commands(desk) == (DUMMY, DUMMY, -10)
    desk.write("0x00", 100)
    assert commands(desk) == (100, DUMMY, DUMMY)


def test_speed_and_torque_are_ignored_while_0x25_is_off() -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.write("0x00", 100)
    for name in ("0x01", "0x02"):
        assert desk.write(name, 50) == DUMMY
    assert commands(desk) == (100, DUMMY, DUMMY)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(100, abs=3)


def test_and_on_a_firmware_without_0x25() -> None:
    desk = Desk(firmware="1.010", rom={"timeout_action": 0})
    desk.write("0x01", 50)
    desk.wait(0.5)
    assert desk.read("0x09") == 0


@pytest.mark.parametrize("rpm", [10, 60, -120])
def test_a_speed_is_kept_for_ever(rpm: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", rpm)
    desk.wait(1.0)
    for _ in range(5):
        desk.wait(0.5)
        assert desk.read("0x09") == pytest.approx(rpm, abs=1)


def test_about_150_rpm_is_the_most_a_bla21_06u_does_at_its_nominal_voltage() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 300)
    desk.wait(2.0)
    assert desk.read("0x09") == pytest.approx(150, abs=5)
    desk.servo.conditions.voltage_v = 6.0
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(150 * 6.0 / 7.4, abs=6)


@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_speed_or_torque_0_brakes(name: str) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 100)
    desk.wait(1.0)
    desk.write(name, 0)
    desk.wait(0.5)
    assert desk.read("0x09") == 0


def test_a_torque_pushes_as_hard_as_it_is_told_against_a_load() -> None:
    desk = Desk(rom=FREE)
    desk.servo.conditions.load_pct = -40.0
    desk.write("0x02", 40)
    desk.wait(1.0)
    assert desk.read("0x0A") == 40
    assert desk.read("0x09") == 0


def test_angles_beyond_180_are_counted_and_lost_at_power_off() -> None:
    desk = Desk(rom={"timeout_action": 0, "angle_limit_cw": 7_200, "soft_start": 0})
    desk.write("0x00", 2_700)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(2_700, abs=3)
    desk.servo.power_off(desk.now)
    desk.servo.power_on(desk.now)
    desk.wait(0.2)
    assert desk.read("0x08") == pytest.approx(-900, abs=3)


def turned_ten_times(extended: int) -> Desk:
    desk = Desk(rom=FREE | {"extended_angle": extended})
    desk.write("0x01", 100)
    while desk.servo.angle_deg < 3_590:
        desk.wait(0.01)
    desk.write("0x01", 0)
    desk.wait(0.5)
    assert 3_580 < desk.servo.angle_deg < 3_700
    return desk


def test_without_extended_angle_ten_turns_are_forgotten() -> None:
    desk = turned_ten_times(0)
    assert -1_800 <= (desk.read("0x08") or 0) <= 1_799
    desk.write("0x00", 0)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(3_600, abs=0.4)


def test_with_extended_angle_0_degrees_unwinds_them() -> None:
    desk = turned_ten_times(1)
    assert (desk.read("0x08") or 0) > 35_000
    desk.write("0x00", 0)
    desk.settle(10.0)
    assert desk.servo.angle_deg == pytest.approx(0, abs=0.4)


def test_reverse_turns_command_and_readings_round() -> None:
    desk = Desk(rom=FREE | {"reverse": 1})
    desk.write("0x00", 450)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(450, abs=3)
    assert desk.servo.angle_deg == pytest.approx(-45.0, abs=0.4)
    desk.write("0x01", 60)
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(60, abs=1)
    assert desk.servo.speed_rpm == pytest.approx(-60, abs=1)


def test_turning_the_direction_round_only_changes_the_sign_of_the_reading() -> None:
    desk = turned_ten_times(0)
    desk.write("0x20", 1)
    desk.write("0x00", 0)
    before = desk.read("0x08") or 0
    desk.write("0x23", 1)
    assert desk.read("0x08") == -before


def test_reverse_swaps_which_way_the_limits_point() -> None:
    desk = Desk(rom=FREE | {"reverse": 1, "speed_limit_cw": 20, "speed_limit_ccw": -80})
    for rpm, held in ((100, 20), (-100, -80)):
        desk.write("0x01", rpm)
        desk.wait(1.0)
        assert desk.read("0x09") == pytest.approx(held, abs=1)


def test_the_origin_moves_0_degrees() -> None:
    desk = Desk(rom={"origin": 450, "timeout_action": 0})
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    assert desk.servo.angle_deg == pytest.approx(45.0, abs=0.4)


def test_0_to_0x0c_are_readable_with_speed_torque_control_off() -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.write("0x00", 1_500)
    desk.wait(0.15)
    assert (desk.read("0x09") or 0) > 50
    assert desk.read("0x0A") is not None


def test_the_same_seed_gives_the_same_servo_to_the_last_bit() -> None:
    def life(seed: int) -> list[object]:
        desk = Desk(rom=FREE, seed=seed)
        desk.write("0x00", 1_234)
        desk.wait(0.3)
        desk.write("0x01", -77)
        heard = [(each.at, each.payload) for each in desk.wait(2.0)]
        return [*heard, desk.read("0x0C"), desk.servo.angle_deg]

    assert life(3) == life(3)


def test_however_often_it_is_looked_at_the_horn_moves_alike() -> None:
    def travel(step: float) -> float:
        desk = Desk(rom=FREE)
        desk.write("0x00", 900)
        end = desk.now + 0.2
        while desk.now < end - 1e-9:
            desk.wait(step)
            desk.read("0x08")
        return desk.servo.angle_deg

    assert travel(0.0013) == pytest.approx(travel(0.2), abs=1.5)

"""Section 4.1: the angle command: where 0° is, which way is +, and what becomes of angles beyond ±180°."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, MODELS, Desk

ANGLE_CW = 1 << 8


def commands(desk: Desk) -> tuple[int | None, ...]:
    return tuple(desk.read(name) for name in ("0x00", "0x01", "0x02"))


@pytest.mark.states("B30")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("model", MODELS)
def test_every_model_settles_within_its_dead_band_and_rests(model: str, cascade: int) -> None:
    desk = Desk(model, rom={"timeout_action": 0, "speed_torque_control": cascade} if cascade else {"timeout_action": 0})
    desk.settle()
    for target in (900, -1_700, -1_690, 3, 0):
        desk.write("0x00", target)
        desk.settle(2.0)
        assert abs((desk.read("0x08") or 0) - target) <= 3
        assert desk.read("0x09") == 0


@pytest.mark.states("B29", "B38")
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


@pytest.mark.states("B29")
def test_negative_is_counter_clockwise() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", -450)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(-45.0, abs=0.4)
    for name, raw in (("0x01", -60), ("0x02", -20)):
        before = desk.servo.angle_deg
        desk.write(name, raw)
        desk.wait(0.5)
        assert desk.servo.angle_deg < before - 10
        assert (desk.read("0x09") or 0) < 0


@pytest.mark.states("B30")
def test_0_is_the_notch_of_the_horn() -> None:
    desk = Desk(rom=FREE, angle_deg=70.0)
    desk.write("0x00", 0)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(0.0, abs=0.4)


@pytest.mark.states("B30")
def test_a_tenth_of_a_degree_makes_a_difference() -> None:
    # Coming from one side and without dead band, so that the play of the gear is the same each time.
    desk = Desk(rom=FREE | {"angle_dead_band": 0, "angle_p_gain": 100, "speed_i_gain": 0})
    rests: list[float] = []
    for target in (100, 101, 102, 103):
        desk.write("0x00", target)
        desk.settle()
        rests.append(desk.servo.angle_deg)
    assert rests == sorted(rests)
    assert rests[-1] - rests[0] == pytest.approx(0.3, abs=0.15)


@pytest.mark.states("B32")
def test_a_command_of_one_kind_puts_the_dummy_into_the_others() -> None:
    desk = Desk(rom=FREE)
    assert commands(desk) == (0, 0, 0)
    desk.write("0x01", 50)
    assert commands(desk) == (DUMMY, 50, DUMMY)
    desk.write("0x02", -10)
    assert commands(desk) == (DUMMY, DUMMY, -10)
    desk.write("0x00", 100)
    assert commands(desk) == (100, DUMMY, DUMMY)


@pytest.mark.states("B32")
@pytest.mark.parametrize("between", ["0x01", "0x02"])
def test_the_same_angle_entered_again_after_another_kind_is_gone_to_again(between: str) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 450)
    desk.settle()
    desk.write(between, -20)
    desk.wait(0.3)
    assert (desk.read("0x08") or 0) < 440
    desk.write("0x00", 450)
    desk.settle()
    assert commands(desk) == (450, DUMMY, DUMMY)
    assert desk.read("0x08") == pytest.approx(450, abs=3)


@pytest.mark.states("B31", "B33")
def test_beyond_180_degrees_the_limits_of_the_delivered_servo_hold_it() -> None:
    desk = Desk(rom=FREE)
    assert desk.write("0x00", 2_700) == 2_700
    desk.settle()
    assert desk.read("0x08") == pytest.approx(1_799, abs=3)
    assert desk.read("0x19") == ANGLE_CW


@pytest.mark.states("B30", "B31")
@pytest.mark.parametrize(("target", "name"), [(2_700, "0x38"), (-2_700, "0x39")])
def test_with_the_limits_widened_it_turns_on_in_the_same_direction(target: int, name: str) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, target)
    desk.write("0x00", target)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(target / 10, abs=0.4)
    assert desk.read("0x08") == pytest.approx(target, abs=3)
    assert desk.read("0x19") == 0


@pytest.mark.states("B33")
@pytest.mark.parametrize(
    ("standing_deg", "reading"), [(179.9, 1_799), (180.0, -1_800), (-180.0, -1_800), (-180.1, 1_799), (359.0, -10)]
)
def test_at_power_on_angles_go_from_minus_180_0_to_179_9(standing_deg: float, reading: int) -> None:
    assert Desk(rom={"soft_start": 0}, angle_deg=standing_deg).read("0x08") == reading


def at_270() -> Desk:
    desk = Desk(rom={"timeout_action": 0, "angle_limit_cw": 7_200, "soft_start": 0})
    desk.write("0x00", 2_700)
    desk.settle()
    return desk


@pytest.mark.states("B34", "B47")
def test_angles_beyond_180_are_counted_and_lost_at_power_off() -> None:
    desk = at_270()
    assert desk.read("0x08") == pytest.approx(2_700, abs=3)
    desk.servo.power_off(desk.now)
    desk.servo.power_on(desk.now)
    desk.wait(0.2)
    assert desk.read("0x08") == pytest.approx(-900, abs=3)


@pytest.mark.states("B34")
def test_and_then_the_next_command_turns_it_the_other_way() -> None:
    for lost, ends_at in ((False, 0.0), (True, 360.0)):
        desk = at_270()
        if lost:
            desk.power_cycle()
        desk.write("0x00", 0)
        desk.settle()
        assert desk.servo.angle_deg == pytest.approx(ends_at, abs=0.4)

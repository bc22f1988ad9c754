"""Sections 4.1 to 4.6: commands of angle, speed and torque, and what 0x08 to 0x0A read."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, MODELS, Desk

ANGLE_CW = 1 << 8
COMMANDS = ("0x00", "0x01", "0x02")


@pytest.mark.states("B30")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("model", MODELS)
def test_every_model_settles_within_its_deadband_and_rests(model: str, cascade: int) -> None:
    desk = Desk(model, rom={"timeout_action": 0} | ({"speed_torque_control": 1} if cascade else {}))
    desk.settle()
    for target in (900, -1_700, -1_690, 3, 0):
        desk.go(target, 2.0)
        assert desk.read("0x08") == pytest.approx(target, abs=3)
        assert desk.read("0x09") == 0


@pytest.mark.states("B29", "B38")
@pytest.mark.parametrize("sign", [1, -1])
def test_positive_is_clockwise_and_negative_counterclockwise(sign: int) -> None:
    desk = Desk(rom=FREE)
    desk.go(450 * sign)
    assert desk.servo.angle_deg == pytest.approx(45.0 * sign, abs=0.4)
    for name, raw in (("0x01", 60), ("0x02", 20)):
        before = desk.servo.angle_deg
        desk.run(name, raw * sign, 0.5)
        assert (desk.servo.angle_deg - before) * sign > 10
        assert desk.value("0x09") * sign > 0


@pytest.mark.states("B30")
def test_0_is_the_notch_of_the_horn() -> None:
    desk = Desk(rom=FREE, angle_deg=70.0)
    desk.go(0)
    assert desk.servo.angle_deg == pytest.approx(0.0, abs=0.4)


@pytest.mark.states("B30")
def test_angles_have_a_resolution_of_a_tenth_of_a_degree() -> None:
    # From one side and without deadband, so that the play of the gear is always the same.
    desk = Desk(rom=FREE | {"angle_dead_band": 0, "angle_p_gain": 100, "speed_i_gain": 0})
    rests: list[float] = []
    for target in (100, 101, 102, 103):
        desk.go(target)
        rests.append(desk.servo.angle_deg)
    assert rests == sorted(rests)
    assert rests[-1] - rests[0] == pytest.approx(0.3, abs=0.15)


@pytest.mark.states("B32")
def test_a_command_of_one_kind_puts_the_dummy_into_the_others() -> None:
    desk = Desk(rom=FREE)
    assert desk.reads(*COMMANDS) == [0, 0, 0]
    for place, raw in ((1, 50), (2, -10), (0, 100)):
        desk.write(COMMANDS[place], raw)
        assert desk.reads(*COMMANDS) == [raw if at == place else DUMMY for at in range(3)]


@pytest.mark.states("B32")
@pytest.mark.parametrize(
    ("name", "reading", "raw"), [("0x00", "0x08", 450), ("0x01", "0x09", 50), ("0x02", "0x0A", 25)]
)
def test_the_same_command_again_after_another_kind_is_executed_again(name: str, reading: str, raw: int) -> None:
    tolerance = 3 if name == "0x00" else 1
    for between in set(COMMANDS) - {name}:
        desk = Desk(rom=FREE | {"angle_limit_cw": 360_000_000}).under(load_pct=-25.0 if name == "0x02" else 0.0)
        desk.run(name, raw, 1.0)
        assert desk.read(reading) == pytest.approx(raw, abs=tolerance)
        desk.run(between, -20 if name == "0x00" else 0, 1.5)
        assert desk.read(name) == DUMMY
        assert name == "0x02" or abs(desk.value(reading) - raw) > 10
        assert desk.write(name, raw) == raw
        desk.wait(1.0)
        assert desk.read(reading) == pytest.approx(raw, abs=tolerance)
        assert desk.reads(*COMMANDS) == [raw if each == name else DUMMY for each in COMMANDS]


@pytest.mark.states("B31", "B33")
def test_beyond_180_degrees_the_default_limits_apply() -> None:
    desk = Desk(rom=FREE)
    assert desk.write("0x00", 2_700) == 2_700
    desk.settle()
    assert desk.read("0x08") == pytest.approx(1_799, abs=3)
    assert desk.read("0x19") == ANGLE_CW


@pytest.mark.states("B30", "B31")
@pytest.mark.parametrize(("target", "name"), [(2_700, "0x38"), (-2_700, "0x39")])
def test_with_wider_limits_it_turns_on_in_the_same_direction(target: int, name: str) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, target)
    desk.go(target)
    assert desk.servo.angle_deg == pytest.approx(target / 10, abs=0.4)
    assert desk.read("0x08") == pytest.approx(target, abs=3)
    assert desk.read("0x19") == 0


@pytest.mark.states("B33")
@pytest.mark.parametrize(
    ("angle_deg", "reading"), [(179.9, 1_799), (180.0, -1_800), (-180.0, -1_800), (-180.1, 1_799), (359.0, -10)]
)
def test_at_power_on_angles_range_from_minus_180_0_to_179_9(angle_deg: float, reading: int) -> None:
    assert Desk(rom={"soft_start": 0}, angle_deg=angle_deg).read("0x08") == reading


def turned_to_270(**rom: int) -> Desk:
    desk = Desk(rom=FREE | {"angle_limit_cw": 7_200} | rom)
    desk.go(2_700)
    assert desk.read("0x08") == pytest.approx(2_700, abs=3)
    return desk


@pytest.mark.states("B34", "B47")
@pytest.mark.parametrize(("power_cycle", "ends_at"), [(False, 0.0), (True, 360.0)])
def test_turns_are_counted_until_power_off_after_which_0_is_in_the_other_direction(
    power_cycle: bool, ends_at: float
) -> None:
    desk = turned_to_270(speed_torque_control=0)
    if power_cycle:
        desk.power_cycle()
        assert desk.read("0x08") == pytest.approx(-900, abs=3)
    desk.go(0)
    assert desk.servo.angle_deg == pytest.approx(ends_at, abs=0.4)


# Speed.


@pytest.mark.states("B37")
@pytest.mark.parametrize("rpm", [10, 60, -120])
def test_a_speed_is_held_until_the_next_command(rpm: int) -> None:
    desk = Desk(rom=FREE)
    desk.run("0x01", rpm, 1.0)
    for _ in range(5):
        desk.wait(0.5)
        assert desk.read("0x09") == pytest.approx(rpm, abs=1)


@pytest.mark.states("B37")
def test_the_maximum_speed_of_a_bla21_06u_is_about_150_rpm_at_nominal_voltage() -> None:
    desk = Desk(rom=FREE)
    desk.run("0x01", 300, 2.0)
    assert desk.read("0x09") == pytest.approx(150, abs=5)
    desk.servo.conditions.voltage_v = 6.0
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(150 * 6.0 / 7.4, abs=6)


@pytest.mark.states("B37")
def test_a_load_reduces_the_maximum_speed_and_not_a_lower_one() -> None:
    def speed(rpm: int, load_pct: float) -> int:
        desk = Desk(rom=FREE | {"speed_i_gain": 20}).under(load_pct=load_pct)
        desk.run("0x01", rpm, 4.0)
        return desk.value("0x09")

    assert speed(300, -30.0) < speed(300, 0.0) - 20
    assert speed(60, -8.0) == speed(60, 0.0) == 60


@pytest.mark.states("B37")
def test_speeds_have_a_resolution_of_1_rpm() -> None:
    desk = Desk(rom=FREE | {"speed_dead_band": 0})
    speeds: list[float] = []
    for rpm in (40, 41, 42):
        desk.run("0x01", rpm, 2.0)
        speeds.append(desk.servo.speed_rpm)
    assert speeds == pytest.approx([40, 41, 42], abs=0.3)


@pytest.mark.states("B37", "B38")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_speed_or_torque_0_brakes(name: str) -> None:
    desk = Desk(rom=FREE)
    desk.run("0x01", 100, 1.0)
    desk.run(name, 0, 0.5)
    assert desk.read("0x09") == 0


@pytest.mark.states("B37")
def test_speed_0_brakes_a_horn_turned_by_a_load() -> None:
    def turned(name: str, raw: int) -> float:
        desk = Desk(rom=FREE)
        desk.write(name, raw)
        desk.under(load_pct=20.0).wait(1.0)
        return desk.servo.angle_deg

    assert turned("0x01", 0) < 0.8 * turned("0x20", 1)


# Torque.


@pytest.mark.states("B38")
@pytest.mark.parametrize("percent", [5, -30, 31, 40, 75, -100])
def test_a_torque_against_an_equal_load_reads_as_commanded_and_turns_nothing(percent: int) -> None:
    desk = Desk(rom=FREE).under(load_pct=-percent)
    desk.run("0x02", percent, 0.3)
    assert desk.read("0x0A") == percent
    assert abs(desk.value("0x09")) <= 10


@pytest.mark.states("B38")
def test_a_horn_without_load_turns_faster_with_more_torque() -> None:
    speeds: list[int] = []
    for percent in (10, 20, 30):
        desk = Desk(rom=FREE)
        desk.run("0x02", percent, 2.0)
        speeds.append(desk.value("0x09"))
    assert 0 < speeds[0] < speeds[1] < speeds[2]


@pytest.mark.states("B38")
@pytest.mark.parametrize(("volts", "lifts"), [(7.4, True), (5.0, False)])
def test_100_percent_needs_the_nominal_supply(volts: float, lifts: bool) -> None:
    desk = Desk(rom=FREE).under(load_pct=-80.0, voltage_v=volts)
    began = desk.servo.angle_deg
    desk.run("0x02", 100, 0.5)
    assert (desk.servo.angle_deg > began) is lifts


# Readings.


@pytest.mark.states("B39")
@pytest.mark.parametrize(("extended", "reading"), [(0, -900), (1, 2_700)])
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_turns_are_counted_after_an_angle_and_by_0x24_after_speed_or_torque(
    name: str, extended: int, reading: int
) -> None:
    desk = turned_to_270(extended_angle=extended)
    desk.run(name, 0, 0.5)
    assert desk.read("0x08") == pytest.approx(reading, abs=4)


@pytest.mark.states("B39")
def test_0x24_has_effect_on_the_next_reading() -> None:
    desk = turned_to_270(extended_angle=1)
    desk.write("0x01", 0)
    counted = desk.value("0x08")
    for extended, reading in ((0, counted - 3_600), (1, counted)):
        desk.write("0x24", extended)
        assert desk.read("0x08") == reading


@pytest.mark.states("B30", "B33", "B39")
@pytest.mark.parametrize(
    ("degrees", "reading"),
    [(12.3, 123), (-0.1, -1), (179.9, 1_799), (180.0, -1_800), (-180.0, -1_800), (720.5, 5)],
)
def test_the_absolute_angle_reads_minus_180_0_to_179_9_in_tenths(degrees: float, reading: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 0)
    desk.write("0x20", 1)
    assert desk.turn(degrees)
    assert desk.read("0x08") == reading


@pytest.mark.states("B39")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_the_angle_can_be_read_while_the_horn_turns(name: str) -> None:
    desk = Desk(rom=FREE | {"extended_angle": 1})
    desk.write(name, 30)
    readings: list[int] = []
    for _ in range(20):
        desk.wait(0.1)
        readings.append(desk.value("0x08"))
        assert readings[-1] == pytest.approx(desk.servo.angle_deg * 10, abs=1)
    assert readings == sorted(readings)
    assert readings[-1] > 1_800


@pytest.mark.states("B40")
@pytest.mark.parametrize(
    ("cascade", "name", "raw"), [(0, "0x00", 1_700), (1, "0x00", 1_700), (1, "0x01", 80), (1, "0x02", 20)]
)
def test_speed_and_torque_are_measured_during_every_command(cascade: int, name: str, raw: int) -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": cascade})
    desk.run(name, raw, 0.12)
    assert desk.value("0x09") > 20
    assert desk.read("0x09") == pytest.approx(desk.servo.speed_rpm, abs=0.6)
    assert desk.read("0x0A") is not None


@pytest.mark.states("B40")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("load_pct", [-45.0, 45.0])
def test_torque_is_measured_while_a_load_is_held(load_pct: float, cascade: int) -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": cascade})
    desk.write("0x00", 0)
    desk.under(load_pct=load_pct).wait(2.0)
    assert desk.read("0x0A") == pytest.approx(-load_pct, abs=4)


@pytest.mark.states("B40")
def test_speed_and_torque_are_measured_without_output_too() -> None:
    desk = Desk(rom=FREE)
    desk.run("0x01", 100, 1.0)
    desk.run("0x20", 1, 0.02)
    assert desk.value("0x09") > 30
    desk.wait(2.0)
    assert desk.reads("0x09", "0x0A") == [0, 0]


@pytest.mark.states("B40")
def test_neither_reads_beyond_the_range_of_its_register() -> None:
    desk = Desk(rom=FREE).under(load_pct=500.0)
    desk.run("0x02", 100, 1.0)
    assert desk.servo.speed_rpm > 300
    assert desk.read("0x09") == 300
    assert abs(desk.value("0x0A")) <= 150

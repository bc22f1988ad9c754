"""Sections 4.1 to 4.6: commands of angle, speed and torque, and what 0x08 to 0x0A read."""

import pytest

from behaviour.servo_story import Rom, Steps, between, follow, go, near, stories, turned, under
from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, MODELS, Desk

ANGLE_CW = 1 << 8
COMMANDS = ("0x00", "0x01", "0x02")
speed_or_torque = pytest.mark.parametrize("name", ["0x01", "0x02"])


@pytest.mark.states("B30", "B31", "B32", "B33", "B37", "B38", "B39", "B40")
@stories({
    "B30: a command of 0 ends at the notch of the horn": ({}, [
        ("0x20", 1, 0), turned(70.0), ("0x20", 0, 0), go(0), {"angle_deg": near(0.0, 0.4)},
    ]),
    "B31, B33: beyond 180 degrees the default limits apply": ({}, [
        ("0x00", 2_700, 0), Desk.settle, {"0x08": near(1_799), "0x19": ANGLE_CW},
    ]),
    **{f"B30, B31: with wider limits it turns on in the same direction, {target}": ({}, [
        (name, target, 0), go(target), {"angle_deg": near(target / 10, 0.4), "0x08": near(target), "0x19": 0},
    ]) for name, target in (("0x38", 2_700), ("0x39", -2_700))},
    "B32: a command of one kind puts the dummy into the others": ({}, [
        {"0x00": 0, "0x01": 0, "0x02": 0},
        ("0x01", 50, 0), {"0x00": DUMMY, "0x01": 50, "0x02": DUMMY},
        ("0x02", -10, 0), {"0x00": DUMMY, "0x01": DUMMY, "0x02": -10},
        ("0x00", 100, 0), {"0x00": 100, "0x01": DUMMY, "0x02": DUMMY},
    ]),
    **{f"B37: a speed is held until the next command, {rpm}": ({}, [
        ("0x01", rpm, 1.0), *([0.5, {"0x09": near(rpm, 1)}] * 5),
    ]) for rpm in (10, 60, -120)},
    "B37: the maximum speed of a BLA21-06U is about 150 rpm at nominal voltage": ({}, [
        ("0x01", 300, 2.0), {"0x09": near(150, 5)}, under(voltage_v=6.0), 0.9, {"0x09": near(150 * 6.0 / 7.4, 6)},
    ]),
    **{f"B37, B38: 0 brakes, {name}": ({}, [("0x01", 100, 1.0), (name, 0, 0.5), {"0x09": 0}])
       for name in ("0x01", "0x02")},
    **{f"B38: a torque against an equal load reads as commanded and turns nothing, {percent}": ({}, [
        under(load_pct=-percent), ("0x02", percent, 0.3), {"0x0A": percent, "0x09": near(0, 10)},
    ]) for percent in (5, -30, 31, 40, 75, -100)},
    "B40: neither reads beyond the range of its register": ({}, [
        under(load_pct=500.0), ("0x02", 100, 1.0),
        {"speed_rpm": between(300, 10_000), "0x09": 300, "0x0A": between(-150, 150)},
    ]),
    "B40: speed and torque are measured without output too": ({}, [
        ("0x01", 100, 1.0), ("0x20", 1, 0.02), {"0x09": between(31, 100)}, 2.0, {"0x09": 0, "0x0A": 0},
    ]),
    **{f"B40: torque is measured while a load of {load} % is held, 0x25 {cascade}": (
        {"speed_torque_control": cascade}, [("0x00", 0, 0), under(load_pct=load), 2.0, {"0x0A": near(-load, 4)}],
    ) for load in (-45.0, 45.0) for cascade in (0, 1)},
})  # fmt: skip
def test_commands_and_readings(rom: Rom, steps: Steps) -> None:
    follow(Desk(rom=FREE | rom), *steps)


@pytest.mark.states("B30")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("model", MODELS)
def test_every_model_settles_within_its_deadband_and_rests(model: str, cascade: int) -> None:
    desk = Desk(model, rom={"timeout_action": 0} | ({"speed_torque_control": 1} if cascade else {}))
    desk.settle()
    for target in (900, -1_700, -1_690, 3, 0):
        desk.go(target, 2.0)
        follow(desk, {"0x08": near(target), "0x09": 0})


@pytest.mark.states("B29", "B38")
@pytest.mark.parametrize("sign", [1, -1])
def test_positive_is_clockwise_and_negative_counterclockwise(sign: int) -> None:
    desk = Desk(rom=FREE)
    follow(desk, go(450 * sign), {"angle_deg": near(45.0 * sign, 0.4)})
    for name, raw in (("0x01", 60), ("0x02", 20)):
        before = desk.servo.angle_deg
        desk.run(name, raw * sign, 0.5)
        assert (desk.servo.angle_deg - before) * sign > 10
        assert desk.value("0x09") * sign > 0


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
@pytest.mark.parametrize(
    ("name", "reading", "raw"), [("0x00", "0x08", 450), ("0x01", "0x09", 50), ("0x02", "0x0A", 25)]
)
def test_the_same_command_again_after_another_kind_is_executed_again(name: str, reading: str, raw: int) -> None:
    reached = {reading: near(raw, 3 if name == "0x00" else 1)}
    for between_raw, other in ((-20 if name == "0x00" else 0, each) for each in COMMANDS if each != name):
        desk = Desk(rom=FREE | {"angle_limit_cw": 360_000_000}).under(load_pct=-25.0 if name == "0x02" else 0.0)
        follow(desk, (name, raw, 1.0), reached, (other, between_raw, 1.5), {name: DUMMY})
        assert name == "0x02" or abs(desk.value(reading) - raw) > 10
        follow(desk, (name, raw, 1.0), reached, {each: raw if each == name else DUMMY for each in COMMANDS})


@pytest.mark.states("B33")
@pytest.mark.parametrize(
    ("angle_deg", "reading"), [(179.9, 1_799), (180.0, -1_800), (-180.0, -1_800), (-180.1, 1_799), (359.0, -10)]
)
def test_at_power_on_angles_range_from_minus_180_0_to_179_9(angle_deg: float, reading: int) -> None:
    assert Desk(rom={"soft_start": 0}, angle_deg=angle_deg).read("0x08") == reading


def turned_to_270(**rom: int) -> Desk:
    desk = Desk(rom=FREE | {"angle_limit_cw": 7_200} | rom)
    follow(desk, go(2_700), {"0x08": near(2_700)})
    return desk


@pytest.mark.states("B34", "B47")
def test_turns_are_counted_until_power_off_after_which_0_is_in_the_other_direction() -> None:
    follow(turned_to_270(speed_torque_control=0), go(0), {"angle_deg": near(0.0, 0.4)})
    desk = turned_to_270(speed_torque_control=0)
    follow(desk, Desk.power_cycle, {"0x08": near(-900)}, go(0), {"angle_deg": near(360.0, 0.4)})


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
    for rpm in (40, 41, 42):
        follow(desk, ("0x01", rpm, 2.0), {"speed_rpm": near(rpm, 0.3)})


@pytest.mark.states("B37")
def test_speed_0_brakes_a_horn_turned_by_a_load() -> None:
    def turned_by_it(name: str, raw: int) -> float:
        desk = Desk(rom=FREE)
        follow(desk, (name, raw, 0), under(load_pct=20.0), 1.0)
        return desk.servo.angle_deg

    assert turned_by_it("0x01", 0) < 0.8 * turned_by_it("0x20", 1)


@pytest.mark.states("B38")
def test_a_horn_without_load_turns_faster_with_more_torque() -> None:
    desks = [Desk(rom=FREE) for _ in range(3)]
    for desk, percent in zip(desks, (10, 20, 30), strict=True):
        desk.run("0x02", percent, 2.0)
    weak, medium, strong = (desk.value("0x09") for desk in desks)
    assert 0 < weak < medium < strong


@pytest.mark.states("B38")
@pytest.mark.parametrize(("volts", "lifts"), [(7.4, True), (5.0, False)])
def test_100_percent_needs_the_nominal_supply(volts: float, lifts: bool) -> None:
    desk = Desk(rom=FREE).under(load_pct=-80.0, voltage_v=volts)
    began = desk.servo.angle_deg
    desk.run("0x02", 100, 0.5)
    assert (desk.servo.angle_deg > began) is lifts


@pytest.mark.states("B39")
@pytest.mark.parametrize(("extended", "reading"), [(0, -900), (1, 2_700)])
@speed_or_torque
def test_turns_are_counted_after_an_angle_and_by_0x24_after_speed_or_torque(
    name: str, extended: int, reading: int
) -> None:
    follow(turned_to_270(extended_angle=extended), (name, 0, 0.5), {"0x08": near(reading, 4)})


@pytest.mark.states("B39")
def test_0x24_has_effect_on_the_next_reading() -> None:
    desk = turned_to_270(extended_angle=1)
    desk.write("0x01", 0)
    counted = desk.value("0x08")
    follow(desk, ("0x24", 0, 0), {"0x08": counted - 3_600}, ("0x24", 1, 0), {"0x08": counted})


@pytest.mark.states("B30", "B33", "B39")
@pytest.mark.parametrize(
    ("degrees", "reading"),
    [(12.3, 123), (-0.1, -1), (179.9, 1_799), (180.0, -1_800), (-180.0, -1_800), (720.5, 5)],
)
def test_the_absolute_angle_reads_minus_180_0_to_179_9_in_tenths(degrees: float, reading: int) -> None:
    follow(Desk(rom=FREE), ("0x01", 0, 0), ("0x20", 1, 0), turned(degrees), {"0x08": reading})


@pytest.mark.states("B39")
@speed_or_torque
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

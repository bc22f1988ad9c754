"""Section 4.13: torque on, off and brake, and what remains of a command when torque is on again."""

import pytest

from behaviour.servo_story import Rom, Steps, follow, go, held, near, refused, stories, turned
from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, Desk

ON, OFF, BRAKE = 0, 1, 2
without_output = pytest.mark.parametrize("mode", [OFF, BRAKE])


@pytest.mark.states("B61", "B62", "B63")
@stories({
    "B61: 0 is on, 1 off and 2 brake": ({}, [
        ("0x20", OFF, 0), {"output": OFF}, ("0x20", BRAKE, 0), {"output": BRAKE}, ("0x20", ON, 0), {"output": ON},
        refused("0x20", 3), held(90.0), {"0x08": 0},
    ]),
    "B62: on written while on has no effect": ({}, [
        ("0x00", 450, 0.05), ("0x20", ON, 0), Desk.settle, {"0x08": near(450)},
    ]),
    **{f"B63: example 3, the last kind of command decides: {name}": ({}, [
        go(450), ("0x20", OFF, 0), (name, raw, 0.5), {name: raw, "0x09": 0},
        ("0x20", ON, 0.5), {name: 0, "0x00": DUMMY, "0x09": 0},
    ]) for name, raw in (("0x01", -50), ("0x02", -30))},
})  # fmt: skip
def test_torque_mode(rom: Rom, steps: Steps) -> None:
    follow(Desk(rom=FREE | rom), *steps)


@pytest.mark.states("B61")
@without_output
@pytest.mark.parametrize(("name", "raw"), [("0x00", 900), ("0x01", 60), ("0x02", 30)])
def test_with_torque_off_or_brake_no_command_moves_the_horn(name: str, raw: int, mode: int) -> None:
    follow(Desk(rom=FREE), ("0x20", mode, 0), (name, raw, 1.0), {"0x08": 0, "0x0A": 0})


@pytest.mark.states("B62")
def test_example_1_the_angle_at_torque_on_is_held() -> None:
    desk = Desk(rom=FREE)
    follow(desk, ("0x00", 1_500, 0.1), ("0x20", OFF, 1.0))
    there = desk.value("0x08")
    assert 50 < there < 1_400
    follow(desk, ("0x20", ON, 1.0), {"0x08": near(there), "0x00": there})


@pytest.mark.states("B62")
@without_output
def test_example_2_the_horn_is_turned_manually_meanwhile(mode: int) -> None:
    follow(Desk(rom=FREE), go(450), ("0x20", mode, 0), turned(0.0), {"0x08": 0}, ("0x20", ON, 1.0), {"0x08": near(0)})


@pytest.mark.states("B63")
def test_an_angle_commanded_after_a_speed_is_off_is_held_as_angle() -> None:
    desk = Desk(rom=FREE)
    follow(desk, ("0x01", 50, 0.3), ("0x20", OFF, 1.0))
    there = desk.value("0x08")
    follow(desk, ("0x00", 900, 0), ("0x20", ON, 0), {"0x00": there}, 0.5, {"0x08": near(there)})


@pytest.mark.states("B62")
@without_output
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_a_speed_or_torque_remains_while_off_or_braked_and_is_0_with_torque_on(name: str, mode: int) -> None:
    desk = Desk(rom=FREE)
    follow(desk, (name, 40, 0.5))
    for each in (mode, OFF, BRAKE, mode):
        follow(desk, ("0x20", each, 0), {name: 40})
    follow(desk, 3.0, ("0x20", ON, 0.5), {name: 0, "0x09": 0, "output": ON})


@pytest.mark.states("B61")
def test_brake_stops_faster_than_off_and_more_slowly_than_speed_0() -> None:
    def run_out(name: str, raw: int) -> float:
        desk = Desk(rom=FREE | {"smoothing": 0})
        desk.run("0x01", 120, 1.0)
        before = desk.servo.angle_deg
        desk.run(name, raw, 3.0)
        return desk.servo.angle_deg - before

    assert run_out("0x01", 0) < run_out("0x20", BRAKE) < run_out("0x20", OFF)


@pytest.mark.states("B64")
@without_output
def test_a_saved_mode_applies_from_the_next_start_on_without_soft_start_and_an_unsaved_one_does_not(mode: int) -> None:
    desk = Desk(rom=FREE | {"soft_start": 1}, angle_deg=170.0)
    follow(desk, ("0x20", mode, 0), Desk.power_cycle, {"0x20": ON, "output": ON}, ("0x20", mode, 0), Desk.save)
    there = desk.value("0x08")
    assert there > 300
    follow(desk, Desk.power_cycle, 2.0, {"0x20": mode, "0x08": there, "output": mode, "soft_starting": False})
    follow(desk, ("0x20", ON, 1.0), {"0x08": near(there)})

"""Section 4.14: the slow way to 0° after power-on, what it changes for a time, and what ends it."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.rig import Rig, json, play
from behaviour.scene import scene
from hornbill.servo.device.servo import State
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from unit.sim.desk import Desk

STORED = {"speed_torque_control": 0, "timeout_time": 60_000}
TEMPORARY = {"0x25": 1, "0x3A": 30, "0x3B": -30, "0x3C": 30, "0x3D": -30}
PERMANENT = {"0x25": 0, "0x3A": 300, "0x3B": -300, "0x3C": 100, "0x3D": -100}


def read(desk: Desk) -> dict[str, int | None]:
    return {name: desk.read(name) for name in TEMPORARY}


def starting(angle_deg: float = 150.0, behaviour: Behaviour | None = None) -> Desk:
    desk = Desk(rom=STORED, angle_deg=angle_deg, behaviour=behaviour)
    assert desk.servo.soft_starting
    return desk


@pytest.mark.states("B66", "B67")
@pytest.mark.parametrize("angle_deg", [150.0, -150.0])
def test_it_goes_to_0_at_no_more_than_30_rpm(angle_deg: float) -> None:
    desk = starting(angle_deg)
    fastest = 0
    while desk.servo.soft_starting:
        desk.wait(0.02)
        fastest = max(fastest, abs(desk.read("0x09") or 0))
    assert 20 <= fastest <= 31
    assert abs(desk.read("0x08") or 0) <= 10
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B66")
@pytest.mark.parametrize("reverse", [0, 1])
def test_0_is_where_the_origin_puts_it(reverse: int) -> None:
    desk = Desk(rom=STORED | {"origin": -300, "reverse": reverse}, angle_deg=45.0)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(30.0 if reverse else -30.0, abs=0.4)


@pytest.mark.states("B66")
def test_it_is_on_as_delivered() -> None:
    desk = Desk(angle_deg=80.0)
    assert desk.read("0x21") == 1
    assert desk.servo.soft_starting
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B66")
def test_it_is_for_the_first_motion_only() -> None:
    desk = starting()
    desk.settle()
    desk.write("0x00", 900)
    desk.wait(0.08)
    assert abs(desk.read("0x09") or 0) > 60


@pytest.mark.states("B67")
def test_five_parameters_change_for_a_time() -> None:
    desk = starting()
    assert read(desk) == TEMPORARY
    desk.settle()
    assert read(desk) == PERMANENT


@pytest.mark.states("B67")
def test_what_was_set_by_hand_comes_back_too() -> None:
    own = {"0x25": 1, "0x3A": 20, "0x3B": -250, "0x3C": 90, "0x3D": -10}
    keys = ("speed_torque_control", "speed_limit_cw", "speed_limit_ccw", "torque_limit_cw", "torque_limit_ccw")
    desk = Desk(rom=STORED | dict(zip(keys, own.values(), strict=True)), angle_deg=150.0)
    assert read(desk) == TEMPORARY
    desk.settle()
    assert read(desk) == own


@pytest.mark.states("B67")
@pytest.mark.switch("soft_start_shows")
def test_a_switch_keeps_the_readings_as_stored() -> None:
    assert read(starting()) == TEMPORARY
    desk = starting(behaviour=Behaviour(soft_start_shows="stored"))
    assert read(desk) == PERMANENT
    desk.wait(0.3)
    assert abs(desk.read("0x09") or 0) <= 31


@pytest.mark.states("B67")
def test_a_save_in_this_time_saves_what_the_parameters_hold() -> None:
    desk = starting()
    desk.opcode(0)
    desk.wait(3.0)
    assert not desk.servo.soft_starting
    assert read(desk) == TEMPORARY


@pytest.mark.states("B67")
def test_torque_is_limited_too() -> None:
    desk = starting()
    desk.servo.conditions.load_pct = 40.0
    desk.wait(0.5)
    assert abs(desk.read("0x0A") or 0) <= 31
    assert desk.servo.angle_deg > 150


@pytest.mark.states("B68")
def test_within_1_degree_there_is_nothing_to_do() -> None:
    desk = Desk(rom=STORED, angle_deg=0.6)
    assert not desk.servo.soft_starting


@pytest.mark.states("B68")
def test_about_1_degree_before_0_it_is_over() -> None:
    desk = starting(20.0)
    while desk.servo.soft_starting:
        desk.wait(0.005)
    # It looks 20 times a second, and at 30 rpm the horn goes 9° in that time.
    assert abs(desk.read("0x08") or 0) <= 10


@pytest.mark.states("B66")
def test_off_holds_where_it_is() -> None:
    desk = Desk(rom=STORED | {"soft_start": 0}, angle_deg=90.0)
    assert read(desk) == PERMANENT
    desk.wait(2.0)
    assert desk.read("0x08") == 900


@pytest.mark.states("B68")
def test_an_angle_command_ends_it_and_is_obeyed_at_full_speed() -> None:
    desk = starting()
    desk.write("0x00", -900)
    assert not desk.servo.soft_starting
    assert read(desk) == PERMANENT
    desk.wait(0.2)
    assert abs(desk.read("0x09") or 0) > 60


@pytest.mark.states("B68")
def test_an_array_command_ends_it() -> None:
    desk = starting()
    desk.array(8, 1, 0.5)
    assert desk.servo.soft_starting
    desk.array(7, 1, 0.5)
    assert not desk.servo.soft_starting
    desk.settle()
    assert desk.read("0x08") == pytest.approx(500, abs=3)


@pytest.mark.states("B68")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_speed_and_torque_end_it_and_are_obeyed_where_0x25_is_on(name: str) -> None:
    desk = Desk(rom=STORED | {"speed_torque_control": 1}, angle_deg=150.0)
    desk.write(name, 20)
    assert not desk.servo.soft_starting
    desk.wait(0.5)
    assert desk.read(name) == 20
    assert (desk.read("0x09") or 0) >= 19


@pytest.mark.states("B68", "B76")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_speed_and_torque_end_it_where_0x25_is_off_again_then_and_the_horn_brakes(name: str) -> None:
    desk = starting()
    assert desk.read("0x25") == 1
    assert desk.write(name, 20) == 20
    assert not desk.servo.soft_starting
    assert desk.read("0x25") == 0
    desk.wait(0.5)
    there = desk.servo.angle_deg
    desk.wait(1.0)
    assert desk.servo.angle_deg == pytest.approx(there, abs=0.1)
    assert abs(there) > 100


@pytest.mark.states("B68")
@pytest.mark.parametrize("mode", [0, 1, 2])
def test_torque_mode_ends_it_and_the_horn_stays(mode: int) -> None:
    desk = starting()
    desk.wait(0.2)
    desk.write("0x20", mode)
    assert not desk.servo.soft_starting
    there = desk.servo.angle_deg
    desk.wait(1.0)
    assert desk.servo.angle_deg == pytest.approx(there, abs=6 if mode == 0 else 15)


@pytest.mark.states("B68", "B85")
def test_a_pulse_ends_it_on_a_model_that_has_the_input_and_on_no_other() -> None:
    for model, ends in (("BLA21-06U-AB", True), ("BLA21-06U-A0", False)):
        desk = Desk(model, rom=STORED, angle_deg=150.0)
        assert desk.servo.soft_starting
        desk.under(pwm_us=1_870.0)
        assert desk.servo.soft_starting is not ends
        desk.settle()
        assert desk.read("0x08") == pytest.approx(350 if ends else 0, abs=3)


@pytest.mark.states("B68")
@pytest.mark.parametrize("cause", [{"voltage_v": 11.0}, {"voltage_v": 3.5}, {"temperature_c": 90.0}])
def test_protection_ends_it(cause: dict[str, float]) -> None:
    desk = starting().under(**cause)
    assert not desk.servo.soft_starting
    there = desk.servo.angle_deg
    desk.under(voltage_v=7.4, temperature_c=25.0).wait(1.0)
    assert desk.servo.angle_deg == pytest.approx(there, abs=6)
    assert read(desk) == PERMANENT


@pytest.mark.states("B68")
def test_a_motor_that_breaks_down_ends_it() -> None:
    desk = starting()
    desk.servo.faults.inject("motor_driver", True)
    desk.wait(0.1)
    assert not desk.servo.soft_starting


@pytest.mark.states("B68")
def test_reading_and_configuring_do_not_end_it() -> None:
    desk = starting()
    for at in range(0x60):
        desk.read(f"0x{at:02X}")
    desk.write("0x3E", 70)
    desk.node_info()
    assert desk.servo.soft_starting


@pytest.mark.states("B68")
@pytest.mark.switch("timeout_from")
def test_a_short_time_out_cuts_it_off_unless_that_runs_from_the_first_command() -> None:
    quick = {"timeout_time": 300}
    desk = Desk(rom=quick, angle_deg=170.0, behaviour=Behaviour(timeout_from="first_command"))
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    cut = Desk(rom=quick, angle_deg=170.0)
    cut.wait(3.0)
    assert cut.servo.output == 1
    assert not cut.servo.soft_starting
    assert cut.servo.angle_deg > 60


@pytest.mark.states("B68")
@pytest.mark.parametrize(("action", "ends"), [(0, False), (1, True), (2, True)])
def test_the_time_out_ends_it_where_its_action_takes_the_output(action: int, ends: bool) -> None:
    rom = {"timeout_time": 300, "timeout_action": action}
    desk = Desk(rom=rom, angle_deg=170.0)
    desk.wait(0.5)
    assert desk.servo.output == action
    assert desk.servo.soft_starting is not ends


def held_up(load_pct: float, **rom: int) -> Recipe:
    """A servo that starts at 120° and does not come to 0°."""
    return Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, rom=rom, angle_deg=120.0, load_pct=load_pct)


@pytest.mark.states("B68")
@scene(held_up(0.0, timeout_time=300, speed_limit_cw=250))
async def test_the_host_sees_a_soft_start_end_by_the_time_out_and_reads_what_rom_holds(rig: Rig) -> None:
    servo = (await rig.ready(within_s=4))[0]
    assert rig.sim(servo).angle_deg > 30
    assert not rig.sim(servo).soft_starting
    await asyncio.sleep(1)
    assert servo.rom()["speed_limit_cw"] == 250
    assert servo.rom()["speed_torque_control"] == 0
    done = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    assert done["state"] == "succeeded", done["error"]


@pytest.mark.states("B68")
@pytest.mark.parametrize("action", [0, 1])
def test_a_soft_start_that_is_held_up_goes_on_where_no_time_out_ends_it(action: int) -> None:
    async def scene(rig: Rig) -> None:
        await asyncio.sleep(8)
        servo = rig.host.fleet.all()[0]
        assert rig.sim(servo).soft_starting
        assert servo.state is State.SOFT_START
        assert "speed_limit_cw" not in servo.rom()

    recipe = held_up(60.0, timeout_time=300, timeout_action=action)
    play(scene, replace(recipe, behaviour=Behaviour(timeout_from="first_command")))

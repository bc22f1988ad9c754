"""Section 4.14: the slow move to 0° after power-on, what it changes temporarily, and what ends it."""

import asyncio
from collections.abc import Callable
from dataclasses import replace

import pytest

from behaviour.rig import Rig, json
from behaviour.scene import scene
from behaviour.servo_story import Rom, Steps, between, follow, near, stories, under
from hornbill.domain.plant import PlantConstants
from hornbill.servo.device.servo import State
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from unit.sim.desk import Desk

STORED = {"speed_torque_control": 0, "timeout_time": 60_000}
FROM_FIRST_COMMAND = Behaviour(timeout_from="first_command")


def limits(*values: int) -> dict[str, int]:
    return dict(zip(("0x25", "0x3A", "0x3B", "0x3C", "0x3D"), values, strict=True))


TEMPORARY = limits(1, 30, -30, 30, -30)
PERMANENT = limits(0, 300, -300, 100, -100)


def starting(angle_deg: float = 150.0, model: str = "BLA21-06U-A0", **rom: int) -> Desk:
    desk = Desk(model, rom=STORED | rom, angle_deg=angle_deg)
    assert desk.servo.soft_starting
    return desk


def array(servo_id: int, position: float) -> Callable[[Desk], None]:
    return lambda desk: desk.array(servo_id, 1, position)


def broken(desk: Desk) -> None:
    desk.servo.faults.inject("motor_driver", True)


@pytest.mark.states("B66", "B67", "B68")
@pytest.mark.parametrize("angle_deg", [150.0, -150.0, 20.0])
def test_it_goes_to_0_at_no_more_than_30_rpm_and_ends_1_degree_before_it(angle_deg: float) -> None:
    desk = starting(angle_deg)
    fastest = 0
    while desk.servo.soft_starting:
        desk.wait(0.005)
        fastest = max(fastest, abs(desk.value("0x09")))
    assert 20 <= fastest <= 31
    assert abs(desk.value("0x08")) <= 10
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)


OWN_LIMITS = {
    "speed_torque_control": 1, "speed_limit_cw": 20, "speed_limit_ccw": -250, "torque_limit_cw": 90,
    "torque_limit_ccw": -80,
}  # fmt: skip


@pytest.mark.states("B66", "B67", "B68", "B76")
@stories({
    "B66, B67: five parameters change until it ends and later motion is fast": ({}, [
        {"0x21": 1, **TEMPORARY}, Desk.settle, PERMANENT, ("0x00", -900, 0.08), {"0x09": between(-300, -61)},
    ]),
    "B66, B67: five parameters return to the stored values": (
        OWN_LIMITS, [TEMPORARY, Desk.settle, limits(1, 20, -250, 90, -80)],
    ),
    "B67: torque is limited too": ({}, [
        under(load_pct=40.0), 0.4, {"0x0A": between(-31, 31), "angle_deg": between(150, 360)},
    ]),
    "B68: an angle command ends it and is executed at full speed": ({}, [
        ("0x00", -900, 0), {"soft_starting": False}, PERMANENT, 0.2, {"0x09": between(-300, -61)},
        Desk.settle, {"0x08": near(-900)},
    ]),
    "B68: an ArrayCommand ends it and is executed at full speed": ({}, [
        array(8, 0.5), {"soft_starting": True}, array(7, -0.9), {"soft_starting": False}, PERMANENT,
        0.2, {"0x09": between(-300, -61)}, Desk.settle, {"0x08": near(-900)},
    ]),
    **{f"B68: {name} ends it and is obeyed where 0x25 is on": ({"speed_torque_control": 1}, [
        (name, 20, 0), {"soft_starting": False}, 0.5, {name: 20, "0x09": between(19, 300)},
    ]) for name in ("0x01", "0x02")},
    "B68: a motor failure ends it and reading and configuring do not": ({}, [
        lambda desk: desk.reads(*(f"0x{at:02X}" for at in range(0x60))), ("0x3E", 70, 0), Desk.node_info,
        {"soft_starting": True}, broken, 0.1, {"soft_starting": False},
    ]),
})  # fmt: skip
def test_soft_start(rom: Rom, steps: Steps) -> None:
    desk = Desk(rom=STORED | rom, angle_deg=150.0)
    follow(desk, {"soft_starting": True}, *steps)


@pytest.mark.states("B66")
@pytest.mark.parametrize("reverse", [0, 1])
def test_0_is_relative_to_the_origin(reverse: int) -> None:
    desk = starting(45.0, origin=-300, reverse=reverse)
    follow(desk, Desk.settle, {"angle_deg": near(30.0 if reverse else -30.0, 0.4)})


@pytest.mark.states("B68")
def test_it_does_not_run_within_1_degree_of_0() -> None:
    assert not Desk(rom=STORED, angle_deg=0.6).servo.soft_starting


@pytest.mark.states("B66")
def test_without_it_the_angle_is_held() -> None:
    follow(Desk(rom=STORED | {"soft_start": 0}, angle_deg=90.0), PERMANENT, 2.0, {"0x08": 900})


@pytest.mark.states("B68", "B76")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_speed_and_torque_end_it_and_the_horn_brakes_where_0x25_is_off(name: str) -> None:
    desk = starting()
    follow(desk, {"0x25": 1}, (name, 20, 0), {"soft_starting": False, "0x25": 0}, 0.5)
    there = desk.servo.angle_deg
    assert abs(there) > 100
    follow(desk, 1.0, {"angle_deg": near(there, 0.1)})


@pytest.mark.states("B68")
@pytest.mark.parametrize("mode", [0, 1, 2])
def test_torque_mode_ends_it_and_the_horn_stays(mode: int) -> None:
    desk = starting()
    follow(desk, 0.2, ("0x20", mode, 0), {"soft_starting": False})
    follow(desk, 1.0, {"angle_deg": near(desk.servo.angle_deg, 6 if mode == 0 else 15)})


@pytest.mark.states("B68", "B85")
@pytest.mark.parametrize(("model", "ends"), [("BLA21-06U-AB", True), ("BLA21-06U-A0", False)])
def test_a_pulse_ends_it_on_a_model_with_pwm_input_only(model: str, ends: bool) -> None:
    desk = starting(model=model).under(pwm_us=1_870.0)
    assert desk.servo.soft_starting is not ends
    desk.settle()
    assert desk.read("0x08") == pytest.approx(350 if ends else 0, abs=3)


@pytest.mark.states("B68")
@pytest.mark.parametrize("cause", [{"voltage_v": 11.0}, {"voltage_v": 3.5}, {"temperature_c": 90.0}])
def test_protection_ends_it(cause: dict[str, float]) -> None:
    desk = starting().under(**cause)
    there = desk.servo.angle_deg
    follow(desk, {"soft_starting": False}, under(voltage_v=7.4, temperature_c=25.0), 1.0)
    follow(desk, {"angle_deg": near(there, 6)}, PERMANENT)


@pytest.mark.states("B68")
@pytest.mark.switch("timeout_from")
def test_a_short_timeout_ends_it_unless_it_starts_at_the_first_command() -> None:
    quick = {"timeout_time": 300}
    desk = Desk(rom=quick, angle_deg=170.0, behaviour=FROM_FIRST_COMMAND)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    ended = Desk(rom=quick, angle_deg=170.0)
    ended.wait(3.0)
    assert (ended.servo.output, ended.servo.soft_starting) == (1, False)
    assert ended.servo.angle_deg > 60


@pytest.mark.states("B68")
@pytest.mark.parametrize("action", [0, 1, 2])
def test_the_timeout_ends_it_unless_its_action_is_hold(action: int) -> None:
    desk = Desk(rom={"timeout_time": 300, "timeout_action": action}, angle_deg=170.0)
    desk.wait(0.5)
    assert (desk.servo.output, desk.servo.soft_starting) == (action, action == 0)


def held_up(load_pct: float, **rom: int) -> Recipe:
    """A servo that starts at 120° and does not reach 0°."""
    plant = PlantConstants(load_pct=load_pct)
    return Recipe(
        "BLA21-06U-A0",
        "1.300",
        servo_id=1,
        node_id=11,
        rom=rom,
        angle_deg=120.0,
        plant=plant,
    )


@pytest.mark.states("B68")
@scene(held_up(0.0, timeout_time=300, speed_limit_cw=250))
async def test_the_host_sees_soft_start_end_by_the_timeout_and_reads_the_stored_limits(rig: Rig) -> None:
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
@scene(lambda action: replace(held_up(60.0, timeout_time=300, timeout_action=action), behaviour=FROM_FIRST_COMMAND))
async def test_a_blocked_soft_start_continues_unless_a_timeout_ends_it(rig: Rig, action: int) -> None:
    await asyncio.sleep(8)
    servo = rig.host.fleet.all()[0]
    assert rig.sim(servo).soft_starting
    assert servo.state is State.SOFT_START
    assert "speed_limit_cw" not in servo.rom()

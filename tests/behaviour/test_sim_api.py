"""What a bench could do to a real servo, done over REST: the servo answers as its model and firmware would."""

import asyncio
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid


async def change(rig: Rig, **what: object) -> dict[str, Any]:
    uid = next(iter(rig.bench.servos))
    found: dict[str, Any] = json(await rig.call("PATCH", f"/sim/servos/{uid}", what))
    return found


async def reading(rig: Rig, key: str) -> Any:
    uid = next(iter(rig.bench.servos))
    return json(await rig.call("GET", f"/servos/{uid}/parameters/{key}"))["value"]


@scene()
async def test_the_list_says_what_every_servo_is_and_where_it_stands(rig: Rig) -> None:
    await rig.ready()
    shown = json(await rig.call("GET", "/sim/servos"))
    assert [(one["model"], one["firmware"], one["node_id"], one["stage"]) for one in shown] == [
        ("BLA21-06U-A0", "1.300", 11, "running")
    ]
    assert shown[0]["story"] == ""
    assert shown[0]["behaviour"]["out_of_range"] == "refuse"
    assert json(await rig.call("GET", f"/sim/servos/{shown[0]['uid']}")) == shown[0]


@scene()
async def test_a_servo_put_on_the_bench_is_found_identified_and_can_be_taken_off_again(rig: Rig) -> None:
    await rig.ready()
    made = json(await rig.call("POST", "/sim/servos", {"model": "BLA15-12U-A0", "firmware": "1.200"}), 201)
    assert made["node_id"] is None
    servos = await rig.ready(2)
    assert {servo.model.name for servo in servos if servo.model} == {"BLA21-06U-A0", "BLA15-12U-A0"}
    assert (await rig.call("DELETE", f"/sim/servos/{made['uid']}")).status_code == 204
    await asyncio.sleep(5)
    assert not rig.host.fleet.get(made["uid"]).online
    problem(await rig.call("DELETE", f"/sim/servos/{made['uid']}"), "unknown_servo", 404)


@pytest.mark.parametrize(
    "body",
    [
        {"model": "BLA99"}, {"model": "BLA21-06U-A0", "firmware": "9.999"},
        {"model": "BLA21-06U-A0", "rom": {"overcurrent_limit": 9999}}, {"model": "BLA21-06U-A0", "rom": {"nothing": 1}},
    ],
)  # fmt: skip
@scene()
async def test_a_servo_that_cannot_exist_is_not_put_on_the_bench(rig: Rig, body: dict[str, object]) -> None:
    problem(await rig.call("POST", "/sim/servos", body), "invalid_value", 422)
    assert len(rig.bench.servos) == 1


@scene()
async def test_heat_and_supply_reach_the_registers_the_faults_and_the_motor(rig: Rig) -> None:
    await rig.ready()
    await change(rig, temperature_c=60, voltage_v=8.0)
    await asyncio.sleep(0.5)
    assert await reading(rig, "current_temperature") == pytest.approx(60, abs=2)
    assert await reading(rig, "current_voltage") == pytest.approx(8.0, abs=0.2)
    shown = await change(rig, temperature_c=95)
    await asyncio.sleep(0.5)
    shown = await change(rig)
    assert shown["faults"] == ["temperature_high"]
    assert shown["output"] == "off"


@scene()
async def test_a_hand_turns_a_horn_without_output_and_not_one_that_holds(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 0}, lease=lease))
    refused = await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"external_angle_deg": 40, "mute": True})
    problem(refused, "busy", 409)
    assert not rig.sim(servo).conditions.mute, "nothing of a refused change may be done"
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await change(rig, external_angle_deg=40)
    assert await reading(rig, "current_angle") == pytest.approx(40, abs=0.1)


@scene()
async def test_faults_are_set_and_taken_back_by_key(rig: Rig) -> None:
    await rig.ready()
    assert (await change(rig, faults={"sensor_weak": True}))["faults"] == ["sensor_weak"]
    assert await reading(rig, "fault_warning") == 1 << 4
    assert (await change(rig, faults={"sensor_weak": False}))["faults"] == []
    refused = await rig.call("PATCH", f"/sim/servos/{next(iter(rig.bench.servos))}", {"faults": {"pwm_low": True}})
    assert "fault bits" in problem(refused, "invalid_value", 422)["detail"]


@scene()
async def test_refused_keys_are_refused_by_the_servo_and_read_again_when_taken_back(rig: Rig, servo: Servo) -> None:
    await change(rig, refuse_keys=["angle_limit_cw"])
    path = f"/servos/{servo.uid}/parameters/angle_limit_cw"
    problem(await rig.call("PUT", path, {"value": 90}), "refused_by_servo", 502)
    await change(rig, refuse_keys=[])
    assert json(await rig.call("PUT", path, {"value": 90}))["value"] == 90


@scene()
async def test_a_mute_servo_goes_offline_and_a_deaf_supply_too(rig: Rig, servo: Servo) -> None:
    await change(rig, mute=True)
    await asyncio.sleep(4)
    assert not servo.online
    await change(rig, mute=False)
    await asyncio.sleep(3)
    assert servo.online
    assert (await change(rig, power="off"))["stage"] == "off"
    await asyncio.sleep(4)
    assert not servo.online
    assert (await change(rig, power="on"))["power"] == "on"
    await rig.ready()


@scene()
async def test_a_slow_servo_answers_late_and_in_order(rig: Rig, servo: Servo) -> None:
    await rig.host.polling.close()
    await change(rig, response_delay_s=0.05)
    loop = asyncio.get_running_loop()
    began = loop.time()
    assert await reading(rig, "soft_start") is True
    assert 0.05 <= loop.time() - began < 0.06
    assert servo.online


@scene()
async def test_during_a_software_update_the_motor_is_off_writes_fail_and_the_end_is_a_restart(
    rig: Rig, servo: Servo
) -> None:
    boots = (await change(rig, software_update=True))["starts"]
    await asyncio.sleep(1.5)
    assert servo.state is State.UPDATING
    assert (await change(rig))["output"] == "off"
    problem(await rig.call("PUT", f"/servos/{servo.uid}/parameters/smoothing", {"value": False}), "busy", 409)
    await change(rig, software_update=False)
    await asyncio.sleep(4)
    assert servo.state is State.READY
    assert (await change(rig))["starts"] == boots + 1


@pytest.mark.parametrize(
    "body",
    [
        {"behaviour": {"out_of_range": "explode"}}, {"behaviour": {"acknowledges_save": "yes"}}, {"behaviour": {"magic": 1}},
        {"behaviour": {"position_unit": True}}, {"refuse_keys": ["nothing"]}, {"faults": {"nothing": True}},
    ],
)  # fmt: skip
@scene()
async def test_switches_and_names_that_do_not_exist_change_nothing(
    rig: Rig, servo: Servo, body: dict[str, object]
) -> None:
    before = rig.sim(servo).behaviour
    answer = await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"voltage_v": 9.0, **body})
    problem(answer, "invalid_value", 422)
    assert rig.sim(servo).behaviour == before
    assert rig.sim(servo).conditions.voltage_v == 7.4


@scene()
async def test_switches_are_set_by_name_and_the_position_unit_by_its_own_word(rig: Rig) -> None:
    shown = await change(rig, behaviour={"out_of_range": "clamp"}, position_unit="radian")
    assert (shown["behaviour"]["out_of_range"], shown["position_unit"]) == ("clamp", "radian")


@scene()
async def test_a_server_without_a_bench_says_so(rig: Rig) -> None:
    bench, rig.app.state.bench = rig.app.state.bench, None
    try:
        found = problem(await rig.call("GET", "/sim/servos"), "no_simulator", 404)
        assert "hornbill demo" in found["detail"]
    finally:
        rig.app.state.bench = bench


@scene(PLAIN, Recipe("BLA15-06U-A0", "1.300", servo_id=2, node_id=12))
async def test_a_second_servo_with_the_same_unique_id_is_refused(rig: Rig) -> None:
    uid = Uid(next(iter(rig.bench.servos)))
    problem(
        await rig.call("POST", "/sim/servos", {"model": "BLA21-06U-A0", "uid": uid}), "invalid_value", 422
    )  # fmt: skip

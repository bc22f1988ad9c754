"""The simulator over REST: everything a bench can do to a real servo."""

import asyncio
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid


def path_of(rig: Rig) -> str:
    """The path of the first servo."""
    return f"/servos/{next(iter(rig.bench.servos))}"


async def change(rig: Rig, **what: object) -> dict[str, Any]:
    """Change the first servo's conditions. Returns the response body."""
    found: dict[str, Any] = json(await rig.call("PATCH", f"/sim{path_of(rig)}", what))
    return found


async def reading(rig: Rig, key: str) -> Any:
    return json(await rig.call("GET", f"{path_of(rig)}/parameters/{key}"))["value"]


@scene()
async def test_servos_are_listed_added_and_removed(rig: Rig, servo: Servo) -> None:
    shown = json(await rig.call("GET", "/sim/servos"))
    assert [(one["model"], one["firmware"], one["node_id"], one["stage"]) for one in shown] == [
        ("BLA21-06U-A0", "1.300", 11, "running")
    ]
    assert shown[0]["story"] == ""
    assert shown[0]["behaviour"]["out_of_range"] == "refuse"
    assert json(await rig.call("GET", f"/sim/servos/{servo.uid}")) == shown[0]
    made = json(await rig.call("POST", "/sim/servos", {"model": "BLA15-12U-A0", "firmware": "1.200"}), 201)
    assert made["node_id"] is None
    servos = await rig.ready(2)
    assert {servo.model.name for servo in servos if servo.model} == {"BLA21-06U-A0", "BLA15-12U-A0"}
    assert (await rig.call("DELETE", f"/sim/servos/{made['uid']}")).status_code == 204
    await asyncio.sleep(5)
    assert not rig.host.fleet.get(made["uid"]).online
    problem(await rig.call("DELETE", f"/sim/servos/{made['uid']}"), "unknown_servo", 404)


@scene(PLAIN, Recipe("BLA15-06U-A0", "1.300", servo_id=2, node_id=12))
async def test_a_servo_that_cannot_exist_or_has_the_unique_id_of_another_is_refused(rig: Rig) -> None:
    for body in (
        {"model": "BLA99"},
        {"model": "BLA21-06U-A0", "firmware": "9.999"},
        {"model": "BLA21-06U-A0", "rom": {"overcurrent_limit": 9999}},
        {"model": "BLA21-06U-A0", "rom": {"nothing": 1}},
        {"model": "BLA21-06U-A0", "uid": Uid(next(iter(rig.bench.servos)))},
    ):
        problem(await rig.call("POST", "/sim/servos", body), "invalid_value", 422)
    assert len(rig.bench.servos) == 2


@scene()
async def test_temperature_supply_and_faults_affect_registers_and_output(rig: Rig, servo: Servo) -> None:
    assert (await change(rig, faults={"sensor_weak": True}))["faults"] == ["sensor_weak"]
    assert await reading(rig, "fault_warning") == 1 << 4
    assert (await change(rig, faults={"sensor_weak": False}))["faults"] == []
    problem(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"faults": {"pwm_low": True}}), "invalid_value", 422)
    await change(rig, temperature_c=60, voltage_v=8.0)
    await asyncio.sleep(0.5)
    assert await reading(rig, "current_temperature") == pytest.approx(60, abs=2)
    assert await reading(rig, "current_voltage") == pytest.approx(8.0, abs=0.2)
    await change(rig, temperature_c=95)
    await asyncio.sleep(0.5)
    shown = await change(rig)
    assert (shown["faults"], shown["output"]) == (["temperature_high"], "off")


@scene()
async def test_a_horn_can_be_turned_manually_only_without_output(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 0}, lease=lease))
    refused = await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"external_angle_deg": 40, "mute": True})
    problem(refused, "busy", 409)
    assert not rig.sim(servo).conditions.mute, "a refused change has no effect"
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await change(rig, external_angle_deg=40)
    assert await reading(rig, "current_angle") == pytest.approx(40, abs=0.1)


@scene()
async def test_refused_keys_and_a_response_delay_last_until_removed(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters/angle_limit_cw"
    await change(rig, refuse_keys=["angle_limit_cw"])
    problem(await rig.call("PUT", path, {"value": 90}), "refused_by_servo", 502)
    await change(rig, refuse_keys=[])
    assert json(await rig.call("PUT", path, {"value": 90}))["value"] == 90
    await rig.host.polling.close()
    await change(rig, response_delay_s=0.05)
    loop = asyncio.get_running_loop()
    began = loop.time()
    assert await reading(rig, "soft_start") is True
    assert 0.05 <= loop.time() - began < 0.06
    assert servo.online


@scene()
async def test_a_muted_servo_and_one_without_supply_are_offline(rig: Rig, servo: Servo) -> None:
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
async def test_during_a_software_update_output_is_off_and_writes_are_refused_and_a_restart_follows(
    rig: Rig, servo: Servo
) -> None:
    starts = (await change(rig, software_update=True))["starts"]
    await asyncio.sleep(1.5)
    assert servo.state is State.UPDATING
    assert (await change(rig))["output"] == "off"
    problem(await rig.call("PUT", f"/servos/{servo.uid}/parameters/smoothing", {"value": False}), "busy", 409)
    await change(rig, software_update=False)
    await asyncio.sleep(4)
    assert servo.state is State.READY
    assert (await change(rig))["starts"] == starts + 1


@scene()
async def test_unknown_switches_and_names_are_refused_and_valid_ones_set(rig: Rig, servo: Servo) -> None:
    before = rig.sim(servo).behaviour
    for body in (
        {"behaviour": {"out_of_range": "explode"}},
        {"behaviour": {"acknowledges_save": "yes"}},
        {"behaviour": {"magic": 1}},
        {"behaviour": {"position_unit": True}},
        {"refuse_keys": ["nothing"]},
        {"faults": {"nothing": True}},
    ):
        response = await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"voltage_v": 9.0, **body})
        problem(response, "invalid_value", 422)
        assert (rig.sim(servo).behaviour, rig.sim(servo).conditions.voltage_v) == (before, 7.4)
    shown = await change(rig, behaviour={"out_of_range": "clamp"}, position_unit="radian")
    assert (shown["behaviour"]["out_of_range"], shown["position_unit"]) == ("clamp", "radian")


@scene()
async def test_a_server_without_a_simulator_refuses(rig: Rig) -> None:
    bench, rig.app.state.bench = rig.app.state.bench, None
    try:
        problem(await rig.call("GET", "/sim/servos"), "no_simulator", 404)
    finally:
        rig.app.state.bench = bench


@scene()
async def test_constants_of_the_plant_are_set_as_a_whole_and_refused_as_a_whole(rig: Rig, servo: Servo) -> None:
    path = f"/sim/servos/{servo.uid}"
    plant = {"inertia": 3.0, "backlash_deg": 0.5, "stop_cw_deg": 30.0, "load_by_angle": [[-90.0, 5.0], [90.0, -5.0]]}
    shown = await change(rig, plant=plant, load_pct=10.0)
    assert (shown["load_inertia"], shown["load_pct"]) == (3.0, 10.0)
    truth = json(await rig.call("GET", f"{path}/truth"))
    expected = DEFAULT_PLANT | plant | {"load_pct": 10.0}
    assert truth["plant"] == expected
    for wrong in ({"inertia": -1}, {"inertja": 1}, {"coulomb": 0.5}, {"stop_cw_deg": -5, "stop_ccw_deg": 5}):
        problem(await rig.call("PATCH", path, {"plant": wrong, "voltage_v": 1.0}), "invalid_value", 422)
    assert json(await rig.call("GET", f"{path}/truth"))["plant"] == expected
    assert json(await rig.call("GET", path))["voltage_v"] == shown["voltage_v"]
    assert (await change(rig, plant={}))["load_inertia"] == 0.0
    made = json(await rig.call("POST", "/sim/servos", {"model": "BLA15-12U-A0", "plant": {"inertia": 2.0}}), 201)
    assert json(await rig.call("GET", f"/sim/servos/{made['uid']}/truth"))["plant"]["inertia"] == 2.0
    problem(await rig.call("GET", f"/sim/servos/{'0' * 32}/truth"), "unknown_servo", 404)


DEFAULT_PLANT: dict[str, Any] = {
    "inertia": 0.0, "breakaway": 0.03, "coulomb": 0.02, "viscous": 0.3, "backlash_deg": 0.2, "torque_lag_s": 0.003,
    "load_pct": 0.0, "load_by_angle": [], "supply_ohm": 0.0, "stop_cw_deg": None, "stop_ccw_deg": None,
    "sensor_noise_deg": 0.0, "wear_per_hour": 0.0,
}  # fmt: skip


@scene()
async def test_the_truth_shows_what_no_reading_does(rig: Rig, servo: Servo) -> None:
    async def truth() -> dict[str, Any]:
        return json(await rig.call("GET", f"/sim/servos/{servo.uid}/truth"))

    await change(rig, plant={"load_pct": 100.0, "supply_ohm": 0.5, "wear_per_hour": 3600.0}, sensor_error=1.0)
    await asyncio.sleep(2.0)
    falls = await truth()
    assert falls["speed_rpm"] > 100
    assert falls["horn_deg"] - falls["motor_deg"] == pytest.approx(0.1), "the load pushes it through the backlash"
    assert falls["friction_factor"] == pytest.approx(1.0 + falls["moved_s"], abs=0.01)
    assert falls["moved_s"] == pytest.approx(2.0, abs=0.1)
    assert falls["supply_v"] == pytest.approx(await reading(rig, "current_voltage") - 0.5, abs=0.15)
    assert falls["temperature_c"] == pytest.approx(await reading(rig, "current_temperature") - 5, abs=1)


@scene(PLAIN, Recipe("BLA15-12U-A0", "1.200", servo_id=2, node_id=12))
async def test_chaos_is_started_listed_and_stopped(rig: Rig) -> None:
    await rig.ready(2)
    idle: dict[str, Any] = {"running": False, "seed": None, "kinds": [], "interval_s": None, "active": 0, "injected": 0}
    assert json(await rig.call("GET", "/sim/chaos")) == idle
    asked = {"seed": 4, "kinds": ["mute", "load"], "interval_s": 2.0}
    started = json(await rig.call("PUT", "/sim/chaos", asked))
    assert started == {**idle, **asked, "running": True}
    await asyncio.sleep(60)
    found = json(await rig.call("GET", "/sim/chaos/injections"))
    assert len(found) > 10
    assert [one["number"] for one in found] == sorted((one["number"] for one in found), reverse=True)
    assert {one["kind"] for one in found} == {"load", "mute"}
    assert {one["uid"] for one in found} == {*rig.bench.servos}
    first = await rig.call("GET", "/sim/chaos/injections?limit=3")
    second = await rig.call("GET", "/sim/chaos/injections" + first.links["next"]["url"])
    assert json(first) + json(second) == found[:6]
    now = rig.host.base.utc_now()
    assert all(one["at"] <= now and (one["until"] > now) is one["active"] for one in found)
    loads = {one["uid"]: one["values"]["load_pct"] for one in found if one["active"] and one["kind"] == "load"}
    for uid, servo in rig.bench.servos.items():
        assert servo.conditions.load_pct == loads.get(uid, 0.0)
    stopped = json(await rig.call("DELETE", "/sim/chaos"))
    assert stopped == {**idle, "injected": len(found)}
    assert not any(one["active"] for one in json(await rig.call("GET", "/sim/chaos/injections")))
    problem(await rig.call("PUT", "/sim/chaos", {"seed": 1, "kinds": ["bad luck"]}), "invalid_value", 422)
    for uid in [*rig.bench.servos]:
        await rig.bench.remove(uid)
    refused = problem(await rig.call("PUT", "/sim/chaos", {"seed": 1}), "invalid_value", 422)
    assert refused["cause"] == "nothing_to_inject"


@scene()
async def test_the_clock_is_virtual_and_its_speed_can_be_changed(rig: Rig) -> None:
    first = json(await rig.call("GET", "/sim/clock"))
    assert (first["virtual"], first["speed"]) == (True, "max")
    await asyncio.sleep(60)
    second = json(await rig.call("GET", "/sim/clock"))
    assert second["now"] - first["now"] == pytest.approx(60, abs=0.01)
    assert second["elapsed_s"] - first["elapsed_s"] == pytest.approx(60, abs=0.01)
    assert second["actual_speed"] > 1
    assert json(await rig.call("PUT", "/sim/clock", {"speed": 500}))["speed"] == 500
    assert json(await rig.call("PUT", "/sim/clock", {"speed": "max"}))["speed"] == "max"
    for wrong in (0, -1, 1001, "fast", None):
        problem(await rig.call("PUT", "/sim/clock", {"speed": wrong}), "invalid_value", 422)


def test_the_speed_of_real_time_cannot_be_changed() -> None:
    async def real(rig: Rig) -> None:
        shown = json(await rig.call("GET", "/sim/clock"))
        assert (shown["virtual"], shown["speed"], shown["actual_speed"]) == (False, 1.0, 1.0)
        refused = problem(await rig.call("PUT", "/sim/clock", {"speed": 10}), "conflict", 409)
        assert refused["cause"] == "real_time"

    play(real, connect=False, behind=True)


REVERSED = Recipe(
    "BLA21-12U-A0", "1.300", servo_id=1, node_id=11,
    rom={"reverse": 1, "origin": 150, "extended_angle": 1, "soft_start": 0, "angle_limit_cw": 9000},
)  # fmt: skip


@scene(REVERSED)
async def test_the_truth_is_in_the_terms_of_the_host(rig: Rig, servo: Servo, lease: str) -> None:
    """With reverse, origin and turns, whatever the host may have read before."""
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    wanted = {"type": "angle", "value": 540.0, "wait": "settled", "confirm": ["turns"]}
    json(await rig.call("POST", f"{path}/command", wanted, lease=lease))
    values = {"values": {"smoothing": False, "overcurrent_limit": 5}}
    json(await rig.call("PATCH", f"{path}/parameters", values, lease=lease))
    truth = json(await rig.call("GET", f"/sim{path}/truth"))
    rows = json(await rig.call("GET", f"{path}/parameters?refresh=true"))["parameters"]
    assert truth["angle_deg"] == pytest.approx(540.0, abs=0.5)
    assert truth["horn_deg"] < -500, "mounted in reverse"
    assert truth["output"] == "on"
    assert truth["faults"] == []
    read = {key: row["value"] for key, row in rows.items()}
    assert truth["ram"] == {key: read[key] for key in truth["ram"]}
    assert truth["ram"]["torque_mode"] == "on"
    assert truth["rom"].keys() == {key for key, one in servo.registers.items() if one.parameter.rom}
    assert {key for key, value in truth["rom"].items() if truth["ram"][key] != value} == {
        "smoothing", "overcurrent_limit",
    }  # fmt: skip
    assert truth["rom_sound"]

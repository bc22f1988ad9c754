"""Save: how it can fail, and what is known of ROM afterwards (sections 4.10 to 4.14, errata C3)."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.restarting import (
    ended,
    failed_with,
    opcodes,
    requests,
    run,
    run_until,
    run_until_step,
    succeeded,
)
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import settled
from hornbill.servo.configuration.restart_plan import RestartOptions
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoStage
from hornbill.units import Uid
from hornbill.wire.services import RestartNodeRequest

GAIN = 0x2C
AFTER = "snapshot_has_previous_values"


async def change(rig: Rig, servo: Servo, **values: object) -> None:
    response = json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
    assert response["outcome"] == "applied", response


async def save(rig: Rig, servo: Servo, body: object = None) -> Any:
    return await run(rig, servo, "save", body)


async def save_until(rig: Rig, servo: Servo, stage: ServoStage) -> str:
    """Start a save and return the job's id as soon as the servo is in this stage."""
    return await run_until(rig, servo, "save", lambda _job: rig.sim(servo).stage is stage)


async def restore_power(rig: Rig, servo: Servo, after_s: float) -> None:
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(after_s)
    rig.bench.power(servo.uid, True)


def step(job: Any, name: str) -> Any:
    return next(one for one in job["steps"] if one["name"] == name)


@settled()
async def test_a_save_lists_its_steps_with_their_evidence(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, angle_p_gain=55)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    assert rig.sim(servo).turn_manually(20.0, asyncio.get_running_loop().time())
    rig.sim(servo).memory.put(0x20, 0)  # as another tool would: on without a command
    job = succeeded(await save(rig, servo))
    assert [one["name"] for one in job["steps"]] == [
        "check", "snapshot", "write", "silence", "restart", "back", "soft_start", "read_back",
    ]  # fmt: skip
    assert {one["state"] for one in job["steps"]} == {"done"}
    assert job["ended_at"] - job["created_at"] < 2, "it has run long enough to begin at once"
    rows = [key for key, register in servo.registers.items() if register.parameter.rom]
    silence, back, over = (step(job, name)["evidence_params"] for name in ("silence", "back", "soft_start"))
    assert 0 <= silence["from_s"] < 0.1
    assert 0.1 < silence["to_s"] < 0.6, "0.05 s of writing and 0.1 s of starting"
    assert silence["to_s"] <= back["after_s"] < 0.6
    assert 0 < over["took_s"] < 0.6
    assert abs(over["angle_deg"]) < 1.1
    moves = {"horn": "moves", "from_deg": 20.0, "to_deg": 0.0, "warnings": ["load_may_drop"]}
    snapshot_id = job["result"]["snapshot"]
    assert {one["name"]: (one["evidence_code"], one["evidence_params"]) for one in job["steps"]} == {
        "check": ("rows_read", {"rows": len(rows), "supply_v": 7.4, **moves}),
        "snapshot": ("snapshot_taken", {"snapshot": snapshot_id}),
        "write": ("sent", {"tries": 1, "acknowledged": True}),
        "silence": ("silent", {"from_s": silence["from_s"], "to_s": silence["to_s"]}),
        "restart": ("restarted", {}),
        "back": ("back_on_node", {"node_id": 11, "node_id_before": 11, "after_s": back["after_s"]}),
        "soft_start": ("soft_start_over", {"took_s": over["took_s"], "angle_deg": over["angle_deg"]}),
        "read_back": ("read_back", {"rows": len(rows)}),
    }
    ahead = "The horn turns slowly (30 rpm) from 20.0° to 0° in about 0.1 s. Keep its path clear. "
    ahead += "There is no torque during the restart, so a load on the horn may drop. Support it."
    assert step(job, "check")["ahead"] == ahead
    assert step(job, "check")["evidence"] == f"{len(rows)} rows read, supply 7.4 V. {ahead}"
    took_s = float(step(job, "silence")["evidence"].rpartition("(")[2].removesuffix(" s)"))
    assert took_s == pytest.approx(silence["to_s"] - silence["from_s"], abs=0.011)
    assert step(job, "back")["evidence"].startswith("node 11 (unchanged)")
    assert (job["result"]["node_id"], job["result"]["node_id_before"]) == (11, 11)
    assert job["result"]["saved"] == rows
    (record,) = job["result"]["servos"]
    assert (record["uid"], record["by"], record["started_at"]) == (servo.uid, "no lease", job["created_at"])
    assert job["steps"][-1]["started_at"] <= record["ended_at"] <= job["ended_at"]
    assert rig.sim(servo).memory.stored(GAIN) == 55
    snapshot = rig.host.history.snapshots.get(job["result"]["snapshot"])
    assert (snapshot.reason, snapshot.ram["angle_p_gain"], snapshot.rom["angle_p_gain"]) == ("before saving", 55, 40)
    assert servo.expected_rom is None


@pytest.mark.parametrize("delay", [0.05, 3.0])
@pytest.mark.parametrize("responds", [True, False], ids=["acknowledged", "acknowledgement lost"])
@pytest.mark.parametrize("node_id", [11, 0], ids=["static id", "dynamic id"])
@settled(lambda responds, node_id: replace(PLAIN, node_id=node_id, behaviour=Behaviour(acknowledges_save=responds)))
async def test_a_save_needs_no_acknowledgement(
    rig: Rig, servo: Servo, delay: float, responds: bool, node_id: int
) -> None:
    rig.sim(servo).conditions.restart_delay_s = delay
    await change(rig, servo, angle_p_gain=55)
    job = succeeded(await save(rig, servo))
    assert step(job, "write")["evidence_params"] == {"tries": 1, "acknowledged": responds}
    acknowledged = "acknowledged" if responds else "not acknowledged: waiting for a restart"
    assert step(job, "write")["evidence"] == f"sent once; {acknowledged}"
    assert rig.sim(servo).memory.stored(GAIN) == servo.registers["angle_p_gain"].rom == 55
    assert opcodes(rig) == 1
    assert requests(rig, RestartNodeRequest) == []


@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("node_id", [11, 0], ids=["static id", "dynamic id"])
@settled(lambda node_id: replace(PLAIN, node_id=node_id))
async def test_a_save_succeeds_with_a_fifth_of_all_frames_lost(rig: Rig, servo: Servo, seed: int, node_id: int) -> None:
    await change(rig, servo, angle_p_gain=55)
    rig.bus.loss(20, seed=seed)
    succeeded(await save(rig, servo))
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert servo.registers["angle_p_gain"].rom == 55


@pytest.mark.parametrize(
    ("during", "disturb", "for_s", "starts"),
    [
        ("write", "frames lost", 0.4, 2), (ServoStage.SAVING, "mute", 1.0, 2), (ServoStage.SAVING, "mute", 10.0, 2),
        (ServoStage.STARTING, "power off", 5.0, 2), ("read_back", "power off", 4.0, 3),
    ],
)  # fmt: skip
@settled()
async def test_a_save_succeeds_despite_a_disturbance(
    rig: Rig, servo: Servo, during: str | ServoStage, disturb: str, for_s: float, starts: int
) -> None:
    await change(rig, servo, angle_p_gain=55)
    if isinstance(during, ServoStage):
        job_id = await save_until(rig, servo, during)
    else:
        job_id = await run_until_step(rig, servo, "save", during)
    sim = rig.sim(servo)
    if disturb == "power off":
        await restore_power(rig, servo, for_s)
    else:
        sim.conditions.mute = disturb == "mute"
        rig.bus.loss(100 if disturb == "frames lost" else 0)
        await asyncio.sleep(for_s)
        sim.conditions.mute = False
        rig.bus.loss(0)
    job = succeeded(await ended(rig, job_id))
    assert step(job, "write")["evidence_params"]["tries"] == (2 if disturb == "frames lost" else 1)
    assert step(job, "write")["evidence"].startswith("sent 2 times") == (disturb == "frames lost")
    assert float(step(job, "silence")["evidence"].split("(")[1].split()[0]) > (for_s if disturb == "mute" else 0)
    assert sim.memory.stored(GAIN) == servo.registers["angle_p_gain"].rom == 55
    assert sim.starts == starts


@settled()
async def test_a_save_follows_a_changed_static_node_id(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, node_id=42)
    job = succeeded(await save(rig, servo))
    assert step(job, "back")["evidence"].startswith("node 11 → node 42")
    moved = step(job, "back")["evidence_params"]
    assert (moved["node_id_before"], moved["node_id"]) == (11, 42)
    assert (job["result"]["node_id_before"], job["result"]["node_id"]) == (11, 42)
    assert servo.node_id == 42


@settled(replace(PLAIN, node_id=0))
async def test_a_save_follows_a_changed_dynamic_node_id(rig: Rig, servo: Servo) -> None:
    was = servo.node_id
    await change(rig, servo, angle_p_gain=55)
    job_id = await save_until(rig, servo, ServoStage.STARTING)
    assert was is not None
    rig.host.store.allocations.drop(servo.uid)
    rig.host.store.allocations.record(Uid("ee" * 16), was)  # given to another servo
    job = succeeded(await ended(rig, job_id))
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert servo.node_id == job["result"]["node_id"] == rig.sim(servo).node_id != was
    assert step(job, "back")["evidence"].startswith(f"node {was} → node {servo.node_id}")


@settled()
async def test_power_loss_during_the_write_is_a_lost_configuration_with_a_snapshot(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, angle_p_gain=55)
    job_id = await save_until(rig, servo, ServoStage.SAVING)
    await restore_power(rig, servo, 2)
    error = failed_with(await ended(rig, job_id), "configuration_lost")
    assert f"Snapshot {error['snapshot']} contains the previous RAM values" in error["detail"]
    found = {one["key"]: one for one in error["differences"]}
    assert found["angle_p_gain"] == {"key": "angle_p_gain", "wanted": 55, "found": None}
    assert error["params"] == {
        "servo": servo.title,
        "cause": "rom_lost_during_save",
        "snapshot": error["snapshot"],
        "also": [AFTER],
    }
    assert set(found) == {key for key, register in servo.registers.items() if register.parameter.rom}
    assert rig.host.history.snapshots.get(error["snapshot"]).ram["angle_p_gain"] == 55
    assert all(one.rom is None for one in servo.registers.values())
    assert servo.busy is None


@pytest.mark.parametrize(
    ("differences", "text"),
    [
        ({"smoothing": (False, True), "angle_p_gain": (55, 40)}, "Angle P gain 40 instead of 55"),
        ({"torque_mode": ("off", "on")}, "Torque On instead of Off"),
    ],
    ids=["two rows", "torque mode"],
)
@settled()
async def test_power_loss_before_the_write_lists_every_difference_from_the_old_rom(
    rig: Rig, servo: Servo, differences: dict[str, tuple[object, object]], text: str
) -> None:
    await change(rig, servo, **{key: wanted for key, (wanted, _) in differences.items()})
    job_id = await run_until_step(rig, servo, "save", "write", {"confirm": ["torque_off_in_rom"]})
    await restore_power(rig, servo, 1)
    error = failed_with(await ended(rig, job_id), "unexpected_result")
    assert text in error["detail"]
    assert error["differences"] == [
        {"key": key, "wanted": wanted, "found": found} for key, (wanted, found) in differences.items()
    ]
    assert error["params"] == {
        "servo": servo.title, "cause": "rom_differs", "keys": list(differences),
        "snapshot": error["snapshot"], "also": [AFTER],
    }  # fmt: skip
    assert error["snapshot"] > 0
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    read = {key: shown[key]["rom"] for key in differences}
    assert read == {key: found for key, (_, found) in differences.items()}, "read after the restart"


@settled()
async def test_a_row_that_cannot_be_read_after_a_save_is_unverified_not_different(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, angle_p_gain=55)
    job_id = await save_until(rig, servo, ServoStage.SAVING)
    rig.sim(servo).conditions.refuse_keys.add("speed_p_gain")
    error = failed_with(await ended(rig, job_id), "unexpected_result")
    assert (error["cause"], error["params"]["keys"]) == ("rom_unverified", ["speed_p_gain"])
    assert "differs" not in error["detail"]
    assert "Speed P gain" in error["detail"]
    assert [one["found"] for one in error["differences"]] == [None]
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert (shown["angle_p_gain"]["rom"], shown["speed_p_gain"]["rom"]) == (55, None)


@settled()
async def test_a_save_times_out_on_a_servo_that_stays_off_and_its_rom_is_unknown(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, angle_p_gain=55)
    began = asyncio.get_running_loop().time()
    job_id = await save_until(rig, servo, ServoStage.SAVING)
    rig.bench.power(servo.uid, False)
    error = failed_with(await ended(rig, job_id), "no_response")
    assert 45 <= asyncio.get_running_loop().time() - began < 50
    assert f"No restart of {servo.title} was seen within 45 s" in error["detail"]
    assert error["params"] == {
        "servo": servo.title, "cause": "restart_not_seen", "within_s": 45.0,
        "snapshot": error["snapshot"], "also": [AFTER],
    }  # fmt: skip
    assert error["snapshot"] > 0
    assert servo.registers["angle_p_gain"].rom is None


@pytest.mark.parametrize("kind", ["save", "restart"])
@settled()
async def test_only_a_client_that_could_start_a_job_joins_it(rig: Rig, servo: Servo, kind: str) -> None:
    await change(rig, servo, angle_p_gain=55)
    path = f"/servos/{servo.uid}"
    job = json(await rig.call("POST", f"{path}/{kind}"), 202)["id"]
    await until(lambda: servo.expected_rom is not None or kind == "restart", every_s=0.001)
    lease = await rig.lease()
    problem(await rig.call("POST", f"{path}/{kind}"), "lease_held", 409)
    assert json(await rig.call("POST", f"{path}/{kind}", lease=lease), 202)["id"] == job
    if kind == "save":
        same = {"values": {"angle_p_gain": 55}, "save": True}
        problem(await rig.call("PATCH", f"{path}/parameters", same), "lease_held", 409)
        assert json(await rig.call("PATCH", f"{path}/parameters", same, lease=lease))["job"] == job
    succeeded(await ended(rig, job))


@settled()
async def test_a_second_save_joins_the_running_one_and_new_values_are_refused(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, angle_p_gain=55)
    job_id = await save_until(rig, servo, ServoStage.SAVING)
    assert json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)["id"] == job_id
    await until(lambda: servo.state is State.RESTARTING, every_s=0.001)
    assert json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)["id"] == job_id
    path, same = f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}, "save": True}
    joined = json(await rig.call("PATCH", path, same))
    assert (joined["job"], joined["outcome"]) == (job_id, "applied")
    assert joined["changes"] == [
        {"key": "angle_p_gain", "before": 55, "requested": 55, "after": 55, "verdict": "unchanged"}
    ]
    problem(await rig.call("PATCH", path, {"values": {"angle_p_gain": 1e9}, "save": True}), "busy", 409)
    other = {"values": {"angle_p_gain": 56}, "save": True}
    problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", other), "busy", 409)
    succeeded(await ended(rig, job_id))
    assert opcodes(rig) == 1
    assert rig.sim(servo).starts == 2


@settled()
async def test_stop_before_the_write_ends_the_save_with_nothing_sent(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, angle_p_gain=55)
    job_id = await run_until_step(rig, servo, "save", "check")
    await rig.call("POST", "/stop")
    error = failed_with(await ended(rig, job_id), "stopped")
    assert error["params"]["cause"] == "stopped"
    assert opcodes(rig) == 0
    assert servo.registers["angle_p_gain"].rom == 40, "nothing was sent, so ROM is unchanged"


@pytest.mark.parametrize("stage", [ServoStage.SAVING, ServoStage.STARTING])
@settled()
async def test_stop_during_the_write_leaves_only_torque_unproved(rig: Rig, servo: Servo, stage: ServoStage) -> None:
    await change(rig, servo, angle_p_gain=55)
    job_id = await save_until(rig, servo, stage)
    await rig.call("POST", "/stop")
    job = await ended(rig, job_id)
    error = failed_with(job, "stopped")
    rows = sum(register.parameter.rom for register in servo.registers.values())
    assert f"{rows - 1} of {rows} rows in ROM are verified. Torque mode is not" in error["detail"]
    assert error["params"] == {
        "servo": servo.title,
        "cause": "torque_unverified_stop",
        "snapshot": error["snapshot"],
        "also": [AFTER],
    }
    assert rig.sim(servo).output == 1
    assert servo.registers["angle_p_gain"].rom == 55
    assert servo.registers["torque_mode"].rom is None
    assert opcodes(rig) == 1


@pytest.mark.parametrize("volts", [3.8, 10.8])
@settled()
async def test_a_save_is_refused_at_a_supply_outside_the_limits(rig: Rig, servo: Servo, volts: float) -> None:
    await change(rig, servo, angle_p_gain=55)
    rig.sim(servo).conditions.voltage_v = volts
    await asyncio.sleep(0.5)
    job = await save(rig, servo)
    error = failed_with(job, "out_of_range")
    assert job["step"] is None
    assert f"{volts:.1f} V" in error["detail"]
    assert error["params"] == {
        "servo": servo.title, "cause": "supply_out_of_range_save", "key": "current_voltage", "requested": volts,
        "minimum": 4.0, "maximum": 10.0, "unit": "V",
    }  # fmt: skip
    assert opcodes(rig) == 0
    assert servo.registers["angle_p_gain"].rom == 40
    rig.sim(servo).conditions.voltage_v = 7.4
    await asyncio.sleep(0.5)
    succeeded(await save(rig, servo))


@settled()
async def test_a_save_is_refused_while_the_horn_turns(rig: Rig, servo: Servo) -> None:
    sim = rig.sim(servo)
    sim.memory.put(0x25, 1)
    sim.memory.put(0x26, 0)
    lease = await rig.lease()
    turning = {"type": "speed", "value": 40}
    json(await rig.call("POST", f"/servos/{servo.uid}/command", turning, lease=lease))
    rig.host.motion.cancel_commands()  # it turns on without a command, as its timeout is set to hold
    await asyncio.sleep(0.5)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", lease=lease))
    error = failed_with(job, "busy")
    speed = error["speed_rpm"]
    assert 35 <= abs(speed) <= 45
    assert f"turns at {speed} rpm" in error["detail"]
    assert error["params"] == {"servo": servo.title, "cause": "horn_turning_before_save", "speed_rpm": speed}
    assert opcodes(rig) == 0


@settled()
async def test_saving_torque_off_requires_a_confirmation(rig: Rig, servo: Servo) -> None:
    await change(rig, servo, torque_mode="off")
    forecast = json(await rig.call("GET", f"/servos/{servo.uid}/restart-forecast?save=true"))
    assert forecast["moves"] is False
    assert any("does not move until torque is turned on" in one for one in forecast["warnings"])
    for body in (None, {}, {"confirm": ["supply"]}):
        refused = problem(await rig.call("POST", f"/servos/{servo.uid}/save", body), "needs_confirmation", 409)
        assert (refused["confirm"], refused["key"]) == ("torque_off_in_rom", "torque_mode")
    patch = {"values": {"angle_p_gain": 55}, "save": True}
    before = rig.writes()
    refused = problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", patch), "needs_confirmation", 409)
    assert refused["confirm"] == "torque_off_in_rom"
    batch = json(await rig.call("PATCH", "/parameters", {"servos": {servo.uid: {"angle_p_gain": 55}}, "save": True}))
    assert batch["servos"][0]["problem"]["code"] == "needs_confirmation"
    assert rig.writes() == before
    assert rig.sim(servo).memory.stored(0x20) == 0
    assert json(await rig.call("GET", "/jobs")) == []
    body = {"confirm": ["torque_off_in_rom"]}
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", body))
    assert job["state"] == "succeeded"
    assert "does not move until torque is turned on" in step(job, "check")["evidence"]
    assert rig.sim(servo).memory.stored(0x20) == 1
    # ROM has torque off now, so a save changes nothing and needs no confirmation.
    succeeded(await save(rig, servo))


@pytest.mark.parametrize("mode", ["off", "brake"])
@settled()
async def test_a_save_turns_torque_on_if_requested(rig: Rig, servo: Servo, mode: str) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": mode}))
    forecast = json(await rig.call("GET", f"/servos/{servo.uid}/restart-forecast?save=true&torque_on=true"))
    assert not any("does not move until torque is turned on" in one for one in forecast["warnings"])
    horn = rig.sim(servo).angle_deg
    job = succeeded(await save(rig, servo, {"torque_on": True}))
    assert forecast["text"] in step(job, "check")["evidence"]
    assert (rig.sim(servo).memory.stored(0x20), servo.raw("torque_mode")) == (0, 0)
    assert abs(rig.sim(servo).angle_deg - horn) < 1


@settled()
async def test_a_refused_save_does_not_turn_torque_on(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "off"}))
    rig.sim(servo).conditions.voltage_v = 3.8
    await asyncio.sleep(0.5)
    job = await save(rig, servo, {"torque_on": True})
    assert job["state"] == "failed"
    assert rig.sim(servo).memory.get(0x20) == 1, "refused before anything was written"
    other = await rig.lease()
    problem(await rig.call("POST", f"{path}/save", {"torque_on": True}), "lease_held", 409)
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", f"{path}/save", {"torque_on": True}, lease=other), "stopped", 423)
    assert rig.sim(servo).memory.get(0x20) == 1


@pytest.mark.parametrize("mode", ["off", "brake"])
@settled()
async def test_saving_a_staged_torque_mode_requires_a_confirmation(rig: Rig, servo: Servo, mode: str) -> None:
    path, lease = f"/servos/{servo.uid}/parameters", await rig.lease()
    patch = {"values": {"torque_mode": mode}, "save": True}
    problem(await rig.call("PATCH", path, patch, lease=lease), "needs_confirmation", 409)
    assert servo.raw("torque_mode") == 0
    json(await rig.call("PATCH", path, {"values": {"torque_mode": mode}}, lease=lease))
    problem(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), "needs_confirmation", 409)
    rig.sim(servo).memory.put(0x20, 0)  # as another tool would: that is no configuration
    problem(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), "needs_confirmation", 409)
    body = {"confirm": ["torque_off_in_rom"]}
    succeeded(json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", body, lease=lease)))
    assert rig.sim(servo).memory.stored(0x20) == {"off": 1, "brake": 2}[mode]


@settled()
async def test_a_restart_does_what_its_forecast_says(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    rig.sim(servo).turn_manually(-90.0, asyncio.get_running_loop().time())
    await asyncio.sleep(0.3)
    forecast = json(await rig.call("GET", f"/servos/{servo.uid}/restart-forecast?save=false"))
    assert (forecast["moves"], forecast["from_deg"], forecast["to_deg"], forecast["takes_s"]) == (True, -90.0, 0.0, 0.5)
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    assert abs(rig.sim(servo).angle_deg) <= 1.1


@settled()
async def test_the_audit_names_client_and_job_of_a_save_and_a_restart(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    good = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", lease=lease))
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true", lease=lease))
    await rig.call("DELETE", f"/leases/{lease}")
    await asyncio.sleep(3)
    rig.sim(servo).conditions.voltage_v = 3.8
    await asyncio.sleep(0.3)
    bad = await save(rig, servo)
    rows = [one.entry for one in rig.host.store.audit.rows(uid=servo.uid)]
    entries = [(one.action, one.outcome, one.by, one.job) for one in rows if one.action in ("save", "restart")]
    assert entries[0] == ("save", "failed", "no lease", bad["id"])
    assert entries[1][:3] == ("restart", "succeeded", "test")
    assert entries[2] == ("save", "succeeded", "test", good["id"])


@settled()
async def test_a_save_permitted_earlier_needs_no_lease_but_no_stop(rig: Rig, servo: Servo) -> None:
    await rig.lease()
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "lease_held", 409)
    job = await rig.host.jobs.wait(rig.host.restarting.start(servo, "save", RestartOptions(by="night shift")))
    assert job.state == "succeeded", job.error
    await rig.call("POST", "/stop")
    with pytest.raises(Exception, match="Stopped by"):
        rig.host.restarting.start(servo, "save", RestartOptions(by="night shift"))


@settled()
async def test_a_full_disk_does_not_prevent_a_save_and_the_missing_snapshot_is_reported(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:

    def full(*_args: object, **_more: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(rig.host.history, "store_known", full)
    job = await save(rig, servo)
    assert job["state"] == "succeeded"
    shown = step(job, "snapshot")
    assert (shown["state"], shown["evidence_code"], shown["evidence_params"]) == ("failed", "snapshot_failed", {})
    assert "cannot be undone" in shown["evidence"]
    assert job["result"]["snapshot"] is None

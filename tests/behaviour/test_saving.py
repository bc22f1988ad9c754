"""Honest save: every way it can go wrong, and what is known of ROM afterwards (sections 4.10 to 4.14, errata C3)."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.servo.configuration.restart_plan import RestartOptions
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoStage
from hornbill.sim.services import Services
from hornbill.units import Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.services import ExecuteOpcodeRequest, ExecuteOpcodeResponse, Opcode, RestartNodeRequest

GAIN = 0x2C


async def old(rig: Rig) -> Servo:
    """A servo that has run for a while, so that a save begins at once."""
    servo = (await rig.ready())[0]
    await asyncio.sleep(4)
    return servo


async def change(rig: Rig, servo: Servo, **values: object) -> None:
    answer = json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
    assert answer["outcome"] == "applied", answer


async def save(rig: Rig, servo: Servo) -> Any:
    return json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))


async def saving_until(rig: Rig, servo: Servo, stage: ServoStage) -> str:
    """Start a save and go on until the servo is in this stage; the id of the job."""
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    async with asyncio.timeout(20):
        while rig.sim(servo).stage is not stage:
            await asyncio.sleep(0.001)
    return str(started["id"])


async def ended(rig: Rig, job_id: str) -> Any:
    await rig.host.jobs.wait(rig.host.jobs.get(job_id))
    return json(await rig.call("GET", f"/jobs/{job_id}"))


def step(job: Any, name: str) -> Any:
    return next(one for one in job["steps"] if one["name"] == name)


def sent(rig: Rig, request: type[ExecuteOpcodeRequest] | type[RestartNodeRequest]) -> int:
    """How often a service was asked for by us."""
    return sum(one.kind is Kind.REQUEST and one.type_id == request.TYPE.id for one in rig.transfers("host"))


@scene()
async def test_a_save_shows_its_steps_with_what_was_found_at_each(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    assert rig.sim(servo).turn_manually(20.0, asyncio.get_running_loop().time())
    rig.sim(servo).memory.put(0x20, 0)  # as another tool would: on, and under nobody's command
    job = await save(rig, servo)
    assert job["state"] == "succeeded", job["error"]
    assert [one["name"] for one in job["steps"]] == [
        "check", "snapshot", "write", "silence", "restart", "back", "soft_start", "read_back",
    ]  # fmt: skip
    assert "supply 7.4 V" in step(job, "check")["evidence"]
    assert "a load on the horn may drop" in step(job, "check")["evidence"]
    assert "from 20.0° to 0° in about 0.1 s" in step(job, "check")["evidence"]
    begun, over = (float(word) for word in step(job, "silence")["evidence"].split() if word[0].isdigit())
    assert begun < 0.1
    assert 0.1 < over < 0.6, "0.05 s of writing and 0.1 s of starting"
    assert step(job, "back")["evidence"].startswith("node 11, as before")
    assert step(job, "soft_start")["evidence"].startswith("finished after")
    assert step(job, "read_back")["evidence"].endswith("all equal to the saved values")
    assert (job["result"]["node_id"], job["result"]["node_id_before"]) == (11, 11)
    assert "angle_p_gain" in job["result"]["saved"]
    assert rig.sim(servo).memory.stored(GAIN) == 55
    kept = rig.host.history.snapshots.get(job["result"]["snapshot"])
    assert (kept.reason, kept.ram["angle_p_gain"], kept.rom["angle_p_gain"]) == ("before saving", 55, 40)
    assert servo.expected_rom is None


@pytest.mark.parametrize("delay", [0.05, 3.0])
@pytest.mark.parametrize("answers", [True, False], ids=["answered", "answer lost"])
@pytest.mark.parametrize("node_id", [11, 0], ids=["static id", "dynamic id"])
@scene(lambda answers, node_id: replace(PLAIN, node_id=node_id, behaviour=Behaviour(acknowledges_save=answers)))
async def test_a_save_ends_in_rom_however_slow_the_restart_and_whether_or_not_it_is_answered(
    rig: Rig, delay: float, answers: bool, node_id: int
) -> None:
    servo = await old(rig)
    rig.sim(servo).conditions.restart_delay_s = delay
    await change(rig, servo, angle_p_gain=55)
    job = await save(rig, servo)
    assert job["state"] == "succeeded", job["error"]
    assert ("not acknowledged" in step(job, "write")["evidence"]) is not answers
    assert rig.sim(servo).memory.stored(GAIN) == servo.registers["angle_p_gain"].rom == 55
    assert sent(rig, ExecuteOpcodeRequest) == 1
    assert sent(rig, RestartNodeRequest) == 0


@pytest.mark.parametrize("seed", range(1, 9))
@pytest.mark.parametrize("node_id", [11, 0], ids=["static id", "dynamic id"])
@scene(lambda node_id: replace(PLAIN, node_id=node_id))
async def test_a_save_ends_in_rom_when_a_fifth_of_all_frames_is_lost(rig: Rig, seed: int, node_id: int) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    rig.bus.loss(20, seed=seed)
    job = await save(rig, servo)
    assert job["state"] == "succeeded", job["error"]
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert servo.registers["angle_p_gain"].rom == 55


@scene()
async def test_a_save_that_never_reached_the_servo_is_sent_again_and_ram_is_not_lost(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    job = rig.host.jobs.get(started["id"])
    while job.step != "write":
        await asyncio.sleep(0.0001)
    rig.bus.loss(100)
    await asyncio.sleep(0.4)
    rig.bus.loss(0)
    done = await ended(rig, started["id"])
    assert done["state"] == "succeeded", done
    assert step(done, "write")["evidence"].startswith("sent 2 times")
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert rig.sim(servo).starts == 2


@pytest.mark.parametrize("mute_s", [1.0, 4.0, 10.0])
@scene()
async def test_a_servo_that_is_mute_after_the_save_is_waited_for(rig: Rig, mute_s: float) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    job_id = await saving_until(rig, servo, ServoStage.SAVING)
    rig.sim(servo).conditions.mute = True
    await asyncio.sleep(mute_s)
    rig.sim(servo).conditions.mute = False
    job = await ended(rig, job_id)
    assert job["state"] == "succeeded", job["error"]
    silent = float(step(job, "silence")["evidence"].split("(")[1].split()[0])
    assert silent > mute_s
    assert rig.sim(servo).memory.stored(GAIN) == servo.registers["angle_p_gain"].rom == 55


@scene()
async def test_a_changed_static_node_id_is_followed_by_unique_id_and_both_are_named(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, node_id=42)
    job = await save(rig, servo)
    assert job["state"] == "succeeded", job["error"]
    assert step(job, "back")["evidence"].startswith("node 11 → node 42")
    assert (job["result"]["node_id_before"], job["result"]["node_id"]) == (11, 42)
    assert servo.node_id == 42


@scene(replace(PLAIN, node_id=0))
async def test_a_servo_whose_new_dynamic_id_is_another_one_is_followed(rig: Rig) -> None:
    servo = await old(rig)
    was = servo.node_id
    await change(rig, servo, angle_p_gain=55)
    job_id = await saving_until(rig, servo, ServoStage.STARTING)
    assert was is not None
    rig.host.store.allocations.drop(servo.uid)
    rig.host.store.allocations.record(Uid("ee" * 16), was)  # somebody else's by now
    job = await ended(rig, job_id)
    assert job["state"] == "succeeded", job["error"]
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert servo.node_id == job["result"]["node_id"] == rig.sim(servo).node_id != was
    assert step(job, "back")["evidence"].startswith(f"node {was} → node {servo.node_id}")


@scene()
async def test_power_cut_while_rom_is_written_is_told_as_lost_and_the_snapshot_is_offered(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    job_id = await saving_until(rig, servo, ServoStage.SAVING)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(2)
    rig.bench.power(servo.uid, True)
    job = await ended(rig, job_id)
    assert job["state"] == "failed"
    assert job["error"]["code"] == "configuration_lost"
    assert f"Snapshot {job['error']['snapshot']} contains the previous RAM values" in job["error"]["detail"]
    found = {one["key"]: one for one in job["error"]["differences"]}
    assert found["angle_p_gain"] == {"key": "angle_p_gain", "wanted": 55, "found": None}
    assert rig.host.history.snapshots.get(job["error"]["snapshot"]).ram["angle_p_gain"] == 55
    assert all(one.rom is None for one in servo.registers.values())
    assert servo.busy is None


@scene()
async def test_power_cut_in_the_restart_is_waited_for_and_rom_is_proved(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    job_id = await saving_until(rig, servo, ServoStage.STARTING)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    rig.bench.power(servo.uid, True)
    job = await ended(rig, job_id)
    assert job["state"] == "succeeded", job["error"]
    assert rig.sim(servo).memory.stored(GAIN) == servo.registers["angle_p_gain"].rom == 55


@scene()
async def test_power_cut_while_it_is_read_back_is_waited_for_and_rom_is_proved(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    job = rig.host.jobs.get(started["id"])
    while job.step != "read_back":
        await asyncio.sleep(0.0005)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    rig.bench.power(servo.uid, True)
    done = await ended(rig, started["id"])
    assert done["state"] == "succeeded", done
    assert rig.sim(servo).starts == 3


@scene()
async def test_power_cut_before_the_servo_could_write_leaves_the_old_rom_and_names_each_difference(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55, smoothing=False)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    job = rig.host.jobs.get(started["id"])
    while job.step != "write":
        await asyncio.sleep(0.0001)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(1)
    rig.bench.power(servo.uid, True)
    done = await ended(rig, started["id"])
    assert (done["state"], done["error"]["code"]) == ("failed", "unexpected_result")
    assert "Angle P gain 40 instead of 55" in done["error"]["detail"]
    assert done["error"]["differences"] == [
        {"key": "smoothing", "wanted": False, "found": True},
        {"key": "angle_p_gain", "wanted": 55, "found": 40},
    ]
    assert done["error"]["snapshot"] > 0
    assert servo.registers["angle_p_gain"].rom == 40, "read after the restart: that is what ROM holds now"


@scene()
async def test_of_a_servo_that_stays_away_rom_is_not_known_and_the_wait_is_bounded(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    began = asyncio.get_running_loop().time()
    job_id = await saving_until(rig, servo, ServoStage.SAVING)
    rig.bench.power(servo.uid, False)
    job = await ended(rig, job_id)
    assert asyncio.get_running_loop().time() - began < 50
    assert (job["state"], job["error"]["code"]) == ("failed", "no_response")
    assert "The contents of its ROM are unknown" in job["error"]["detail"]
    assert job["error"]["snapshot"] > 0
    assert servo.registers["angle_p_gain"].rom is None


@pytest.mark.parametrize("kind", ["save", "restart"])
@scene()
async def test_a_save_or_restart_under_way_is_joined_only_by_who_could_begin_it(rig: Rig, kind: str) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    path = f"/servos/{servo.uid}"
    job = json(await rig.call("POST", f"{path}/{kind}"), 202)["id"]
    while servo.expected_rom is None and kind == "save":
        await asyncio.sleep(0.001)
    lease = await rig.lease()
    problem(await rig.call("POST", f"{path}/{kind}"), "lease_held", 409)
    assert json(await rig.call("POST", f"{path}/{kind}", lease=lease), 202)["id"] == job
    if kind == "save":
        same = {"values": {"angle_p_gain": 55}, "save": True}
        problem(await rig.call("PATCH", f"{path}/parameters", same), "lease_held", 409)
        assert json(await rig.call("PATCH", f"{path}/parameters", same, lease=lease))["job"] == job
    assert (await ended(rig, job))["state"] == "succeeded"


@scene()
async def test_a_second_save_joins_also_while_the_servo_restarts_and_new_values_are_refused(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    job_id = await saving_until(rig, servo, ServoStage.SAVING)
    assert json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)["id"] == job_id
    while servo.state is not State.RESTARTING:
        await asyncio.sleep(0.001)
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
    assert (await ended(rig, job_id))["state"] == "succeeded"
    assert sent(rig, ExecuteOpcodeRequest) == 1
    assert rig.sim(servo).starts == 2


@scene()
async def test_stop_before_the_write_ends_the_save_with_nothing_sent(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    await asyncio.sleep(0.005)
    assert rig.host.jobs.get(started["id"]).step == "check"
    await rig.call("POST", "/stop")
    job = await ended(rig, started["id"])
    assert (job["state"], job["error"]["code"]) == ("failed", "stopped")
    assert sent(rig, ExecuteOpcodeRequest) == 0
    assert servo.registers["angle_p_gain"].rom == 40, "nothing was sent, so ROM holds what it held"


@pytest.mark.parametrize("stage", [ServoStage.SAVING, ServoStage.STARTING])
@scene()
async def test_stop_during_the_save_is_never_in_its_way_and_only_torque_stays_unproved(
    rig: Rig, stage: ServoStage
) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    job_id = await saving_until(rig, servo, stage)
    await rig.call("POST", "/stop")
    job = await ended(rig, job_id)
    assert (job["state"], job["error"]["code"]) == ("failed", "stopped")
    assert "Torque mode is not" in job["error"]["detail"]
    assert rig.sim(servo).output == 1
    assert servo.registers["angle_p_gain"].rom == 55
    assert servo.registers["torque_mode"].rom is None
    assert sent(rig, ExecuteOpcodeRequest) == 1


@pytest.mark.parametrize("volts", [3.8, 10.8])
@scene()
async def test_at_a_supply_that_switches_the_output_off_nothing_is_saved(rig: Rig, volts: float) -> None:
    servo = await old(rig)
    await change(rig, servo, angle_p_gain=55)
    rig.sim(servo).conditions.voltage_v = volts
    await asyncio.sleep(0.5)
    job = await save(rig, servo)
    assert (job["state"], job["error"]["code"], job["step"]) == ("failed", "out_of_range", None)
    assert f"{volts:.1f} V" in job["error"]["detail"]
    assert (job["error"]["minimum"], job["error"]["maximum"], job["error"]["unit"]) == (4.0, 10.0, "V")
    assert sent(rig, ExecuteOpcodeRequest) == 0
    assert servo.registers["angle_p_gain"].rom == 40
    rig.sim(servo).conditions.voltage_v = 7.4
    await asyncio.sleep(0.5)
    assert (await save(rig, servo))["state"] == "succeeded"


@scene()
async def test_a_horn_that_turns_is_not_let_go_of(rig: Rig) -> None:
    servo = await old(rig)
    sim = rig.sim(servo)
    sim.memory.put(0x25, 1)
    sim.memory.put(0x26, 0)
    lease = await rig.lease()
    turning = {"type": "speed", "value": 40}
    json(await rig.call("POST", f"/servos/{servo.uid}/command", turning, lease=lease))
    rig.host.motion.cancel_commands()  # nobody's command any more, and it turns on: its time-out is off
    await asyncio.sleep(0.5)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", lease=lease))
    assert (job["state"], job["error"]["code"]) == ("failed", "busy")
    assert "rpm" in job["error"]["detail"]
    assert sent(rig, ExecuteOpcodeRequest) == 0


@scene()
async def test_torque_off_as_configuration_is_asked_about_first_and_saved_once_it_is_confirmed(rig: Rig) -> None:
    servo = await old(rig)
    await change(rig, servo, torque_mode="off")
    told = json(await rig.call("GET", f"/servos/{servo.uid}/restart-forecast?save=true"))
    assert told["moves"] is False
    assert any("does not move until torque is turned on" in one for one in told["warnings"])
    for body in (None, {}, {"confirm": ["supply"]}):
        asked = problem(await rig.call("POST", f"/servos/{servo.uid}/save", body), "needs_confirmation", 409)
        assert (asked["confirm"], asked["key"]) == ("torque_off_in_rom", "torque_mode")
    patch = {"values": {"angle_p_gain": 55}, "save": True}
    before = rig.writes()
    asked = problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", patch), "needs_confirmation", 409)
    assert asked["confirm"] == "torque_off_in_rom"
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
    # Now ROM has no torque already: a save takes nothing away, and technicians are not asked each time.
    assert (await save(rig, servo))["state"] == "succeeded"


@pytest.mark.parametrize("mode", ["off", "brake"])
@scene()
async def test_a_servo_without_torque_is_saved_with_torque_when_that_is_asked_for(rig: Rig, mode: str) -> None:
    servo = await old(rig)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": mode}))
    told = json(await rig.call("GET", f"/servos/{servo.uid}/restart-forecast?save=true&torque_on=true"))
    assert not any("does not move until torque is turned on" in one for one in told["warnings"])
    horn = rig.sim(servo).angle_deg
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", {"torque_on": True}))
    assert job["state"] == "succeeded", job["error"]
    assert told["text"] in step(job, "check")["evidence"]
    assert (rig.sim(servo).memory.stored(0x20), servo.raw("torque_mode")) == (0, 0)
    assert abs(rig.sim(servo).angle_deg - horn) < 1


@scene()
async def test_when_a_save_with_torque_is_refused_torque_goes_off_again(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    opcode = Services.opcode

    def no_save(self: Services, request: ExecuteOpcodeRequest, behaviour: Behaviour) -> ExecuteOpcodeResponse:
        return ExecuteOpcodeResponse(0, False) if request.opcode == Opcode.SAVE else opcode(self, request, behaviour)

    servo = await old(rig)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    monkeypatch.setattr(Services, "opcode", no_save)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", {"torque_on": True}))
    assert (job["state"], job["error"]["code"]) == ("failed", "refused_by_servo")
    await asyncio.sleep(0.5)
    assert (rig.sim(servo).output, servo.raw("torque_mode")) == (1, 1)


@scene()
async def test_a_save_with_torque_is_refused_before_torque_is_turned_on(rig: Rig) -> None:
    servo = await old(rig)
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "off"}))
    rig.sim(servo).conditions.voltage_v = 3.8
    await asyncio.sleep(0.5)
    job = json(await rig.call("POST", f"{path}/save?wait=true", {"torque_on": True}))
    assert job["state"] == "failed"
    assert rig.sim(servo).memory.get(0x20) == 1, "refused before anything was written"
    other = await rig.lease()
    problem(await rig.call("POST", f"{path}/save", {"torque_on": True}), "lease_held", 409)
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", f"{path}/save", {"torque_on": True}, lease=other), "stopped", 423)
    assert rig.sim(servo).memory.get(0x20) == 1


@pytest.mark.parametrize("mode", ["off", "brake"])
@scene()
async def test_values_that_turn_torque_on_or_off_are_what_a_save_with_them_is_judged_by(rig: Rig, mode: str) -> None:
    servo = await old(rig)
    path, lease = f"/servos/{servo.uid}/parameters", await rig.lease()
    patch = {"values": {"torque_mode": mode}, "save": True}
    problem(await rig.call("PATCH", path, patch, lease=lease), "needs_confirmation", 409)
    assert servo.raw("torque_mode") == 0
    json(await rig.call("PATCH", path, {"values": {"torque_mode": mode}}, lease=lease))
    problem(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), "needs_confirmation", 409)
    rig.sim(servo).memory.put(0x20, 0)  # as another tool would: that is no configuration
    problem(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), "needs_confirmation", 409)
    body = {"confirm": ["torque_off_in_rom"]}
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", body, lease=lease))
    assert job["state"] == "succeeded", job["error"]
    assert rig.sim(servo).memory.stored(0x20) == {"off": 1, "brake": 2}[mode]


@scene()
async def test_a_restart_forecast_tells_what_then_happens(rig: Rig) -> None:
    servo = await old(rig)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    rig.sim(servo).turn_manually(-90.0, asyncio.get_running_loop().time())
    await asyncio.sleep(0.3)
    told = json(await rig.call("GET", f"/servos/{servo.uid}/restart-forecast?save=false"))
    assert (told["moves"], told["from_deg"], told["to_deg"], told["takes_s"]) == (True, -90.0, 0.0, 0.5)
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    assert abs(rig.sim(servo).angle_deg) <= 1.1


@scene()
async def test_save_and_restart_are_in_the_audit_with_who_and_the_job(rig: Rig) -> None:
    servo = await old(rig)
    lease = await rig.lease()
    good = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", lease=lease))
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true", lease=lease))
    await rig.call("DELETE", f"/leases/{lease}")
    await asyncio.sleep(3)
    rig.sim(servo).conditions.voltage_v = 3.8
    await asyncio.sleep(0.3)
    bad = await save(rig, servo)
    rows = [one.entry for one in rig.host.store.audit.rows(uid=servo.uid)]
    told = [(one.action, one.outcome, one.by, one.job) for one in rows if one.action in ("save", "restart")]
    assert told[0] == ("save", "failed", "no lease", bad["id"])
    assert told[1][:3] == ("restart", "succeeded", "test")
    assert told[2] == ("save", "succeeded", "test", good["id"])


@scene()
async def test_who_was_permitted_long_ago_saves_without_a_lease_but_not_under_a_stop(rig: Rig) -> None:
    servo = await old(rig)
    await rig.lease()
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "lease_held", 409)
    job = await rig.host.jobs.wait(rig.host.restarting.start(servo, "save", RestartOptions(by="night shift")))
    assert job.state == "succeeded", job.error
    await rig.call("POST", "/stop")
    with pytest.raises(Exception, match="Stopped by"):
        rig.host.restarting.start(servo, "save", RestartOptions(by="night shift"))


@scene()
async def test_a_full_disk_keeps_nobody_from_saving_and_the_missing_snapshot_is_said(
    rig: Rig,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    servo = await old(rig)

    def full(*_args: object, **_more: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(rig.host.history, "store_known", full)
    job = await save(rig, servo)
    assert job["state"] == "succeeded"
    assert step(job, "snapshot")["state"] == "failed"
    assert "cannot be undone" in step(job, "snapshot")["evidence"]
    assert job["result"]["snapshot"] is None

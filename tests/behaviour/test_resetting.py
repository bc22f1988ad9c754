"""Factory reset: right whatever ERASE turns out to do, torque only in the last moment, and what a failure leaves."""

import asyncio
import itertools
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.device import ServoStage
from hornbill.sim.registers import Registers, Request
from hornbill.sim.services import Services
from hornbill.wire.datatype import Kind
from hornbill.wire.services import ExecuteOpcodeRequest, ExecuteOpcodeResponse, Opcode

CHANGED = {
    "angle_p_gain": 77, "smoothing": 0, "reverse": 1, "angle_limit_cw": 600, "voltage_limit_lower": 50,
    "timeout_action": 2, "torque_mode": 1, "origin": 150,
}  # fmt: skip
WORN = replace(PLAIN, rom=CHANGED)
IDENTITY = ("origin", "servo_id", "node_id")


async def old(rig: Rig) -> Servo:
    servo = (await rig.ready())[0]
    await asyncio.sleep(4)
    return servo


async def reset(rig: Rig, servo: Servo, body: object = None) -> Any:
    return json(await rig.call("POST", f"/servos/{servo.uid}/factory-reset?wait=true", body))


async def reset_until(rig: Rig, servo: Servo, step: str) -> str:
    """Start a reset and go on until this step runs; the id of the job."""
    started = json(await rig.call("POST", f"/servos/{servo.uid}/factory-reset"), 202)
    job = rig.host.jobs.get(started["id"])
    async with asyncio.timeout(30):
        while job.step != step:
            await asyncio.sleep(0.0002)
            assert not job.ended, job.error
    return str(started["id"])


async def ended(rig: Rig, job_id: str) -> Any:
    await rig.host.jobs.wait(rig.host.jobs.get(job_id))
    return json(await rig.call("GET", f"/jobs/{job_id}"))


def stored(rig: Rig, servo: Servo) -> dict[str, int | None]:
    memory = rig.sim(servo).memory
    return {key: memory.stored(one.parameter.address) for key, one in servo.registers.items() if one.parameter.rom}


def defaults(servo: Servo) -> dict[str, int | None]:
    return {key: one.parameter.default for key, one in servo.registers.items() if one.parameter.rom}


def erases(rig: Rig) -> int:
    """How often ERASE was sent."""
    found = 0
    for transfer in rig.transfers("host"):
        if transfer.kind is Kind.REQUEST and transfer.type_id == ExecuteOpcodeRequest.TYPE.id:
            request = ExecuteOpcodeRequest.decode(transfer.payload)
            found += request is not None and request.opcode == Opcode.ERASE
    return found


def erase_restarts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ERASE end in a restart, as no document says or denies."""
    erase = Registers.erase

    def and_restart(self: Registers) -> None:
        erase(self)
        self.pending = Request.RESTART

    monkeypatch.setattr(Registers, "erase", and_restart)


def erase_does_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ERASE be answered and not carried out."""

    def nothing(_self: Registers) -> None:
        return

    monkeypatch.setattr(Registers, "erase", nothing)


PRODUCT = list(itertools.product((False, True), repeat=6))
NAMES = ("erase_rom", "spares_identity", "restarts", "keeps", "static_id", "answers")


@pytest.mark.parametrize(
    ",".join(NAMES),
    PRODUCT,
    ids=["-".join(name for name, on in zip(NAMES, row, strict=True) if on) or "none" for row in PRODUCT],
)
def test_a_reset_comes_out_right_whatever_erase_does(
    monkeypatch: pytest.MonkeyPatch,
    erase_rom: bool,
    spares_identity: bool,
    restarts: bool,
    keeps: bool,
    static_id: bool,
    answers: bool,
) -> None:
    behaviour = Behaviour(
        erase_rom=erase_rom,
        erase_keeps_identity=spares_identity,
        acknowledges_restart=answers,
        acknowledges_save=answers,
    )
    if restarts:
        erase_restarts(monkeypatch)

    async def scene(rig: Rig) -> None:
        servo = await old(rig)
        before = stored(rig, servo)
        job = await reset(rig, servo, {"keep_identity": keeps})
        assert job["state"] == "succeeded", job
        wanted = defaults(servo) | ({key: before[key] for key in IDENTITY} if keeps else {})
        assert stored(rig, servo) == wanted
        assert {key: servo.registers[key].rom for key in wanted} == wanted
        assert servo.unsaved() == []
        assert erases(rig) == 1
        assert (servo.busy, servo.expected_rom) == (None, None)
        assert servo.drift == {}
        energised = [one for one in rig.writes() if one[1:] == ("0x20", 0)]
        assert len(energised) == 1, "torque is given by us once: right before the SAVE"
        assert rig.writes()[-1] == energised[0]
        child = json(await rig.call("GET", f"/jobs/{job['result']['save']}"))
        assert (child["kind"], child["state"]) == ("save", "succeeded")

    play(scene, replace(WORN, node_id=11 if static_id else 0, behaviour=behaviour))


@pytest.mark.parametrize("seed", range(1, 5))
@scene(WORN)
async def test_a_reset_comes_out_right_when_a_fifth_of_all_frames_is_lost(rig: Rig, seed: int) -> None:
    servo = await old(rig)
    before = stored(rig, servo)
    rig.bus.loss(20, seed=seed)
    job = await reset(rig, servo)
    rig.bus.loss(0)
    assert job["state"] == "succeeded", job["error"]
    assert stored(rig, servo) == defaults(servo) | {key: before[key] for key in IDENTITY}
    assert erases(rig) == 1


@scene(WORN)
async def test_the_horn_is_not_moved_before_the_restart_that_was_told_of(rig: Rig) -> None:
    servo = await old(rig)
    sim = rig.sim(servo)
    sim.turn_manually(40.0, asyncio.get_running_loop().time())
    await asyncio.sleep(0.2)
    told = json(await rig.call("GET", f"/servos/{servo.uid}/factory-reset"))["restart"]
    assert told["moves"] is True
    started = json(await rig.call("POST", f"/servos/{servo.uid}/factory-reset"), 202)
    job, stood = rig.host.jobs.get(started["id"]), sim.angle_deg
    while sim.stage is not ServoStage.SAVING:
        await asyncio.sleep(0.002)
        assert abs(sim.angle_deg - stood) < 0.3
    await rig.host.jobs.wait(job)
    assert job.state == "succeeded", job.error
    await asyncio.sleep(0.5)
    assert abs(servo.angle_deg or 0) <= 1.5, "soft start has brought it to 0 of the origin that was kept"


@scene(WORN)
async def test_the_preview_names_every_row_before_and_after_and_what_is_kept_and_changes_nothing(rig: Rig) -> None:
    servo = await old(rig)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/factory-reset?keep_identity=true"))
    assert shown["kept"] == {"origin": 15.0, "servo_id": 1, "node_id": 11}
    found = {one["key"]: (one["before"], one["requested"], one["verdict"]) for one in shown["changes"]}
    assert found == {
        "torque_mode": ("off", "on", "planned"),
        "smoothing": (False, True, "planned"),
        "reverse": (True, False, "planned"),
        "timeout_action": ("brake", "off", "planned"),
        "angle_p_gain": (77, 40, "planned"),
        "angle_limit_cw": (60.0, 179.9, "planned"),
        "voltage_limit_lower": (5.0, 4.0, "planned"),
    }
    assert shown["restart"]["moves"] is True
    whole = json(await rig.call("GET", f"/servos/{servo.uid}/factory-reset?keep_identity=false"))
    assert whole["kept"] == {}
    assert {"origin", "servo_id", "node_id"} <= {one["key"] for one in whole["changes"]}
    assert rig.writes() == []
    assert erases(rig) == 0


@scene(replace(PLAIN, rom={"angle_p_gain": 77}))
async def test_a_row_that_only_rom_holds_otherwise_is_in_the_preview(rig: Rig) -> None:
    servo = await old(rig)
    body = {"values": {"angle_p_gain": 40}}
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body))
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/factory-reset"))
    assert ("angle_p_gain", 77, 40) in {(one["key"], one["before"], one["requested"]) for one in shown["changes"]}


@scene(
    Recipe("BLA21-12U-AB", "1.300", servo_id=1, node_id=11, rom={"pwm_neutral": 1600, "angle_d_gain": 9}),
    Recipe("BLA15-06U-A0", "1.010", servo_id=2, node_id=12, rom={"angle_d_gain": 9}),
)
async def test_a_pwm_model_is_reset_with_its_pwm_rows_and_an_old_firmware_without_rows_it_lacks(rig: Rig) -> None:
    servos = await rig.ready(2)
    await asyncio.sleep(4)
    for servo in servos:
        job = await reset(rig, servo)
        assert job["state"] == "succeeded", job
        assert stored(rig, servo) == defaults(servo) | {key: servo.raw(key) for key in IDENTITY}


@scene(WORN)
async def test_a_refused_erase_changes_nothing_but_torque(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_args: object) -> ExecuteOpcodeResponse:
        return ExecuteOpcodeResponse(0, False)

    servo = await old(rig)
    before = stored(rig, servo)
    monkeypatch.setattr(Services, "opcode", refuse)
    job = await reset(rig, servo)
    assert (job["state"], job["error"]["code"]) == ("failed", "refused_by_servo")
    assert "Saved to ROM" in job["error"]["not_done"]
    assert stored(rig, servo) == before
    assert servo.raw("torque_mode") == 1
    assert servo.registers["angle_p_gain"].rom == 77, "ROM is still known"
    assert {name for _, name, _ in rig.writes()} <= {"0x20"}


@pytest.mark.parametrize("step", ["erase", "read", "rows", "save"])
@scene(WORN)
async def test_stop_ends_a_reset_at_once_and_nothing_more_is_written_but_the_stop(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    servo = await old(rig)
    if step == "rows":
        erase_does_nothing(monkeypatch)
    if step in ("read", "rows"):
        rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await reset_until(rig, servo, step)
    await asyncio.sleep(0.003)  # what the adapter has got by now leaves
    count = len(rig.writes())
    opcodes = erases(rig)
    await rig.call("POST", "/stop")
    job = json(await rig.call("GET", f"/jobs/{job_id}"))
    assert (job["state"], job["error"]["code"]) == ("failed", "stopped"), job
    assert job["error"]["snapshot"] > 0
    assert "Every row verified" in job["error"]["not_done"]
    await asyncio.sleep(10)
    assert {one[1:] for one in rig.writes()[count:]} == {("0x20", 1)}
    assert erases(rig) <= max(opcodes, 1)
    assert rig.sim(servo).output == 1
    assert servo.busy is None


@scene(WORN)
async def test_rows_are_written_one_by_one_when_erase_does_nothing(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    servo = await old(rig)
    before = stored(rig, servo)
    erase_does_nothing(monkeypatch)
    job = await reset(rig, servo)
    assert job["state"] == "succeeded", job
    assert stored(rig, servo) == defaults(servo) | {key: before[key] for key in IDENTITY}
    written = next(one["evidence"] for one in job["steps"] if one["name"] == "rows")
    assert set(written.split(", ")) == set(CHANGED) - {"origin", "torque_mode"}


@scene(WORN)
async def test_power_lost_in_the_middle_is_told_with_what_is_not_done_and_the_snapshot(rig: Rig) -> None:
    servo = await old(rig)
    rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await reset_until(rig, servo, "read")
    rig.bench.power(servo.uid, False)
    job = await ended(rig, job_id)
    assert (job["state"], job["error"]["code"]) == ("failed", "no_response")
    assert {"Saved to ROM", "Every row verified"} <= set(job["error"]["not_done"])
    assert "Not done: " in job["error"]["detail"]
    held = rig.host.history.snapshots.get(job["error"]["snapshot"])
    assert (held.reason, held.ram["angle_p_gain"], held.ram["origin"]) == ("before factory reset", 77, 150)
    assert servo.busy is None
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(6)
    assert servo.registers["angle_p_gain"].rom == 77, "ERASE reached RAM alone"


@scene(WORN)
async def test_power_lost_for_a_moment_while_rows_are_written_begins_them_anew(rig: Rig) -> None:
    servo = await old(rig)
    before = stored(rig, servo)
    rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await reset_until(rig, servo, "identity")
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.5)
    rig.bench.power(servo.uid, True)
    job = await ended(rig, job_id)
    assert job["state"] == "succeeded", job
    assert stored(rig, servo) == defaults(servo) | {key: before[key] for key in IDENTITY}


@scene(WORN)
async def test_power_lost_while_the_reset_is_saved_is_told_as_a_lost_configuration(rig: Rig) -> None:
    servo = await old(rig)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/factory-reset"), 202)
    while rig.sim(servo).stage is not ServoStage.SAVING:
        await asyncio.sleep(0.001)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(1)
    rig.bench.power(servo.uid, True)
    job = await ended(rig, started["id"])
    assert (job["state"], job["error"]["code"]) == ("failed", "configuration_lost")
    assert rig.host.history.snapshots.get(job["error"]["snapshot"]).ram["angle_p_gain"] == 77
    assert job["error"]["not_done"] == ["Saved to ROM", "Every row verified"]


@scene(WORN)
async def test_when_the_save_of_a_reset_is_refused_torque_goes_off_again(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    opcode = Services.opcode

    def no_save(self: Services, request: ExecuteOpcodeRequest, behaviour: Behaviour) -> ExecuteOpcodeResponse:
        return ExecuteOpcodeResponse(0, False) if request.opcode == Opcode.SAVE else opcode(self, request, behaviour)

    servo = await old(rig)
    monkeypatch.setattr(Services, "opcode", no_save)
    job = await reset(rig, servo)
    assert (job["state"], job["error"]["code"]) == ("failed", "refused_by_servo")
    await asyncio.sleep(0.5)
    assert rig.sim(servo).output == 1
    assert servo.raw("torque_mode") == 1


@scene()
async def test_a_reset_is_refused_under_a_stop_under_command_and_against_the_holder_of_the_lease(rig: Rig) -> None:
    servo = await old(rig)
    path = f"/servos/{servo.uid}/factory-reset"
    lease = await rig.lease()
    problem(await rig.call("POST", path), "lease_held", 409)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    problem(await rig.call("POST", path, lease=lease), "busy", 409)
    await rig.call("DELETE", f"/leases/{lease}")
    await rig.call("POST", "/stop")
    problem(await rig.call("POST", path), "stopped", 423)
    assert erases(rig) == 0


@scene(WORN)
async def test_while_it_is_reset_nothing_else_is_done_to_it_and_the_audit_names_every_row(rig: Rig) -> None:
    servo = await old(rig)
    job_id = await reset_until(rig, servo, "erase")
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "busy", 409)
    problem(await rig.call("POST", f"/servos/{servo.uid}/factory-reset"), "busy", 409)
    body = {"values": {"angle_p_gain": 1}}
    problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body), "busy", 409)
    assert (await ended(rig, job_id))["state"] == "succeeded"
    rows = [one.entry for one in rig.host.store.audit.rows(uid=servo.uid) if one.entry.action == "factory_reset"]
    assert {one.job for one in rows} == {job_id}
    assert rows[0].outcome == "succeeded"
    told = {one.key: (one.before, one.after) for one in rows[1:]}
    assert told["angle_p_gain"] == (77, 40)
    assert told["torque_mode"] == ("off", "on")
    assert set(told) == set(CHANGED) - {"origin"}


@scene(WORN)
async def test_a_reset_that_is_cancelled_leaves_torque_off(rig: Rig) -> None:
    servo = await old(rig)
    rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await reset_until(rig, servo, "read")
    job = json(await rig.call("DELETE", f"/jobs/{job_id}"))
    assert job["state"] == "cancelled"
    rig.sim(servo).conditions.response_delay_s = 0
    await asyncio.sleep(1)
    assert rig.sim(servo).output == 1
    assert servo.busy is None


@scene(WORN)
async def test_a_dry_run_of_a_restart_names_what_is_lost_and_what_the_horn_does_and_sends_nothing(rig: Rig) -> None:
    servo = await old(rig)
    rig.sim(servo).turn_manually(40.0, asyncio.get_running_loop().time())
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}}))
    path, written, boot_count = f"/servos/{servo.uid}/restart", rig.writes(), servo.boot_count
    plan = json(await rig.call("POST", path, {"dry_run": True}))
    assert [(one["key"], one["before"], one["requested"], one["verdict"]) for one in plan["lost"]] == [
        ("angle_p_gain", 55, 77, "planned")
    ]
    assert plan["restart"] == json(await rig.call("GET", f"/servos/{servo.uid}/restart-forecast"))
    await asyncio.sleep(1)
    assert (rig.writes(), servo.boot_count, rig.host.jobs.all()) == (written, boot_count, [])
    job = json(await rig.call("POST", f"{path}?wait=true", {"dry_run": False}))
    assert job["state"] == "succeeded"
    assert servo.boot_count == boot_count + 1
    assert servo.raw("angle_p_gain") == 77


@scene(WORN)
async def test_a_dry_run_of_a_reset_answers_as_the_preview_does_and_sends_nothing(rig: Rig) -> None:
    servo = await old(rig)
    path = f"/servos/{servo.uid}/factory-reset"
    for keeps in (True, False):
        shown = json(await rig.call("GET", f"{path}?keep_identity={keeps}"))
        assert json(await rig.call("POST", path, {"dry_run": True, "keep_identity": keeps})) == shown
    assert (rig.writes(), erases(rig), rig.host.jobs.all()) == ([], 0, [])


@pytest.mark.parametrize("verb", ["restart", "factory-reset"])
@scene()
async def test_a_dry_run_is_refused_for_every_reason_the_real_one_is(rig: Rig, verb: str) -> None:
    servo = await old(rig)
    path = f"/servos/{servo.uid}/{verb}"

    async def both(code: str, status: int, lease: str | None = None) -> None:
        for body in ({"dry_run": True}, {}):
            problem(await rig.call("POST", path, body, lease=lease), code, status)

    lease = await rig.lease()
    await both("lease_held", 409)
    json(await rig.call("POST", path, {"dry_run": True}, lease=lease))
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    await both("busy", 409, lease)
    await rig.call("DELETE", f"/leases/{lease}")
    await rig.call("POST", "/stop")
    await both("stopped", 423)
    await rig.call("DELETE", "/stop")
    if verb == "factory-reset":
        rig.sim(servo).conditions.voltage_v = 3.9
        await asyncio.sleep(3)
        refused = problem(await rig.call("POST", path, {"dry_run": True}), "out_of_range", 422)
        assert "3.9 V" in refused["detail"]
        rig.sim(servo).conditions.voltage_v = 7.4
        await asyncio.sleep(3)
    job_id = json(await rig.call("POST", path), 202)["id"]
    problem(await rig.call("POST", path, {"dry_run": True}), "busy", 409)
    await ended(rig, job_id)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    await both("no_response", 504)
    assert erases(rig) == (1 if verb == "factory-reset" else 0)

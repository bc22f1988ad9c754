"""Factory reset: independent of how ERASE behaves, torque on only at the end, and a defined state after a failure."""

import asyncio
from dataclasses import replace
from itertools import product
from typing import Any

import pytest

from behaviour.actions import power_cycle
from behaviour.restarting import ended, failed_with, opcodes, refuse, run, run_until, run_until_step, succeeded
from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene, settled
from hornbill.servo.device.servo import Servo
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.device import ServoStage
from hornbill.sim.registers import Registers, Request
from hornbill.wire.services import Opcode

CHANGED = {
    "angle_p_gain": 77, "smoothing": 0, "reverse": 1, "angle_limit_cw": 600, "voltage_limit_lower": 50,
    "timeout_action": 2, "torque_mode": 1, "origin": 150,
}  # fmt: skip
CONFIGURED = replace(PLAIN, rom=CHANGED)
IDENTITY = ("origin", "servo_id", "node_id")


async def reset(rig: Rig, servo: Servo, body: object = None) -> Any:
    return await run(rig, servo, "factory-reset", body)


def stored(rig: Rig, servo: Servo) -> dict[str, int | None]:
    memory = rig.sim(servo).memory
    return {key: memory.stored(one.parameter.address) for key, one in servo.registers.items() if one.parameter.rom}


def defaults(servo: Servo, identity_of: dict[str, int | None] | None = None) -> dict[str, int | None]:
    """The defaults, with the identity of another set of values."""
    found = {key: one.parameter.default for key, one in servo.registers.items() if one.parameter.rom}
    return found | {key: identity_of[key] for key in IDENTITY if identity_of is not None}


def erases(rig: Rig) -> int:
    return opcodes(rig, Opcode.ERASE)


def erase_restarts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ERASE end in a restart, which no document states or denies."""
    erase = Registers.erase

    def and_restart(self: Registers) -> None:
        erase(self)
        self.pending = Request.RESTART

    monkeypatch.setattr(Registers, "erase", and_restart)


def erase_does_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ERASE be acknowledged and not carried out."""

    def nothing(_self: Registers) -> None: ...

    monkeypatch.setattr(Registers, "erase", nothing)


VARIANTS = ("erase_rom", "spares_identity", "restarts", "keeps_identity", "static_id", "responds")
Variant = frozenset[str]


def variant(bits: int) -> Variant:
    return frozenset(name for place, name in enumerate(VARIANTS) if bits >> place & 1)


def fraction() -> list[Variant]:
    """16 of the 64 variants, with every combination of any three of them; tests/release plays all."""
    return [
        variant(a | b << 1 | c << 2 | d << 3 | (a ^ b ^ c) << 4 | (b ^ c ^ d) << 5)
        for a, b, c, d in product((0, 1), repeat=4)
    ]


def check_reset(monkeypatch: pytest.MonkeyPatch, given: Variant) -> None:
    """Reset a servo whose ERASE behaves in this way."""
    responds = "responds" in given
    behaviour = Behaviour(
        erase_rom="erase_rom" in given,
        erase_keeps_identity="spares_identity" in given,
        acknowledges_restart=responds,
        acknowledges_save=responds,
    )
    if "restarts" in given:
        erase_restarts(monkeypatch)

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await asyncio.sleep(4)
        before = stored(rig, servo)
        keeps = "keeps_identity" in given
        job = await reset(rig, servo, {"keep_identity": keeps})
        assert job["state"] == "succeeded", job
        wanted = defaults(servo, before if keeps else None)
        assert stored(rig, servo) == wanted
        assert {key: servo.registers[key].rom for key in wanted} == wanted
        assert servo.unsaved() == []
        assert erases(rig) == 1
        assert (servo.busy, servo.expected_rom, servo.drift) == (None, None, {})
        torque_on = [one for one in rig.writes() if one[1:] == ("0x20", 0)]
        assert torque_on == [rig.writes()[-1]], "torque on is written once: just before the SAVE"
        child = json(await rig.call("GET", f"/jobs/{job['result']['save']}"))
        assert (child["kind"], child["state"]) == ("save", "succeeded")

    play(scene, replace(CONFIGURED, node_id=11 if "static_id" in given else 0, behaviour=behaviour))


@pytest.mark.parametrize("given", fraction(), ids=lambda given: "-".join(sorted(given)) or "none")
def test_a_reset_succeeds_however_erase_behaves(monkeypatch: pytest.MonkeyPatch, given: Variant) -> None:
    check_reset(monkeypatch, given)


@pytest.mark.parametrize("seed", [1, 2])
@settled(CONFIGURED)
async def test_a_reset_succeeds_with_a_fifth_of_all_frames_lost(rig: Rig, servo: Servo, seed: int) -> None:
    before = stored(rig, servo)
    rig.bus.loss(20, seed=seed)
    job = await reset(rig, servo)
    rig.bus.loss(0)
    assert job["state"] == "succeeded", job["error"]
    assert stored(rig, servo) == defaults(servo, before)
    assert erases(rig) == 1


@settled(CONFIGURED)
async def test_the_horn_does_not_move_before_the_announced_restart(rig: Rig, servo: Servo) -> None:
    sim = rig.sim(servo)
    sim.turn_manually(40.0, asyncio.get_running_loop().time())
    await asyncio.sleep(0.2)
    assert json(await rig.call("GET", f"/servos/{servo.uid}/factory-reset"))["restart"]["moves"] is True
    before = sim.angle_deg

    def saving(_job: object) -> bool:
        assert abs(sim.angle_deg - before) < 0.3
        return sim.stage is ServoStage.SAVING

    succeeded(await ended(rig, await run_until(rig, servo, "factory-reset", saving)))
    await asyncio.sleep(0.5)
    assert abs(servo.angle_deg or 0) <= 1.5, "soft start has moved it to 0° of the origin that was kept"


@settled(CONFIGURED)
async def test_a_preview_lists_every_change_and_what_is_kept_and_sends_nothing(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/factory-reset"
    shown = json(await rig.call("GET", f"{path}?keep_identity=true"))
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
    whole = json(await rig.call("GET", f"{path}?keep_identity=false"))
    assert whole["kept"] == {}
    assert set(IDENTITY) <= {one["key"] for one in whole["changes"]}
    for keeps, preview in ((True, shown), (False, whole)):
        assert json(await rig.call("POST", path, {"dry_run": True, "keep_identity": keeps})) == preview
    assert (rig.writes(), erases(rig), rig.host.jobs.all()) == ([], 0, [])
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 40}}))
    shown = json(await rig.call("GET", path))
    found = {(one["key"], one["before"], one["requested"]) for one in shown["changes"]}
    assert ("angle_p_gain", 77, 40) in found, "a value that differs only in ROM is listed too"


@scene(
    Recipe("BLA21-12U-AB", "1.300", servo_id=1, node_id=11, rom={"pwm_neutral": 1600, "angle_d_gain": 9}),
    Recipe("BLA15-06U-A0", "1.010", servo_id=2, node_id=12, rom={"angle_d_gain": 9}),
)
async def test_a_reset_covers_the_rows_that_the_model_and_firmware_have(rig: Rig, servos: list[Servo]) -> None:
    await asyncio.sleep(4)
    for servo in servos:
        job = await reset(rig, servo)
        assert job["state"] == "succeeded", job
        assert stored(rig, servo) == defaults(servo, {key: servo.raw(key) for key in IDENTITY})


@settled(CONFIGURED)
async def test_a_refused_erase_changes_only_torque_and_torque_is_off_after_a_refused_save(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = stored(rig, servo)
    refuse(monkeypatch, Opcode.ERASE)
    error = failed_with(await reset(rig, servo), "refused_by_servo")
    assert "Saved to ROM" in error["not_done"]
    assert stored(rig, servo) == before
    assert servo.raw("torque_mode") == 1
    assert servo.registers["angle_p_gain"].rom == 77, "ROM is still known"
    assert {name for _, name, _ in rig.writes()} <= {"0x20"}
    monkeypatch.undo()
    refuse(monkeypatch, Opcode.SAVE)
    failed_with(await reset(rig, servo), "refused_by_servo")
    await asyncio.sleep(0.5)
    assert rig.sim(servo).output == servo.raw("torque_mode") == 1


@pytest.mark.parametrize("step", ["erase", "read", "rows", "save"])
@settled(CONFIGURED)
async def test_stop_ends_a_reset_and_only_torque_off_follows(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    if step == "rows":
        erase_does_nothing(monkeypatch)
    if step in ("read", "rows"):
        rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await run_until_step(rig, servo, "factory-reset", step)
    await asyncio.sleep(0.003)  # what the adapter has by now is sent
    count = len(rig.writes())
    sent = erases(rig)
    await rig.call("POST", "/stop")
    error = failed_with(json(await rig.call("GET", f"/jobs/{job_id}")), "stopped")
    assert error["snapshot"] > 0
    assert "Every row verified" in error["not_done"]
    await asyncio.sleep(10)
    assert {one[1:] for one in rig.writes()[count:]} == {("0x20", 1)}
    assert erases(rig) <= max(sent, 1)
    assert rig.sim(servo).output == 1
    assert servo.busy is None


@settled(CONFIGURED)
async def test_rows_are_written_if_erase_does_nothing(rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch) -> None:
    before = stored(rig, servo)
    erase_does_nothing(monkeypatch)
    job = succeeded(await reset(rig, servo))
    assert stored(rig, servo) == defaults(servo, before)
    written = next(one["evidence"] for one in job["steps"] if one["name"] == "rows")
    assert set(written.split(", ")) == set(CHANGED) - {"origin", "torque_mode"}


@settled(CONFIGURED)
async def test_power_loss_ends_a_reset_with_what_is_not_done_and_the_snapshot(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await run_until_step(rig, servo, "factory-reset", "read")
    rig.bench.power(servo.uid, False)
    error = failed_with(await ended(rig, job_id), "no_response")
    assert {"Saved to ROM", "Every row verified"} <= set(error["not_done"])
    assert "Not done: " in error["detail"]
    snapshot = rig.host.history.snapshots.get(error["snapshot"])
    assert (snapshot.reason, snapshot.ram["angle_p_gain"], snapshot.ram["origin"]) == ("before factory reset", 77, 150)
    assert servo.busy is None
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(6)
    assert servo.registers["angle_p_gain"].rom == 77, "ERASE changed RAM only"


@settled(CONFIGURED)
async def test_a_short_power_loss_while_rows_are_written_restarts_the_writing(rig: Rig, servo: Servo) -> None:
    before = stored(rig, servo)
    rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await run_until_step(rig, servo, "factory-reset", "identity")
    await power_cycle(rig, servo.uid, 0.5)
    succeeded(await ended(rig, job_id))
    assert stored(rig, servo) == defaults(servo, before)


@settled(CONFIGURED)
async def test_power_loss_during_the_save_of_a_reset_is_a_lost_configuration(rig: Rig, servo: Servo) -> None:
    sim = rig.sim(servo)
    job_id = await run_until(rig, servo, "factory-reset", lambda _job: sim.stage is ServoStage.SAVING)
    await power_cycle(rig, servo.uid, 1)
    error = failed_with(await ended(rig, job_id), "configuration_lost")
    assert rig.host.history.snapshots.get(error["snapshot"]).ram["angle_p_gain"] == 77
    assert error["not_done"] == ["Saved to ROM", "Every row verified"]


@settled(CONFIGURED)
async def test_a_reset_excludes_other_changes_and_its_audit_lists_every_row(rig: Rig, servo: Servo) -> None:
    job_id = await run_until_step(rig, servo, "factory-reset", "erase")
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "busy", 409)
    problem(await rig.call("POST", f"/servos/{servo.uid}/factory-reset"), "busy", 409)
    body = {"values": {"angle_p_gain": 1}}
    problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body), "busy", 409)
    succeeded(await ended(rig, job_id))
    rows = [one.entry for one in rig.host.store.audit.rows(uid=servo.uid) if one.entry.action == "factory_reset"]
    assert {one.job for one in rows} == {job_id}
    assert rows[0].outcome == "succeeded"
    changes = {one.key: (one.before, one.after) for one in rows[1:]}
    assert changes["angle_p_gain"] == (77, 40)
    assert changes["torque_mode"] == ("off", "on")
    assert set(changes) == set(CHANGED) - {"origin"}


@settled(CONFIGURED)
async def test_a_cancelled_reset_leaves_torque_off(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.response_delay_s = 0.01
    job_id = await run_until_step(rig, servo, "factory-reset", "read")
    assert json(await rig.call("DELETE", f"/jobs/{job_id}"))["state"] == "cancelled"
    rig.sim(servo).conditions.response_delay_s = 0
    await asyncio.sleep(1)
    assert rig.sim(servo).output == 1
    assert servo.busy is None


@settled(CONFIGURED)
async def test_a_dry_run_of_a_restart_lists_lost_values_and_the_move_and_sends_nothing(rig: Rig, servo: Servo) -> None:
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
    succeeded(await run(rig, servo, "restart", {"dry_run": False}))
    assert servo.boot_count == boot_count + 1
    assert servo.raw("angle_p_gain") == 77


@pytest.mark.parametrize("verb", ["restart", "factory-reset"])
@settled()
async def test_a_restart_or_reset_and_its_dry_run_are_refused_alike(rig: Rig, servo: Servo, verb: str) -> None:
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
    assert erases(rig) == 0
    job_id = json(await rig.call("POST", path), 202)["id"]
    problem(await rig.call("POST", path, {"dry_run": True}), "busy", 409)
    await ended(rig, job_id)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    await both("no_response", 504)
    assert erases(rig) == (1 if verb == "factory-reset" else 0)

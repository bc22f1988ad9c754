"""Failures around configuration: concurrent clients, restarts at bad moments, cancelled jobs."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from behaviour.actions import torque
from behaviour.clashes import Watch
from behaviour.restarting import ended, failed_with, run, run_until_step
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene, settled
from hornbill.errors import Busy
from hornbill.servo.configuration.restart_plan import RestartKind, RestartOptions
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.registers import Registers
from hornbill.wire.services import MAGIC

GAIN = 0x2C
STILL = replace(PLAIN, rom={"soft_start": 0, "torque_mode": 1})
TWO = (STILL, replace(STILL, servo_id=2, node_id=12))
RESTARTS: tuple[RestartKind, ...] = ("save", "restart", "factory_reset")


async def old(rig: Rig, count: int) -> list[Servo]:
    """Servos that have run for a while, by node ID."""
    found = await rig.ready(count)
    await asyncio.sleep(4)
    return sorted(found, key=lambda one: one.node_id or 0)


async def patch(rig: Rig, servo: Servo, *, save: bool = False, lease: str | None = None, **values: object) -> Any:
    body = {"values": values, "save": save}
    return json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body, lease=lease))


async def until_step(rig: Rig, job_id: str, step: str) -> None:
    """Wait until a job is at this step."""
    job = rig.host.jobs.get(job_id)
    await until(lambda: job.step == step or job.ended, 60, 0.0002)
    assert not job.ended, job.error


async def aside(rig: Rig, servo: Servo) -> None:
    """Put its horn at 90°, under more load than soft start can move, with torque on after a restart."""
    await torque(rig, servo, "off")
    assert rig.bench.turn_manually(servo.uid, 90.0)
    rig.sim(servo).memory.put(0x20, 0)  # as another tool would: on, and commanded by no client
    rig.sim(servo).conditions.load_pct = 60.0


def brief_power_cut(rig: Rig, servo: Servo) -> None:
    rig.bench.power(servo.uid, on=False)
    rig.bench.power(servo.uid, on=True)


@settled(STILL)
async def test_a_job_cancelled_before_its_first_step_leaves_its_servo_ready(rig: Rig, servo: Servo) -> None:
    begin: list[Callable[[], RunningJob]] = [
        lambda: rig.host.restarting.start(servo, "save"), lambda: rig.host.restarting.start(servo, "restart"),
        lambda: rig.host.restarting.start(servo, "factory_reset"), lambda: rig.host.wiggle.identify(servo, None),
    ]  # fmt: skip
    for each in begin:
        job = each()
        await rig.host.jobs.cancel(job.id)
        assert job.ended
        assert servo.busy is None
        assert rig.host.leases.current(rig.host.base.now()) is None
        assert servo.state is State.READY


@settled()
async def test_a_save_fails_when_the_servo_keeps_restarting(rig: Rig, servo: Servo) -> None:
    await aside(rig, servo)
    job_id = await run_until_step(rig, servo, "save", "soft_start")

    async def sag() -> None:  # each soft start makes the supply sag
        while True:
            brief_power_cut(rig, servo)
            await asyncio.sleep(3)

    task = asyncio.create_task(sag())
    try:
        async with asyncio.timeout(300):
            done = await ended(rig, job_id)
    finally:
        task.cancel()
    error = failed_with(done, "no_response")
    assert (error["cause"], error["servo"]) == ("restarts_repeatedly", servo.title)
    assert servo.busy is None
    await asyncio.sleep(10)
    assert (await rig.ready())[0] is servo


@pytest.mark.parametrize("how", ["stop", "cancel"])
@settled(replace(STILL, behaviour=Behaviour(erase_rom=True)))
async def test_rom_is_unknown_when_a_reset_ends_during_erase(rig: Rig, servo: Servo, how: str) -> None:
    await patch(rig, servo, save=True, angle_p_gain=77)
    await rig.ready()
    await asyncio.sleep(8)
    assert servo.registers["angle_p_gain"].rom == 77
    rig.sim(servo).conditions.response_delay_s = 0.1
    job_id = await run_until_step(rig, servo, "factory-reset", "erase")
    await asyncio.sleep(0.05)
    assert rig.sim(servo).memory.stored(GAIN) == 40
    json(await (rig.call("POST", "/stop") if how == "stop" else rig.call("DELETE", f"/jobs/{job_id}")))
    rig.sim(servo).conditions.response_delay_s = 0.0
    await ended(rig, job_id)
    assert servo.registers["angle_p_gain"].rom is None
    assert servo.registers["angle_p_gain"].at is None


@settled(STILL)
async def test_values_lost_in_a_restart_before_their_save_are_not_reported_saved(rig: Rig, servo: Servo) -> None:
    response = await patch(rig, servo, save=True, angle_p_gain=55)
    brief_power_cut(rig, servo)
    done = await ended(rig, response["job"])
    assert rig.sim(servo).memory.stored(GAIN) == 40
    error = failed_with(done, "unexpected_result")
    assert error["params"] == {"servo": servo.title, "cause": "values_lost_before_save", "keys": ["angle_p_gain"]}
    assert error["differences"] == [{"key": "angle_p_gain", "wanted": 55, "found": 40}]


@pytest.mark.parametrize("change", ["restart", "write"])
@scene(*TWO)
async def test_a_profile_changed_before_its_save_is_not_reported_saved(rig: Rig, change: str) -> None:
    first, second = await old(rig, 2)
    json(await rig.call("PUT", "/profiles/bench", {"values": {"angle_p_gain": 55}}), 201)
    body = {"uids": [first.uid, second.uid], "save": True, "on_anomaly": "continue"}
    started = json(await rig.call("POST", "/profiles/bench/apply", body), 202)
    await until_step(rig, started["id"], "save 1")
    if change == "restart":
        brief_power_cut(rig, second)
    else:
        await patch(rig, second, angle_p_gain=66)
    done = await ended(rig, started["id"])
    assert [one["saved"] for one in done["result"]["servos"]] == [True, False], done["result"]
    assert done["state"] == "failed"
    lost = done["result"]["servos"][1]["problem"]
    assert (lost["cause"], lost["servo"], lost["keys"]) == ("values_lost_before_save", second.title, ["angle_p_gain"])
    assert lost["differences"] == [{"key": "angle_p_gain", "wanted": 55, "found": 40 if change == "restart" else 66}]
    if change == "restart":
        assert rig.sim(second).memory.stored(GAIN) == 40


@pytest.mark.parametrize("wanted", [(12, 11), (12, 13)], ids=["swapped", "in a chain"])
@scene(*TWO)
async def test_static_node_ids_saved_at_once_never_clash(rig: Rig, wanted: tuple[int, int]) -> None:
    first, second = await old(rig, 2)
    watch = Watch(rig)
    rig.sim(second).conditions.drop_responses_pct = 60.0  # it is saved after the one that wants its ID
    body = {"servos": {first.uid: {"node_id": wanted[0]}, second.uid: {"node_id": wanted[1]}}, "save": True}
    response = json(await rig.call("PATCH", "/parameters", body))
    done = [await ended(rig, one["job"]) for one in response["servos"] if one["job"] is not None]
    if wanted == (12, 13):
        assert [one["state"] for one in done] == ["succeeded"] * 2, done
        assert (first.node_id, second.node_id) == wanted
    await asyncio.sleep(5)
    assert watch.clashes == set()


@settled(STILL)
async def test_a_servo_is_not_identified_and_restarted_at_once(rig: Rig, servo: Servo) -> None:
    job = rig.host.wiggle.identify(servo, None)
    lease = rig.host.leases.current(rig.host.base.now())
    assert lease is not None
    for other in RESTARTS:
        with pytest.raises(Busy):
            rig.host.restarting.start(servo, other, RestartOptions(lease.id))
    await ended(rig, job.id)


@settled(STILL)
async def test_a_static_node_id_taken_meanwhile_is_not_saved(rig: Rig, servo: Servo) -> None:
    await patch(rig, servo, node_id=50)
    watch = Watch(rig)
    rig.bench.add(replace(STILL, servo_id=2, node_id=50))
    await rig.ready(2)
    error = failed_with(await run(rig, servo, "save"), "conflict")
    owner = next(one for one in rig.host.fleet.all() if one is not servo)
    planned = problem(await rig.call("POST", f"/servos/{servo.uid}/save", {"dry_run": True}), "conflict", 409)
    assert {key: planned[key] for key in error["params"]} == error["params"]
    assert error["params"] == {
        "servo": servo.title, "cause": "node_id_still_in_use", "key": "node_id", "requested": 50,
        "owner": owner.uid, "owner_title": owner.title,
    }  # fmt: skip
    assert rig.sim(servo).starts == 1
    assert watch.clashes == set()


# without a command, nothing ends this soft start
@settled(replace(PLAIN, rom={"speed_torque_control": 0}, behaviour=Behaviour(timeout_from="first_command")))
async def test_values_of_an_unfinished_soft_start_are_not_taken_for_rom(rig: Rig, servo: Servo) -> None:
    await aside(rig, servo)
    done = await run(rig, servo, "save")
    error = failed_with(done, "did_not_move")
    assert error["params"] == {
        "servo": servo.title, "cause": "soft_start_stuck", "snapshot": error["snapshot"],
        "also": ["snapshot_has_previous_values"],
    }  # fmt: skip
    await asyncio.sleep(40)
    assert rig.sim(servo).soft_starting
    stored = {key: rig.sim(servo).memory.stored(one.parameter.address) for key, one in servo.registers.items()}
    wrong = {key: one.rom for key, one in servo.registers.items() if one.rom not in (None, stored[key])}
    assert wrong == {}, done["error"]


@pytest.mark.parametrize("later", ["stop", "torque off", "release", "slow responses"])
@settled(replace(PLAIN, rom={"soft_start": 0, "timeout_action": 0}, angle_deg=25.0))
async def test_an_identify_fails_exactly_if_it_lost_torque(rig: Rig, servo: Servo, later: str) -> None:
    lease = await rig.lease()
    started = json(await rig.call("POST", f"/servos/{servo.uid}/identify", lease=lease), 202)
    await until_step(rig, started["id"], "restore")
    if later == "stop":
        json(await rig.call("POST", "/stop"))
    elif later == "release":
        await rig.call("DELETE", f"/leases/{lease}")
    elif later == "torque off":
        await torque(rig, servo, "off")
    else:
        for _ in range(4):
            rig.sim(servo).conditions.mute = True
            await asyncio.sleep(1.7)
            rig.sim(servo).conditions.mute = False
            await asyncio.sleep(0.13)
    done = await ended(rig, started["id"])
    await asyncio.sleep(1)
    assert (done["state"] == "succeeded") is (rig.sim(servo).register(0x20) == 0), done
    assert later == "slow responses" or done["state"] == "failed"


@settled(STILL)
async def test_a_write_after_an_unnoticed_restart_is_not_taken_for_rom(rig: Rig, servo: Servo) -> None:
    brief_power_cut(rig, servo)
    rig.bus.loss(100)
    await asyncio.sleep(0.12)  # its first NodeStatus is lost
    rig.bus.loss(0)
    boot_count = servo.boot_count
    response = await patch(rig, servo, angle_p_gain=55)
    assert servo.boot_count == boot_count
    assert response["outcome"] == "applied", response
    await asyncio.sleep(3)
    assert servo.boot_count == boot_count + 1
    assert rig.sim(servo).memory.get(GAIN) == 55
    assert rig.sim(servo).memory.stored(GAIN) == 40
    assert servo.registers["angle_p_gain"].rom in (None, 40)


@scene(replace(STILL, behaviour=Behaviour(save_opcode_restarts=False)))
async def test_after_a_save_without_a_restart_rom_is_unknown(rig: Rig) -> None:
    async def again(rig: Rig) -> Servo:
        await rig.host.disconnect()
        await rig.host.connect("memory:host", 1_000_000)
        return (await rig.ready())[0]

    rig.host.store.servos._wall = rig.host.base.utc_now  # pyright: ignore[reportPrivateUsage] - the clock that jumps
    await asyncio.sleep(24)
    servo = await again(rig)
    assert servo.registers["angle_p_gain"].rom == 40
    await patch(rig, servo, angle_p_gain=55)
    job_id = await run_until_step(rig, servo, "save", "silence")
    json(await rig.call("DELETE", f"/jobs/{job_id}"))
    assert servo.registers["angle_p_gain"].rom is None
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert (await again(rig)).registers["angle_p_gain"].rom is None
    assert rig.sim(servo).starts == 1


@pytest.mark.parametrize(
    ("ok", "code", "facts", "requests"),
    [
        (False, "refused_by_servo", {"cause": "restart_refused"}, 1),
        (True, "no_response", {"cause": "restart_ignored", "tries": 4}, 4),
    ],
    ids=["rejected", "ignored"],
)
@settled(replace(STILL, behaviour=Behaviour(save_opcode_restarts=False)))
async def test_rom_is_unknown_if_the_restart_is_rejected_or_ignored(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch, ok: bool, code: str, facts: dict[str, Any], requests: int
) -> None:
    magic: list[int] = []
    await patch(rig, servo, angle_p_gain=55)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)

    async def answer(_servo: Servo, number: int) -> bool:
        magic.append(number)
        return ok

    monkeypatch.setattr(rig.host.requests, "restart", answer)
    error = failed_with(await ended(rig, started["id"]), code)
    assert error["params"] == {
        "servo": servo.title,
        "snapshot": error["snapshot"],
        "also": ["snapshot_has_previous_values"],
        **facts,
    }
    assert magic == [MAGIC] * requests
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert servo.registers["angle_p_gain"].rom is None


@scene(*TWO)
async def test_a_commissioning_excludes_another_and_once_cancelled_restores_a_parked_id_or_reports_it(
    rig: Rig,
) -> None:
    first, second = await old(rig, 2)
    wanted = [{"uid": first.uid, "servo_id": 2}, {"uid": second.uid, "servo_id": 1}]
    started = json(await rig.call("POST", "/commissioning", {"servos": wanted, "save": True}), 202)
    other = {"servos": [{"uid": second.uid, "servo_id": 9}], "save": True}
    problem(await rig.call("POST", "/commissioning", other), "busy", 409)
    await until_step(rig, started["id"], "save 1")
    json(await rig.call("DELETE", f"/jobs/{started['id']}"))
    done = await ended(rig, started["id"])
    unit = done["result"]["servos"][1]
    assert rig.sim(second).servo_id == 2 or "Servo ID" in (unit["problem"] or {}).get("detail", ""), done


@settled(STILL)
async def test_a_failed_reset_records_its_writes(rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(_self: Registers) -> None:
        return

    monkeypatch.setattr(Registers, "erase", nothing)
    await patch(rig, servo, angle_p_gain=77, temperature_limit_upper=70)
    rig.sim(servo).conditions.refuse_keys.add("temperature_limit_upper")
    done = await run(rig, servo, "factory-reset")
    assert done["state"] == "failed", done
    shown = json(await rig.call("GET", f"/audit?uid={servo.uid}"))
    rows = [one for one in shown if one["action"] == "factory_reset"]
    done_to = {one["key"]: (one["before"], one["after"]) for one in rows if one["outcome"] == "applied"}
    assert done_to["angle_p_gain"] == (77, 40), done_to

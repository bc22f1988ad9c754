"""What goes wrong around configuration: two callers at once, a servo that starts anew, a server that ends half way."""

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.errors import Busy
from hornbill.servo.configuration.restart_plan import RestartKind, RestartOptions
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoStage
from hornbill.sim.registers import Registers
from hornbill.units import Uid
from hornbill.wire.frame import Frame

GAIN = 0x2C
STILL = replace(PLAIN, rom={"soft_start": 0, "torque_mode": 1})


async def old(rig: Rig, count: int = 1) -> list[Servo]:
    found = await rig.ready(count)
    await asyncio.sleep(4)
    return sorted(found, key=lambda one: one.node_id or 0)


async def ended(rig: Rig, job_id: str) -> Any:
    await rig.host.jobs.wait(rig.host.jobs.get(job_id))
    return json(await rig.call("GET", f"/jobs/{job_id}"))


async def patch(rig: Rig, servo: Servo, *, save: bool = False, lease: str | None = None, **values: object) -> Any:
    body = {"values": values, "save": save}
    return json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body, lease=lease))


async def until_step(rig: Rig, job_id: str, step: str) -> None:
    job = rig.host.jobs.get(job_id)
    async with asyncio.timeout(60):
        while job.step != step:
            await asyncio.sleep(0.0002)
            assert not job.ended, job.error


async def aside(rig: Rig, servo: Servo) -> None:
    """Let its horn stand at 90°, under more load than soft start can move, and torque be on when it starts anew."""
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    assert rig.bench.turn_manually(Uid(servo.uid), 90.0)
    rig.sim(servo).memory.put(0x20, 0)  # as another tool would: on, and under nobody's command
    rig.sim(servo).conditions.load_pct = 60.0


@pytest.mark.parametrize("kind", ["save", "restart", "reset", "identify"])
@scene(STILL)
async def test_a_job_that_is_cancelled_before_its_first_turn_leaves_its_servo_ready(rig: Rig, kind: str) -> None:
    servo = (await old(rig))[0]
    begin = {
        "save": lambda: rig.host.restarting.start(servo, "save"),
        "restart": lambda: rig.host.restarting.start(servo, "restart"),
        "reset": lambda: rig.host.restarting.start(servo, "factory_reset"),
        "identify": lambda: rig.host.wiggle.identify(servo, None),
    }[kind]
    job = begin()
    await rig.host.jobs.cancel(job.id)
    assert job.ended
    assert servo.busy is None
    assert rig.host.leases.current(rig.host.base.now()) is None
    assert servo.state is State.READY


@scene()
async def test_a_servo_that_starts_again_and_again_after_its_save_ends_the_job(rig: Rig) -> None:
    servo = (await old(rig))[0]
    await aside(rig, servo)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    await until_step(rig, started["id"], "soft_start")

    async def sag() -> None:  # each soft start pulls the supply down
        while True:
            rig.bench.power(Uid(servo.uid), on=False)
            rig.bench.power(Uid(servo.uid), on=True)
            while servo.soft_starting:
                await asyncio.sleep(0.0001)
            while not servo.soft_starting:
                await asyncio.sleep(0.0001)

    task = asyncio.create_task(sag())
    try:
        async with asyncio.timeout(300):
            done = await ended(rig, started["id"])
    finally:
        task.cancel()
    assert done["state"] == "failed", done
    assert servo.busy is None
    await asyncio.sleep(10)
    assert (await rig.ready())[0] is servo


@pytest.mark.parametrize("how", ["stop", "cancel"])
@scene(replace(STILL, behaviour=Behaviour(erase_rom=True)))
async def test_what_rom_holds_is_not_known_when_a_reset_ends_while_erase_is_under_way(rig: Rig, how: str) -> None:
    servo = (await old(rig))[0]
    await patch(rig, servo, save=True, angle_p_gain=77)
    await rig.ready()
    await asyncio.sleep(8)
    assert servo.registers["angle_p_gain"].rom == 77
    rig.sim(servo).conditions.response_delay_s = 0.1
    started = json(await rig.call("POST", f"/servos/{servo.uid}/factory-reset"), 202)
    await until_step(rig, started["id"], "erase")
    await asyncio.sleep(0.05)
    assert rig.sim(servo).memory.stored(GAIN) == 40
    if how == "stop":
        json(await rig.call("POST", "/stop"))
    else:
        json(await rig.call("DELETE", f"/jobs/{started['id']}"))
    rig.sim(servo).conditions.response_delay_s = 0.0
    await ended(rig, started["id"])
    assert servo.registers["angle_p_gain"].rom is None
    assert servo.registers["angle_p_gain"].at is None


@scene(STILL)
async def test_values_that_a_restart_took_before_they_were_saved_are_not_called_saved(rig: Rig) -> None:
    servo = (await old(rig))[0]
    answer = await patch(rig, servo, save=True, angle_p_gain=55)
    rig.bench.power(Uid(servo.uid), on=False)
    rig.bench.power(Uid(servo.uid), on=True)
    done = await ended(rig, answer["job"])
    assert rig.sim(servo).memory.stored(GAIN) == 40
    assert done["state"] == "failed", done


@scene(STILL, replace(STILL, servo_id=2, node_id=12))
async def test_a_profile_that_a_restart_took_before_its_save_is_not_called_saved(rig: Rig) -> None:
    first, second = await old(rig, 2)
    json(await rig.call("PUT", "/profiles/bench", {"values": {"angle_p_gain": 55}}), 201)
    body = {"uids": [first.uid, second.uid], "save": True, "on_anomaly": "continue"}
    started = json(await rig.call("POST", "/profiles/bench/apply", body), 202)
    await until_step(rig, started["id"], "save 1")
    rig.bench.power(Uid(second.uid), on=False)
    rig.bench.power(Uid(second.uid), on=True)
    done = await ended(rig, started["id"])
    assert rig.sim(second).memory.stored(GAIN) == 40
    assert [one["saved"] for one in done["result"]["servos"]] == [True, False], done["result"]
    assert done["state"] == "failed"


@scene(STILL, replace(STILL, servo_id=2, node_id=12))
async def test_a_profile_somebody_changes_before_its_save_is_not_called_saved(rig: Rig) -> None:
    first, second = await old(rig, 2)
    json(await rig.call("PUT", "/profiles/bench", {"values": {"angle_p_gain": 55}}), 201)
    body = {"uids": [first.uid, second.uid], "save": True, "on_anomaly": "continue"}
    started = json(await rig.call("POST", "/profiles/bench/apply", body), 202)
    await until_step(rig, started["id"], "save 1")
    await patch(rig, second, angle_p_gain=66)
    done = await ended(rig, started["id"])
    assert [one["saved"] for one in done["result"]["servos"]] == [True, False], done["result"]


@pytest.mark.parametrize("other", ["save", "restart", "factory_reset"])
@scene(STILL)
async def test_one_servo_is_not_wiggled_and_restarted_at_once(rig: Rig, other: RestartKind) -> None:
    servo = (await old(rig))[0]
    job = rig.host.wiggle.identify(servo, None)
    lease = rig.host.leases.current(rig.host.base.now())
    assert lease is not None
    with pytest.raises(Busy):
        rig.host.restarting.start(servo, other, RestartOptions(lease.id))
    await ended(rig, job.id)


class Nodes:
    """Looks at every simulated servo each time anything was on the bus: node ids that two shared."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.clashes: set[int] = set()
        rig.bus.port("watch").listen(self.look)

    def look(self, _frames: Sequence[Frame]) -> None:
        up = [
            int(sim.node_id)
            for sim in self.rig.bench.servos.values()
            if sim.stage is ServoStage.RUNNING and sim.powered
        ]
        self.clashes |= {node for node in up if node and up.count(node) > 1}


@scene(STILL, replace(STILL, servo_id=2, node_id=12))
async def test_static_node_ids_that_are_swapped_and_saved_at_once_never_clash(rig: Rig) -> None:
    first, second = await old(rig, 2)
    nodes = Nodes(rig)
    rig.sim(second).conditions.drop_responses_pct = 60.0
    body = {"servos": {first.uid: {"node_id": 12}, second.uid: {"node_id": 11}}, "save": True}
    answer = json(await rig.call("PATCH", "/parameters", body))
    for one in answer["servos"]:
        if one["job"] is not None:
            await ended(rig, one["job"])
    await asyncio.sleep(5)
    assert nodes.clashes == set()


@scene(STILL, replace(STILL, servo_id=2, node_id=12))
async def test_a_chain_of_static_node_ids_saved_at_once_never_clashes(rig: Rig) -> None:
    first, second = await old(rig, 2)
    nodes = Nodes(rig)
    rig.sim(second).conditions.drop_responses_pct = 60.0  # it is saved later than the one that wants its id
    body = {"servos": {first.uid: {"node_id": 12}, second.uid: {"node_id": 13}}, "save": True}
    answer = json(await rig.call("PATCH", "/parameters", body))
    done = [await ended(rig, one["job"]) for one in answer["servos"]]
    assert [one["state"] for one in done] == ["succeeded"] * 2, done
    assert (first.node_id, second.node_id) == (12, 13)
    assert nodes.clashes == set()


@scene(STILL)
async def test_a_static_node_id_somebody_else_is_on_meanwhile_is_not_saved(rig: Rig) -> None:
    first = (await old(rig))[0]
    await patch(rig, first, node_id=50)
    nodes = Nodes(rig)
    rig.bench.add(replace(STILL, servo_id=2, node_id=50))
    await rig.ready(2)
    done = json(await rig.call("POST", f"/servos/{first.uid}/save?wait=true"))
    assert done["error"]["code"] == "conflict", done
    assert rig.sim(first).starts == 1
    assert nodes.clashes == set()


def test_after_a_soft_start_that_did_not_end_its_temporary_values_are_not_called_rom() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await old(rig))[0]
        await aside(rig, servo)
        done = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
        assert done["state"] == "failed", done
        await asyncio.sleep(40)
        assert rig.sim(servo).soft_starting
        stored = {key: rig.sim(servo).memory.stored(one.parameter.address) for key, one in servo.registers.items()}
        wrong = {key: one.rom for key, one in servo.registers.items() if one.rom not in (None, stored[key])}
        assert wrong == {}, done["error"]

    never = Behaviour(timeout_from="first_command")  # nobody commands it, so nothing ends its soft start
    play(scene, replace(PLAIN, rom={"speed_torque_control": 0}, behaviour=never))


@pytest.mark.parametrize("later", ["stop", "torque off", "release"])
@scene(replace(PLAIN, rom={"soft_start": 0, "timeout_action": 0}, angle_deg=25.0))
async def test_an_identify_that_lost_its_torque_on_the_way_back_does_not_say_that_it_holds(
    rig: Rig, later: str
) -> None:
    servo = (await old(rig))[0]
    lease = await rig.lease()
    answer = await rig.call("POST", f"/servos/{servo.uid}/identify", lease=lease)
    started = json(answer, 202)
    await until_step(rig, started["id"], "restore")
    if later == "stop":
        json(await rig.call("POST", "/stop"))
    elif later == "release":
        await rig.call("DELETE", f"/leases/{lease}")
    else:
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    done = await ended(rig, started["id"])
    await asyncio.sleep(1)
    assert rig.sim(servo).register(0x20) == 1
    assert done["state"] == "failed", done


@scene(replace(PLAIN, rom={"soft_start": 0, "timeout_action": 0}, angle_deg=25.0))
async def test_an_identify_whose_rows_are_given_back_slowly_keeps_torque(rig: Rig) -> None:
    servo = (await old(rig))[0]
    started = json(await rig.call("POST", f"/servos/{servo.uid}/identify"), 202)
    await until_step(rig, started["id"], "restore")
    for _ in range(4):
        rig.sim(servo).conditions.mute = True
        await asyncio.sleep(1.7)
        rig.sim(servo).conditions.mute = False
        await asyncio.sleep(0.13)
    done = await ended(rig, started["id"])
    await asyncio.sleep(1)
    assert (done["state"] == "succeeded") is (rig.sim(servo).register(0x20) == 0), done


@scene(STILL)
async def test_what_was_written_right_after_a_restart_nobody_had_noticed_is_not_called_rom(rig: Rig) -> None:
    servo = (await old(rig))[0]
    rig.bench.power(Uid(servo.uid), on=False)
    rig.bench.power(Uid(servo.uid), on=True)
    rig.bus.loss(100)
    await asyncio.sleep(0.12)  # its first NodeStatus is lost
    rig.bus.loss(0)
    boot_count = servo.boot_count
    answer = await patch(rig, servo, angle_p_gain=55)
    assert servo.boot_count == boot_count
    assert answer["outcome"] == "applied", answer
    await asyncio.sleep(3)
    assert servo.boot_count == boot_count + 1
    assert rig.sim(servo).memory.get(GAIN) == 55
    assert rig.sim(servo).memory.stored(GAIN) == 40
    assert servo.registers["angle_p_gain"].rom in (None, 40)


def test_after_a_save_that_was_carried_out_without_a_restart_whoever_meets_the_servo_again_claims_nothing() -> None:
    async def again(rig: Rig) -> Servo:
        await rig.host.disconnect()
        await rig.host.connect("memory:host", 1_000_000)
        return (await rig.ready())[0]

    async def scene(rig: Rig) -> None:
        rig.host.store.servos._wall = rig.host.base.utc_now  # pyright: ignore[reportPrivateUsage] - the clock that jumps
        await old(rig)
        await asyncio.sleep(20)
        servo = await again(rig)
        assert servo.registers["angle_p_gain"].rom == 40
        await patch(rig, servo, angle_p_gain=55)
        started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
        await until_step(rig, started["id"], "silence")
        json(await rig.call("DELETE", f"/jobs/{started['id']}"))
        assert servo.registers["angle_p_gain"].rom is None
        assert rig.sim(servo).memory.stored(GAIN) == 55
        assert (await again(rig)).registers["angle_p_gain"].rom is None
        assert rig.sim(servo).starts == 1

    play(scene, replace(STILL, behaviour=Behaviour(save_opcode_restarts=False)))


@scene(replace(STILL, behaviour=Behaviour(save_opcode_restarts=False)))
async def test_a_refused_restart_after_a_save_leaves_rom_unknown(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    servo = (await old(rig))[0]
    await patch(rig, servo, angle_p_gain=55)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)

    async def no(_servo: Servo, _magic: int) -> bool:
        return False

    monkeypatch.setattr(rig.host.requests, "restart", no)
    done = await ended(rig, started["id"])
    assert done["error"]["code"] == "refused_by_servo", done
    assert rig.sim(servo).memory.stored(GAIN) == 55
    assert servo.registers["angle_p_gain"].rom is None


@scene(STILL, replace(STILL, servo_id=2, node_id=12))
async def test_a_commissioning_that_is_cancelled_gives_a_parked_id_back_or_says_so(rig: Rig) -> None:
    first, second = await old(rig, 2)
    wanted = [{"uid": first.uid, "servo_id": 2}, {"uid": second.uid, "servo_id": 1}]
    started = json(await rig.call("POST", "/commissioning", {"servos": wanted, "save": True}), 202)
    await until_step(rig, started["id"], "save 1")
    json(await rig.call("DELETE", f"/jobs/{started['id']}"))
    done = await ended(rig, started["id"])
    unit = done["result"]["servos"][1]
    assert rig.sim(second).servo_id == 2 or "Servo ID" in (unit["problem"] or {}).get("detail", ""), done


@scene(STILL, replace(STILL, servo_id=2, node_id=12))
async def test_two_commissionings_of_one_servo_are_not_under_way_at_once(rig: Rig) -> None:
    first, second = await old(rig, 2)
    both = {"servos": [{"uid": first.uid, "servo_id": 5}, {"uid": second.uid, "servo_id": 6}], "save": True}
    started = json(await rig.call("POST", "/commissioning", both), 202)
    other = {"servos": [{"uid": second.uid, "servo_id": 9}], "save": True}
    problem(await rig.call("POST", "/commissioning", other), "busy", 409)
    assert (await ended(rig, started["id"]))["state"] == "succeeded"


def test_a_reset_that_fails_half_way_has_a_row_in_the_audit_for_each_row_it_wrote(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def nothing(_self: Registers) -> None:
        return

    monkeypatch.setattr(Registers, "erase", nothing)

    async def scene(rig: Rig) -> None:
        servo = (await old(rig))[0]
        await patch(rig, servo, angle_p_gain=77, temperature_limit_upper=70)
        rig.sim(servo).conditions.refuse_keys.add("temperature_limit_upper")
        done = json(await rig.call("POST", f"/servos/{servo.uid}/factory-reset?wait=true"))
        assert done["state"] == "failed", done
        written = {key for node, name, _raw in rig.writes() for key, one in servo.registers.items()
                   if (node, name) == (servo.node_id, one.parameter.name) and key != "torque_mode"}  # fmt: skip
        shown = json(await rig.call("GET", f"/audit?uid={servo.uid}"))
        rows = [one for one in shown if one["action"] == "factory_reset"]
        done_to = {one["key"]: (one["before"], one["after"]) for one in rows if one["outcome"] == "applied"}
        assert done_to["angle_p_gain"] == (77, 40), (done_to, written)

    play(scene, STILL)

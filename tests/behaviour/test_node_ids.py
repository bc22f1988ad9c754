"""Node ids over REST and with the whole server: pins, forgetting, the allocator's mode, refusals, and sudden deaths."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.neighbour import Neighbour
from behaviour.rig import CATALOG, PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.app.settings import Settings
from hornbill.errors import BusDisconnected
from hornbill.node.allocator import RECYCLE_AFTER_S, AllocationMode
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.host import Host, HostSettings
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import NodeId, Uid
from hornbill.wire.datatype import Kind, Structure
from hornbill.wire.messages import AllocationMessage

DYNAMIC = Recipe("BLA21-06U-A0", "1.300", servo_id=1)
STRANGER = Uid("ab" * 16)


async def table(rig: Rig) -> dict[str, Any]:
    """GET /allocations."""
    return json(await rig.call("GET", "/allocations"))


async def row(rig: Rig, uid: str) -> dict[str, Any]:
    """One row of it."""
    return next(one for one in (await table(rig))["allocations"] if one["uid"] == uid)


async def allocator(rig: Rig) -> dict[str, Any]:
    """The allocator as GET /bus shows it."""
    return json(await rig.call("GET", "/bus"))["allocator"]


async def restart(rig: Rig, servo: Servo, off_s: float = 4.0) -> None:
    """Cut the supply of a servo, long enough to be noticed."""
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(off_s)
    rig.bench.power(servo.uid, True)


@scene(DYNAMIC)
async def test_the_table_says_who_is_there_and_when_a_node_was_last_seen(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(200)
    (found,) = (await table(rig))["allocations"]
    assert (found["uid"], found["node_id"], found["pinned"], found["online"]) == (servo.uid, 125, False, True)
    gone_at = rig.host.base.utc_now()
    assert found["last_seen"] == pytest.approx(gone_at, abs=0.01)
    kept = rig.host.store.allocations
    asked_at = kept.get(servo.uid).last_seen
    kept._wall = rig.host.base.utc_now  # pyright: ignore[reportPrivateUsage] - the test's clock jumps
    await asyncio.sleep(61)
    assert (kept.get(servo.uid).last_seen or 0) > (asked_at or 0)
    gone_at = rig.host.base.utc_now()
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(600)
    found = await row(rig, servo.uid)
    assert not found["online"]
    assert gone_at - 61 < found["last_seen"] < gone_at + 5


@scene(DYNAMIC)
async def test_a_pin_is_given_at_the_next_start_and_the_answer_says_so(rig: Rig, servo: Servo) -> None:
    answer = json(await rig.call("PUT", f"/allocations/{servo.uid}", {"node_id": 17}))
    assert (answer["node_id"], answer["pinned"], answer["online"]) == (17, True, True)
    assert "at its next start" in answer["note"]
    assert "uses 125" in answer["note"]
    await asyncio.sleep(5)
    assert servo.node_id == 125
    await restart(rig, servo)
    await rig.ready()
    assert servo.node_id == 17
    again = json(await rig.call("PUT", f"/allocations/{servo.uid}", {"node_id": 17}))
    assert "already" in again["note"]
    assert (await row(rig, servo.uid))["pinned"]


@scene(PLAIN)
async def test_a_node_never_met_can_be_pinned(rig: Rig) -> None:
    json(await rig.call("PUT", f"/allocations/{STRANGER}", {"node_id": 42}))
    assert (await row(rig, STRANGER))["last_seen"] is None
    sim = rig.bench.add(replace(DYNAMIC, uid=bytes.fromhex(STRANGER)))
    await rig.ready(2)
    assert sim.node_id == 42
    assert (await row(rig, STRANGER))["pinned"]


@scene()
async def test_a_pin_on_a_servo_with_a_fixed_id_says_that_it_asks_for_none(rig: Rig, servo: Servo) -> None:
    answer = json(await rig.call("PUT", f"/allocations/{servo.uid}", {"node_id": 17}))
    assert "fixed node ID 11 (0x46)" in answer["note"]


@scene(DYNAMIC, PLAIN)
async def test_what_cannot_be_pinned(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    rig.host.store.allocations.record(STRANGER, NodeId(90))
    Neighbour(rig.bus.port("gps"), 20).speak()
    await asyncio.sleep(2)
    path = f"/allocations/{servo.uid}"
    for node_id in (0, 126, 127, -1, 10**20):
        problem(await rig.call("PUT", path, {"node_id": node_id}), "out_of_range", 422)
    assert "is allocated to" in problem(await rig.call("PUT", path, {"node_id": 90}), "invalid_value", 422)["detail"]
    found = problem(await rig.call("PUT", path, {"node_id": 20}), "invalid_value", 422)
    assert "used by another node" in found["detail"]
    assert found["owner"] == bytes(range(100, 116)).hex()
    problem(await rig.call("PUT", "/allocations/nonsense", {"node_id": 5}), "invalid_value", 422)
    problem(await rig.call("PUT", path, {"node_id": "x"}), "invalid_value", 422)
    assert [one["pinned"] for one in (await table(rig))["allocations"]] == [False, False]


@scene(connect=False)
async def test_our_own_id_is_neither_pinned_nor_given(rig: Rig) -> None:
    rig.host.allocating.own_id = 125
    answer = await rig.call("PUT", f"/allocations/{STRANGER}", {"node_id": 125})
    assert "used by hornbill itself" in problem(answer, "invalid_value", 422)["detail"]


@scene(DYNAMIC)
async def test_forgetting_says_when_it_takes_effect(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PUT", f"/allocations/{servo.uid}", {"node_id": 17}))
    answer = json(await rig.call("DELETE", f"/allocations/{servo.uid}"))
    assert (answer["node_id"], answer["pinned"]) == (17, True)
    assert "keeps node ID 125 until it restarts" in answer["note"]
    assert (await table(rig))["allocations"] == []
    await asyncio.sleep(2)
    assert servo.node_id == 125
    await restart(rig, servo)
    await rig.ready()
    assert servo.node_id == 125, "where it was met last"
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    answer = json(await rig.call("DELETE", f"/allocations/{servo.uid}"))
    assert "is free" in answer["note"]
    problem(await rig.call("DELETE", f"/allocations/{servo.uid}"), "unknown_uid", 404)
    problem(await rig.call("DELETE", "/allocations/nonsense"), "invalid_value", 422)


@scene(DYNAMIC)
async def test_a_servo_that_saves_is_not_forgotten_meanwhile(rig: Rig, servo: Servo) -> None:
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    await asyncio.sleep(0.01)
    assert servo.state is State.SAVING
    problem(await rig.call("DELETE", f"/allocations/{servo.uid}"), "busy", 409)
    async with asyncio.timeout(30):
        while json(await rig.call("GET", f"/jobs/{job['id']}"))["state"] == "running":
            await asyncio.sleep(0.1)
    json(await rig.call("DELETE", f"/allocations/{servo.uid}"))


@scene()
async def test_the_mode_is_chosen_over_rest_and_kept(rig: Rig) -> None:
    assert (await allocator(rig))["mode"] == "on"
    answer = json(await rig.call("PUT", "/bus/allocator", {"mode": "off"}))
    assert (answer["mode"], answer["state"]) == ("off", "off")
    problem(await rig.call("PUT", "/bus/allocator", {"mode": "maybe"}), "invalid_value", 422)
    sim = rig.bench.add(DYNAMIC)
    await asyncio.sleep(8)
    assert sim.node_id == 0
    (waiting,) = (await table(rig))["pending"]
    assert sim.uid.hex().startswith(waiting["uid_part"])
    assert waiting["attempts"] > 3
    again = Host(CATALOG, rig.host.store, no_port, HostSettings(127, bytes(16), (0, 1)))
    assert again.allocating.allocator.mode == "off"
    await again.close()
    assert json(await rig.call("PUT", "/bus/allocator", {"mode": "on"}))["state"] == "on"
    await rig.ready(2)
    assert sim.node_id == 125
    assert len(rig.events("allocator_mode")) == 2
    json(await rig.call("DELETE", "/bus"))
    assert json(await rig.call("PUT", "/bus/allocator", {"mode": "force"}))["mode"] == "force"


def test_a_mode_told_at_the_start_counts_before_the_one_chosen_last(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(rig: Rig) -> None:
        json(await rig.call("PUT", "/bus/allocator", {"mode": "off"}))
        for told, counts in ((AllocationMode.FORCE, "force"), (None, "off")):
            host = Host(CATALOG, rig.host.store, no_port, HostSettings(127, bytes(16), (0, 1), allocator=told))
            assert host.allocating.allocator.mode == counts
            await host.close()

    play(scene, connect=False)
    monkeypatch.setenv("HORNBILL_ALLOCATOR", "force")
    assert Settings().allocator == "force"
    assert Settings(allocator="off").allocator == "off"


async def no_port(_address: str, _bitrate: int) -> Any:
    raise AssertionError


def answered(competitor: Neighbour, prefix: bytes) -> None:
    """Another allocator answers a first part."""
    competitor.say(Kind.MESSAGE, AllocationMessage(0, False, prefix))


@scene()
async def test_it_stands_down_for_another_allocator_says_so_and_insists_when_told_to(rig: Rig) -> None:
    competitor = Neighbour(rig.bus.port("competitor"), 9).speak()
    answered(competitor, bytes(6))
    await asyncio.sleep(0.01)
    found = await allocator(rig)
    assert (found["state"], found["competing_node_id"]) == ("standby", 9)
    (event,) = rig.events("second_allocator")
    assert (event.level, event.text) == (
        "warning",
        "Node 9 also allocates node IDs. hornbill's allocator is on standby.",
    )
    sim = rig.bench.add(DYNAMIC)
    asked = 0
    for _ in range(30):  # it answers first parts for as long as it likes
        await asyncio.sleep(0.1)
        waiting = (await table(rig))["pending"]
        if waiting and waiting[0]["attempts"] > asked:
            asked = waiting[0]["attempts"]
            answered(competitor, bytes(6))
    assert sim.node_id == 0
    answer = json(await rig.call("PUT", "/bus/allocator", {"mode": "force"}))
    assert (answer["state"], answer["mode"]) == ("on", "force")
    answered(competitor, bytes(6))
    await rig.ready(2)
    assert sim.node_id == 125
    assert (await allocator(rig))["competing_node_id"] == 9
    assert rig.events("second_allocator")[-1].text.endswith("hornbill continues to allocate, because it is forced.")


@scene()
async def test_it_comes_back_when_the_other_one_is_gone_and_says_so(rig: Rig) -> None:
    answered(Neighbour(rig.bus.port("competitor"), 9), bytes(6))
    sim = rig.bench.add(DYNAMIC)
    await rig.ready(2)
    assert sim.node_id == 125
    (event,) = rig.events("second_allocator_gone")
    assert event.text == "Node 9 no longer allocates node IDs. hornbill allocates them again."


def fill(rig: Rig, days_ago: float) -> None:
    """Every node id belongs to a node last seen so many days ago, each a second later than the one before."""
    allocations = rig.host.store.allocations
    wall = allocations._wall  # pyright: ignore[reportPrivateUsage]
    for number in range(1, 126):
        allocations._wall = lambda number=number: wall() - days_ago * 86_400 + number  # pyright: ignore[reportPrivateUsage]
        allocations.record(Uid(f"{number:032x}"), NodeId(number))
    allocations._wall = wall  # pyright: ignore[reportPrivateUsage]


@scene(DYNAMIC)
async def test_recycling_frees_what_was_not_seen_for_long_and_spares_pins_and_who_is_here(
    rig: Rig, servo: Servo
) -> None:
    kept = rig.host.store.allocations
    wall = kept._wall  # pyright: ignore[reportPrivateUsage]
    kept._wall = lambda: wall() - 7200  # pyright: ignore[reportPrivateUsage]
    kept.record(STRANGER, NodeId(90))
    kept.record(Uid("cd" * 16), NodeId(91))
    kept.pin(Uid("cd" * 16), NodeId(91))
    kept.seen([servo.uid])
    kept._wall = wall  # pyright: ignore[reportPrivateUsage]
    kept.record(Uid("ef" * 16), NodeId(92))
    before = (await table(rig))["free"]
    assert before == (await allocator(rig))["free"]
    problem(await rig.call("POST", "/allocations/recycle", {"idle_longer_than_s": 1}), "invalid_value", 422)
    answer = json(await rig.call("POST", "/allocations/recycle", {"idle_longer_than_s": 3600}))
    assert [(one["uid"], one["node_id"]) for one in answer["freed"]] == [(STRANGER, 90)]
    assert answer["free"] == before + 1
    assert {one["node_id"] for one in (await table(rig))["allocations"]} == {servo.node_id, 91, 92}
    assert rig.events("node_ids_freed")
    assert json(await rig.call("POST", "/allocations/recycle", {"idle_longer_than_s": 3600}))["freed"] == []


@scene(replace(PLAIN, node_id=1))
async def test_a_full_table_is_said_aloud_with_the_unique_id_and_room_can_be_made(rig: Rig) -> None:
    fill(rig, 29)
    assert (await allocator(rig))["free"] == 0
    sim = rig.bench.add(DYNAMIC)
    await asyncio.sleep(15)
    assert sim.node_id == 0
    (event,) = rig.events("no_node_id")
    assert (event.level, event.uid) == ("failure", sim.uid.hex())
    assert sim.uid.hex() in event.text
    assert "taken" in event.text
    (waiting,) = (await table(rig))["pending"]
    assert (waiting["uid_part"], waiting["stage"]) == (sim.uid.hex(), 3)
    assert "Remove allocations" in waiting["refusal"]
    json(await rig.call("DELETE", f"/allocations/{7:032x}"))
    await rig.ready(2)
    assert sim.node_id == 7
    assert (await table(rig))["pending"] == []


@scene(replace(PLAIN, node_id=1))
async def test_in_a_full_table_the_id_of_a_node_away_for_a_month_is_given_and_that_is_said(rig: Rig) -> None:
    await rig.ready()
    fill(rig, RECYCLE_AFTER_S / 86_400 + 1)
    sim = rig.bench.add(DYNAMIC)
    await rig.ready(2)
    assert sim.node_id == 2, "node 1 is there"
    (event,) = rig.events("node_id_recycled")
    assert f"{2:032x}" in event.text
    entries = rig.host.store.allocations.entries()
    assert len(entries) == 125
    assert entries[Uid(sim.uid.hex())] == 2


@scene()
async def test_a_node_allocated_by_us_that_is_no_servo_is_online_in_the_table(rig: Rig) -> None:
    gps = Neighbour(rig.bus.port("gps"), 20)
    rig.host.store.allocations.record(Uid(gps.unique_id.hex()), NodeId(20))
    gps.speak()
    await asyncio.sleep(3)
    assert (await row(rig, gps.unique_id.hex()))["online"]


def test_the_fixed_id_of_a_servo_that_is_switched_off_is_given_to_nobody(tmp_path: Path) -> None:
    async def first(rig: Rig) -> None:
        await rig.ready()

    async def second(rig: Rig) -> None:
        assert [servo.node_id for servo in await rig.ready()] == [124]

    play(first, replace(PLAIN, node_id=125), store=str(tmp_path))
    play(second, DYNAMIC, store=str(tmp_path))


@scene(replace(DYNAMIC, rom={"soft_start": 0}), fast=True)
async def test_a_hundred_restarts_give_one_id_and_the_servo_is_known_after_each(rig: Rig) -> None:
    (servo,) = await rig.ready()
    first = servo.node_id
    for _ in range(100):
        await asyncio.sleep(3)  # a younger uptime could not be seen to go back
        boot_count = servo.boot_count
        await restart(rig, servo, off_s=0.3)
        async with asyncio.timeout(20):
            while servo.boot_count == boot_count or servo.state is not State.READY:
                await asyncio.sleep(0.05)
        assert servo.node_id == first
    assert rig.host.store.allocations.entries() == {servo.uid: first}


@pytest.mark.parametrize("sent", [False, True])
@pytest.mark.parametrize("stage", [1, 2, 3])
@scene(
    *(replace(DYNAMIC, servo_id=1 + n, rom={"soft_start": 0}) for n in range(3)), store=lambda tmp_path: str(tmp_path)
)
async def test_a_server_killed_in_any_stage_leaves_a_table_its_successor_goes_on_with(
    rig: Rig, tmp_path: Path, stage: int, sent: bool
) -> None:
    """Killed just before or just after its answer left: nothing is closed, and the store is opened once more."""
    assert rig.host.connection is not None
    participant = rig.host.connection.participant
    broadcast, killed = participant.broadcast, asyncio.Event()

    def until_killed(message: Structure, *, priority: int) -> None:
        if (
            not killed.is_set()
            and isinstance(message, AllocationMessage)
            and len(message.unique_id) == (6, 12, 16)[stage - 1]
        ):
            killed.set()
            asyncio.get_running_loop().call_later(
                0.002 if sent else 0, lambda: asyncio.ensure_future(rig.cable.unplug())
            )
            if not sent:
                raise BusDisconnected("The process is dead.", cause=None)
        broadcast(message, priority=priority)

    participant.broadcast = until_killed
    await killed.wait()
    await asyncio.sleep(0.1)
    with Store(tmp_path) as store:
        entries = store.allocations.entries()
        assert len(entries) == (stage == 3)
        sims = list(rig.bench.servos.values())
        assert sum(bool(sim.node_id) for sim in sims) == (stage == 3 and sent)

        async def open_port(_address: str, _bitrate: int) -> Any:
            return rig.bus.port("successor")

        host = Host(CATALOG, store, open_port, HostSettings(127, bytes(range(16)), (0, 1)))
        await host.connect("memory:successor", 1_000_000)
        async with asyncio.timeout(30):
            while sum(servo.state is State.READY for servo in host.fleet.all()) < 3:
                await asyncio.sleep(0.05)
        ids = {Uid(sim.uid.hex()): sim.node_id for sim in sims}
        assert store.allocations.entries() == ids
        assert len(set(ids.values())) == 3
        assert all(ids[uid] == node_id for uid, node_id in entries.items()), "what was given stays given"
        await host.close()

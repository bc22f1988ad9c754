"""Node IDs over REST: pins, removal, the allocator's mode, refusals, and a server that crashes while it allocates."""

import asyncio
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import power_cycle
from behaviour.neighbour import Neighbour
from behaviour.rig import CATALOG, PLAIN, Rig, json, play, problem, until
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
FOREIGN = Uid("ab" * 16)
DAY_S = 86_400


async def table(rig: Rig) -> dict[str, Any]:
    """GET /allocations."""
    return json(await rig.call("GET", "/allocations"))


async def row(rig: Rig, uid: str) -> dict[str, Any]:
    """One row of it."""
    return next(one for one in (await table(rig))["allocations"] if one["uid"] == uid)


async def pin(rig: Rig, uid: str, node_id: object) -> dict[str, Any]:
    return json(await rig.call("PUT", f"/allocations/{uid}", {"node_id": node_id}))


async def remove(rig: Rig, uid: str) -> dict[str, Any]:
    return json(await rig.call("DELETE", f"/allocations/{uid}"))


async def allocator(rig: Rig) -> dict[str, Any]:
    """The allocator in GET /bus."""
    return json(await rig.call("GET", "/bus"))["allocator"]


async def set_mode(rig: Rig, mode: str) -> dict[str, Any]:
    return json(await rig.call("PUT", "/bus/allocator", {"mode": mode}))


@contextmanager
def clock_offset(rig: Rig, seconds: float) -> Generator[None]:
    """Store allocations with another time."""
    allocations = rig.host.store.allocations
    wall = allocations._wall  # pyright: ignore[reportPrivateUsage]
    allocations._wall = lambda: wall() + seconds  # pyright: ignore[reportPrivateUsage]
    yield
    allocations._wall = wall  # pyright: ignore[reportPrivateUsage]


@scene(DYNAMIC)
async def test_the_table_lists_nodes_and_when_each_was_last_seen(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(65)
    (found,) = (await table(rig))["allocations"]
    assert (found["uid"], found["node_id"], found["pinned"], found["online"]) == (servo.uid, 125, False, True)
    assert found["last_seen"] == pytest.approx(rig.host.base.utc_now(), abs=0.01)
    stored = rig.host.store.allocations
    before = stored.get(servo.uid).last_seen
    stored._wall = rig.host.base.utc_now  # pyright: ignore[reportPrivateUsage] - the test's clock jumps
    await asyncio.sleep(61)
    assert (stored.get(servo.uid).last_seen or 0) > (before or 0)
    gone_at = rig.host.base.utc_now()
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(120)
    found = await row(rig, servo.uid)
    assert not found["online"]
    assert gone_at - 61 < found["last_seen"] < gone_at + 5


@scene(DYNAMIC)
async def test_a_pin_or_its_removal_takes_effect_at_the_next_start(rig: Rig, servo: Servo) -> None:
    pinned = await pin(rig, servo.uid, 17)
    assert (pinned["node_id"], pinned["pinned"], pinned["online"]) == (17, True, True)
    assert "at its next start" in pinned["note"]
    assert "uses 125" in pinned["note"]
    removed = await remove(rig, servo.uid)
    assert (removed["node_id"], removed["pinned"]) == (17, True)
    assert "keeps node ID 125 until it restarts" in removed["note"]
    assert (await table(rig))["allocations"] == []
    await asyncio.sleep(2)
    assert servo.node_id == 125
    await power_cycle(rig, servo.uid, 4)
    await rig.ready()
    assert servo.node_id == 125, "where it was last seen"
    await pin(rig, servo.uid, 17)
    await power_cycle(rig, servo.uid, 4)
    await rig.ready()
    assert servo.node_id == 17
    assert "already" in (await pin(rig, servo.uid, 17))["note"]
    assert (await row(rig, servo.uid))["pinned"]
    await asyncio.sleep(4)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    await asyncio.sleep(0.01)
    assert servo.state is State.SAVING
    problem(await rig.call("DELETE", f"/allocations/{servo.uid}"), "busy", 409)
    await rig.host.jobs.wait(rig.host.jobs.get(job["id"]))
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    assert "is free" in (await remove(rig, servo.uid))["note"]
    problem(await rig.call("DELETE", f"/allocations/{servo.uid}"), "unknown_uid", 404)
    problem(await rig.call("DELETE", "/allocations/nonsense"), "unknown_servo", 404)


@scene(PLAIN)
async def test_a_node_never_seen_or_with_a_fixed_id_can_be_pinned(rig: Rig, servo: Servo) -> None:
    await pin(rig, FOREIGN, 42)
    assert (await row(rig, FOREIGN))["last_seen"] is None
    sim = rig.bench.add(replace(DYNAMIC, uid=bytes.fromhex(FOREIGN)))
    gps = Neighbour(rig.bus.port("gps"), 20)
    rig.host.store.allocations.record(Uid(gps.unique_id.hex()), NodeId(20))
    gps.start()
    await rig.ready(2)
    assert sim.node_id == 42
    assert (await row(rig, FOREIGN))["pinned"]
    assert "fixed node ID 11 (0x46)" in (await pin(rig, servo.uid, 17))["note"]
    await asyncio.sleep(3)
    assert (await row(rig, gps.unique_id.hex()))["online"], "no servo, and allocated"


@scene(DYNAMIC, PLAIN)
async def test_an_invalid_pin_is_rejected(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    rig.host.store.allocations.record(FOREIGN, NodeId(90))
    Neighbour(rig.bus.port("gps"), 20).start()
    await asyncio.sleep(2)
    path = f"/allocations/{servo.uid}"
    for node_id in (0, 126, 127, -1, 10**20):
        problem(await rig.call("PUT", path, {"node_id": node_id}), "out_of_range", 422)
    for node_id, detail in ((90, "is allocated to"), (20, "used by another node")):
        found = problem(await rig.call("PUT", path, {"node_id": node_id}), "invalid_value", 422)
        assert detail in found["detail"]
    assert found["owner"] == bytes(range(100, 116)).hex()
    problem(await rig.call("PUT", "/allocations/nonsense", {"node_id": 5}), "unknown_servo", 404)
    problem(await rig.call("PUT", path, {"node_id": "x"}), "invalid_value", 422)
    rig.host.allocating.own_id = 123
    found = problem(await rig.call("PUT", path, {"node_id": 123}), "invalid_value", 422)
    assert "used by hornbill itself" in found["detail"]
    assert [one["pinned"] for one in (await table(rig))["allocations"]] == [False, False]


async def no_port(_address: str, _bitrate: int) -> Any:
    raise AssertionError


async def mode_of_next_server(rig: Rig, given: AllocationMode | None = None) -> str:
    host = Host(CATALOG, rig.host.store, no_port, HostSettings(127, bytes(16), (0, 1), allocator=given))
    mode = host.allocating.allocator.mode
    await host.close()
    return mode


@scene()
async def test_the_mode_is_stored_and_an_option_takes_precedence(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    assert (await allocator(rig))["mode"] == "on"
    found = await set_mode(rig, "off")
    assert (found["mode"], found["state"]) == ("off", "off")
    problem(await rig.call("PUT", "/bus/allocator", {"mode": "maybe"}), "invalid_value", 422)
    sim = rig.bench.add(DYNAMIC)
    await asyncio.sleep(8)
    assert sim.node_id == 0
    (waiting,) = (await table(rig))["pending"]
    assert sim.uid.hex().startswith(waiting["uid_part"])
    assert waiting["attempts"] > 3
    assert await mode_of_next_server(rig) == "off"
    assert await mode_of_next_server(rig, AllocationMode.FORCE) == "force"
    assert (await set_mode(rig, "on"))["state"] == "on"
    await rig.ready(2)
    assert sim.node_id == 125
    assert len(rig.events("allocator_mode")) == 2
    json(await rig.call("DELETE", "/bus"))
    assert (await set_mode(rig, "force"))["mode"] == "force"
    monkeypatch.setenv("HORNBILL_ALLOCATOR", "force")
    assert Settings().allocator == "force"
    assert Settings(allocator="off").allocator == "off"


def respond(competitor: Neighbour) -> None:
    """Another allocator responds to a first part."""
    competitor.send(Kind.MESSAGE, AllocationMessage(0, False, bytes(6)))


@scene()
async def test_the_allocator_is_on_standby_beside_another_one_unless_forced_or_until_it_is_gone(rig: Rig) -> None:
    competitor = Neighbour(rig.bus.port("competitor"), 9).start()
    respond(competitor)
    await asyncio.sleep(0.01)
    found = await allocator(rig)
    assert (found["state"], found["competing_node_id"]) == ("standby", 9)
    (event,) = rig.events("second_allocator")
    assert (event.level, event.params) == ("warning", {"node_id": 9, "allocator": "standby"})
    sim = rig.bench.add(DYNAMIC)
    attempts = 0
    for _ in range(30):  # the other one responds to each attempt
        await asyncio.sleep(0.1)
        waiting = (await table(rig))["pending"]
        if waiting and waiting[0]["attempts"] > attempts:
            attempts = waiting[0]["attempts"]
            respond(competitor)
    assert sim.node_id == 0
    found = await set_mode(rig, "force")
    assert (found["state"], found["mode"]) == ("on", "force")
    respond(competitor)
    await rig.ready(2)
    assert sim.node_id == 125
    assert (await allocator(rig))["competing_node_id"] == 9
    assert rig.events("second_allocator")[-1].params == {"node_id": 9, "allocator": "on"}
    await set_mode(rig, "on")
    respond(competitor)
    await asyncio.sleep(0.01)
    assert (await allocator(rig))["state"] == "standby"
    rig.bench.add(replace(DYNAMIC, servo_id=2))
    await rig.ready(3)
    assert rig.events("second_allocator_gone")[-1].params == {"node_id": 9, "allocator": "on"}


def fill(rig: Rig, days_ago: float) -> None:
    """Allocate every node ID to a node last seen some days ago, each a second later than the one before."""
    for number in range(1, 126):
        with clock_offset(rig, number - days_ago * DAY_S):
            rig.host.store.allocations.record(Uid(f"{number:032x}"), NodeId(number))


@scene(DYNAMIC)
async def test_recycling_frees_idle_allocations_but_no_pins_and_no_online_nodes(rig: Rig, servo: Servo) -> None:
    stored = rig.host.store.allocations
    pinned = Uid("cd" * 16)
    with clock_offset(rig, -7200):
        stored.record(FOREIGN, NodeId(90))
        stored.record(pinned, NodeId(91))
        stored.pin(pinned, NodeId(91))
        stored.seen([servo.uid])
    stored.record(Uid("ef" * 16), NodeId(92))
    before = (await table(rig))["free"]
    assert before == (await allocator(rig))["free"]
    problem(await rig.call("POST", "/allocations/recycle", {"idle_longer_than_s": 1}), "invalid_value", 422)
    found = json(await rig.call("POST", "/allocations/recycle", {"idle_longer_than_s": 3600}))
    assert [(one["uid"], one["node_id"]) for one in found["freed"]] == [(FOREIGN, 90)]
    assert found["free"] == before + 1
    assert {one["node_id"] for one in (await table(rig))["allocations"]} == {servo.node_id, 91, 92}
    assert rig.events("node_ids_freed")
    assert json(await rig.call("POST", "/allocations/recycle", {"idle_longer_than_s": 3600}))["freed"] == []


@scene(replace(PLAIN, node_id=1))
async def test_a_full_table_is_reported_with_the_unique_id_until_an_allocation_is_removed(rig: Rig) -> None:
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
    await remove(rig, f"{7:032x}")
    await rig.ready(2)
    assert sim.node_id == 7
    assert (await table(rig))["pending"] == []


@scene(replace(PLAIN, node_id=1))
async def test_in_a_full_table_the_id_of_a_node_away_for_a_month_is_recycled(rig: Rig) -> None:
    await rig.ready()
    fill(rig, RECYCLE_AFTER_S / DAY_S + 1)
    sim = rig.bench.add(DYNAMIC)
    await rig.ready(2)
    assert sim.node_id == 2, "node 1 is online"
    (event,) = rig.events("node_id_recycled")
    assert f"{2:032x}" in event.text
    entries = rig.host.store.allocations.entries()
    assert len(entries) == 125
    assert entries[Uid(sim.uid.hex())] == 2


def test_the_fixed_id_of_a_servo_that_is_off_is_not_allocated(tmp_path: Path) -> None:
    async def first(rig: Rig) -> None:
        await rig.ready()

    async def second(rig: Rig) -> None:
        assert [servo.node_id for servo in await rig.ready()] == [124]

    play(first, replace(PLAIN, node_id=125), store=str(tmp_path))
    play(second, DYNAMIC, store=str(tmp_path))


@scene(replace(DYNAMIC, rom={"soft_start": 0}), fast=True)
async def test_a_servo_keeps_its_node_id_over_thirty_restarts(rig: Rig, servo: Servo) -> None:
    first = servo.node_id
    for _ in range(30):
        await asyncio.sleep(3)  # of a younger uptime one could not see that it went back
        boot_count = servo.boot_count
        await power_cycle(rig, servo.uid, 0.3)
        await until(lambda count=boot_count: servo.boot_count != count and servo.state is State.READY, 20)
        assert servo.node_id == first
    assert rig.host.store.allocations.entries() == {servo.uid: first}


@pytest.mark.parametrize("sent", [False, True])
@pytest.mark.parametrize("stage", [1, 2, 3])
@scene(
    *(replace(DYNAMIC, servo_id=1 + n, rom={"soft_start": 0}) for n in range(3)), store=lambda tmp_path: str(tmp_path)
)
async def test_a_crash_in_any_stage_leaves_a_table_from_which_the_next_server_continues(
    rig: Rig, tmp_path: Path, stage: int, sent: bool
) -> None:
    """The server crashes just before or after its response was sent: nothing is closed, the store is opened again."""
    assert rig.host.connection is not None
    participant = rig.host.connection.participant
    broadcast, crashed = participant.broadcast, asyncio.Event()

    def until_crash(message: Structure, *, priority: int) -> None:
        length = len(message.unique_id) if isinstance(message, AllocationMessage) else 0
        if not crashed.is_set() and length == (6, 12, 16)[stage - 1]:
            crashed.set()
            asyncio.get_running_loop().call_later(
                0.002 if sent else 0, lambda: asyncio.ensure_future(rig.cable.unplug())
            )
            if not sent:
                raise BusDisconnected("The process is dead.", cause=None)
        broadcast(message, priority=priority)

    participant.broadcast = until_crash
    await crashed.wait()
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
        await until(lambda: sum(servo.state is State.READY for servo in host.fleet.all()) == 3)
        ids = {Uid(sim.uid.hex()): sim.node_id for sim in sims}
        assert store.allocations.entries() == ids
        assert len(set(ids.values())) == 3
        assert all(ids[uid] == node_id for uid, node_id in entries.items()), "earlier allocations are unchanged"
        await host.close()

"""Torque mode in ROM over a save: kept unless a client staged another; no horn moves further than announced (4.13)."""

import asyncio
import sqlite3
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.rig import CATALOG, PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host, HostSettings
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoStage
from hornbill.sim.services import Services
from hornbill.store.store import Store
from hornbill.units import Raw
from hornbill.wire.datatype import Kind
from hornbill.wire.port import CanPort
from hornbill.wire.services import ExecuteOpcodeRequest, ExecuteOpcodeResponse, Opcode

GAIN = 0x2C
TORQUE = 0x20


async def old(rig: Rig) -> Servo:
    """A servo that has run for a while, so that a save begins at once."""
    servo = (await rig.ready())[0]
    await asyncio.sleep(4)
    return servo


async def stopped(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", "/stop?by=Aki"))
    json(await rig.call("DELETE", "/stop"))
    assert servo.raw("torque_mode") == 1


async def braked(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", "/stop?by=Aki", {"mode": "brake"}))
    json(await rig.call("DELETE", "/stop"))
    assert servo.raw("torque_mode") == 2


async def lease_ended(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    await rig.call("DELETE", f"/leases/{lease}")
    await asyncio.sleep(0.1)
    assert servo.raw("torque_mode") == 1


async def switched_off(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))


async def other_tool(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).memory.put(TORQUE, 1)
    await asyncio.sleep(1.2)
    assert servo.raw("torque_mode") == 1


EVERY_WAY = (stopped, braked, lease_ended, switched_off, other_tool)
"""To take the output of a servo without staging anything."""

Way = Callable[[Rig, Servo], Awaitable[None]]


@pytest.fixture(params=EVERY_WAY, ids=lambda way: way.__name__)
def way(request: pytest.FixtureRequest) -> Way:
    found: Way = request.param
    return found


async def configuration(rig: Rig, servo: Servo) -> tuple[Any, ...]:
    """Everything that tells of a servo's configuration."""
    found = json(await rig.call("GET", f"/servos/{servo.uid}"))
    parameters = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))
    torque = parameters["parameters"]["torque_mode"]
    taken = json(await rig.call("POST", f"/servos/{servo.uid}/snapshots", {"reason": "test"}), 201)
    compared = json(await rig.call("GET", f"/compare?left=servo:{servo.uid}&right=rom:{servo.uid}"))
    matrix = json(await rig.call("GET", "/parameters?keys=torque_mode"))["servos"][servo.uid]
    return (
        found["unsaved"], found["drift"], parameters["revision"], torque["configured"], torque["unsaved"],
        torque["differs_from_default"], taken["values"], compared["differences"],
        (matrix["revision"], matrix["parameters"]["torque_mode"]["configured"]),
    )  # fmt: skip


@scene()
async def test_nobody_who_takes_the_output_changes_the_configuration(rig: Rig, way: Way) -> None:
    servo = await old(rig)
    before = await configuration(rig, servo)
    assert before[0] == before[1] == before[7] == []
    await way(rig, servo)
    assert json(await rig.call("GET", f"/servos/{servo.uid}/parameters/torque_mode"))["value"] in ("off", "brake")
    assert await configuration(rig, servo) == before
    patch = {"values": {"angle_p_gain": 41}}
    answer = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", patch, **{"If-Match": before[2]})
    assert json(answer)["outcome"] == "applied", "a revision of before is no conflict"
    kept = rig.host.history.snapshots.of(servo.uid)
    assert all(one.ram["torque_mode"] == 0 for one in kept), "to undo it would write no torque mode"


@scene()
async def test_what_a_client_writes_as_torque_mode_is_configuration_whatever_happens_then(rig: Rig, way: Way) -> None:
    servo = await old(rig)
    path = f"/servos/{servo.uid}"
    before = json(await rig.call("GET", f"{path}/parameters"))["revision"]
    done = json(await rig.call("PATCH", f"{path}/parameters", {"values": {"torque_mode": "brake"}}))
    assert done["changes"] == [
        {"key": "torque_mode", "before": "on", "requested": "brake", "after": "brake", "verdict": "applied"}
    ]
    output = json(await rig.call("GET", path))["output"]
    assert (output["state"], output["reason"], output["by"]) == ("brake", "configured", "no lease")
    stale = await rig.call("PATCH", f"{path}/parameters", {"values": {"angle_p_gain": 41}}, **{"If-Match": before})
    problem(stale, "stale_revision", 412)
    await way(rig, servo)
    reading = json(await rig.call("GET", f"{path}/parameters"))["parameters"]["torque_mode"]
    assert (reading["configured"], reading["rom"], reading["unsaved"]) == ("brake", "on", True)
    assert json(await rig.call("GET", path))["unsaved"] == ["torque_mode"]
    body = {"confirm": ["torque_off_in_rom"]}
    job = json(await rig.call("POST", f"{path}/save?wait=true", body))
    assert job["state"] == "succeeded", job["error"]
    assert rig.sim(servo).memory.stored(TORQUE) == 2
    assert json(await rig.call("GET", path))["unsaved"] == []


@scene()
async def test_to_stage_what_the_output_happens_to_be_is_a_change_all_the_same(rig: Rig) -> None:
    servo = await old(rig)
    await stopped(rig, servo)
    path = f"/servos/{servo.uid}"
    writes = len(rig.writes())
    done = json(await rig.call("PATCH", f"{path}/parameters", {"values": {"torque_mode": "off", "smoothing": True}}))
    assert [(one["key"], one["before"], one["verdict"]) for one in done["changes"]] == [
        ("smoothing", True, "unchanged"), ("torque_mode", "on", "applied"),
    ]  # fmt: skip
    assert json(await rig.call("GET", path))["unsaved"] == ["torque_mode"]
    assert len(rig.writes()) == writes, "its output is off already"
    rows = [one.entry for one in rig.host.store.audit.rows(uid=servo.uid) if one.entry.key == "torque_mode"]
    assert (rows[0].before, rows[0].after, rows[0].outcome) == ("on", "off", "applied")


@pytest.mark.parametrize("torque", [0, 1, 2])
@scene(lambda torque: replace(PLAIN, rom={"torque_mode": torque}))
async def test_a_plain_save_keeps_the_torque_mode_of_rom(rig: Rig, way: Way, torque: Raw) -> None:
    servo = await old(rig)
    await way(rig, servo)
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}}))
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    assert job["state"] == "succeeded", job["error"]
    assert rig.sim(servo).memory.stored(TORQUE) == servo.registers["torque_mode"].rom == torque
    assert rig.sim(servo).memory.stored(GAIN) == 55
    output = json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]
    assert (output["state"], output["reason"]) == (("on", "off", "brake")[torque], "configured")


@scene(replace(PLAIN, rom={"torque_mode": 1}))
async def test_an_output_that_somebody_switched_on_is_not_saved_either(rig: Rig) -> None:
    servo = await old(rig)
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    rig.host.motion.stop_commanding(servo)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", lease=lease))
    assert job["state"] == "succeeded", job["error"]
    assert rig.sim(servo).memory.stored(TORQUE) == 1
    assert rig.sim(servo).output == 1


@scene()
async def test_every_other_way_to_save_keeps_it_too(rig: Rig, way: Way) -> None:
    servo = await old(rig)
    values, gain = {"angle_p_gain": 55}, 55
    json(await rig.call("PUT", "/profiles/stiff", {"values": values}), 201)
    snapshot = json(await rig.call("POST", f"/servos/{servo.uid}/snapshots"), 201)["id"]
    calls: dict[str, tuple[str, str, object]] = {
        "patch": ("PATCH", f"/servos/{servo.uid}/parameters", {"values": values, "save": True}),
        "matrix": ("PATCH", "/parameters", {"servos": {servo.uid: values}, "save": True}),
        "profile": ("POST", "/profiles/stiff/apply?wait=true", {"uids": [servo.uid], "save": True}),
        "commission": (
            "POST", "/commissioning?wait=true",
            {"servos": [{"uid": servo.uid, "servo_id": 7}], "profile": "stiff", "save": True},
        ),
        "restore": ("POST", f"/servos/{servo.uid}/snapshots/{snapshot}/restore", {"save": True}),
    }  # fmt: skip
    for name, (verb, path, body) in calls.items():
        if name == "restore":
            gain = 40
        else:
            await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 50}})
        await way(rig, servo)
        answer = json(await rig.call(verb, path, body))
        ids = [answer.get("job"), *(one["job"] for one in answer.get("servos", []))]
        for job_id in filter(None, ids):
            job = await rig.host.jobs.wait(rig.host.jobs.get(job_id))
            assert job.state == "succeeded", (name, job.error)
        assert answer.get("state", "succeeded") == "succeeded", (name, answer)
        memory = rig.sim(servo).memory
        assert (memory.stored(GAIN), memory.stored(TORQUE)) == (gain, 0), name
        await asyncio.sleep(3)


@scene(replace(PLAIN, rom={"torque_mode": 1, "soft_start": 0}))
async def test_torque_on_with_a_save_needs_no_lease_and_without_one_still_does(rig: Rig, way: Way) -> None:
    servo = await old(rig)
    path = f"/servos/{servo.uid}/parameters"
    await way(rig, servo)
    values = {"torque_mode": "on", "angle_p_gain": 55}
    problem(await rig.call("PATCH", path, {"values": values}), "lease_required", 428)
    problem(await rig.call("PATCH", path, {"values": values, "dry_run": True}), "lease_required", 428)
    planned = json(await rig.call("PATCH", path, {"values": values, "save": True, "dry_run": True}))
    assert planned["rom_changes"] == [
        {"key": "torque_mode", "before": "off", "after": "on"}, {"key": "angle_p_gain", "before": 40, "after": 55},
    ]  # fmt: skip
    done = json(await rig.call("PATCH", path, {"values": values, "save": True}))
    assert {one["key"]: one["verdict"] for one in done["changes"]} == {
        "torque_mode": "planned", "angle_p_gain": "applied",
    }  # fmt: skip
    job = await rig.host.jobs.wait(rig.host.jobs.get(done["job"]))
    assert job.state == "succeeded", job.error
    assert (rig.sim(servo).memory.stored(TORQUE), rig.sim(servo).memory.stored(GAIN)) == (0, 55)
    assert rig.sim(servo).output == 0


def unknown_rom(rig: Rig, servo: Servo) -> None:
    """As of a servo that was met long after its start."""
    for register in servo.registers.values():
        register.rom = None
    rig.host.store.servos.put_rom(servo.uid, {})


@pytest.mark.parametrize("output", ["on", "off"])
@scene()
async def test_where_nobody_knows_what_rom_holds_it_is_asked_and_each_answer_is_taken(rig: Rig, output: str) -> None:
    servo = await old(rig)
    path, values = f"/servos/{servo.uid}", {"angle_p_gain": 55}
    json(await rig.call("PUT", "/profiles/stiff", {"values": values}), 201)
    for word, stored in (("torque_on_in_rom", 0), ("torque_off_in_rom", 1)):
        if output == "off":
            await stopped(rig, servo)
        unknown_rom(rig, servo)
        writes = rig.writes()
        asked = [
            problem(await rig.call("POST", f"{path}/save"), "needs_confirmation", 409),
            problem(await rig.call("POST", f"{path}/save", {"dry_run": True}), "needs_confirmation", 409),
            problem(
                await rig.call("PATCH", f"{path}/parameters", {"values": values, "save": True}),
                "needs_confirmation", 409,
            ),
            problem(
                await rig.call("POST", "/commissioning", {"servos": [{"uid": servo.uid, "servo_id": 7}]}),
                "needs_confirmation", 409,
            ),
            json(await rig.call("PATCH", "/parameters", {"servos": {servo.uid: values}, "save": True}))["servos"][
                0
            ]["problem"],
            json(
                await rig.call("POST", "/profiles/stiff/apply?wait=true", {"uids": [servo.uid], "save": True})
            )["error"],
        ]  # fmt: skip
        for one in asked:
            assert one["code"] == "needs_confirmation"
            assert (one["key"], one["choices"]) == ("torque_mode", ["torque_on_in_rom", "torque_off_in_rom"])
        assert rig.writes() == writes, "nothing is written before it is answered"
        job = json(await rig.call("POST", f"{path}/save?wait=true", {"confirm": [word]}))
        assert job["state"] == "succeeded", job["error"]
        assert rig.sim(servo).memory.stored(TORQUE) == stored
        await asyncio.sleep(3)


@pytest.mark.parametrize("save", [True, False])
@scene()
async def test_a_dry_run_lists_what_rom_will_hold_differently_and_says_what_the_horn_does(rig: Rig, save: bool) -> None:
    servo = await old(rig)
    path, values = f"/servos/{servo.uid}", {"angle_p_gain": 55}
    json(await rig.call("PATCH", f"{path}/parameters", {"values": {"smoothing": False}}))
    await stopped(rig, servo)
    rig.sim(servo).turn_manually(-90.0, asyncio.get_running_loop().time())
    json(await rig.call("PUT", "/profiles/stiff", {"values": values}), 201)
    along = {"key": "smoothing", "before": True, "after": False}
    new = {"key": "angle_p_gain", "before": 40, "after": 55}
    writes = rig.writes()
    asked = {"dry_run": True, "save": save}
    found: list[Any] = [
        json(await rig.call("PATCH", f"{path}/parameters", {"values": values, **asked})),
        json(await rig.call("PATCH", "/parameters", {"servos": {servo.uid: values}, **asked}))["servos"][0],
        json(
            await rig.call("POST", "/commissioning", {"servos": [{"uid": servo.uid}], "profile": "stiff", **asked})
        )["servos"][0],
        json(await rig.call("POST", f"{path}/copy", {"from": "profile:stiff", **asked})),
    ]  # fmt: skip
    if save:
        job = json(await rig.call("POST", "/profiles/stiff/apply?wait=true", {"uids": [servo.uid], **asked}))
        found.append(job["result"]["servos"][0])
    for one in found:
        assert one["rom_changes"] == ([along, new] if save else []), one
        assert one["rom_unknown"] == []
        assert (one["restart"] is not None) == save
    if save:
        alone = json(await rig.call("POST", f"{path}/save", {"dry_run": True}))
        assert alone["rom_changes"] == [along]
        for one in [*found, alone]:
            restart = one["restart"]
            assert (restart["moves"], restart["from_deg"], restart["to_deg"]) == (True, -90.0, 0.0)
            assert any("turns on briefly" in warning for warning in restart["warnings"])
    assert rig.writes() == writes


@scene()
async def test_a_dry_run_refuses_what_the_real_call_would(rig: Rig) -> None:
    servo = await old(rig)
    path, values = f"/servos/{servo.uid}", {"angle_p_gain": 55}
    json(await rig.call("PUT", "/profiles/stiff", {"values": values}), 201)

    async def refused(code: str, status: int) -> None:
        dry = {"dry_run": True, "save": True}
        problem(await rig.call("POST", f"{path}/save", {"dry_run": True}), code, status)
        problem(await rig.call("PATCH", f"{path}/parameters", {"values": values, **dry}), code, status)
        body = {"servos": [{"uid": servo.uid}], "profile": "stiff", **dry}
        problem(await rig.call("POST", "/commissioning", body), code, status)
        answer = await rig.call("PATCH", "/parameters", {"servos": {servo.uid: values}, **dry})
        if answer.status_code == 200:
            assert json(answer)["servos"][0]["problem"]["code"] == code
        else:
            problem(answer, code, status)
        answer = await rig.call("POST", "/profiles/stiff/apply?wait=true", {"uids": [servo.uid], **dry})
        if answer.status_code == 200:
            assert json(answer)["error"]["code"] == code
        else:
            problem(answer, code, status)

    sim = rig.sim(servo)
    sim.conditions.voltage_v = 3.8
    await asyncio.sleep(2.5)
    await refused("out_of_range", 422)
    sim.conditions.voltage_v = 7.4
    await asyncio.sleep(2.5)
    lease = await rig.lease()
    await refused("lease_held", 409)
    await rig.call("DELETE", f"/leases/{lease}")
    await rig.call("POST", "/stop")
    await refused("stopped", 423)
    await rig.call("DELETE", "/stop")
    sim.conditions.temperature_c = 110.0
    await asyncio.sleep(2.5)
    await refused("busy", 409)  # its output would have to come on, and it protects itself


# The horn.


LOOK_S = 0.0002
"""Output on and SAVE are a few frames apart, each about a tenth of a millisecond long."""


@dataclass
class Watched:
    """A horn, looked at every LOOK_S: where it was while its output was off before, and on since."""

    angles: list[float] = field(default_factory=list[float])
    energised_for: float = 0.0


@asynccontextmanager
async def watching(rig: Rig, servo: Servo) -> AsyncGenerator[Watched]:
    """The horn, in the degrees of 0x08 as they were before the restart, until the servo starts anew."""
    sim, loop, seen = rig.sim(servo), asyncio.get_running_loop(), Watched()
    starts = sim.starts

    async def look() -> None:
        while sim.starts == starts:
            sim._device.motion.advance(loop.time())  # pyright: ignore[reportPrivateUsage] - between its frames
            seen.angles.append(sim.angle_deg)
            seen.energised_for += LOOK_S * (sim.output == 0 and sim.stage is ServoStage.RUNNING)
            await asyncio.sleep(LOOK_S)

    task = asyncio.create_task(look())
    try:
        yield seen
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


SCENES: dict[str, dict[str, Any]] = {
    "at 0": {"by_hand": 0.0},
    "at 30": {"by_hand": 30.0},
    "at -120": {"by_hand": -120.0},
    "at 179.9": {"by_hand": 179.9},
    "at -180": {"by_hand": -180.0},
    "no soft start": {"by_hand": 75.0, "rom": {"soft_start": 0}},
    "no smoothing": {"by_hand": 75.0, "rom": {"smoothing": 0}},
    "speed and torque control": {"by_hand": 75.0, "rom": {"speed_torque_control": 1}},
    "reversed": {"by_hand": 75.0, "rom": {"reverse": 1}},
    "another zero": {"by_hand": 75.0, "rom": {"origin": 300}},
    "two turns on": {
        "by_hand": 750.0,
        "rom": {"extended_angle": 1, "angle_limit_cw": 36000, "angle_limit_ccw": -36000},
    },
    "outside its limits": {"by_hand": 90.0, "rom": {"angle_limit_cw": 450, "angle_limit_ccw": -450}},
    "loaded": {"by_hand": 20.0, "load_pct": 40.0},
    "loaded the other way": {"by_hand": -20.0, "load_pct": -40.0},
    "its timeout switches it off": {"by_hand": 179.9, "rom": {"timeout_action": 1}},
    "its timeout brakes": {"by_hand": 45.0, "rom": {"timeout_action": 2}},
    "on the brake": {"by_hand": 45.0, "mode": "brake"},
}


@pytest.mark.parametrize("name", SCENES)
def test_the_horn_stays_where_it_stands_until_the_restart_and_then_does_what_was_announced(name: str) -> None:
    scenery = SCENES[name]
    rom = {"timeout_action": 0, **scenery.get("rom", {})}

    async def scene(rig: Rig) -> None:
        servo = await old(rig)
        path, sim, loop = f"/servos/{servo.uid}", rig.sim(servo), asyncio.get_running_loop()
        lease = await rig.lease()
        json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
        json(await rig.call("POST", f"{path}/command", {"type": "angle", "value": 10, "wait": "settled"}, lease=lease))
        await rig.call("DELETE", f"/leases/{lease}")
        await asyncio.sleep(0.1)
        if "mode" in scenery:
            json(await rig.call("POST", f"{path}/torque", {"mode": scenery["mode"]}))
        if scenery.get("load_pct"):  # a hand carries it until it is turned
            sim.conditions.load_pct = 0.0
        assert sim.turn_manually(scenery["by_hand"], loop.time())
        announced = json(await rig.call("POST", f"{path}/save", {"dry_run": True}))["restart"]
        stood = sim.angle_deg
        sim.conditions.load_pct = scenery.get("load_pct", 0.0) / 100.0  # as much as friction still holds
        async with watching(rig, servo) as seen:
            job = json(await rig.call("POST", f"{path}/save?wait=true"))
        assert job["state"] == "succeeded", job["error"]
        assert max(abs(angle - stood) for angle in seen.angles) < 0.5, "until the restart nothing moved it"
        assert 0 < seen.energised_for < 0.05
        assert sim.memory.stored(TORQUE) == 0
        assert announced["text"] in job["steps"][0]["evidence"]
        here = json(await rig.call("GET", f"{path}/parameters/current_angle"))["value"]
        low, high = sorted((announced["from_deg"] or here, announced["to_deg"]))
        coasts = any("coasts" in warning for warning in announced["warnings"])
        assert coasts == (name == "its timeout switches it off")
        beyond = 3.0 if coasts else 1.5
        assert low - beyond <= here <= high + beyond, "no further than announced"
        if rom["timeout_action"] == 0:  # else its own timeout may end the soft start on the way
            assert here == pytest.approx(announced["to_deg"], abs=1.5)

    play(scene, replace(PLAIN, rom=rom))


# What goes wrong on the way.

HOLDS = replace(PLAIN, rom={"timeout_action": 0})
"""Its own time-out takes nothing from it: what is left on stays on."""


async def saving_until(rig: Rig, servo: Servo, reached: Callable[[], bool]) -> str:
    """Start a save of a servo whose output a stop took, and go on until that is so; the id of the job."""
    await stopped(rig, servo)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    job = rig.host.jobs.get(started["id"])
    async with asyncio.timeout(20):
        while not reached():
            await asyncio.sleep(0.0001)
            assert not job.ended, job.error
    return str(started["id"])


async def ended(rig: Rig, job_id: str) -> Any:
    await rig.host.jobs.wait(rig.host.jobs.get(job_id))
    return json(await rig.call("GET", f"/jobs/{job_id}"))


def energised(rig: Rig, servo: Servo) -> Callable[[], bool]:
    return lambda: rig.sim(servo).output == 0


def commanded(rig: Rig, _servo: Servo) -> Callable[[], bool]:
    """The present angle has been written as the command, and 0x20 not yet."""
    return lambda: rig.writes()[-1][1] == "0x00"


def saves(rig: Rig) -> int:
    return sum(
        one.type_id == ExecuteOpcodeRequest.TYPE.id and one.kind is Kind.REQUEST for one in rig.transfers("host")
    )


async def off_for_good(rig: Rig, servo: Servo, output: int = 1) -> None:
    """Its output is off, or on the brake, soon, and stays so."""
    await asyncio.sleep(0.3)
    for _ in range(30):
        assert rig.sim(servo).output == output
        await asyncio.sleep(0.1)


@pytest.mark.parametrize("moment", [commanded, energised])
@pytest.mark.parametrize("mode", ["off", "brake"])
@scene(HOLDS)
async def test_stop_on_the_way_ends_the_save_and_the_output_is_as_stop_wants_it(
    rig: Rig, moment: Callable[[Rig, Servo], Callable[[], bool]], mode: str
) -> None:
    servo = await old(rig)
    job_id = await saving_until(rig, servo, moment(rig, servo))
    pressed = json(await rig.call("POST", "/stop?by=Kim", {"mode": mode}))
    assert pressed["servos"][0]["confirmed"]
    job = await ended(rig, job_id)
    assert (job["state"], job["error"]["code"]) == ("failed", "stopped"), job
    await off_for_good(rig, servo, {"off": 1, "brake": 2}[mode])
    assert rig.sim(servo).memory.stored(TORQUE) == 0, "never saved without"
    assert saves(rig) == 0 or rig.sim(servo).starts == 2
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]["reason"] == "stop"


@pytest.mark.parametrize("ms", range(0, 120, 4))
@scene(HOLDS)
async def test_stop_at_any_moment_leaves_the_output_off_and_rom_with_torque(rig: Rig, ms: int) -> None:
    servo = await old(rig)
    await stopped(rig, servo)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    await asyncio.sleep(ms / 1000)
    json(await rig.call("POST", "/stop?by=Kim"))
    await ended(rig, started["id"])
    await off_for_good(rig, servo)
    assert rig.sim(servo).memory.stored(TORQUE) == 0


@pytest.mark.parametrize("moment", [commanded, energised])
@scene(HOLDS)
async def test_whoever_switches_it_off_on_the_way_has_the_last_word(
    rig: Rig,
    moment: Callable[[Rig, Servo], Callable[[], bool]],
) -> None:
    servo = await old(rig)
    job_id = await saving_until(rig, servo, moment(rig, servo))
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "brake"}))
    job = await ended(rig, job_id)
    if rig.sim(servo).starts == 1:
        assert (job["state"], job["error"]["code"]) == ("failed", "torque_off"), job
        await off_for_good(rig, servo, 2)
    assert rig.sim(servo).memory.stored(TORQUE) == 0


def refuses_to_save(monkeypatch: pytest.MonkeyPatch) -> None:
    opcode = Services.opcode

    def no_save(self: Services, request: ExecuteOpcodeRequest, behaviour: Behaviour) -> ExecuteOpcodeResponse:
        return ExecuteOpcodeResponse(0, False) if request.opcode == Opcode.SAVE else opcode(self, request, behaviour)

    monkeypatch.setattr(Services, "opcode", no_save)


@pytest.mark.parametrize(("way", "raw"), [(stopped, 1), (braked, 2)])
@scene(HOLDS)
async def test_when_it_is_not_saved_the_output_goes_back_to_what_it_was_and_why(
    rig: Rig, way: Way, raw: Raw, monkeypatch: pytest.MonkeyPatch
) -> None:
    servo = await old(rig)
    await way(rig, servo)
    before = json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]
    refuses_to_save(monkeypatch)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    assert (job["state"], job["error"]["code"]) == ("failed", "refused_by_servo")
    await off_for_good(rig, servo, raw)
    after = json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]
    assert {**after, "since": 0} == {**before, "since": 0}
    assert (after["reason"], after["by"]) == ("stop", "Aki")


@scene(HOLDS)
async def test_a_servo_that_falls_silent_on_the_way_is_switched_off_when_it_is_heard_again(rig: Rig) -> None:
    servo = await old(rig)
    job_id = await saving_until(rig, servo, energised(rig, servo))
    rig.bus.loss(100)  # before the SAVE
    await asyncio.sleep(70)
    job = await ended(rig, job_id)
    assert job["state"] == "failed"
    rig.bus.loss(0)
    await asyncio.sleep(3)
    await off_for_good(rig, servo)
    assert rig.sim(servo).memory.stored(TORQUE) == 0


@pytest.mark.parametrize("away_s", [0.5, 8.0])
@scene(HOLDS)
async def test_a_power_cut_on_the_way_leaves_what_rom_holds(rig: Rig, away_s: float) -> None:
    servo = await old(rig)
    job_id = await saving_until(rig, servo, energised(rig, servo))
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(away_s)
    rig.bench.power(servo.uid, True)
    await ended(rig, job_id)
    await asyncio.sleep(5)
    assert rig.sim(servo).memory.stored(TORQUE) == 0
    assert (rig.sim(servo).output, rig.sim(servo).soft_starting) == (0, False), "as it starts by itself"


@scene(HOLDS)
async def test_a_servo_that_protects_itself_is_not_saved_while_its_output_would_have_to_come_on(rig: Rig) -> None:
    servo = await old(rig)
    await stopped(rig, servo)
    rig.sim(servo).conditions.temperature_c = 110.0
    await asyncio.sleep(2.5)
    refused = problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "busy", 409)
    assert "is in protection" in refused["detail"]
    rig.sim(servo).conditions.temperature_c = 25.0
    await asyncio.sleep(2.5)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    rig.sim(servo).conditions.temperature_c = 110.0  # between the question and the writing
    await asyncio.sleep(0.06)
    job = await ended(rig, started["id"])
    assert (job["state"], rig.sim(servo).memory.stored(TORQUE)) in (("succeeded", 0), ("failed", 0))
    assert rig.sim(servo).output == 1


@scene(HOLDS)
async def test_a_horn_that_turns_is_not_caught_on_its_way(rig: Rig) -> None:
    servo = await old(rig)
    await stopped(rig, servo)
    rig.sim(servo).conditions.load_pct = 30.0  # it falls
    await asyncio.sleep(0.3)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    assert (job["state"], job["error"]["code"]) == ("failed", "busy"), job
    assert "is turning at" in job["error"]["detail"]
    assert saves(rig) == 0
    assert rig.sim(servo).output == 1


@scene(HOLDS)
async def test_a_lease_that_ends_on_the_way_takes_nothing_from_the_save(rig: Rig) -> None:
    servo = await old(rig)
    await stopped(rig, servo)
    lease = await rig.lease()
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), 202)
    while not energised(rig, servo)():
        await asyncio.sleep(0.0001)
    await rig.call("DELETE", f"/leases/{lease}")
    await ended(rig, started["id"])
    assert rig.sim(servo).memory.stored(TORQUE) == 0
    await off_for_good(rig, servo)


@pytest.mark.parametrize(("way", "ends"), [("save", "released"), ("restart", "expired")])
@scene(HOLDS)
async def test_what_a_save_or_a_restart_inside_a_lease_energised_is_off_when_the_lease_ends(
    rig: Rig, way: str, ends: str
) -> None:
    servo = await old(rig)
    lease = await rig.lease(60 if ends == "released" else 20)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}, lease=lease))
    body = {"torque_on": True} if way == "save" else {}
    started = json(await rig.call("POST", f"/servos/{servo.uid}/{way}", body, lease=lease), 202)
    await ended(rig, started["id"])
    assert energised(rig, servo)(), "it starts as its ROM says"
    if ends == "released":
        await rig.call("DELETE", f"/leases/{lease}")
    else:
        await asyncio.sleep(25)
    await off_for_good(rig, servo)


@pytest.mark.parametrize("seed", range(1, 7))
@scene(HOLDS)
async def test_a_fifth_of_all_frames_lost_saves_it_or_leaves_the_output_off(rig: Rig, seed: int) -> None:
    servo = await old(rig)
    await stopped(rig, servo)
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}}))
    rig.bus.loss(20, seed=seed)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    rig.bus.loss(0)
    assert rig.sim(servo).memory.stored(TORQUE) == 0
    if job["state"] == "succeeded":
        assert rig.sim(servo).memory.stored(GAIN) == 55
        assert rig.sim(servo).output == 0
    else:
        await off_for_good(rig, servo)


@pytest.mark.parametrize("restarts", [False, True])
def test_a_server_that_is_killed_with_the_output_on_leaves_it_to_the_next_to_switch_it_off(
    tmp_path: Path, restarts: bool
) -> None:
    kept, left = tmp_path / "kept.sqlite", tmp_path / "left.sqlite"

    async def open_port(rig: Rig) -> CanPort:
        return rig.bus.port("next", bitrate=1_000_000)

    async def scene(rig: Rig) -> None:
        servo = await old(rig)
        await saving_until(rig, servo, energised(rig, servo))
        with sqlite3.connect(kept) as source, sqlite3.connect(left) as copy:
            source.backup(copy)  # what a kill leaves
        await rig.cable.unplug()  # nothing it sends arrives any more
        await asyncio.sleep(3)
        assert rig.sim(servo).output == 0, "nobody is there, and its own time-out holds"
        if restarts:
            rig.bench.power(servo.uid, False)
            await asyncio.sleep(1)
            rig.bench.power(servo.uid, True)
            await asyncio.sleep(4)
        store = Store(f"sqlite:///{left}")
        heir = Host(
            CATALOG, store, lambda _address, _bitrate: open_port(rig),
            HostSettings(126, bytes(range(16, 32)), (0, 1)), wall=rig.walls,
        )  # fmt: skip
        try:
            await heir.connect("memory:next", 1_000_000)
            await asyncio.sleep(6)
            assert rig.sim(servo).output == (0 if restarts else 1)
            found = heir.fleet.get(servo.uid).output_state
            expected = ("on", "configured", None) if restarts else ("off", "stop", "Aki")
            assert (found.state, found.reason, found.by) == expected
            assert store.settings.get("energised_for_save") is None
        finally:
            await heir.close()
            store.close()

    play(scene, HOLDS, store=f"sqlite:///{kept}")

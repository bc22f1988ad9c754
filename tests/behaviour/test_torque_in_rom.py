"""Torque mode in ROM over a save: kept unless a client staged another; no horn moves further than announced (4.13)."""

import asyncio
import sqlite3
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import power_cycle
from behaviour.restarting import ended, failed_with, opcodes, refuse, run, run_until, succeeded
from behaviour.rig import CATALOG, PLAIN, Rig, json, problem, until
from behaviour.scene import settled
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.host import Host, HostSettings
from hornbill.sim.device import ServoStage
from hornbill.store.store import Store
from hornbill.units import Raw
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort
from hornbill.wire.services import Opcode

GAIN = 0x2C
TORQUE = 0x20
COMMISSION = "/commissioning?wait=true"
Reached = Callable[[Rig, Servo], bool]


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


async def by_another_tool(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).memory.put(TORQUE, 1)
    await asyncio.sleep(1.2)
    assert servo.raw("torque_mode") == 1


TurnOff = Callable[[Rig, Servo], Awaitable[None]]
WAYS: tuple[TurnOff, ...] = (stopped, braked, lease_ended, switched_off, by_another_tool)
"""To turn torque off without staging a torque mode."""

each_way = pytest.mark.parametrize("turn_off", WAYS, ids=lambda way: way.__name__)


async def configuration(rig: Rig, servo: Servo) -> tuple[Any, ...]:
    """All that shows a servo's configuration."""
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


def save_calls(servo: Servo, **options: object) -> dict[str, tuple[str, str, dict[str, Any]]]:
    """The calls that save a P gain of 55, with these options; "stiff" is a profile."""
    values, path = {"angle_p_gain": 55}, f"/servos/{servo.uid}"
    options = {"save": True, **options}
    return {
        "patch": ("PATCH", f"{path}/parameters", {"values": values, **options}),
        "matrix": ("PATCH", "/parameters", {"servos": {servo.uid: values}, **options}),
        "profile": ("POST", "/profiles/stiff/apply?wait=true", {"uids": [servo.uid], **options}),
        "commission": ("POST", COMMISSION, {"servos": [{"uid": servo.uid}], "profile": "stiff", **options}),
        "copy": ("POST", f"{path}/copy", {"from": "profile:stiff", **options}),
    }


async def store_profile(rig: Rig) -> None:
    json(await rig.call("PUT", "/profiles/stiff", {"values": {"angle_p_gain": 55}}), 201)


def problem_of(response: Any) -> Any:
    """The problem of a refused call, of a failed job or of the only servo of a call."""
    body = response.json()
    if response.status_code != 200:
        return body
    return body["servos"][0]["problem"] if "servos" in body else body["error"]


@each_way
@settled()
async def test_turning_torque_off_does_not_change_the_configuration(rig: Rig, servo: Servo, turn_off: TurnOff) -> None:
    before = await configuration(rig, servo)
    assert before[0] == before[1] == before[7] == []
    await turn_off(rig, servo)
    assert json(await rig.call("GET", f"/servos/{servo.uid}/parameters/torque_mode"))["value"] in ("off", "brake")
    assert await configuration(rig, servo) == before
    patch = {"values": {"angle_p_gain": 41}}
    response = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", patch, **{"If-Match": before[2]})
    assert json(response)["outcome"] == "applied", "the revision is the same as before"
    kept = rig.host.history.snapshots.of(servo.uid)
    assert all(one.ram["torque_mode"] == 0 for one in kept), "to undo it would write no torque mode"


@each_way
@settled()
async def test_a_staged_torque_mode_stays_when_torque_is_turned_off(rig: Rig, servo: Servo, turn_off: TurnOff) -> None:
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
    await turn_off(rig, servo)
    reading = json(await rig.call("GET", f"{path}/parameters"))["parameters"]["torque_mode"]
    assert (reading["configured"], reading["rom"], reading["unsaved"]) == ("brake", "on", True)
    assert json(await rig.call("GET", path))["unsaved"] == ["torque_mode"]
    body = {"confirm": ["torque_off_in_rom"]}
    succeeded(await run(rig, servo, "save", body))
    assert rig.sim(servo).memory.stored(TORQUE) == 2
    assert json(await rig.call("GET", path))["unsaved"] == []


@settled()
async def test_staging_the_present_torque_state_is_a_change(rig: Rig, servo: Servo) -> None:
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


@pytest.mark.parametrize(
    ("torque", "turn_off"), [*((0, one) for one in WAYS), (1, stopped), (1, braked), (2, stopped), (2, switched_off)]
)
@settled(lambda torque: replace(PLAIN, rom={"torque_mode": torque}))
async def test_a_save_keeps_the_torque_mode_of_rom(rig: Rig, servo: Servo, turn_off: TurnOff, torque: Raw) -> None:
    await turn_off(rig, servo)
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}}))
    succeeded(await run(rig, servo, "save"))
    assert rig.sim(servo).memory.stored(TORQUE) == servo.registers["torque_mode"].rom == torque
    assert rig.sim(servo).memory.stored(GAIN) == 55
    output = json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]
    assert (output["state"], output["reason"]) == (("on", "off", "brake")[torque], "configured")


@settled(replace(PLAIN, rom={"torque_mode": 1}))
async def test_a_save_does_not_store_torque_that_was_turned_on(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    rig.host.motion.stop_commanding(servo)
    succeeded(await run(rig, servo, "save", lease=lease))
    assert rig.sim(servo).memory.stored(TORQUE) == 1
    assert rig.sim(servo).output == 1


@settled()
async def test_every_other_call_that_saves_keeps_the_torque_mode_of_rom(rig: Rig, servo: Servo) -> None:
    await store_profile(rig)
    path = f"/servos/{servo.uid}/snapshots"
    snapshot = json(await rig.call("POST", path), 201)["id"]
    calls = save_calls(servo) | {"restore": ("POST", f"{path}/{snapshot}/restore", {"save": True})}
    del calls["copy"]
    for turn_off, (name, (verb, path, body)) in zip(WAYS, calls.items(), strict=True):
        if name != "restore":
            await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 50}})
        await turn_off(rig, servo)
        response = json(await rig.call(verb, path, body))
        for job_id in filter(None, [response.get("job"), *(one["job"] for one in response.get("servos", []))]):
            succeeded(await ended(rig, job_id))
        assert response.get("state", "succeeded") == "succeeded", (name, response)
        memory = rig.sim(servo).memory
        assert (memory.stored(GAIN), memory.stored(TORQUE)) == (40 if name == "restore" else 55, 0), name
        await asyncio.sleep(3)


@pytest.mark.parametrize("turn_off", [stopped, braked])
@settled(replace(PLAIN, rom={"torque_mode": 1, "soft_start": 0}))
async def test_staging_torque_on_requires_a_lease_unless_it_is_saved(rig: Rig, servo: Servo, turn_off: TurnOff) -> None:
    path = f"/servos/{servo.uid}/parameters"
    await turn_off(rig, servo)
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


def forget_rom(rig: Rig, servo: Servo) -> None:
    """As for a servo that was first seen long after its start."""
    for register in servo.registers.values():
        register.rom = None
    rig.host.store.servos.put_rom(servo.uid, {})


@pytest.mark.parametrize("output", ["on", "off"])
@settled()
async def test_saving_with_unknown_rom_requires_a_torque_mode(rig: Rig, servo: Servo, output: str) -> None:
    path = f"/servos/{servo.uid}/save"
    await store_profile(rig)
    calls = [*save_calls(servo).values(), ("POST", path, None), ("POST", path, {"dry_run": True})]
    for word, stored in (("torque_on_in_rom", 0), ("torque_off_in_rom", 1)):
        if output == "off":
            await stopped(rig, servo)
        forget_rom(rig, servo)
        writes = rig.writes()
        for verb, where, body in calls:
            refusal = problem_of(await rig.call(verb, where, body))
            assert (refusal["code"], refusal["key"]) == ("needs_confirmation", "torque_mode"), where
            assert refusal["choices"] == ["torque_on_in_rom", "torque_off_in_rom"]
        assert rig.writes() == writes, "nothing is written before the confirmation"
        succeeded(await run(rig, servo, "save", {"confirm": [word]}))
        assert rig.sim(servo).memory.stored(TORQUE) == stored
        await asyncio.sleep(3)


@pytest.mark.parametrize("save", [True, False])
@settled()
async def test_a_dry_run_lists_the_changes_of_rom_and_the_move(rig: Rig, servo: Servo, save: bool) -> None:
    path = f"/servos/{servo.uid}"
    json(await rig.call("PATCH", f"{path}/parameters", {"values": {"smoothing": False}}))
    await stopped(rig, servo)
    rig.sim(servo).turn_manually(-90.0, asyncio.get_running_loop().time())
    await store_profile(rig)
    pending = {"key": "smoothing", "before": True, "after": False}
    new = {"key": "angle_p_gain", "before": 40, "after": 55}
    writes = rig.writes()
    for name, (verb, where, body) in save_calls(servo, dry_run=True, save=save).items():
        if name == "profile" and not save:
            continue
        plan = json(await rig.call(verb, where, body))
        plan = plan["result"] if name == "profile" else plan
        plan = plan["servos"][0] if "servos" in plan else plan
        assert plan["rom_changes"] == ([pending, new] if save else []), name
        assert plan["rom_unknown"] == []
        assert (plan["restart"] is not None) == save
        if save:
            check_move(plan["restart"])
    if save:
        alone = json(await rig.call("POST", f"{path}/save", {"dry_run": True}))
        assert alone["rom_changes"] == [pending]
        check_move(alone["restart"])
    assert rig.writes() == writes


def check_move(restart: dict[str, Any]) -> None:
    assert (restart["moves"], restart["from_deg"], restart["to_deg"]) == (True, -90.0, 0.0)
    assert any("turns on briefly" in warning for warning in restart["warnings"])


@settled()
async def test_a_dry_run_is_refused_for_the_same_reasons_as_the_call(rig: Rig, servo: Servo) -> None:
    await store_profile(rig)
    calls = save_calls(servo, dry_run=True)
    del calls["copy"]

    async def refused(code: str) -> None:
        for verb, path, body in [*calls.values(), ("POST", f"/servos/{servo.uid}/save", {"dry_run": True})]:
            assert problem_of(await rig.call(verb, path, body))["code"] == code, path

    sim = rig.sim(servo)
    sim.conditions.voltage_v = 3.8
    await asyncio.sleep(2.5)
    await refused("out_of_range")
    sim.conditions.voltage_v = 7.4
    await asyncio.sleep(2.5)
    lease = await rig.lease()
    await refused("lease_held")
    await rig.call("DELETE", f"/leases/{lease}")
    await rig.call("POST", "/stop")
    await refused("stopped")
    await rig.call("DELETE", "/stop")
    sim.conditions.temperature_c = 110.0
    await asyncio.sleep(2.5)
    await refused("busy")  # torque would have to be turned on, and the servo is in protection


class Watch:
    """The angles of a horn, and for how long torque was on, at each frame of the bus until the servo restarts."""

    def __init__(self, rig: Rig, servo: Servo) -> None:
        self.angles: list[float] = []
        self.torque_on_s = 0.0
        self._sim = rig.sim(servo)
        self._starts = self._sim.starts
        self._torque_on_since: float | None = None
        rig.bus.port("watch").listen(self._check)

    def _check(self, _frames: Sequence[Frame]) -> None:
        sim, now = self._sim, asyncio.get_running_loop().time()
        if sim.starts == self._starts:
            sim._device.motion.advance(now)  # pyright: ignore[reportPrivateUsage] - between its frames
            self.angles.append(sim.angle_deg)
        if self._torque_on_since is not None:
            self.torque_on_s += now - self._torque_on_since
        on = sim.starts == self._starts and sim.output == 0 and sim.stage is ServoStage.RUNNING
        self._torque_on_since = now if on else None


PLACES: dict[str, dict[str, Any]] = {
    "at 0": {"at_deg": 0.0},
    "at 30": {"at_deg": 30.0},
    "at -120": {"at_deg": -120.0},
    "at 179.9": {"at_deg": 179.9},
    "at -180": {"at_deg": -180.0},
    "no soft start": {"rom": {"soft_start": 0}},
    "no smoothing": {"rom": {"smoothing": 0}},
    "speed and torque control": {"rom": {"speed_torque_control": 1}},
    "reversed": {"rom": {"reverse": 1}},
    "another origin": {"rom": {"origin": 300}},
    "after two turns": {
        "at_deg": 750.0,
        "rom": {"extended_angle": 1, "angle_limit_cw": 36_000, "angle_limit_ccw": -36_000},
    },
    "outside its limits": {"at_deg": 90.0, "rom": {"angle_limit_cw": 450, "angle_limit_ccw": -450}},
    "loaded": {"at_deg": 20.0, "load_pct": 40.0},
    "loaded in the other direction": {"at_deg": -20.0, "load_pct": -40.0},
    "timeout: off": {"at_deg": 179.9, "rom": {"timeout_action": 1}},
    "timeout: brake": {"at_deg": 45.0, "rom": {"timeout_action": 2}},
    "braked": {"at_deg": 45.0, "mode": "brake"},
}


@pytest.mark.parametrize("case", PLACES.values(), ids=PLACES)
@settled(lambda case: replace(PLAIN, rom={"timeout_action": 0, **case.get("rom", {})}))
async def test_the_horn_moves_only_as_announced(rig: Rig, servo: Servo, case: dict[str, Any]) -> None:
    path, sim, loop = f"/servos/{servo.uid}", rig.sim(servo), asyncio.get_running_loop()
    lease = await rig.lease()
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    json(await rig.call("POST", f"{path}/command", {"type": "angle", "value": 10, "wait": "settled"}, lease=lease))
    await rig.call("DELETE", f"/leases/{lease}")
    await asyncio.sleep(0.1)
    if "mode" in case:
        json(await rig.call("POST", f"{path}/torque", {"mode": case["mode"]}))
    if case.get("load_pct"):  # a hand carries it until it is turned
        sim.conditions.load_pct = 0.0
    assert sim.turn_manually(case.get("at_deg", 75.0), loop.time())
    announced = json(await rig.call("POST", f"{path}/save", {"dry_run": True}))["restart"]
    stood = sim.angle_deg
    sim.conditions.load_pct = case.get("load_pct", 0.0) / 100.0  # as much as friction still holds
    seen = Watch(rig, servo)
    job = await run(rig, servo, "save")
    assert job["state"] == "succeeded", job["error"]
    assert max(abs(angle - stood) for angle in seen.angles) < 0.5, "until the restart nothing moved it"
    assert 0 < seen.torque_on_s < 0.05
    assert sim.memory.stored(TORQUE) == 0
    assert announced["text"] in job["steps"][0]["evidence"]
    here = json(await rig.call("GET", f"{path}/parameters/current_angle"))["value"]
    low, high = sorted((announced["from_deg"] or here, announced["to_deg"]))
    coasts = any("coasts" in warning for warning in announced["warnings"])
    assert coasts == (case.get("rom") == {"timeout_action": 1})
    beyond = 3.0 if coasts else 1.5
    assert low - beyond <= here <= high + beyond, "no further than announced"
    if "timeout_action" not in case.get("rom", {}):  # else its own timeout may end the soft start on the way
        assert here == pytest.approx(announced["to_deg"], abs=1.5)


HOLDS = replace(PLAIN, rom={"timeout_action": 0})
"""With its timeout set to hold: torque that is left on remains on."""


async def save_until(rig: Rig, servo: Servo, reached: Reached) -> str:
    """Start a save of a servo whose torque Stop turned off; the job's id as soon as that is reached."""
    await stopped(rig, servo)
    return await run_until(rig, servo, "save", lambda _job: reached(rig, servo))


def torque_on(rig: Rig, servo: Servo) -> bool:
    return rig.sim(servo).output == 0


def commanded(rig: Rig, _servo: Servo) -> bool:
    """The present angle has been written as the command, and 0x20 has not been written yet."""
    return rig.writes()[-1][1] == "0x00"


async def stays_off(rig: Rig, servo: Servo, output: int = 1) -> None:
    """Torque is soon off (or the brake on), and remains so for 3 s."""
    await asyncio.sleep(0.3)
    for _ in range(30):
        assert rig.sim(servo).output == output
        await asyncio.sleep(0.1)


@pytest.mark.parametrize("moment", [commanded, torque_on])
@pytest.mark.parametrize("mode", ["off", "brake"])
@settled(HOLDS)
async def test_stop_ends_a_save_with_torque_off_or_brake(rig: Rig, servo: Servo, moment: Reached, mode: str) -> None:
    job_id = await save_until(rig, servo, moment)
    pressed = json(await rig.call("POST", "/stop?by=Kim", {"mode": mode}))
    assert pressed["servos"][0]["confirmed"]
    failed_with(await ended(rig, job_id), "stopped")
    await stays_off(rig, servo, {"off": 1, "brake": 2}[mode])
    assert rig.sim(servo).memory.stored(TORQUE) == 0, "never saved without"
    assert opcodes(rig) == 0 or rig.sim(servo).starts == 2
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]["reason"] == "stop"


async def check_stop(rig: Rig, servo: Servo, after_ms: int) -> None:
    """Press Stop that long after the start of a save; torque must be off, and on in ROM."""
    await stopped(rig, servo)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    await asyncio.sleep(after_ms / 1000)
    json(await rig.call("POST", "/stop?by=Kim"))
    await ended(rig, started["id"])
    await stays_off(rig, servo)
    assert rig.sim(servo).memory.stored(TORQUE) == 0


@pytest.mark.parametrize("after_ms", range(0, 120, 20))
@settled(HOLDS)
async def test_stop_during_a_save_leaves_rom_with_torque_on(rig: Rig, servo: Servo, after_ms: int) -> None:
    await check_stop(rig, servo, after_ms)


@pytest.mark.parametrize("moment", [commanded, torque_on])
@settled(HOLDS)
async def test_torque_off_or_brake_during_a_save_takes_precedence(rig: Rig, servo: Servo, moment: Reached) -> None:
    job_id = await save_until(rig, servo, moment)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "brake"}))
    job = await ended(rig, job_id)
    if rig.sim(servo).starts == 1:
        failed_with(job, "torque_off")
        await stays_off(rig, servo, 2)
    assert rig.sim(servo).memory.stored(TORQUE) == 0


@pytest.mark.parametrize("body", [None, {"torque_on": True}])
@pytest.mark.parametrize(("turn_off", "raw"), [(stopped, 1), (braked, 2)])
@settled(HOLDS)
async def test_a_refused_save_restores_the_output(
    rig: Rig, servo: Servo, turn_off: TurnOff, raw: Raw, body: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    await turn_off(rig, servo)
    before = json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]
    refuse(monkeypatch, Opcode.SAVE)
    error = failed_with(await run(rig, servo, "save", body), "refused_by_servo")
    assert error["params"] == {
        "servo": servo.title, "cause": "save_refused", "snapshot": error["snapshot"],
        "also": ["snapshot_has_previous_values"],
    }  # fmt: skip
    assert "RAM is unchanged. ROM is unchanged" in error["detail"]
    await stays_off(rig, servo, raw)
    assert servo.raw("torque_mode") == raw
    after = json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]
    assert {**after, "since": 0} == {**before, "since": 0}
    assert (after["reason"], after["by"]) == ("stop", "Aki")


@settled(HOLDS)
async def test_torque_is_off_on_a_servo_that_responds_again_after_a_failed_save(rig: Rig, servo: Servo) -> None:
    job_id = await save_until(rig, servo, torque_on)
    rig.bus.loss(100)  # before the SAVE
    await asyncio.sleep(70)
    job = await ended(rig, job_id)
    assert job["state"] == "failed"
    rig.bus.loss(0)
    await asyncio.sleep(3)
    await stays_off(rig, servo)
    assert rig.sim(servo).memory.stored(TORQUE) == 0


@pytest.mark.parametrize("away_s", [0.5, 8.0])
@settled(HOLDS)
async def test_power_loss_during_a_save_leaves_rom_unchanged(rig: Rig, servo: Servo, away_s: float) -> None:
    job_id = await save_until(rig, servo, torque_on)
    await power_cycle(rig, servo.uid, away_s)
    await ended(rig, job_id)
    await asyncio.sleep(5)
    assert rig.sim(servo).memory.stored(TORQUE) == 0
    assert (rig.sim(servo).output, rig.sim(servo).soft_starting) == (0, False), "as after any restart"


@settled(HOLDS)
async def test_a_servo_in_protection_is_not_saved_if_torque_must_be_turned_on(rig: Rig, servo: Servo) -> None:
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


@settled(HOLDS)
async def test_a_turning_horn_prevents_a_save(rig: Rig, servo: Servo) -> None:
    await stopped(rig, servo)
    rig.sim(servo).conditions.load_pct = 30.0  # it falls
    await asyncio.sleep(0.3)
    error = failed_with(await run(rig, servo, "save"), "busy")
    assert "is turning at" in error["detail"]
    assert opcodes(rig) == 0
    assert rig.sim(servo).output == 1


@settled(HOLDS)
async def test_the_end_of_a_lease_does_not_interrupt_a_save(rig: Rig, servo: Servo) -> None:
    await stopped(rig, servo)
    lease = await rig.lease()
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), 202)
    await until(lambda: torque_on(rig, servo), every_s=0.0001)
    await rig.call("DELETE", f"/leases/{lease}")
    await ended(rig, started["id"])
    assert rig.sim(servo).memory.stored(TORQUE) == 0
    await stays_off(rig, servo)


@pytest.mark.parametrize(("verb", "end"), [("save", "released"), ("restart", "expired")])
@settled(HOLDS)
async def test_the_end_of_a_lease_turns_torque_off_after_a_save(rig: Rig, servo: Servo, verb: str, end: str) -> None:
    lease = await rig.lease(60 if end == "released" else 20)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}, lease=lease))
    body = {"torque_on": True} if verb == "save" else {}
    started = json(await rig.call("POST", f"/servos/{servo.uid}/{verb}", body, lease=lease), 202)
    await ended(rig, started["id"])
    assert torque_on(rig, servo), "it starts as its ROM says"
    if end == "released":
        await rig.call("DELETE", f"/leases/{lease}")
    else:
        await asyncio.sleep(25)
    await stays_off(rig, servo)


@pytest.mark.parametrize("seed", range(1, 4))
@settled(HOLDS)
async def test_with_a_fifth_of_all_frames_lost_it_is_saved_or_torque_is_off(rig: Rig, servo: Servo, seed: int) -> None:
    await stopped(rig, servo)
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}}))
    rig.bus.loss(20, seed=seed)
    job = await run(rig, servo, "save")
    rig.bus.loss(0)
    assert rig.sim(servo).memory.stored(TORQUE) == 0
    if job["state"] == "succeeded":
        assert rig.sim(servo).memory.stored(GAIN) == 55
        assert rig.sim(servo).output == 0
    else:
        await stays_off(rig, servo)


@pytest.mark.parametrize("restarts", [False, True])
@settled(HOLDS, store=lambda tmp_path: f"sqlite:///{tmp_path / 'store.sqlite'}")
async def test_torque_left_on_by_a_killed_server_is_turned_off(
    rig: Rig, servo: Servo, tmp_path: Path, restarts: bool
) -> None:
    async def open_port(_address: str, _bitrate: int) -> CanPort:
        return rig.bus.port("next", bitrate=1_000_000)

    left = tmp_path / "left.sqlite"
    await save_until(rig, servo, torque_on)
    with sqlite3.connect(tmp_path / "store.sqlite") as source, sqlite3.connect(left) as copy:
        source.backup(copy)  # what a kill leaves
    await rig.cable.unplug()  # its frames no longer arrive
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 0, "no host is there, and its timeout is set to hold"
    if restarts:
        await power_cycle(rig, servo.uid, 1)
        await asyncio.sleep(4)
    store = Store(f"sqlite:///{left}")
    successor = Host(CATALOG, store, open_port, HostSettings(126, bytes(range(16, 32)), (0, 1)), wall=rig.walls)
    try:
        await successor.connect("memory:next", 1_000_000)
        await asyncio.sleep(6)
        assert rig.sim(servo).output == (0 if restarts else 1)
        found = successor.fleet.get(servo.uid).output_state
        expected = ("on", "configured", None) if restarts else ("off", "stop", "Aki")
        assert (found.state, found.reason, found.by) == expected
        assert store.settings.get("energised_for_save") is None
    finally:
        await successor.close()
        store.close()


async def at_the_last_try(rig: Rig, servo: Servo) -> None:
    """The first tries of the write precede the start by more than an uptime of whole seconds tells."""
    rig.bench.power(servo.uid, False)
    asyncio.get_running_loop().call_later(0.95, rig.bench.power, servo.uid, True)
    assert await rig.host.requests.write(servo, servo.registers["torque_mode"].parameter, 1) == 1


async def before_it_is_identified(rig: Rig, servo: Servo) -> None:
    """Its restart while offline is noticed, and noticed again when it is identified."""
    boot_count = servo.boot_count
    await power_cycle(rig, servo.uid, 4.0)
    await until(lambda: servo.boot_count != boot_count, every_s=0.0005)
    await switched_off(rig, servo)


@pytest.mark.parametrize("turn_off", [at_the_last_try, before_it_is_identified], ids=lambda way: way.__name__)
@settled(replace(PLAIN, rom={"soft_start": 0}))
async def test_torque_off_written_right_after_a_start_is_not_taken_as_rom(
    rig: Rig, servo: Servo, turn_off: TurnOff
) -> None:
    starts = rig.sim(servo).starts
    await turn_off(rig, servo)
    await until(lambda: rig.sim(servo).starts > starts and servo.state is State.READY)
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 1
    assert rig.sim(servo).stored()["torque_mode"] == 0
    row = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/torque_mode"))
    assert (row["value"], row["rom"]) == ("off", None)

"""Test plans: cycles, limits, stop rules, resumption, and torque off however a run ends."""

import asyncio
import csv
import io
import sqlite3
import xml.etree.ElementTree as ET
from collections.abc import Awaitable, Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import torque
from behaviour.rig import Rig, json, problem, until
from behaviour.scene import scene
from hornbill.domain.plant import PlantConstants
from hornbill.servo.device.servo import Servo
from hornbill.servo.runs.plan_run import PlanRun, PlanTarget
from hornbill.servo.runtime.hub import JobChanged
from hornbill.sim.bench.chaos import KINDS, ChaosKind
from hornbill.sim.bench.recipe import Recipe

ROM = {"soft_start": 0, "timeout_action": 0, "speed_torque_control": 1}
ONE = Recipe("BLA21-12U-A0", "1.300", servo_id=1, node_id=11, rom=ROM)
TWO = Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12, rom=ROM)

THERE = {"do": "move", "angle_deg": 10, "timeout_s": 1}
BACK = {"do": "move", "angle_deg": -10, "timeout_s": 1}
ENDED = ("succeeded", "failed", "cancelled")


def plan(*servos: Servo, **more: object) -> dict[str, object]:
    made: dict[str, object] = {"name": "endurance", "servos": [one.uid for one in servos], "steps": [THERE, BACK]}
    return made | more


async def start(rig: Rig, *servos: Servo, **more: object) -> str:
    return str(json(await rig.call("POST", "/plans", {"plan": plan(*servos, **more)}), 202)["id"])


async def job(rig: Rig, job_id: str) -> Any:
    return json(await rig.call("GET", f"/jobs/{job_id}"))


async def ended(rig: Rig, job_id: str) -> Any:
    """The job once it has ended, which must leave torque off and the lease free."""
    async with asyncio.timeout(3600):
        while (found := await job(rig, job_id))["state"] not in ENDED:
            await asyncio.sleep(0.05)
    assert json(await rig.call("GET", "/leases")) == []
    return found


async def run(rig: Rig, *servos: Servo, **more: object) -> Any:
    done = await ended(rig, await start(rig, *servos, **more))
    assert all(rig.sim(servo).output != 0 for servo in servos)
    return done


async def cycles(rig: Rig, job_id: str, number: int) -> None:
    """Wait until that number of cycles is complete."""
    found = rig.host.jobs.get(job_id)
    await until(lambda: int(str((found.result or {}).get("cycles_done", 0))) >= number, within_s=600)


@scene(ONE, TWO)
async def test_a_plan_runs_all_cycles_without_its_client_and_turns_torque_off(rig: Rig, servos: list[Servo]) -> None:
    first, second = servos
    steps = [
        {"do": "move", "angle_deg": {first.uid: 20, second.uid: -20}, "speed_deg_s": 90},
        {"do": "wait", "for_s": 0.5},
        {"do": "speed", "speed_rpm": 10, "for_s": 0.3, "servos": [first.uid]},
        {"do": "torque", "torque_pct": 20, "for_s": 0.1, "servos": [second.uid]},
        {"do": "move", "angle_deg": 0},
    ]
    done = await run(rig, *servos, cycles=3, steps=steps, limits={"temperature_c": 60, "torque_pct": 100})
    assert done["state"] == "succeeded", done["error"]
    assert done["progress"] == 1.0
    result = done["result"]
    assert (result["plan"], result["cycles_done"]) == ("endurance", 3)
    for one, uses in zip(result["servos"], ((1, 2, 3, 5), (1, 2, 4, 5)), strict=True):
        assert one["verdict"] == "done"
        assert [count["step"] for count in one["steps"] if count["runs"]] == list(uses)
        assert all(count["runs"] in (0, 3) and not count["exceeded"] for count in one["steps"])
        assert 0 < one["steps"][4]["settle_s_mean"] <= one["steps"][4]["settle_s_max"] < 1
        assert one["steps"][0]["error_deg_max"] <= 1.0
        assert 10 < one["measured"]["temperature_c_max"] < 60
    shown = {step["name"]: step for step in done["steps"]}
    assert shown["move 2.1"]["text"].endswith("1. Move to -20°")
    assert shown["move 2.1"]["evidence"].startswith("3 of 3 within limits, error up to ")
    assert all(step["state"] == "done" for step in done["steps"])


FILE = """
name = "endurance"
servos = ["{uid}"]

[[steps]]
do = "move"
angle_deg = 10
"""


@scene(ONE)
async def test_a_plan_is_also_the_text_of_a_file(rig: Rig, servo: Servo) -> None:
    body = {"plan": FILE.format(uid=servo.uid), "dry_run": True}
    found = json(await rig.call("POST", "/plans", body))
    assert (found["name"], found["steps"], found["servos"][0]["uid"]) == ("endurance", 1, servo.uid)
    assert found["plan"]["limits"]["position_error_deg"] == 1.0
    started = json(await rig.call("POST", "/plans", {"plan": found["plan"]}), 202)
    assert (await ended(rig, started["id"]))["state"] == "succeeded"
    for wrong, said in (("name =", "not TOML"), ("[" * 5000, "not TOML"), ('name = "x"', "servos")):
        refused = problem(await rig.call("POST", "/plans", {"plan": wrong, "dry_run": True}), "invalid_value", 422)
        assert said in refused["detail"], wrong


REFUSED: dict[str, tuple[dict[str, object], str, int]] = {
    "unknown servo": ({"servos": ["nobody"]}, "unknown_servo", 404),
    "unknown profile": ({"profile": "none"}, "unknown_profile", 404),
    "beyond the angle limit": ({"steps": [{"do": "move", "angle_deg": 200}]}, "out_of_range", 422),
    "no such step": ({"steps": [{"do": "dance"}]}, "invalid_value", 422),
    "unknown name in a step": ({"steps": [THERE | {"servos": ["other"]}]}, "invalid_value", 422),
    "idle servo": ({"servos": ["a", "b"], "steps": [THERE | {"servos": ["a"]}]}, "invalid_value", 422),
    "unknown field": ({"limits": {"temperature": 60}}, "invalid_value", 422),
    "speed control is off": ({"steps": [{"do": "speed", "speed_rpm": 10, "for_s": 1}]}, "mode_off", 409),
}


@scene(Recipe("BLA21-12U-A0", "1.300", servo_id=1, node_id=11, rom={"soft_start": 0}))
async def test_what_cannot_run_is_refused_before_anything_is_sent(rig: Rig, servo: Servo) -> None:
    before = len(rig.writes())
    for name, (more, code, status) in REFUSED.items():
        for dry_run in (False, True):
            response = await rig.call("POST", "/plans", {"plan": plan(servo, **more), "dry_run": dry_run})
            if dry_run and code in ("mode_off", "out_of_range"):  # a problem of the servo, not of the plan
                assert json(response)["servos"][0]["problem"]["code"] == code, name
            else:
                problem(response, code, status)
    lease = await rig.lease()
    problem(await rig.call("POST", "/plans", {"plan": plan(servo)}), "lease_held", 409)
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", "/plans", {"plan": plan(servo)}, lease=lease), "stopped", 423)
    json(await rig.call("PUT", f"/leases/{lease}"), 200)
    json(await rig.call("DELETE", "/stop"))
    assert [one for one in rig.writes()[before:] if one[1] != "0x20"] == []


@scene(ONE)
async def test_a_dry_run_sends_only_reads(rig: Rig, servo: Servo) -> None:
    steps = [THERE, {"do": "wait", "for_s": 2}, {"do": "speed", "speed_rpm": 1, "for_s": 1}]
    before = len(rig.writes())
    body = {"plan": plan(servo, steps=steps, cycles=10), "dry_run": True}
    found = json(await rig.call("POST", "/plans", body))
    assert (found["cycles"], found["steps"], found["least_s"]) == (10, 3, 30)
    (one,) = found["servos"]
    assert one["problem"] is None
    assert {caution["code"] for caution in one["cautions"]} >= {"continuous_rotation"}
    assert len(rig.writes()) == before
    assert json(await rig.call("GET", "/jobs")) == []


Change = dict[str, object]
HOT: Change = {"temperature_c": 75}
LOADED: Change = {"load_pct": 60}


@pytest.mark.parametrize(
    ("change", "limits", "quantity"),
    [
        (HOT, {"temperature_c": 60}, "temperature_c"),
        (LOADED, {"torque_pct": 40}, "torque_pct"),
        ({"voltage_v": 9.0}, {"voltage_min_v": 11}, "voltage_min_v"),
        ({"voltage_v": 14.0}, {"voltage_max_v": 13}, "voltage_max_v"),
        ({"plant": {"stop_cw_deg": 5.0}}, {"position_error_deg": 2}, "position_error_deg"),
        ({"temperature_c": 90}, {"faults": ["warning"]}, "faults"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
@pytest.mark.parametrize("on_limit", ["stop", "drop", "continue"])
@scene(ONE, TWO)
async def test_an_exceeded_limit_is_recorded_and_the_stop_rule_decides(
    rig: Rig, servos: list[Servo], change: Change, limits: dict[str, object], quantity: str, on_limit: str
) -> None:
    first, second = servos
    more = {"cycles": 6, "limits": limits, "stop": {"on_limit": on_limit}}
    job_id = await start(rig, *servos, **more)
    await cycles(rig, job_id, 2)
    json(await rig.call("PATCH", f"/sim/servos/{first.uid}", change))
    done = await ended(rig, job_id)
    assert rig.sim(first).output != 0
    assert rig.sim(second).output != 0
    assert (done["state"], done["error"]["code"]) == ("failed", "unexpected_result"), done["error"]
    assert done["error"]["cause"] == "plan_limit_exceeded"
    hit, other = done["result"]["servos"]
    assert hit["exceeded"][0]["quantity"] == quantity
    protected = quantity == "faults" and on_limit == "continue"  # the servo itself switches its output off
    assert (hit["verdict"], hit["dropped"], other["exceeded"]) == ("failed", on_limit == "drop" or protected, [])
    total = done["result"]["cycles_done"]
    assert total >= 2
    assert total < 6 if on_limit == "stop" else total == 6
    assert other["verdict"] == ("waiting" if on_limit == "stop" else "done")
    failed = [step for step in done["steps"] if step["state"] == "failed"]
    assert failed
    assert all(step["uid"] == first.uid for step in failed)
    for count in hit["steps"]:
        assert 0 <= count["exceeded"] <= count["runs"]


@scene(ONE)
async def test_a_run_ends_after_its_time_or_after_a_number_of_exceeded_limits(rig: Rig, servo: Servo) -> None:
    done = await run(rig, servo, cycles=100_000, stop={"after_s": 5})
    assert done["state"] == "succeeded"
    assert 5 <= done["result"]["ran_s"] < 6.5
    assert done["progress"] == 1.0
    rules = {"on_limit": "continue", "after_exceeded": 7}
    done = await run(rig, servo, cycles=100_000, stop=rules, limits={"temperature_c": 1})
    assert (done["state"], done["result"]["servos"][0]["exceeded_total"]) == ("failed", 7)


async def stop(rig: Rig, _servo: Servo) -> None:
    json(await rig.call("POST", "/stop", {"reason": "test"}))


async def other_client(rig: Rig, _servo: Servo) -> None:
    body = {"holder": "other", "force": True, "reason": "needed", "ttl_s": 0.2}
    json(await rig.call("POST", "/leases", body), 201)
    await asyncio.sleep(0.3)


async def unplug(rig: Rig, _servo: Servo) -> None:
    await rig.cable.unplug()
    await asyncio.sleep(1)
    rig.cable.plug_in()


async def power_off(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"power": "off"}))
    await asyncio.sleep(20)
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"power": "on"}))


async def cancel(rig: Rig, _servo: Servo) -> None:
    (running,) = json(await rig.call("GET", "/jobs"))
    json(await rig.call("DELETE", f"/jobs/{running['id']}"))


@pytest.mark.parametrize(
    ("disturb", "code"),
    [
        (stop, "stopped"), (other_client, "lease_required"), (unplug, "bus_disconnected"), (power_off, "no_response"),
        (cancel, None),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)  # fmt: skip
@scene(ONE, TWO)
async def test_whatever_ends_a_run_torque_goes_off_and_the_run_can_be_resumed(
    rig: Rig, servos: list[Servo], disturb: Callable[[Rig, Servo], Awaitable[None]], code: str | None
) -> None:
    job_id = await start(rig, *servos, cycles=9)
    await cycles(rig, job_id, 3)
    await disturb(rig, servos[0])
    done = await ended(rig, job_id)
    assert done["state"] == ("failed" if code else "cancelled")
    assert code is None or done["error"]["code"] in (code, "lease_held"), done["error"]
    assert 3 <= done["result"]["cycles_done"] < 9
    await until(lambda: all(rig.sim(servo).output != 0 for servo in servos), within_s=10)
    await rig.ready(2)
    written = len(rig.writes())
    await asyncio.sleep(5)
    assert len(rig.writes()) == written, "nothing continues automatically"
    await rig.call("DELETE", "/stop")
    json(await rig.call("POST", f"/jobs/{job_id}/resume"), 202)
    done = await ended(rig, job_id)
    assert done["state"] == "succeeded", done["error"]
    assert done["result"]["cycles_done"] == 9
    for one in done["result"]["servos"]:
        runs = [count["runs"] for count in one["steps"]]
        assert all(9 <= number <= 10 for number in runs), "the step in which it ended is repeated by all servos"


@scene(ONE, store=lambda tmp_path: f"sqlite:///{tmp_path / 'hornbill.db'}")
async def test_the_next_server_turns_torque_off_and_resumes_on_request(rig: Rig, tmp_path: Path, servo: Servo) -> None:
    """A killed server cannot turn torque off, and the servo holds: its timeout (0x26) is set to hold."""
    json(await rig.call("PUT", "/profiles/soft", {"values": {"angle_p_gain": 40}}), 201)
    uid, job_id = servo.uid, await start(rig, servo, cycles=12, profile="soft")
    await cycles(rig, job_id, 4)
    with (
        closing(sqlite3.connect(tmp_path / "hornbill.db")) as old,
        closing(sqlite3.connect(tmp_path / "killed.db")) as new,
    ):
        old.backup(new)
    await rig.cable.unplug()
    sim = rig.bench.servo(uid)
    with await rig.restart_server(f"sqlite:///{tmp_path / 'killed.db'}"):
        found = await job(rig, job_id)
        assert (found["state"], found["error"]["code"], found["resumable"]) == ("failed", "interrupted", True)
        kept = found["result"]["cycles_done"]
        assert kept >= 3, "at most a second of results is lost"
        assert sim.output == 0
        rig.cable.plug_in()
        await rig.host.connect("memory:host", 1_000_000)
        await rig.ready()
        await until(lambda: sim.output != 0, within_s=2)
        json(await rig.call("POST", f"/jobs/{job_id}/resume"), 202)
        done = await ended(rig, job_id)
        assert done["state"] == "succeeded", done["error"]
        assert [count["runs"] for count in done["result"]["servos"][0]["steps"]] == [12, 12]
        assert sim.memory.get(0x2C) == 40
        assert sim.output != 0
        await rig.host.close()


@scene(ONE, TWO)
async def test_reports_have_the_results_of_every_step(rig: Rig, servos: list[Servo]) -> None:
    rig.sim(servos[1]).conditions.plant = PlantConstants(stop_cw_deg=4.0)
    done = await run(rig, *servos, cycles=3, stop={"on_limit": "continue"})

    async def report(form: str) -> str:
        return (await rig.call("GET", f"/jobs/{done['id']}/report?format={form}")).text

    rows = list(csv.DictReader(io.StringIO(await report("csv"))))
    assert [(row["servo_id"], row["step"], row["runs"], row["exceeded"]) for row in rows] == [
        ("1", "1", "3", "0"), ("1", "2", "3", "0"), ("2", "1", "3", "3"), ("2", "2", "3", "0"),
    ]  # fmt: skip
    assert float(rows[2]["error_deg_max"]) == pytest.approx(6.0, abs=0.5)
    assert 0 < float(rows[0]["settle_s_mean"]) <= float(rows[0]["settle_s_max"])
    assert rows[0]["action"] == "Move to 10°"
    suites = ET.fromstring(await report("junit"))
    assert suites.attrib["failures"] == "1"
    (failure,) = suites.iter("failure")
    assert "0 of 3 within limits, error up to 6" in failure.attrib["message"]
    html = await report("html")
    assert "Test plan: endurance" in html
    assert "position error 6" in html
    assert html.count("<td>Move to 10°</td>") == 2


@scene(ONE)
async def test_a_run_takes_over_the_lease_of_its_client_and_blocks_other_writes(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    await torque(rig, servo, "on", lease)
    body = {"plan": plan(servo, cycles=3)}
    job_id = json(await rig.call("POST", "/plans", body, lease=lease), 202)["id"]
    problem(await rig.call("PUT", f"/leases/{lease}"), "unknown_lease", 404)
    (held,) = json(await rig.call("GET", "/leases"))
    assert held["holder"] == "plan endurance"
    path = f"/servos/{servo.uid}/parameters/angle_p_gain"
    problem(await rig.call("PUT", path, {"value": 50}), "lease_held", 409)
    problem(await rig.call("POST", "/plans", body), "busy", 409)
    assert (await ended(rig, job_id))["state"] == "succeeded"


@scene(ONE)
async def test_torque_off_by_another_client_ends_a_run_within_a_wait(rig: Rig, servo: Servo) -> None:
    job_id = await start(rig, servo, steps=[THERE, {"do": "wait", "for_s": 60}])
    await until(lambda: (rig.host.jobs.get(job_id).step or "").startswith("wait"))
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    async with asyncio.timeout(1):
        done = await ended(rig, job_id)
    assert (done["state"], done["error"]["code"]) == ("failed", "torque_off")
    assert rig.sim(servo).output == 1


@scene(ONE, fast=True)
async def test_a_run_survives_lost_frames_and_publishes_about_once_a_second(rig: Rig, servo: Servo) -> None:
    rig.bus.loss(5)
    job_id = await start(rig, servo, cycles=15)
    await cycles(rig, job_id, 1)
    began, before = rig.host.base.now(), len(rig.changes)
    done = await ended(rig, job_id)
    assert done["state"] == "succeeded", done["error"]
    seconds = rig.host.base.now() - began
    shown = sum(isinstance(change, JobChanged) for change in rig.changes[before:])
    assert seconds > 5
    assert shown <= seconds + 6


@scene(ONE)
async def test_a_run_that_exceeded_a_limit_is_resumed_and_still_ends_as_failed(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", HOT))
    done = await run(rig, servo, cycles=3, limits={"temperature_c": 60})
    assert (done["result"]["cycles_done"], done["resumable"]) == (0, True)
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"temperature_c": 25}))
    json(await rig.call("POST", f"/jobs/{done['id']}/resume"), 202)
    done = await ended(rig, done["id"])
    assert (done["state"], done["result"]["cycles_done"]) == ("failed", 3)
    assert done["error"]["cause"] == "plan_limit_exceeded"
    (one,) = done["result"]["servos"]
    assert [(count["runs"], count["exceeded"]) for count in one["steps"]] == [(4, 1), (3, 0)]


MISFORTUNE: list[ChaosKind] = [kind for kind in KINDS if kind not in ("rom_lost", "load")]
"""Not those after which a run is rightly refused: a servo on defaults, and a free horn turned around by its load."""


@scene(ONE, TWO, fast=True)
async def test_under_chaos_every_reported_arrival_is_true_and_torque_is_off_after_each_end(
    rig: Rig, servos: list[Servo], monkeypatch: pytest.MonkeyPatch
) -> None:
    def safe(servo: Servo) -> bool:
        """Off, or on only because the servo has restarted since, with torque on in its ROM."""
        sim = rig.sim(servo)
        return not sim.powered or sim.output != 0 or servo.output_state.reason == "configured"

    arrivals: list[float] = []
    show_step = PlanRun.show_step

    def check(one: PlanRun, target: PlanTarget, number: int, *, running: bool, at: float) -> None:
        if not running and not target.now_exceeded and one.job.state == "running" and target.goal is not None:
            goal = target.goal.raw / target.goal.parameter.per_unit
            arrivals.append(abs(rig.sim(target.servo).angle_deg - goal))
        show_step(one, target, number, running=running, at=at)

    monkeypatch.setattr(PlanRun, "show_step", check)
    rig.bench.chaos.start(3, MISFORTUNE, interval_s=3.0)
    job_id, ends = await start(rig, *servos, cycles=10), 0
    async with asyncio.timeout(3600):
        while (done := await ended(rig, job_id))["result"]["cycles_done"] < 10:
            ends += 1
            assert ends < 60, done["error"]
            if ends == 6:
                rig.bench.chaos.stop()
            await until(lambda: all(safe(servo) for servo in servos), within_s=120)
            while (await rig.call("POST", f"/jobs/{job_id}/resume")).status_code != 202:
                await asyncio.sleep(1)
    assert ends >= 2
    assert len(arrivals) >= 40
    assert max(arrivals) <= 1.3, "the limit, and the resolution and noise of the sensor"
    for one in done["result"]["servos"]:
        for count in one["steps"]:
            assert 10 <= count["runs"] <= 10 + ends
            assert count["exceeded"] <= count["runs"]
    await until(lambda: all(safe(servo) for servo in servos), within_s=120)

"""Profiles applied to many servos of several models by one job: left out, refused, stopped at, saved, told."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.bag import ADDRESSES, GAINS, MIXED, RAW, THREE, apply, in_order, memory, outcomes, put, states
from behaviour.rig import Rig, json, play, problem
from behaviour.scene import scene
from hornbill.domain.change import LeftOut
from hornbill.domain.profile import Profile
from hornbill.schema.scale import Value
from hornbill.servo.device.servo import Servo
from hornbill.sim.behaviour import Behaviour


@scene(*MIXED)
async def test_across_models_rows_a_servo_lacks_are_left_out_and_told(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    await put(rig, values={**GAINS, "pwm_neutral": 1500, "angle_boost": 1.5})
    job = await apply(rig, servos)
    assert (job["state"], outcomes(job)) == ("succeeded", ["applied"] * 3), job["error"]
    left = [[row["key"] for row in one["left_out"]] for one in job["result"]["servos"]]
    assert left == [[], ["angle_boost", "pwm_neutral"], ["pwm_neutral"]]
    why = job["result"]["servos"][1]["left_out"][0]
    assert "BLA21-12U-A0 with firmware 1.010" in why["why"]
    assert why["why_code"] == "not_in_servo"
    assert why["why_params"] == {"model": "BLA21-12U-A0", "firmware": "1.010"}
    assert [memory(rig, servo) for servo in servos] == [RAW] * 3
    asked = {(node, name) for node, name, _ in rig.writes() if name != "0x20"}
    assert not {(12, "0x2F"), (12, "0x34"), (13, "0x34")} & asked
    snapshots = rig.host.store.snapshots.counts()
    assert [snapshots[servo.uid] for servo in servos] == [1, 1, 1]


@pytest.mark.parametrize("on_anomaly", ["stop", "continue"])
@scene(*MIXED)
async def test_a_value_one_model_does_not_allow_is_never_written_there(rig: Rig, on_anomaly: str) -> None:
    servos = await in_order(rig, 3)
    before = [memory(rig, servo) for servo in servos]
    await put(rig, values={**GAINS, "voltage_limit_upper": 15.0})
    job = await apply(rig, servos, on_anomaly=on_anomaly)
    first, second, third = job["result"]["servos"]
    assert (job["state"], job["error"]["code"]) == ("failed", "out_of_range")
    assert [one["outcome"] for one in (first, third)] == ["rejected"] * 2
    assert (first["problem"]["code"], first["problem"]["key"]) == ("out_of_range", "voltage_limit_upper")
    assert "2 of 3 servos" in job["error"]["detail"]
    assert [memory(rig, servo) for servo in (servos[0], servos[2])] == [before[0], before[2]]
    if on_anomaly == "stop":
        assert second["outcome"] == "not_tried"
        assert rig.writes() == []
        assert states(job)["write 2"] == "skipped"
    else:
        assert second["outcome"] == "applied"
        assert memory(rig, servos[1]) == RAW


@scene(*THREE)
async def test_stop_ends_the_job_at_the_first_servo_that_refuses_and_leaves_the_rest_untouched(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    before = memory(rig, servos[1])
    rig.sim(servos[1]).conditions.refuse_keys.add("angle_limit_cw")
    await put(rig)
    job = await apply(rig, servos, on_anomaly="stop")
    assert job["state"] == "failed"
    assert (job["error"]["code"], job["error"]["uid"]) == ("refused_by_servo", servos[1].uid)
    assert outcomes(job)[0] == "applied"
    assert outcomes(job)[1] in ("rolled_back", "rejected")
    assert outcomes(job)[2] == "not_tried"
    assert [memory(rig, servo) for servo in servos] == [RAW, before, before]
    assert {node for node, name, _ in rig.writes() if name != "0x20"} <= {11, 12}
    assert (states(job)["write 2"], states(job)["write 3"]) == ("failed", "skipped")
    evidence = next(step["evidence"] for step in job["steps"] if step["name"] == "write 3")
    assert servos[1].title in evidence


@scene(*THREE)
async def test_continue_goes_on_past_a_servo_that_refuses_and_says_so_at_the_end(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    before = memory(rig, servos[1])
    rig.sim(servos[1]).conditions.refuse_keys.add("angle_limit_cw")
    await put(rig)
    job = await apply(rig, servos, on_anomaly="continue", save=True)
    assert job["state"] == "failed"
    assert "1 of 3 servos" in job["error"]["detail"]
    assert outcomes(job)[::2] == ["applied", "applied"]
    assert [one["saved"] for one in job["result"]["servos"]] == [True, False, True]
    assert [memory(rig, servo) for servo in servos] == [RAW, before, RAW]
    assert [rig.sim(servo).starts for servo in servos] == [2, 1, 2]
    assert states(job)["save 2"] == "skipped"
    told = json(await rig.call("GET", f"/jobs/{job['id']}/report"))["servos"]
    assert [(one["verdict"], one["verified_in"], one["profile"]) for one in told] == [
        ("done", "rom", "gains"), ("failed", None, "gains"), ("done", "rom", "gains")
    ]  # fmt: skip
    assert told[0]["values"]["timeout_time"] == {"value": 500, "unit": "ms"}
    assert told[1]["problem"] == job["result"]["servos"][1]["problem"]["detail"]


@scene(*THREE)
async def test_what_was_saved_is_in_rom_after_the_restart_unit_by_unit(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    await put(rig)
    job = await apply(rig, servos, save=True)
    assert job["state"] == "succeeded", job
    assert set(states(job).values()) == {"done"}
    for servo, one in zip(servos, job["result"]["servos"], strict=True):
        assert (one["outcome"], one["saved"]) == ("applied", True)
        own = json(await rig.call("GET", f"/jobs/{one['job']}"))
        assert (own["kind"], own["uid"], own["state"]) == ("save", servo.uid, "succeeded")
        assert rig.sim(servo).starts == 2
        assert {key: rig.sim(servo).memory.stored(address) for key, address in ADDRESSES.items()} == RAW
        assert servo.unsaved() == []
    saves = [step for step in job["steps"] if step["name"].startswith(("write", "save"))]
    assert [step["uid"] for step in saves] == [servo.uid for servo in servos for _ in range(2)]
    times = [time for step in saves for time in (step["started_at"], step["ended_at"])]
    assert times == sorted(times), "one servo after the other"


@scene(*MIXED)
async def test_a_dry_run_says_what_would_change_and_writes_nothing(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    await put(rig, values={**GAINS, "pwm_neutral": 1500})
    job = await apply(rig, servos, dry_run=True, save=True)
    assert (job["state"], outcomes(job)) == ("succeeded", ["planned"] * 3), job
    changes = {one["key"]: one["requested"] for one in job["result"]["servos"][1]["changes"]}
    assert changes == GAINS
    assert rig.writes() == []
    assert [rig.sim(servo).starts for servo in servos] == [1, 1, 1]


@pytest.mark.parametrize(("on_anomaly", "third"), [("stop", "not_tried"), ("continue", "applied")])
@pytest.mark.parametrize(
    ("kind", "code", "outcome", "held"),
    [("clamp", "unexpected_result", "applied", 60_000), ("refuse", "refused_by_servo", "rolled_back", 1000)],
)
def test_a_value_the_servo_clamps_or_refuses_is_an_anomaly_and_that_servo_is_not_saved(
    on_anomaly: str, third: str, kind: Any, code: str, outcome: str, held: int
) -> None:
    async def scene(rig: Rig) -> None:
        servos = await in_order(rig, 3)
        row = servos[1].registers["timeout_time"].parameter
        assert memory(rig, servos[1])["timeout_time"] == 1000
        servos[1].registers["timeout_time"].parameter = row.model_copy(update={"maximum": 80_000})
        await put(rig, values={"angle_p_gain": 55, "timeout_time": 60_000})
        taken = rig.host.profiles.values_for

        def wrong_table(profile: Profile, servo: Servo) -> tuple[dict[str, Value], list[LeftOut]]:
            values, left = taken(profile, servo)
            return (values | {"timeout_time": 70_000} if servo is servos[1] else values), left

        rig.host.profiles.values_for = wrong_table  # our table says 80,000; the servo knows better
        job = await apply(rig, servos, save=True, on_anomaly=on_anomaly)
        assert (job["state"], job["error"]["code"]) == ("failed", code)
        assert outcomes(job) == ["applied", outcome, third]
        assert memory(rig, servos[1])["timeout_time"] == held
        assert rig.sim(servos[1]).starts == 1
        assert [one["saved"] for one in job["result"]["servos"]] == [True, False, third == "applied"]

    clamping = replace(THREE[1], behaviour=Behaviour(out_of_range=kind))
    play(scene, THREE[0], clamping, THREE[2])


@scene(*THREE)
async def test_a_profile_with_an_id_is_for_one_servo_and_nobody_is_named_twice(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    await put(rig, values={"servo_id": 9}, identity=True)
    uids = [servo.uid for servo in servos]
    problem(await rig.call("POST", "/profiles/gains/apply", {"uids": uids}), "conflict", 409)
    problem(await rig.call("POST", "/profiles/gains/apply", {"uids": uids[:1] * 2}), "invalid_value", 422)
    problem(await rig.call("POST", "/profiles/other/apply", {"uids": uids}), "unknown_profile", 404)
    problem(await rig.call("POST", "/profiles/gains/apply", {"uids": ["0" * 32]}), "unknown_servo", 404)
    assert rig.writes() == []
    assert (await apply(rig, servos[:1]))["state"] == "succeeded"
    assert rig.sim(servos[0]).memory.get(0x45) == 9


@scene(MIXED[0])
async def test_0x36_in_another_unit_than_the_servos_pwm_mode_gives_it_is_refused(rig: Rig, servo: Servo) -> None:
    kept = await put(rig, values={"pwm_output_range": 60}, units={"pwm_output_range": "rpm"})
    assert kept["units"] == {"pwm_output_range": "rpm"}
    job = await apply(rig, [servo])
    assert (job["state"], job["error"]["code"]) == ("failed", "invalid_value")
    assert "pwm_mode" in job["error"]["detail"]
    assert rig.writes() == []
    await put(rig, values={"pwm_output_range": 60, "pwm_mode": "speed"})
    assert (await apply(rig, [servo]))["state"] == "succeeded"
    assert (rig.sim(servo).memory.get(0x36), rig.sim(servo).memory.get(0x37)) == (60, 1)


@scene()
async def test_while_somebody_else_has_the_lease_nothing_is_applied(rig: Rig, servo: Servo) -> None:
    await put(rig)
    lease = await rig.lease()
    body = {"uids": [servo.uid]}
    problem(await rig.call("POST", "/profiles/gains/apply", body), "lease_held", 409)
    job = json(await rig.call("POST", "/profiles/gains/apply?wait=true", body, lease=lease))
    assert job["state"] == "succeeded"
    (row, *_) = rig.host.audit.rows.rows(uid=servo.uid, key="angle_p_gain")
    assert (row.entry.by, row.entry.job, row.entry.outcome) == ("test", job["id"], "applied")


@scene()
async def test_after_a_stop_values_are_written_but_nothing_is_saved(rig: Rig, servo: Servo) -> None:
    await put(rig)
    json(await rig.call("POST", "/stop"))
    job = await apply(rig, [servo], save=True)
    assert (job["state"], job["error"]["code"]) == ("failed", "stopped")
    assert memory(rig, servo) == RAW
    assert rig.sim(servo).starts == 1


@scene(*THREE)
async def test_a_cancelled_job_lets_the_servo_it_is_at_come_to_its_end_and_tells_how(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    before = memory(rig, servos[2])
    await put(rig)
    started = json(await rig.call("POST", "/profiles/gains/apply", {"uids": [one.uid for one in servos]}), 202)
    while not any(node == 12 and name == "0x2C" for node, name, _ in rig.writes()):
        await asyncio.sleep(0.0002)
    job = json(await rig.call("DELETE", f"/jobs/{started['id']}"))
    assert (job["state"], outcomes(job)) == ("cancelled", ["applied", "applied", "not_tried"])
    assert [memory(rig, servo) for servo in servos] == [RAW, RAW, before]


@scene(*THREE)
async def test_a_servo_that_is_off_is_told_before_anything_is_written(rig: Rig) -> None:
    servos = await in_order(rig, 3)
    await put(rig)
    rig.bench.power(servos[2].uid, on=False)
    await asyncio.sleep(4)
    job = await apply(rig, servos)
    assert (job["state"], job["error"]["code"]) == ("failed", "no_response")
    assert outcomes(job) == ["not_tried", "not_tried", "rejected"]
    assert rig.writes() == []

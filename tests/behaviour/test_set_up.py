"""The set-up of a servo: stored, copied into runs, and decisive for whether runs can be compared."""

from typing import Any

import pytest

from behaviour.restarting import succeeded
from behaviour.rig import Rig, json, problem
from behaviour.scene import scene
from behaviour.test_step import ready, step_test
from hornbill.lab import stored
from hornbill.lab.verdict import THRESHOLDS
from hornbill.servo.device.servo import Servo
from hornbill.store.tables import Json

NOTHING = {
    "arm_mm": None, "mass_g": None, "inertia_gm2": None, "load_nm": None, "mounting": None, "supply_v": None,
    "ambient_c": None,
}  # fmt: skip
ARM = {"arm_mm": 60.0, "mass_g": 120.0, "mounting": "vice", "supply_v": 7.4, "ambient_c": 24.0}


async def run_of(rig: Rig, path: str, lease: str, **body: object) -> Any:
    job = succeeded(await step_test(rig, path, lease, step_deg=5, dwell_s=0.5, **body))
    return json(await rig.call("GET", f"/runs/{job['result']['run']}"))


@scene()
async def test_a_set_up_is_stored_per_servo_audited_replaced_and_forgotten_with_it(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/set-up"
    assert json(await rig.call("GET", path)) == NOTHING
    assert json(await rig.call("PUT", path, ARM)) == {**NOTHING, **ARM}
    assert json(await rig.call("GET", path)) == {**NOTHING, **ARM}
    assert json(await rig.call("PUT", path, {"inertia_gm2": 0.43})) == {**NOTHING, "inertia_gm2": 0.43}
    audit = json(await rig.call("GET", "/audit?action=set_up"))
    assert [(one["before"], one["after"], one["outcome"]) for one in audit] == [
        (ARM, {"inertia_gm2": 0.43}, "applied"), ({}, ARM, "applied"),
    ]  # fmt: skip
    rig.host.store.servos.forget(servo.uid)
    assert rig.host.store.servos.get(servo.uid) is None


@scene()
async def test_an_impossible_set_up_is_refused(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/set-up"
    json(await rig.call("PUT", path, ARM))
    for wrong in (
        {"arm_mm": -1}, {"mass_g": 0}, {"inertia_gm2": 1, "arm_mm": 60}, {"mounting": "desk"}, {"supply_v": "much"},
        {"colour": 1}, {"ambient_c": 300},
    ):  # fmt: skip
        problem(await rig.call("PUT", path, wrong), "invalid_value", 422)
    problem(await rig.call("GET", f"/servos/{'0' * 32}/set-up"), "unknown_servo", 404)
    assert json(await rig.call("GET", path)) == {**NOTHING, **ARM}


@scene()
async def test_a_run_copies_the_set_up_or_has_its_own(rig: Rig) -> None:
    _, path, lease = await ready(rig)
    json(await rig.call("PUT", f"{path}/set-up", ARM))
    first = await run_of(rig, path, lease)
    own = await run_of(rig, path, lease, set_up={"load_nm": 0.5})
    json(await rig.call("PUT", f"{path}/set-up", {}))
    assert json(await rig.call("GET", f"/runs/{first['id']}"))["set_up"] == {**NOTHING, **ARM}, "it is a copy"
    assert own["set_up"] == {**NOTHING, "load_nm": 0.5}
    assert first["procedure"] == "step/1"
    assert (first["verdict"]["level"], first["verdict"]["code"]) == ("notice", "smoothing_measured")
    listed = json(await rig.call("GET", "/runs"))
    assert [one["verdict"] for one in listed] == [own["verdict"], first["verdict"]], "also without its samples"


@scene()
async def test_runs_are_comparable_if_servo_set_up_procedure_and_step_are_the_same(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    first = await run_of(rig, path, lease)
    same = await run_of(rig, path, lease)
    document = rig.host.store.runs.get(first["id"]).document
    other: dict[str, int] = {}
    for code, change in (
        ("other_set_up", {"set_up": {"mass_g": 50.0}}), ("other_procedure", {"procedure": "step/9"}),
        ("other_step", {"step_deg": 6.0}),
    ):  # fmt: skip
        changed: dict[str, Json] = {**document, **change}  # pyright: ignore[reportAssignmentType] - plain JSON
        other[code] = rig.host.store.runs.add(servo.uid, "", changed).id
    other["other_servo"] = rig.host.store.runs.add(servo.uid[::-1], "", document).id  # pyright: ignore[reportArgumentType]

    async def overlay(*numbers: int) -> tuple[bool, str | None]:
        found = json(await rig.call("GET", f"/runs/overlay?ids={','.join(map(str, numbers))}"))
        reason = found["not_comparable"]
        return found["comparable"], None if reason is None else reason["code"]

    assert await overlay(first["id"], same["id"]) == (True, None)
    assert await overlay(first["id"]) == (True, None)
    for code, number in other.items():
        assert await overlay(first["id"], number) == (False, code)


@scene()
async def test_a_run_of_an_older_version_is_shown_with_its_note(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    new = await run_of(rig, path, lease)
    older = dict(rig.host.store.runs.get(new["id"]).document)
    for added in ("procedure", "set_up", "nominal_v"):
        del older[added]
    older["warnings"] = ["A sentence."]
    number = rig.host.store.runs.add(servo.uid, "arm of 30 g", older).id
    run = json(await rig.call("GET", f"/runs/{number}"))
    assert (run["note"], run["procedure"], run["set_up"]) == ("arm of 30 g", stored.FIRST_PROCEDURE, NOTHING)
    assert [(one["text"], one["code"]) for one in run["warnings"]] == [("A sentence.", "text")]
    assert run["verdict"]["code"] == "settles", "its warning had no code"


@scene()
async def test_the_server_says_whether_scipy_is_there_and_which_thresholds_decide(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = json(await rig.call("GET", "/tuning"))
    assert (shown["package"], shown["available"], shown["install"]) == ("scipy", True, None)
    assert {one["name"]: one["value"] for one in shown["thresholds"]} == {
        name: one.value for name, one in THRESHOLDS.items()
    }

    def absent(_name: str) -> None:
        """No package is installed."""

    monkeypatch.setattr("hornbill.lab.improve.find_spec", absent)
    shown = json(await rig.call("GET", "/tuning"))
    assert (shown["available"], shown["install"]) == (False, "pip install 'hornbill[tune]'")

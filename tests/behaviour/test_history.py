"""Snapshots: taken before each change and manually, compared, and restored in whole or by row."""

import asyncio
from dataclasses import replace
from typing import Any

from behaviour.actions import by_servo_id, torque, write
from behaviour.restarting import ended, succeeded
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.domain.change import Reason
from hornbill.servo.configuration.history import configured_values
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import Change, ReadingChanged, ServoChanged
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.servos import ServoFacts
from hornbill.units import Uid

TWO = (
    Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, rom={"angle_p_gain": 60}),
    Recipe("BLA15-12U-A0", "1.200", servo_id=2, node_id=12),
)


async def patch(rig: Rig, servo: Servo, values: dict[str, Any]) -> None:
    response = json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
    assert response["outcome"] == "applied", response


async def listed(rig: Rig, servo: Servo) -> list[dict[str, Any]]:
    return json(await rig.call("GET", f"/servos/{servo.uid}/snapshots"))


async def take(rig: Rig, servo: Servo, **body: Any) -> dict[str, Any]:
    return json(await rig.call("POST", f"/servos/{servo.uid}/snapshots", body or None), 201)


async def restore(rig: Rig, servo: Servo, snapshot: dict[str, Any], **body: Any) -> dict[str, Any]:
    path = f"/servos/{servo.uid}/snapshots/{snapshot['id']}/restore"
    return json(await rig.call("POST", path, body or None))


async def compare(rig: Rig, left: str, right: str, **more: str) -> dict[str, Any]:
    return json(await rig.http.get("/compare", params={"left": left, "right": right, **more}))


@scene()
async def test_a_snapshot_is_stored_before_each_change_and_once_of_an_unchanged_servo(rig: Rig, servo: Servo) -> None:
    made = [await rig.host.history.take(rig.host.requests, servo, reason=Reason("again"), by="me") for _ in range(3)]
    assert len({one.id for one in made}) == 1
    lease, path = await rig.lease(), f"/servos/{servo.uid}/parameters"
    for body in ({"values": {"angle_p_gain": 45}, "dry_run": True}, {"values": {"angle_p_gain": 40}}):
        json(await rig.call("PATCH", path, body, lease=lease))
    assert [one["id"] for one in await listed(rig, servo)] == [made[0].id], "neither writes"
    await write(rig, servo, lease, angle_p_gain=45)
    assert [one["id"] for one in await listed(rig, servo)] == [made[0].id], "it was unchanged before"
    await write(rig, servo, lease, angle_p_gain=50, angle_d_gain=31, smoothing=True)
    newest, oldest = await listed(rig, servo)
    assert newest["reason"] == "before a change of angle_p_gain and 1 more", "smoothing was on"
    default = servo.registers["angle_p_gain"].parameter.default
    assert (oldest["values"]["angle_p_gain"], newest["values"]["angle_p_gain"]) == (default, 45)
    assert newest["rom"]["angle_p_gain"] == default
    assert (newest["automatic"], newest["by"], newest["model"], newest["firmware"]) == (
        True, "test", "BLA21-06U-A0", "1.300",
    )  # fmt: skip
    assert set(newest["values"]) == {key for key, one in servo.registers.items() if one.parameter.rom}
    assert newest["id"] > oldest["id"]


@scene()
async def test_a_manual_snapshot_is_always_stored_reads_stale_values_and_can_be_deleted(rig: Rig, servo: Servo) -> None:
    first = await take(rig, servo)
    servo.forget("angle_p_gain")
    assert "angle_p_gain" not in configured_values(servo)
    second = await take(rig, servo, reason="before the fair")
    assert [one["id"] for one in await listed(rig, servo)] == [second["id"], first["id"]]
    assert (first["reason"], second["reason"], second["automatic"]) == ("manual", "before the fair", False)
    assert second["values"] == first["values"]
    path = f"/servos/{servo.uid}/snapshots/{second['id']}"
    assert json(await rig.call("GET", path)) == second
    assert (await rig.call("DELETE", path)).status_code == 204
    for verb in ("GET", "DELETE"):
        problem(await rig.call(verb, path), "unknown_snapshot", 404)
    deleted, taken = json(await rig.call("GET", "/audit?action=snapshot"))[:2]
    assert (taken["after"], taken["detail"], taken["by"]) == (second["id"], "before the fair", "no lease")
    assert (deleted["action"], deleted["outcome"], deleted["before"]) == ("snapshot", "dropped", second["id"])
    rig.bench.power(servo.uid, False)
    await until(lambda: not servo.online, 10)
    problem(await rig.call("POST", f"/servos/{servo.uid}/snapshots"), "no_response", 504)
    assert [one["id"] for one in await listed(rig, servo)] == [first["id"]]


@scene(*TWO)
async def test_a_snapshot_of_another_servo_is_unknown_and_an_invalid_side_lists_the_valid_forms(rig: Rig) -> None:
    one, other = await rig.ready(2)
    made = await take(rig, one)
    for snapshot in (made["id"], 10**30, -1, 0):
        path = f"/servos/{other.uid}/snapshots/{snapshot}"
        for verb, end in (("GET", ""), ("DELETE", ""), ("POST", "/restore")):
            problem(await rig.call(verb, path + end), "unknown_snapshot", 404)
    assert len(await listed(rig, one)) == 1
    problem(await rig.call("GET", f"/servos/{'0' * 32}/snapshots"), "unknown_servo", 404)

    async def rejected(left: str, code: str, status: int) -> str:
        response = await rig.http.get("/compare", params={"left": left, "right": f"rom:{one.uid}"})
        return problem(response, code, status)["detail"]

    for left in ("", "servo", "servo:1", "snapshot:x", "profile:", "profile:a/b", "default:", "default:BLA", "ram:1"):
        detail = await rejected(left, "invalid_value", 422)
        assert "snapshot-rom:ID" in detail or "BLA21-06U-A0" in detail
    await rejected("profile:none", "unknown_profile", 404)
    await rejected("snapshot:77", "unknown_snapshot", 404)


@scene(connect=False)
async def test_a_known_offline_servo_has_snapshots_and_rom(rig: Rig) -> None:
    uid = Uid("ab" * 16)
    rig.host.store.servos.seen(uid, ServoFacts(model="BLA21-06U-A0", firmware=1300))
    rig.host.store.servos.put_rom(uid, {"angle_p_gain": 33})
    rig.host.store.snapshots.add(
        uid, reason="long ago", by="me", automatic=False, model="BLA21-06U-A0", firmware=1300,
        schema_revision="x", ram={"angle_p_gain": 44}, rom={},
    )  # fmt: skip
    found = json(await rig.call("GET", f"/servos/{uid}/snapshots"))
    assert [one["values"] for one in found] == [{"angle_p_gain": 44}]
    differences = (await compare(rig, f"rom:{uid}", f"snapshot:{found[0]['id']}"))["differences"]
    gain = next(one for one in differences if one["key"] == "angle_p_gain")
    assert (gain["left"], gain["right"]) == (33, 44)
    problem(await rig.call("GET", f"/compare?left=servo:{uid}&right=rom:{uid}"), "no_response", 504)


@scene()
async def test_a_restore_leaves_identity_and_torque_alone(rig: Rig, servo: Servo) -> None:
    made = await take(rig, servo)
    await patch(rig, servo, {"angle_p_gain": 45, "smoothing": False, "servo_id": 9, "torque_mode": "off"})
    differences = (await compare(rig, f"snapshot:{made['id']}", f"servo:{servo.uid}"))["differences"]
    assert {one["key"] for one in differences} == {"angle_p_gain", "smoothing", "torque_mode"}
    planned = await restore(rig, servo, made, dry_run=True)
    assert planned["outcome"] == "planned"
    assert servo.raw("angle_p_gain") == 45
    response = await restore(rig, servo, made)
    assert response["outcome"] == "applied"
    verdicts = {one["key"]: one["verdict"] for one in response["changes"]}
    assert {key for key, verdict in verdicts.items() if verdict == "applied"} == {"angle_p_gain", "smoothing"}
    assert {one["key"] for one in response["left_out"]} == {"origin", "servo_id", "node_id", "torque_mode"}
    memory = rig.sim(servo).memory
    assert (memory.get(0x45), memory.get(0x20)) == (9, 1)
    differences = (await compare(rig, f"snapshot:{made['id']}", f"servo:{servo.uid}"))["differences"]
    assert {one["key"] for one in differences} == {"torque_mode"}
    undo = (await listed(rig, servo))[0]
    assert (undo["values"]["angle_p_gain"], undo["reason"]) == (45, f"restore of snapshot {made['id']}")


@scene()
async def test_named_rows_are_restored_including_identity(rig: Rig, servo: Servo) -> None:
    made = await take(rig, servo)
    await patch(rig, servo, {"angle_p_gain": 45, "smoothing": False, "servo_id": 9})
    response = await restore(rig, servo, made, keys=["servo_id"])
    assert [one["key"] for one in response["changes"]] == ["servo_id"]
    assert (servo.raw("servo_id"), servo.raw("angle_p_gain")) == (1, 45)
    path = f"/servos/{servo.uid}/snapshots/{made['id']}/restore"
    problem(await rig.call("POST", path, {"keys": ["no_such_row"]}), "unknown_parameter", 404)
    problem(await rig.call("POST", path, {"keys": ["boot_loader"]}), "forbidden_parameter", 403)
    problem(await rig.call("POST", path, {"keys": ["current_angle"]}), "invalid_value", 422)
    stale = await rig.call("POST", path, None, **{"If-Match": '"old"'})
    problem(stale, "stale_revision", 412)
    assert servo.raw("angle_p_gain") == 45


@scene()
async def test_a_restore_never_turns_torque_on_nor_reverses_under_torque(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    await torque(rig, servo, "on", lease)
    made = await take(rig, servo)
    assert made["values"]["torque_mode"] == "on"
    await torque(rig, servo, "off")
    path = f"/servos/{servo.uid}/snapshots/{made['id']}/restore"
    body = {"keys": ["torque_mode", "smoothing"]}
    response = json(await rig.call("POST", path, body, lease=lease))
    assert "never turns torque on" in response["left_out"][0]["why"]
    assert rig.sim(servo).memory.get(0x20) == 1

    await write(rig, servo, lease, reverse=True, angle_p_gain=45)
    await torque(rig, servo, "on", lease)
    problem(await rig.call("POST", path, None, lease=lease), "torque_on", 409)
    assert servo.raw("angle_p_gain") == 45


@scene()
async def test_defaults_and_profiles_are_compared_and_copied(rig: Rig, servo: Servo) -> None:
    default = servo.registers["angle_p_gain"].parameter.default
    await patch(rig, servo, {"angle_p_gain": 45, "smoothing": False})
    json(await rig.call("PUT", "/profiles/soft", {"values": {"angle_p_gain": 30}}), 201)
    found = await compare(rig, f"servo:{servo.uid}", "profile:soft")
    first = next(one for one in found["differences"] if one["key"] == "angle_p_gain")
    assert (first["left"], first["right"]) == (45, 30)
    assert all(not one["right_has"] for one in found["differences"] if one["key"] != "angle_p_gain")
    found = await compare(rig, "default:BLA21-06U-A0@1.300", f"servo:{servo.uid}")
    assert {one["key"] for one in found["differences"]} == {"angle_p_gain", "smoothing"}
    response = await rig.call("POST", f"/servos/{servo.uid}/copy", {"from": "profile:soft"})
    assert [one["after"] for one in json(response)["changes"]] == [30]
    json(await rig.call("POST", f"/servos/{servo.uid}/copy", {"from": "default:BLA21-06U-A0@1.300"}))
    assert (servo.raw("angle_p_gain"), servo.raw("smoothing")) == (default, 1)


STORED = {
    "soft_start": 1, "torque_mode": 0, "torque_limit_cw": 37, "torque_limit_ccw": -37, "speed_torque_control": 1,
}  # fmt: skip


@scene(replace(PLAIN, rom=STORED, angle_deg=120.0))
async def test_temporary_values_of_soft_start_are_never_configuration(rig: Rig) -> None:
    wrong: list[dict[str, int]] = []

    def check(change: Change) -> None:
        if isinstance(change, ServoChanged | ReadingChanged):
            for servo in rig.host.fleet.all():
                keys = servo.soft_start_rows.keys() & STORED.keys()
                seen = {key: raw for key, raw in configured_values(servo).items() if key in keys}
                if servo.identified and any(STORED[key] != raw for key, raw in seen.items()):
                    wrong.append(seen)

    rig.host.hub.subscribe(check)
    await until(lambda: any(one.state is State.SOFT_START for one in rig.host.fleet.all()), 20)
    servo = rig.host.fleet.all()[0]
    assert servo.raw("torque_limit_cw") != 37
    shown = problem(await rig.call("POST", f"/servos/{servo.uid}/snapshots"), "busy", 409)
    assert "soft start" in shown["detail"]
    await rig.ready()
    made = await take(rig, servo)
    assert (made["values"]["torque_limit_cw"], made["values"]["speed_torque_control"]) == (37, True)
    assert wrong == []


@scene(replace(PLAIN, servo_id=7, rom={"angle_p_gain": 61, "smoothing": 0, "soft_start": 0}))
async def test_after_lost_rom_the_last_snapshot_restores_the_servo(rig: Rig, servo: Servo) -> None:
    made = await take(rig, servo)
    sim = rig.sim(servo)
    rig.bench.power(servo.uid, False)
    sim.memory.rom_sound = False
    await asyncio.sleep(5)
    rig.bench.power(servo.uid, True)
    await until(lambda: servo.rom_lost and servo.state is State.READY)
    assert servo.raw("angle_p_gain") != 61
    lease = await rig.lease()
    body = {"type": "angle", "value": 0}
    problem(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease), "configuration_lost", 409)
    path = f"/servos/{servo.uid}/snapshots/{made['id']}/restore"
    response = json(await rig.call("POST", path, {"identity": True, "save": True}, lease=lease))
    assert response["outcome"] == "applied", response
    succeeded(await ended(rig, response["job"]))
    assert not servo.rom_lost
    differ = (await compare(rig, f"snapshot:{made['id']}", f"rom:{servo.uid}", identity="true"))["differences"]
    assert {one["key"] for one in differ} <= {"torque_mode"}
    assert (sim.memory.stored(0x2C), sim.memory.stored(0x45), sim.memory.stored(0x46)) == (61, 7, 11)


@scene(*TWO)
async def test_a_copy_from_another_model_lists_every_row_that_does_not_fit(rig: Rig) -> None:
    there, here = by_servo_id(await rig.ready(2))
    body: dict[str, Any] = {"from": f"servo:{there.uid}"}
    shown = problem(await rig.call("POST", f"/servos/{here.uid}/copy", body), "out_of_range", 422)
    assert {one["code"] for one in shown["problems"]} == {"out_of_range"}
    bad = {one["key"] for one in shown["problems"]}
    assert len(bad) > 1
    assert rig.writes() == []
    body["keys"] = [
        key for key, one in here.registers.items()
        if one.parameter.rom and not one.parameter.identity and key not in {*bad, "torque_mode"}
    ]  # fmt: skip
    assert json(await rig.call("POST", f"/servos/{here.uid}/copy", body))["outcome"] == "applied"
    differ = (await compare(rig, f"servo:{there.uid}", f"servo:{here.uid}"))["differences"]
    assert {one["key"] for one in differ if one["left_has"] and one["right_has"]} <= {*bad, "torque_mode"}
    assert here.servo_id == 2

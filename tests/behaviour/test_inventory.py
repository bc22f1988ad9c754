"""Every servo ever met, on the bus or not: listed, labelled, downloaded and forgotten."""

import asyncio
import csv
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.servos import ServoFacts

ONE = replace(PLAIN, uid=bytes(range(16)), serial=123, rom={"angle_limit_cw": 600, "torque_mode": 1})
TWO = Recipe("BLA15-12U-A0", "1.300", servo_id=2, node_id=12, uid=bytes(range(16, 32)), serial=456)


async def listed(rig: Rig, query: str = "") -> list[dict[str, Any]]:
    return list(json(await rig.call("GET", f"/inventory{query}")))


async def off(rig: Rig, uid: str) -> None:
    rig.bench.power(rig.host.fleet.get(uid).uid, False)
    await asyncio.sleep(5)


@scene(ONE)
async def test_it_has_who_a_servo_is_what_it_last_held_and_when_it_was_seen(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(60)
    one = json(await rig.call("GET", f"/inventory/{servo.uid}"))
    assert (one["model"], one["serial"], one["firmware"]) == ("BLA21-06U-A0", "61-000123", "1.300")
    assert (one["node_id"], one["servo_id"], one["online"]) == (11, 1, True)
    assert (one["rom"]["angle_limit_cw"], one["rom"]["torque_mode"]) == (60.0, "off")
    assert one["last_seen"] - one["first_seen"] > 30
    assert (one["snapshots"], one["drift"]) == (0, [])


def test_one_that_is_off_stays_listed_over_a_restart_of_the_server_and_takes_a_nickname(tmp_path: Path) -> None:
    async def first(rig: Rig) -> str:
        return str((await rig.ready(2))[0].uid)

    async def later(rig: Rig) -> None:
        await rig.ready()
        shown = await listed(rig)
        assert [one["online"] for one in shown] == [True, False]  # the one seen last first
        uid = shown[1]["uid"]
        assert shown[1]["rom"]["angle_limit_cw"] == 60.0
        lease = await rig.lease()
        named = json(await rig.call("PATCH", f"/inventory/{uid}", {"label": "  Spare "}, lease=lease))
        assert named["label"] == "Spare"
        assert rig.host.store.audit.rows(action="label")[0].entry.by == "test"
        problem(await rig.call("GET", f"/servos/{uid}"), "unknown_servo", 404)  # it was not on this bus yet

    where = str(tmp_path / "data")
    play(first, ONE, TWO, store=where)
    play(later, TWO, store=where)


def test_notes_on_a_servo_outlive_the_server_and_are_audited_and_a_nickname_leaves_them_alone(tmp_path: Path) -> None:
    async def first(rig: Rig) -> str:
        uid = (await rig.ready())[0].uid
        assert json(await rig.call("GET", f"/inventory/{uid}"))["notes"] == ""
        lease = await rig.lease()
        said = {"notes": "  New gears.\nLeft play: 0.2°  "}
        assert json(await rig.call("PATCH", f"/inventory/{uid}", said, lease=lease))["notes"] == said["notes"].strip()
        await rig.call("PATCH", f"/inventory/{uid}", {"label": "Spare"})
        named = json(await rig.call("PATCH", f"/inventory/{uid}", {"label": "Spare"}))
        assert (named["label"], named["notes"]) == ("Spare", said["notes"].strip())
        (row,) = rig.host.store.audit.rows(action="notes")
        assert (row.entry.by, row.entry.before, row.entry.after) == ("test", "", said["notes"].strip())
        problem(await rig.call("PATCH", f"/inventory/{uid}", {"notes": "x" * 4001}), "invalid_value", 422)
        return str(uid)

    async def later(rig: Rig) -> None:
        (one,) = await listed(rig)
        assert (one["label"], one["notes"]) == ("Spare", "New gears.\nLeft play: 0.2°")
        assert json(await rig.call("PATCH", f"/inventory/{one['uid']}", {"notes": ""}))["notes"] == ""
        assert (await listed(rig))[0]["label"] == "Spare"

    where = str(tmp_path / "data")
    play(first, ONE, store=where)
    play(later, ONE, store=where)


@scene(ONE, TWO)
async def test_it_is_filtered_by_model_nickname_and_part_of_the_serial(rig: Rig) -> None:
    one, two = sorted(await rig.ready(2), key=lambda servo: servo.servo_id or 0)
    json(await rig.call("PATCH", f"/inventory/{two.uid}", {"label": "Rudder"}))
    for query, expected in {
        "?model=BLA15-12U-A0": [two.uid], "?label=Rudder": [two.uid], "?q=123": [one.uid], "?q=61-0": [one.uid],
        "?q=999": [], "?model=BLA15-12U-A0&q=123": [],
    }.items():  # fmt: skip
        assert [found["uid"] for found in await listed(rig, query)] == expected, query


@scene(ONE)
async def test_the_download_has_a_line_a_servo_and_a_column_a_row_with_its_unit(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PATCH", f"/inventory/{servo.uid}", {"label": '=HYPERLINK("x"), "left"'}))
    answer = await rig.call("GET", "/inventory.csv")
    assert answer.headers["content-type"].startswith("text/csv")
    assert "inventory.csv" in answer.headers["content-disposition"]
    (line,) = csv.DictReader(io.StringIO(answer.text))
    assert (line["uid"], line["online"], line["angle_limit_cw [°]"]) == (servo.uid, "true", "60.0")
    assert (line["torque_mode"], line["serial"]) == ("off", "61-000123")
    assert line["label"] == '\'=HYPERLINK("x"), "left"'
    assert line["first_seen"].endswith("+00:00")


@scene(ONE)
async def test_one_that_is_on_the_bus_is_not_forgotten(rig: Rig, servo: Servo) -> None:
    refused = problem(await rig.call("DELETE", f"/inventory/{servo.uid}"), "busy", 409)
    assert "off the bus" in refused["detail"]
    assert len(await listed(rig)) == 1


@scene(ONE)
async def test_one_that_is_forgotten_comes_back_as_new_and_is_polled_and_found_again(rig: Rig, servo: Servo) -> None:
    uid = servo.uid
    json(await rig.call("PATCH", f"/servos/{uid}", {"label": "Rudder"}))
    json(await rig.call("POST", f"/servos/{uid}/snapshots", {"reason": "by hand"}), 201)
    await off(rig, uid)
    assert (await rig.call("DELETE", f"/inventory/{uid}", lease=await rig.lease())).status_code == 204
    assert await listed(rig) == []
    assert json(await rig.call("GET", "/servos")) == []
    problem(await rig.call("GET", f"/inventory/{uid}"), "unknown_servo", 404)
    problem(await rig.call("DELETE", f"/inventory/{uid}"), "unknown_servo", 404)
    entry = rig.host.store.audit.rows(action="forget")[0].entry
    assert (entry.by, entry.uid, entry.before) == ("test", uid, "Rudder")
    assert (servo.model, servo.serial, servo.firmware_text, servo.title) == (None, None, None, f"servo {uid[:8]}")
    rig.bench.power(uid, True)
    back = (await rig.ready())[0]
    await asyncio.sleep(5)
    assert (back.uid, back.label) == (uid, "")
    (one,) = await listed(rig)
    assert (one["snapshots"], one["rom"]["angle_limit_cw"]) == (1, 60.0)  # its history was not asked for
    reading = json(await rig.call("GET", f"/servos/{uid}/parameters"))["parameters"]["current_voltage"]
    assert reading["age_s"] < 3
    assert rig.events("drift") == []


@scene(ONE)
async def test_its_history_goes_with_it_when_asked_for(rig: Rig, servo: Servo) -> None:
    for _ in range(3):
        json(await rig.call("POST", f"/servos/{servo.uid}/snapshots", {"reason": "by hand"}), 201)
    await off(rig, servo.uid)
    assert (await rig.call("DELETE", f"/inventory/{servo.uid}?history=true")).status_code == 204
    assert rig.host.store.snapshots.of(servo.uid) == []
    assert "3 snapshots" in rig.host.store.audit.rows(action="forget")[0].entry.detail


@scene(ONE)
async def test_of_an_unknown_model_there_is_what_every_model_has_in_common(rig: Rig, servo: Servo) -> None:
    rig.host.store.servos.seen(servo.uid, ServoFacts(model="BLA99-99U-Z9"))
    one = json(await rig.call("GET", f"/inventory/{servo.uid}"))
    assert one["rom"]["angle_p_gain"] == 40
    assert one["serial"] == "61-000123"

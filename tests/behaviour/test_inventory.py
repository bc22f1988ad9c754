"""Inventory: all known servos, on the bus or not: listed, labelled, downloaded and removed."""

import asyncio
import csv
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

from behaviour.actions import by_servo_id
from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.servos import ServoFacts

ONE = replace(PLAIN, uid=bytes(range(16)), serial=123, rom={"angle_limit_cw": 600, "torque_mode": 1})
TWO = Recipe("BLA15-12U-A0", "1.300", servo_id=2, node_id=12, uid=bytes(range(16, 32)), serial=456)


async def listed(rig: Rig, query: str = "") -> list[dict[str, Any]]:
    return list(json(await rig.call("GET", f"/inventory{query}")))


async def shown(rig: Rig, uid: str) -> dict[str, Any]:
    return json(await rig.call("GET", f"/inventory/{uid}"))


async def change(rig: Rig, uid: str, lease: str | None = None, **body: str) -> dict[str, Any]:
    return json(await rig.call("PATCH", f"/inventory/{uid}", body, lease=lease))


@scene(ONE)
async def test_an_entry_has_identity_rom_values_and_when_the_servo_was_seen(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(60)
    one = await shown(rig, servo.uid)
    assert (one["model"], one["serial"], one["firmware"]) == ("BLA21-06U-A0", "61-000123", "1.300")
    assert (one["node_id"], one["servo_id"], one["online"]) == (11, 1, True)
    assert (one["rom"]["angle_limit_cw"], one["rom"]["torque_mode"]) == (60.0, "off")
    assert one["last_seen"] - one["first_seen"] > 30
    assert (one["snapshots"], one["drift"]) == (0, [])
    assert (one["bench"], one["bench_seen_at"]) == (rig.host.bench, one["last_seen"])
    rig.host.store.servos.seen(servo.uid, ServoFacts(model="BLA99-99U-Z9"))
    one = await shown(rig, servo.uid)
    assert (one["rom"]["angle_p_gain"], one["serial"]) == (40, "61-000123"), "rows that all models have"


def test_entries_labels_and_notes_are_stored_over_a_restart_of_the_server(tmp_path: Path) -> None:
    notes = "New gears.\nLeft play: 0.2°"

    async def first(rig: Rig) -> None:
        uid = by_servo_id(await rig.ready(2))[0].uid
        assert (await shown(rig, uid))["notes"] == ""
        lease = await rig.lease()
        assert (await change(rig, uid, lease, notes=f"  {notes}  "))["notes"] == notes
        for _ in range(2):
            named = await change(rig, uid, lease, label="  Spare ")
            assert (named["label"], named["notes"]) == ("Spare", notes), "a label leaves the notes alone"
        (row,) = rig.host.store.audit.rows(action="notes")
        assert (row.entry.by, row.entry.before, row.entry.after) == ("test", "", notes)
        problem(await rig.call("PATCH", f"/inventory/{uid}", {"notes": "x" * 4001}), "invalid_value", 422)

    async def later(rig: Rig) -> None:
        await rig.ready()
        entries = await listed(rig)
        assert [one["online"] for one in entries] == [True, False]  # last seen first
        one = entries[1]
        assert (one["label"], one["notes"], one["rom"]["angle_limit_cw"]) == ("Spare", notes, 60.0)
        problem(await rig.call("GET", f"/servos/{one['uid']}"), "unknown_servo", 404)  # not seen on this bus
        lease = await rig.lease()
        assert (await change(rig, one["uid"], lease, label="Old"))["label"] == "Old"
        assert rig.host.store.audit.rows(action="label")[0].entry.by == "test"
        assert (await change(rig, one["uid"], notes=""))["notes"] == ""
        assert (await shown(rig, one["uid"]))["label"] == "Old"

    play(first, ONE, TWO, store=str(tmp_path / "data"))
    play(later, TWO, store=str(tmp_path / "data"))


@scene(ONE, TWO)
async def test_it_is_filtered_by_model_label_and_part_of_the_serial(rig: Rig) -> None:
    one, two = by_servo_id(await rig.ready(2))
    await change(rig, two.uid, label="Rudder")
    for query, expected in {
        "?model=BLA15-12U-A0": [two.uid], "?label=Rudder": [two.uid], "?q=123": [one.uid], "?q=61-0": [one.uid],
        "?q=999": [], "?q=uDDe": [two.uid], f"?q={two.uid[:8]}": [two.uid], "?q=servo": [],
        "?model=BLA15-12U-A0&q=123": [],
    }.items():  # fmt: skip
        assert [found["uid"] for found in await listed(rig, query)] == expected, query


@scene(ONE)
async def test_the_csv_has_a_line_for_each_servo_and_a_column_with_unit_for_each_row(rig: Rig, servo: Servo) -> None:
    await change(rig, servo.uid, label='=HYPERLINK("x"), "left"')
    response = await rig.call("GET", "/inventory.csv")
    assert response.headers["content-type"].startswith("text/csv")
    assert "inventory.csv" in response.headers["content-disposition"]
    (line,) = csv.DictReader(io.StringIO(response.text))
    assert (line["uid"], line["online"], line["angle_limit_cw [°]"]) == (servo.uid, "true", "60.0")
    assert (line["torque_mode"], line["serial"]) == ("off", "61-000123")
    assert line["label"] == '\'=HYPERLINK("x"), "left"'
    assert line["first_seen"].endswith("+00:00")


@scene(ONE)
async def test_a_servo_can_be_removed_off_the_bus_and_returns_as_new_with_its_history(rig: Rig, servo: Servo) -> None:
    uid = servo.uid
    problem(await rig.call("DELETE", f"/inventory/{uid}"), "busy", 409)
    assert len(await listed(rig)) == 1
    json(await rig.call("PATCH", f"/servos/{uid}", {"label": "Rudder"}))
    json(await rig.call("POST", f"/servos/{servo.uid}/snapshots", {"reason": "manual"}), 201)
    rig.bench.power(uid, False)
    await asyncio.sleep(5)
    assert (await rig.call("DELETE", f"/inventory/{uid}", lease=await rig.lease())).status_code == 204
    assert await listed(rig) == []
    assert json(await rig.call("GET", "/servos")) == []
    for verb in ("GET", "DELETE"):
        problem(await rig.call(verb, f"/inventory/{uid}"), "unknown_servo", 404)
    entry = rig.host.store.audit.rows(action="forget")[0].entry
    assert (entry.by, entry.uid, entry.before) == ("test", uid, "Rudder")
    assert (servo.model, servo.serial, servo.firmware_text, servo.title) == (None, None, None, f"servo {uid[:8]}")
    rig.bench.power(uid, True)
    back = (await rig.ready())[0]
    await asyncio.sleep(5)
    assert (back.uid, back.label) == (uid, "")
    (one,) = await listed(rig)
    assert (one["snapshots"], one["rom"]["angle_limit_cw"]) == (1, 60.0)
    reading = json(await rig.call("GET", f"/servos/{uid}/parameters"))["parameters"]["current_voltage"]
    assert reading["age_s"] < 3
    assert rig.events("drift") == []
    json(await rig.call("POST", f"/servos/{uid}/snapshots", {"reason": "manual"}), 201)
    rig.bench.power(uid, False)
    await asyncio.sleep(5)
    assert (await rig.call("DELETE", f"/inventory/{uid}?history=true")).status_code == 204
    assert rig.host.store.snapshots.of(uid) == []
    assert "2 snapshots" in rig.host.store.audit.rows(action="forget")[0].entry.detail

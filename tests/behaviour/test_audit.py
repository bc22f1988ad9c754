"""The audit: client, action and outcome of each change; listed newest first, filtered, and as CSV."""

import asyncio
import csv
import io
from typing import Any

from behaviour.rig import Rig, json, play, problem
from behaviour.scene import scene
from hornbill.domain.note import Note
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Uid

TWO = tuple(Recipe("BLA21-06U-A0", "1.300", servo_id=n, node_id=10 + n) for n in (1, 2))


async def audit(rig: Rig, **wanted: Any) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json(await rig.http.get("/audit", params=wanted))
    return found


def deed(row: dict[str, Any]) -> tuple[str, str, str]:
    return row["by"], row["action"], row["outcome"]


@scene()
async def test_a_change_records_client_values_and_outcome(rig: Rig, servo: Servo) -> None:
    lease, foreign = await rig.lease(), "ab" * 16
    body = {"values": {"angle_limit_cw": 60.5}}
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body, lease=lease))
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "left ear"}, lease=lease))
    json(await rig.call("PUT", f"/allocations/{foreign}", {"node_id": 77}))
    json(await rig.call("DELETE", f"/allocations/{foreign}", lease=lease))
    json(await rig.call("PUT", "/bus/allocator", {"mode": "off"}, lease=lease))
    found = [(*deed(row), row["uid"], row["before"], row["after"]) for row in (await audit(rig))[:5]]
    assert found == [
        ("test", "allocator", "applied", None, "on", "off"),
        ("test", "forget", "applied", foreign, 77, None),
        ("no lease", "pin", "applied", foreign, None, 77),
        ("test", "label", "applied", servo.uid, "", "left ear"),
        ("test", "write", "applied", servo.uid, 179.9, 60.5),
    ]
    assert (await audit(rig, key="angle_limit_cw"))[0]["requested"] == 60.5


@scene(connect=False)
async def test_rows_are_newest_first_and_filters_combine(rig: Rig) -> None:
    one, other = Uid("1" * 32), Uid("2" * 32)
    for n in range(30):
        action, uid = "write" if n % 2 else "torque", one if n % 3 else other
        rig.host.audit.note(NewAuditEntry("me", action, "applied", uid, f"k{n}"))
    rows = await audit(rig)
    assert [row["key"] for row in rows] == [f"k{n}" for n in reversed(range(30))]
    wanted = {"uid": other, "action": "write", "since": rows[-1]["at"], "before_id": rows[2]["id"], "limit": 4}
    assert [row["key"] for row in await audit(rig, **wanted)] == ["k21", "k15", "k9", "k3"]
    assert [row["key"] for row in await audit(rig, key="k7")] == ["k7"]
    assert await audit(rig, since=rows[0]["at"] + 1) == []
    for wrong in ({"limit": 0}, {"limit": 1001}, {"before_id": 0}, {"since": "nan"}, {"key": "a\0b"}):
        problem(await rig.http.get("/audit", params=wrong), "invalid_value", 422)


@scene(connect=False)
async def test_the_csv_file_contains_all_rows_and_no_formulas(rig: Rig) -> None:
    rig.host.audit.note(
        NewAuditEntry(
            "=cmd|x", "label", "applied", Uid("1" * 32), after='@evil, "quoted"\nline', notes=Note.words(" \t+1")
        )
    )
    rig.host.audit.note(*(NewAuditEntry("me", "write", "applied", key="k", before=-5, after=n) for n in range(2345)))
    rig.host.audit.note(NewAuditEntry("me", "torque", "applied", after=True, notes=Note.words("−5 °C")))
    response = await rig.http.get("/audit.csv")
    assert response.headers["content-type"] == "text/csv; charset=utf-8"
    assert 'filename="hornbill-audit.csv"' in response.headers["content-disposition"]
    rows = list(csv.DictReader(io.StringIO(response.text)))
    assert len(rows) == 2347
    assert (rows[0]["after"], rows[0]["detail"]) == ("true", "−5 °C")
    assert [row["after"] for row in rows[1:-1]] == [str(n) for n in reversed(range(2345))]
    assert rows[1]["before"] == "-5"
    last = rows[-1]
    assert (last["by"], last["after"], last["detail"]) == ("'=cmd|x", '\'@evil, "quoted"\nline', "' \t+1")
    assert rows[0]["time"].endswith("Z")
    only = list(csv.DictReader(io.StringIO((await rig.http.get("/audit.csv", params={"action": "torque"})).text)))
    assert [row["action"] for row in only] == ["torque"]


@scene(*TWO)
async def test_a_stop_and_its_clearing_are_recorded_once_and_after_it_was_sent(rig: Rig) -> None:
    servos = await rig.ready(2)
    order: list[str] = []
    add = rig.host.store.audit.add

    def slow(entries: Any) -> None:
        rows = list(entries)
        if rows[0].action == "stop" and rows[0].outcome == "pressed":
            order.append("audit")
            order.extend(f"stopped {one.node_id}" for one in servos if rig.sim(one).memory.get(0x20) == 2)
        add(rows)

    rig.host.store.audit.add = slow  # pyright: ignore[reportAttributeAccessIssue]
    rig.host.stop.now("brake", "Ann", "smoke")
    assert order == []
    await rig.call("POST", "/stop?by=Ann", {"mode": "brake", "reason": "smoke"})  # the page presses over two channels
    await rig.call("DELETE", "/stop?by=Bob")
    await asyncio.sleep(1)
    assert order == ["audit", "stopped 11", "stopped 12"]
    cleared, pressed = await audit(rig, action="stop")
    assert deed(pressed) == ("Ann", "stop", "pressed")
    assert pressed["requested"] == "brake"
    assert pressed["detail"].startswith("smoke. 2 of 2 acknowledged within ")
    assert deed(cleared) == ("Bob", "stop", "cleared")
    assert cleared["detail"].startswith("Stop of Ann cleared.")


def test_a_stop_is_recorded_when_unacknowledged_and_the_server_ends() -> None:
    async def scene(rig: Rig) -> list[tuple[str, str]]:
        await rig.ready()
        await rig.cable.unplug()
        rig.host.stop.now("off", "Ann", "")
        await rig.host.close()
        return [(row.entry.by, row.entry.detail) for row in rig.host.store.audit.rows(action="stop")]

    assert play(scene) == [("Ann", "0 of 1 acknowledged.")]


@scene()
async def test_leases_taken_released_and_expired_are_recorded(rig: Rig) -> None:
    await rig.ready()
    lease = await rig.lease()
    await rig.call("DELETE", f"/leases/{lease}")
    await rig.lease(ttl_s=0.5)
    await asyncio.sleep(2)
    rows = await audit(rig, action="lease")
    assert [row["outcome"] for row in reversed(rows)] in (
        ["taken", "released", "taken", "expired"], ["taken", "taken", "released", "expired"],
    )  # fmt: skip
    assert {row["by"] for row in rows} == {"test"}
    assert rows[0]["detail"] == "The lease of test expired."


@scene()
async def test_a_failing_audit_blocks_nothing_and_is_reported_once(rig: Rig, servo: Servo) -> None:

    def full(_entries: Any) -> None:
        raise OSError("disk full")

    rig.host.store.audit.add = full  # pyright: ignore[reportAttributeAccessIssue]
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "a"}))
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(1)
    assert rig.sim(servo).memory.get(0x20) == 1
    assert len(rig.events("store_failed")) == 1

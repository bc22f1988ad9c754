"""Health: alive, ready and its parts; a busy computer is named before a servo is declared dead."""

import asyncio
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from httpx import Response

from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from behaviour.secured import GIVEN, SecuredServer, secured
from behaviour.test_metrics import of, scrape
from behaviour.test_store_stalled import disk_full
from hornbill import resources
from hornbill.servo.device.servo import Servo
from hornbill.servo.doctor.server import DISK_FULL, DISK_LOW
from hornbill.store.audit import NewAuditEntry
from jumping_clock import stall

ROOT = "http://127.0.0.1"


async def ready(rig: Rig) -> tuple[int, Any]:
    """Status and body of /ready."""
    response: Response = await rig.http.get(f"{ROOT}/ready")
    return response.status_code, response.json()


async def findings(rig: Rig) -> list[str]:
    """Codes of the doctor's findings on the server."""
    return [one["code"] for one in json(await rig.call("GET", "/bus/doctor")) if not one["node_ids"]]


def apart_from_load(codes: Iterable[str]) -> list[str]:
    """Findings without that the computer is busy, which it may be in a test in real time."""
    return [code for code in codes if code != "computer_busy"]


@scene(PLAIN, store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_failing_database_is_reported_until_a_write_succeeds(rig: Rig, servo: Servo, tmp_path: Path) -> None:
    assert (await rig.http.get(f"{ROOT}/health")).json() == {"status": "ok"}
    status, body = await ready(rig)
    assert (status, body["ready"], apart_from_load(body["findings"])) == (200, True, [])
    off = {"disk": "off", "view": "off"}  # this application has no data folder and no view
    assert body["parts"] | {"loop": "ok"} == {"store": "ok", "bus": "ok", "allocator": "ok", "loop": "ok"} | off

    await asyncio.sleep(5)  # what was found at the first contact is stored first
    await rig.host.store.settled()
    with disk_full(rig):
        problem(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "elbow"}), "store_failed", 500)
        status, body = await ready(rig)
        assert (status, body["parts"]["store"]) == (503, "failed")
        assert apart_from_load(body["findings"]) == ["database"]
        assert len(rig.events("store_failed")) == 1
        health = json(await rig.call("GET", "/health"))
        assert (health["status"], health["ready"]) == ("failed", False)
        assert health["commit"] == resources.commit()
        (found,) = health["parts"]["store"]["findings"]
        assert "disk" in found["evidence"]
        assert apart_from_load(await findings(rig)) == ["database"]
        metrics = await scrape(rig)
        assert of(metrics, "part_state", part="store", state="failed") == 1
        assert of(metrics, "part_state", part="store", state="ok") == 0
        assert of(metrics, "store_failures_total") == 1
        assert (await rig.http.get(f"{ROOT}/health")).status_code == 200, "it is alive"
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "elbow"}))
    assert (await ready(rig))[0] == 200
    assert apart_from_load(await findings(rig)) == []


@scene(PLAIN, settle_s=3)
async def test_a_lost_bus_is_not_ready_and_no_bus_is(rig: Rig, servo: Servo) -> None:
    await rig.cable.unplug()
    await asyncio.sleep(1)
    status, body = await ready(rig)
    assert (status, body["parts"]["bus"]) == (503, "failed")
    rig.cable.plug_in()
    await asyncio.sleep(8)
    assert (await ready(rig))[0] == 200
    json(await rig.call("DELETE", "/bus"))
    status, body = await ready(rig)
    assert (status, body["parts"]["bus"], body["parts"]["allocator"]) == (200, "off", "off"), "nobody asked for a bus"


@scene(PLAIN, store=lambda tmp_path: str(tmp_path), behind=True)
async def test_changes_that_are_given_up_are_counted(rig: Rig, servo: Servo, tmp_path: Path) -> None:
    assert of(await scrape(rig), "store_lost_changes_total") == 0
    rig.host.store.audit.add([NewAuditEntry(None, "write", "applied")])  # pyright: ignore[reportArgumentType]
    await rig.host.store.settled()
    assert of(await scrape(rig), "store_lost_changes_total") == 1


@pytest.mark.parametrize(
    ("free", "state"), [(DISK_LOW, "ok"), (DISK_LOW - 1, "degraded"), (DISK_FULL - 1, "failed"), (None, "off")]
)
def test_free_disk_space(free: int | None, state: str) -> None:
    @scene()
    async def play(rig: Rig) -> None:
        rig.host.doctor.of_server.disk = None if free is None else (free, 64_000_000_000)
        status, body = await ready(rig)
        assert (status, body["parts"]["disk"]) == (503 if state == "failed" else 200, state)
        assert await findings(rig) == (["disk_space"] if state in ("degraded", "failed") else [])
        assert of(await scrape(rig), "disk_free_bytes") == free

    play()


@scene(PLAIN, settle_s=3)
async def test_a_busy_computer_is_named_before_a_servo_is_declared_dead(rig: Rig, servo: Servo) -> None:
    assert of(await scrape(rig), "loop_lag_recent_seconds") == 0
    stall(4)  # longer than the silence after which a servo is offline
    await asyncio.sleep(0.1)
    assert servo.online, "its messages of these seconds were not processed yet"
    assert rig.events("offline") == []
    status, body = await ready(rig)
    assert (status, body["parts"]["loop"]) == (503, "failed")
    assert await findings(rig) == ["computer_busy"]
    assert of(await scrape(rig), "loop_lag_recent_seconds") == pytest.approx(4, abs=0.05)
    await asyncio.sleep(11)
    assert (await ready(rig))[0] == 200


@scene(PLAIN, settle_s=3)
async def test_errors_and_events_of_a_silent_servo_say_that_the_computer_was_busy(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters/angle_p_gain"
    rig.sim(servo).conditions.drop_responses_pct = 100
    quiet = problem(await rig.call("GET", path), "no_response", 504)
    assert "busy" not in quiet["detail"]
    assert "lag_s" not in quiet
    asyncio.get_running_loop().call_later(0.5, stall, 0.3)
    busy = problem(await rig.call("GET", path), "no_response", 504)
    assert "This computer was busy: hornbill ran up to 0.3" in busy["detail"]
    assert busy["lag_s"] == pytest.approx(0.3, abs=0.03)
    assert (busy["cause"], busy["also"]) == ("servo_not_responding", ["computer_busy"])
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(2)
    stall(0.5)
    await asyncio.sleep(2)
    (event,) = rig.events("offline")
    assert "This computer was busy" in event.text
    assert event.params["lag_s"] == pytest.approx(0.5, abs=0.03)


@secured(given=GIVEN)
async def test_probes_need_no_token_and_contain_no_names(server: SecuredServer) -> None:
    async with server.client(address=("192.0.2.9", 5000)) as far:
        assert (await far.get(f"{ROOT}/health")).json() == {"status": "ok"}
        body = (await far.get(f"{ROOT}/ready")).json()
        assert set(body) == {"ready", "parts", "findings"}
        assert {type(state) for state in body["parts"].values()} == {str}
        problem(await far.get("/health"), "unauthorized", 401)
        problem(await far.get("/monitoring/alerts.yaml"), "unauthorized", 401)

"""GET /metrics against what happens on the bus: what Prometheus' own parser reads out of it."""

import asyncio
import json as json_
import re
from pathlib import Path
from typing import Any, cast

import pytest
from prometheus_client.parser import text_string_to_metric_families

from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.api.routes.server.metrics import PROCESS, TABLE

DOCS = Path(__file__).parents[2] / "docs"
Labels = dict[str, str]
Scrape = dict[str, list[tuple[Labels, float]]]


async def scrape(rig: Rig) -> Scrape:
    """Every sample by its name."""
    answer = await rig.http.get("http://127.0.0.1/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    found: Scrape = {}
    for family in text_string_to_metric_families(answer.text):
        for sample in family.samples:
            found.setdefault(sample.name, []).append((sample.labels, sample.value))
    return found


def of(found: Scrape, name: str, **labels: str) -> float | None:
    """The one sample with these labels; None where there is none."""
    values = [value for has, value in found.get(f"hornbill_{name}", []) if labels.items() <= has.items()]
    assert len(values) < 2, f"{name} {labels} is there {len(values)} times"
    return values[0] if values else None


@scene()
async def test_what_a_servo_says_is_in_the_metrics(rig: Rig) -> None:
    (servo,) = await rig.ready()
    label = 'left "knee"\\\nrear'
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": label}))
    rig.sim(servo).conditions.temperature_c = 41.0
    await asyncio.sleep(10.0)
    found = await scrape(rig)
    who = {"uid": servo.uid, "label": label}
    assert of(found, "servo_temperature_celsius", **who) == pytest.approx(41, abs=1)
    assert of(found, "servo_voltage_volts", **who) == pytest.approx(rig.sim(servo).conditions.voltage_v, abs=0.2)
    assert of(found, "servo_online", **who) == 1
    age = of(found, "servo_angle_age_seconds", **who)
    assert age is not None
    assert 0 <= age <= 0.2
    assert of(found, "servo_angle_degrees", **who) == pytest.approx(servo.angle_deg)
    assert of(found, "servos", state="ready") == 1
    assert of(found, "bus_state", state="active") == 1
    assert of(found, "bus_state", state="lost") == 0
    for level in ("notification", "warning", "failure"):
        assert of(found, "servo_faults", level=level, **who) == 0
    assert of(found, "servo_info", model="BLA21-06U-A0", firmware="1.300", **who) == 1
    frames = of(found, "bus_frames_total", direction="rx")
    assert frames is not None
    assert frames > 50
    assert 0 < (of(found, "bus_load_ratio") or 0) < 1


@scene()
async def test_a_silent_servo_has_no_readings_only_an_age(rig: Rig) -> None:
    (servo,) = await rig.ready()
    await asyncio.sleep(3.0)
    before = await scrape(rig)
    assert of(before, "servo_temperature_celsius", uid=servo.uid) is not None
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"mute": True}))
    await asyncio.sleep(1.0)
    soon = await scrape(rig)
    assert of(soon, "servo_angle_degrees", uid=servo.uid) is None
    await asyncio.sleep(9.0)
    found = await scrape(rig)
    assert of(found, "servo_online", uid=servo.uid) == 0
    assert of(found, "servo_angle_age_seconds", uid=servo.uid) == pytest.approx(10, abs=0.5)
    for name in (
        "servo_temperature_celsius", "servo_voltage_volts", "servo_angle_degrees", "servo_faults", "servo_fault",
        "servo_health", "servo_uptime_seconds",
    ):  # fmt: skip
        assert of(found, name, uid=servo.uid) is None, name


@scene()
async def test_faults_stops_leases_and_refusals_are_counted(rig: Rig) -> None:
    (servo,) = await rig.ready()
    lease = await rig.lease()
    json(await rig.call("DELETE", f"/leases/{lease}"))
    lapsing = await rig.call("POST", "/leases", {"holder": "test", "ttl_s": 1.0})
    json(lapsing, 201)
    await asyncio.sleep(2.0)
    rig.sim(servo).conditions.temperature_c = 120.0
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(4.0)
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"refuse_keys": ["smoothing"]}))
    refused = await rig.call("GET", f"/servos/{servo.uid}/parameters/smoothing")
    assert refused.status_code == 502
    found = await scrape(rig)
    assert of(found, "stop_latched") == 1
    assert of(found, "stops_total") == 1
    assert of(found, "stop_response_seconds_count") == 1
    assert of(found, "stop_response_seconds_bucket", le="0.02") == 1
    assert of(found, "stop_unconfirmed_servos") == 0
    assert of(found, "leases_total", event="taken") == 2
    assert of(found, "leases_total", event="released") == 1
    assert of(found, "leases_total", event="expired") == 1
    assert of(found, "lease_held") == 0
    assert of(found, "servo_faults", level="warning") == 1
    active = [has["fault"] for has, value in found["hornbill_servo_fault"] if value == 1]
    assert len(active) == 1
    assert of(found, "bus_refusals_total", kind="read") == 1
    assert of(found, "events_total", level="failure", code="stopped") == 1
    answered = of(found, "bus_requests_total", kind="read", outcome="responded")
    assert answered == of(found, "bus_request_seconds_count", kind="read")


@scene()
async def test_requests_are_counted_by_the_route_and_not_by_what_is_asked_for(rig: Rig) -> None:
    (servo,) = await rig.ready()
    await rig.call("GET", f"/servos/{servo.uid}/parameters/smoothing")
    for number in range(50):
        await rig.call("GET", f"/servos/{number:032x}")
        await rig.call("GET", f"/nothing/of/that/name/{number}")
    await rig.http.request("BREW", "http://127.0.0.1/api/v1/servos")
    found = await scrape(rig)
    name = "http_request_seconds_count"
    row = "/api/v1/servos/{uid}/parameters/{key}"
    assert (of(found, name, method="GET", route=row, status="200") or 0) >= 1
    assert (of(found, name, method="GET", route="/api/v1/servos/{uid}", status="404") or 0) >= 50
    assert (of(found, name, method="GET", route="other", status="404") or 0) >= 50
    assert (of(found, name, method="other", route="other", status="405") or 0) >= 1
    routes = {labels["route"] for labels, _ in found[f"hornbill_{name}"]}
    assert not any("nothing" in route or servo.uid in route for route in routes)


@scene()
async def test_open_sockets_and_ended_jobs_are_counted(rig: Rig) -> None:
    (servo,) = await rig.ready()
    before = of(await scrape(rig), "sockets_open", route="/api/v1/ws") or 0
    socket = Socket(rig.app)
    await socket.hear("hello")
    json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    found = await scrape(rig)
    assert of(found, "sockets_open", route="/api/v1/ws") == before + 1
    assert of(found, "jobs_total", kind="save", outcome="succeeded") == 1
    await socket.close()
    assert of(await scrape(rig), "sockets_open", route="/api/v1/ws") == before


@scene(connect=False)
async def test_without_a_bus_there_are_metrics_and_none_of_a_bus(rig: Rig) -> None:
    found = await scrape(rig)
    assert of(found, "bus_state", state="disconnected") == 1
    assert of(found, "bus_load_ratio") is None
    assert of(found, "build_info") == 1


@scene(PLAIN)
async def test_every_metric_of_the_table_is_there_and_no_other(rig: Rig) -> None:
    await rig.ready()
    answer = await rig.http.get("http://127.0.0.1/metrics")
    families = {one.name for one in text_string_to_metric_families(answer.text)}
    ours = {name for name in families if not name.startswith(PROCESS)}
    assert ours == {one.name for one in TABLE}


def _queries(part: Any) -> list[str]:
    """Every `expr` and `query` anywhere in the dashboard."""
    if isinstance(part, list):
        return [text for one in cast("list[Any]", part) for text in _queries(one)]
    if not isinstance(part, dict):
        return []
    members = cast("dict[str, Any]", part)
    own = [value for key, value in members.items() if key in ("expr", "query") and isinstance(value, str)]
    return own + [text for one in members.values() for text in _queries(one)]


def test_the_dashboard_asks_only_for_metrics_and_labels_there_are() -> None:
    dashboard = json_.loads((DOCS / "grafana" / "hornbill.json").read_text(encoding="utf-8"))
    samples: dict[str, set[str]] = {}
    for one in TABLE:
        labels = set(one.labels)
        if one.kind == "counter":
            samples[f"{one.name}_total"] = labels
        elif one.kind == "histogram":
            samples |= {f"{one.name}_count": labels, f"{one.name}_sum": labels, f"{one.name}_bucket": labels | {"le"}}
        else:
            samples[one.name] = labels
    queries = _queries(dashboard)
    asked = {name for text in queries for name in re.findall(r"\bhornbill_\w+", text)}
    assert len(asked) >= 20
    assert asked <= set(samples), f"there is no {asked - set(samples)}"
    everywhere = {label for labels in samples.values() for label in labels} | {"job", "instance"}
    for text in queries:
        for name, selector in re.findall(r"\b(hornbill_\w+){([^}]*)}", text):
            used = set(re.findall(r"(\w+)\s*(?:=~|!~|!=|=)", selector))
            assert used <= samples[name] | {"job", "instance"}, text
        for group in re.findall(r"\b(?:by|without)\s*\(([^)]*)\)", text):
            assert {part.strip() for part in group.split(",")} <= everywhere, text
    ids = [panel["id"] for panel in dashboard["panels"]]
    assert len(ids) == len(set(ids)) >= 10

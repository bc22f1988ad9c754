"""GET /metrics compared with the bus, as Prometheus' own parser reads it."""

import asyncio
import json as json_
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, cast

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from behaviour.test_roles import autopilot, command
from hornbill.api.routes.server.metrics import PROCESS, TABLE
from hornbill.api.routes.server.monitoring import ALERTS, DASHBOARD
from hornbill.servo.device.servo import Servo

DOCS = Path(__file__).parents[2] / "docs"
METRICS = "http://127.0.0.1/metrics"
Labels = dict[str, str]
Scrape = dict[str, list[tuple[Labels, float]]]


async def scrape(rig: Rig) -> Scrape:
    """All samples by name."""
    response = await rig.http.get(METRICS)
    assert response.status_code == 200
    assert response.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    found: Scrape = {}
    for family in text_string_to_metric_families(response.text):
        for sample in family.samples:
            found.setdefault(sample.name, []).append((sample.labels, sample.value))
    return found


def of(found: Scrape, name: str, **labels: str) -> float | None:
    """The one sample with these labels; None where there is none."""
    values = [value for has, value in found.get(f"hornbill_{name}", []) if labels.items() <= has.items()]
    assert len(values) < 2, f"{len(values)} samples of {name} {labels}"
    return values[0] if values else None


async def scraped(rig: Rig, **labels: str) -> Callable[..., float | None]:
    """The samples now, as a function of a name and labels."""
    found = await scrape(rig)
    return partial(of, found, **labels)


@scene(PLAIN)
async def test_metrics_of_a_servo_that_another_node_commands(rig: Rig, servo: Servo) -> None:
    async with autopilot(rig, command(1, 0.1)):
        await asyncio.sleep(3)
        value = await scraped(rig, uid=servo.uid, node_id="10")
        assert (value("servo_commanded"), value("servo_command_degrees")) == (1, 18)
        assert value("servo_command_hertz") == pytest.approx(50, rel=0.02)
    await asyncio.sleep(1.5)
    found = await scrape(rig)
    assert of(found, "servo_commanded", uid=servo.uid) is None
    assert of(found, "servo_command_gaps_total", uid=servo.uid) == 1
    assert [of(found, "bus_role", role=role) for role in ("host", "guest", "observer")] == [1, 0, 0]


@scene(PLAIN)
async def test_metrics_of_a_servo_and_the_bus(rig: Rig, servo: Servo) -> None:
    label = 'left "knee"\\\nrear'
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": label}))
    rig.sim(servo).conditions.temperature_c = 41.0
    await asyncio.sleep(10.0)
    servo_value = await scraped(rig, uid=servo.uid, label=label)
    assert servo_value("servo_temperature_celsius") == pytest.approx(41, abs=1)
    assert servo_value("servo_voltage_volts") == pytest.approx(rig.sim(servo).conditions.voltage_v, abs=0.2)
    assert servo_value("servo_online") == 1
    assert servo_value("servo_angle_age_seconds") == pytest.approx(0.1, abs=0.1)
    assert servo_value("servo_angle_degrees") == pytest.approx(servo.angle_deg)
    for level in ("notification", "warning", "failure"):
        assert servo_value("servo_faults", level=level) == 0
    assert servo_value("servo_info", model="BLA21-06U-A0", firmware="1.300") == 1
    value = await scraped(rig)
    assert value("servos", state="ready") == 1
    assert value("bus_state", state="active") == 1
    assert value("bus_state", state="lost") == 0
    assert (value("bus_frames_total", direction="rx") or 0) > 50
    assert 0 < (value("bus_load_ratio") or 0) < 1
    families = {one.name for one in text_string_to_metric_families((await rig.http.get(METRICS)).text)}
    assert {name for name in families if not name.startswith(PROCESS)} == {one.name for one in TABLE}


@scene()
async def test_a_silent_servo_has_no_readings_but_an_age(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3.0)
    assert (await scraped(rig, uid=servo.uid))("servo_temperature_celsius") is not None
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"mute": True}))
    await asyncio.sleep(1.0)
    assert (await scraped(rig, uid=servo.uid))("servo_angle_degrees") is None
    await asyncio.sleep(9.0)
    value = await scraped(rig, uid=servo.uid)
    assert value("servo_online") == 0
    assert value("servo_angle_age_seconds") == pytest.approx(10, abs=0.5)
    readings = "temperature_celsius voltage_volts angle_degrees faults fault health uptime_seconds"
    assert [value(f"servo_{name}") for name in readings.split()] == [None] * 7


@scene()
async def test_faults_stops_leases_and_refusals_are_counted(rig: Rig, servo: Servo) -> None:
    json(await rig.call("DELETE", f"/leases/{await rig.lease()}"))
    await rig.lease(ttl_s=1.0)
    await asyncio.sleep(2.0)
    rig.sim(servo).conditions.temperature_c = 120.0
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(4.0)
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"refuse_keys": ["smoothing"]}))
    assert (await rig.call("GET", f"/servos/{servo.uid}/parameters/smoothing")).status_code == 502
    found = await scrape(rig)
    expected: list[tuple[str, Labels, float]] = [
        ("stop_latched", {}, 1),
        ("stops_total", {}, 1),
        ("stop_response_seconds_count", {}, 1),
        ("stop_response_seconds_bucket", {"le": "0.02"}, 1),
        ("stop_unconfirmed_servos", {}, 0),
        ("leases_total", {"event": "taken"}, 2),
        ("leases_total", {"event": "released"}, 1),
        ("leases_total", {"event": "expired"}, 1),
        ("lease_held", {}, 0),
        ("servo_faults", {"level": "warning"}, 1),
        ("bus_refusals_total", {"kind": "read"}, 1),
        ("events_total", {"level": "failure", "code": "stopped"}, 1),
    ]
    for name, labels, value in expected:
        assert of(found, name, **labels) == value, (name, labels)
    assert [value for _, value in found["hornbill_servo_fault"]].count(1) == 1
    responded = of(found, "bus_requests_total", kind="read", outcome="responded")
    assert responded == of(found, "bus_request_seconds_count", kind="read")


@scene()
async def test_requests_sockets_and_jobs_are_counted_by_route_without_parameters(rig: Rig, servo: Servo) -> None:
    await rig.call("GET", f"/servos/{servo.uid}/parameters/smoothing")
    for number in range(50):
        await rig.call("GET", f"/servos/{number:032x}")
        await rig.call("GET", f"/nothing/of/that/name/{number}")
    await rig.http.request("BREW", "http://127.0.0.1/api/v1/servos")
    found = await scrape(rig)
    name = "http_request_seconds_count"
    for method, route, status, least in (
        ("GET", "/api/v1/servos/{uid}/parameters/{key}", "200", 1),
        ("GET", "/api/v1/servos/{uid}", "404", 50),
        ("GET", "other", "404", 50),
        ("other", "other", "405", 1),
    ):
        assert (of(found, name, method=method, route=route, status=status) or 0) >= least, route
    routes = {labels["route"] for labels, _ in found[f"hornbill_{name}"]}
    assert not any("nothing" in route or servo.uid in route for route in routes)
    before = of(found, "sockets_open", route="/api/v1/ws") or 0
    socket = Socket(rig.app)
    await socket.receive("hello")
    json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    value = await scraped(rig)
    assert value("sockets_open", route="/api/v1/ws") == before + 1
    assert value("jobs_total", kind="save", outcome="succeeded") == 1
    await socket.close()
    assert (await scraped(rig))("sockets_open", route="/api/v1/ws") == before


@scene(connect=False)
async def test_without_a_bus_there_are_no_metrics_of_one(rig: Rig) -> None:
    value = await scraped(rig)
    assert value("bus_state", state="disconnected") == 1
    assert value("bus_load_ratio") is None
    assert value("build_info") == 1


def _queries(part: Any) -> list[str]:
    """Every `expr` and `query` anywhere in the dashboard."""
    if isinstance(part, list):
        return [text for one in cast("list[Any]", part) for text in _queries(one)]
    if not isinstance(part, dict):
        return []
    members = cast("dict[str, Any]", part)
    own = [value for key, value in members.items() if key in ("expr", "query") and isinstance(value, str)]
    return own + [text for one in members.values() for text in _queries(one)]


def test_dashboard_and_alert_rules_use_only_existing_metrics_and_labels() -> None:
    dashboard = json_.loads(DASHBOARD.read_text(encoding="utf-8"))
    alerts = yaml.safe_load(ALERTS.read_text(encoding="utf-8"))
    samples: dict[str, set[str]] = {}
    for one in TABLE:
        labels = set(one.labels)
        if one.kind == "counter":
            samples[f"{one.name}_total"] = labels
        elif one.kind == "histogram":
            samples |= {f"{one.name}_count": labels, f"{one.name}_sum": labels, f"{one.name}_bucket": labels | {"le"}}
        else:
            samples[one.name] = labels
    queries = _queries(dashboard) + _queries(alerts)
    named = {name for text in queries for name in re.findall(r"\bhornbill_\w+", text)}
    assert len(named) >= 20
    assert named <= set(samples)
    everywhere = {label for labels in samples.values() for label in labels} | {"job", "instance"}
    for text in queries:
        for name, selector in re.findall(r"\b(hornbill_\w+){([^}]*)}", text):
            used = set(re.findall(r"(\w+)\s*(?:=~|!~|!=|=)", selector))
            assert used <= samples[name] | {"job", "instance"}, text
        for group in re.findall(r"\b(?:by|without)\s*\(([^)]*)\)", text):
            assert {part.strip() for part in group.split(",")} <= everywhere, text
    ids = [panel["id"] for panel in dashboard["panels"]]
    assert len(ids) == len(set(ids)) >= 10

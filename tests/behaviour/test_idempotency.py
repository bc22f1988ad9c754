"""Idempotency-Key: a repeated POST has one effect, whatever happens to the client and to the server."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from behaviour.actions import torque
from behaviour.rig import Response, Rig, json, play, problem
from behaviour.scene import scene
from behaviour.secured import SecuredServer, through
from hornbill.api.routing import WITHOUT_KEY
from hornbill.errors import StoreFailed
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.store.responses import Keys, Responses

KEY = {"Idempotency-Key": "8e03978e-40d5-43dd-bc93-6894a57f9324"}
LEASE = {"holder": "a", "ttl_s": 5.0}


async def nothing(*_: object) -> None:
    """As if the server had ended before."""


def failing(error: Exception) -> Any:
    def fail(*_: object) -> None:
        raise error

    return fail


async def post(rig: Rig, path: str, body: object = None, key: str = "k", **more: Any) -> Response:
    return await rig.call("POST", path, body, **{"Idempotency-Key": key}, **more)


def jobs(rig: Rig, kind: str) -> int:
    return len([job for job in rig.host.jobs.all() if job.kind == kind])


@scene()
async def test_a_repeated_save_is_done_once_and_gets_the_same_response(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/save?wait=true"
    first, again = await post(rig, path), await post(rig, path)
    assert json(first)["state"] == "succeeded"
    assert (again.status_code, again.content) == (first.status_code, first.content)
    assert again.headers["location"] == first.headers["location"]
    assert (again.headers["idempotency-replayed"], "idempotency-replayed" in first.headers) == ("true", False)
    assert jobs(rig, "save") == 1
    json(await post(rig, path, key="another"))
    assert jobs(rig, "save") == 2


@scene()
async def test_a_repeated_motion_command_is_sent_once(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    await torque(rig, servo, "on", lease)
    path, body = f"/servos/{servo.uid}/command", {"type": "angle", "value": 12.0}
    first = await post(rig, path, body, lease=lease)
    sent = [write for write in rig.writes() if write[1] == "0x00"]
    again = await post(rig, path, body, lease=lease)
    assert json(again) == json(first)
    assert sent
    assert [write for write in rig.writes() if write[1] == "0x00"] == sent
    json(await post(rig, path, body, key="new", lease=lease))
    assert len(rig.writes()) > len(sent)


@scene()
async def test_a_key_of_another_request_an_invalid_one_and_one_that_cannot_be_stored_are_rejected(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    for keys in [[b""], [b" "], [b"a b"], [b"x" * 256], [b"\xe9"], [b"a", b"b"]]:
        headers = [(b"Idempotency-Key", key) for key in keys]
        problem(await rig.http.post("/leases", json=LEASE, headers=headers), "invalid_value", 422)
    full = failing(StoreFailed("The disk is full, so nothing can be stored.", cause=None))
    with monkeypatch.context() as patch:
        patch.setattr(Responses, "begin", full)
        problem(await post(rig, "/leases", LEASE), "store_failed", 500)
    assert json(await rig.call("GET", "/leases")) == []
    with monkeypatch.context() as patch:
        patch.setattr(Responses, "end", full)
        json(await post(rig, "/leases", LEASE), 201)
    problem(await post(rig, "/leases", LEASE), "interrupted", 500)
    for path, body in (("/leases", {**LEASE, "holder": "b"}), ("/stop/restore?wait=true", {}), ("/commissioning", {})):
        problem(await post(rig, path, body), "idempotency_key_reused", 422)
    assert [one["holder"] for one in json(await rig.call("GET", "/leases"))] == ["a"]


@scene()
async def test_a_repeated_stop_stops_again_and_a_repeated_rejected_command_moves_nothing(
    rig: Rig, servo: Servo
) -> None:
    path, body = f"/servos/{servo.uid}/command", {"type": "angle", "value": 12.0}
    lease = await rig.lease()
    for _ in range(2):
        assert json(await post(rig, "/stop", key="stop"))["latched"] is True
        problem(await post(rig, path, body, lease=lease), "stopped", 423)
        json(await rig.call("DELETE", "/stop"))
    await torque(rig, servo, "on", lease)
    before = len(rig.writes())
    problem(await post(rig, path, body, lease=lease), "stopped", 423)
    assert len(rig.writes()) == before


@scene()
async def test_a_repeated_lease_request_shows_the_lease_now_and_fails_once_it_has_expired(rig: Rig) -> None:
    first = json(await post(rig, "/leases", LEASE), 201)
    await asyncio.sleep(2)
    again = json(await post(rig, "/leases", LEASE), 201)
    assert (again["id"], again["expires_at"]) == (first["id"], pytest.approx(first["expires_at"]))
    assert again["expires_in_s"] < 3.1
    await asyncio.sleep(4)
    problem(await post(rig, "/leases", LEASE), "unknown_lease", 404)
    assert await rig.lease() != first["id"]
    problem(await post(rig, "/leases", LEASE), "unknown_lease", 404)


@scene()
async def test_a_repeated_request_for_motion_control_shows_its_present_state(rig: Rig) -> None:
    lease = await rig.lease()
    request = {**LEASE, "holder": "other", "reason": "", "timeout_s": 3.0}
    first = json(await post(rig, "/leases/requests", request), 202)
    assert first["state"] == "waiting"
    shown = json(await rig.call("GET", "/leases"))[0]["request"]["id"]
    assert (await rig.call("POST", f"/leases/requests/{shown}/refuse", lease=lease)).status_code == 204
    again = json(await post(rig, "/leases/requests", request), 202)
    assert (again["id"], again["state"]) == (first["id"], "refused")


@scene()
async def test_concurrent_repeats_share_one_job(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/restart?wait=true"
    repeats = [asyncio.create_task(post(rig, path)) for _ in range(5)]
    await asyncio.sleep(0.01)
    problem(await post(rig, f"/servos/{servo.uid}/save"), "idempotency_key_reused", 422)
    assert not any(one.done() for one in repeats)
    responses = await asyncio.gather(*repeats)
    assert {one.content for one in responses} == {responses[0].content}
    assert json(responses[0])["state"] == "succeeded"
    assert jobs(rig, "restart") == 1
    assert sorted("idempotency-replayed" in one.headers for one in responses) == [False, True, True, True, True]


def test_a_response_is_replayed_after_a_restart_of_the_server_and_its_key_stored_only_hashed(tmp_path: Path) -> None:
    async def save(rig: Rig) -> tuple[bytes, int]:
        [servo] = await rig.ready()
        response = await rig.call("POST", f"/servos/{servo.uid}/save?wait=true", **KEY)
        return response.content, jobs(rig, "save")

    before, after = play(save, store=str(tmp_path)), play(save, store=str(tmp_path))
    assert before == after
    assert before[1] == 1
    for file in tmp_path.iterdir():
        assert KEY["Idempotency-Key"].encode() not in file.read_bytes(), file


@scene()
async def test_a_request_cut_off_by_a_crash_or_that_failed_is_not_repeated(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = f"/servos/{servo.uid}/restart"
    with monkeypatch.context() as patch:
        patch.setattr(Host, "connected", failing(ZeroDivisionError()))
        with pytest.raises(ZeroDivisionError):
            await post(rig, path)
    problem(await post(rig, path), "interrupted", 500)
    assert rig.host.jobs.all() == []
    with monkeypatch.context() as patch:
        patch.setattr(Keys, "end", nothing)
        json(await post(rig, path, key="crash"), 202)
    problem(await post(rig, path, key="crash"), "interrupted", 500)
    assert jobs(rig, "restart") == 1


def test_the_same_key_of_two_tokens_is_two_keys() -> None:
    async def scene(door: SecuredServer) -> None:
        ids: list[str] = []
        for token in [await door.token(name, "configure") for name in ("a", "b")]:
            async with door.client(token) as client:
                ids.append(json(await client.post("/leases", json=LEASE, headers=KEY), 201)["id"])
                await client.delete(f"/leases/{ids[-1]}")
        assert ids[0] != ids[1]

    through(scene, given="the-token-of-the-command-line")


@scene()
async def test_responses_with_a_secret_are_not_stored(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Responses, "begin", failing(AssertionError("stored")))
    paths = WITHOUT_KEY.keys() - {"/api/v1/stop"}
    assert paths
    for path in paths:
        await post(rig, path.removeprefix("/api/v1"), {})


SENT = st.lists(st.tuples(st.sampled_from("kl"), st.sampled_from("ab"), st.booleans()), min_size=1, max_size=12)


@settings(max_examples=10, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(sent=SENT)
@scene(fast=True)
async def test_each_key_has_one_effect_in_any_sequence_of_requests(rig: Rig, sent: list[tuple[str, str, bool]]) -> None:
    """Two keys and two requests, concurrently or in sequence, against a dictionary as the model."""
    [servo] = await rig.ready()
    model: dict[str, str] = {}
    running: list[tuple[str, str, asyncio.Task[Response]]] = []
    for key, reason, at_once in sent:
        model.setdefault(key, reason)
        task = asyncio.create_task(post(rig, f"/servos/{servo.uid}/snapshots", {"reason": reason}, key=key))
        running.append((key, reason, task))
        await (asyncio.sleep(0) if at_once else task)
    responses: dict[str, bytes] = {}
    for key, reason, task in running:
        response = await task
        if model[key] != reason:
            problem(response, "idempotency_key_reused", 422)
        else:
            assert responses.setdefault(key, response.content) == response.content
    taken = [one.reason for one in rig.host.store.snapshots.of(servo.uid) if not one.automatic]
    assert sorted(taken) == sorted(model.values())

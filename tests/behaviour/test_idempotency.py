"""A POST with an Idempotency-Key is done once, whatever happens to whoever sends it, and to the server."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from behaviour.rig import Answer, Rig, json, play, problem
from behaviour.scene import scene
from behaviour.test_access import Door, through
from hornbill.api.routing import WITHOUT_KEY
from hornbill.servo.host import Host
from hornbill.store.responses import Responses

KEY = {"Idempotency-Key": "8e03978e-40d5-43dd-bc93-6894a57f9324"}


def nothing(*_: object) -> None:
    """In place of what a server that ends does not come to any more."""


def kept(*_: object) -> None:
    pytest.fail("it was kept")


async def post(rig: Rig, path: str, body: object = None, key: str = "k", **more: Any) -> Answer:
    return await rig.call("POST", path, body, **{"Idempotency-Key": key}, **more)


@scene()
async def test_a_save_sent_twice_is_done_once_and_answered_alike(rig: Rig) -> None:
    [servo] = await rig.ready()
    first = await post(rig, f"/servos/{servo.uid}/save?wait=true")
    again = await post(rig, f"/servos/{servo.uid}/save?wait=true")
    assert json(first)["state"] == "succeeded"
    assert (again.status_code, again.content) == (first.status_code, first.content)
    assert again.headers["location"] == first.headers["location"]
    assert (again.headers["idempotency-replayed"], "idempotency-replayed" in first.headers) == ("true", False)
    assert len([job for job in rig.host.jobs.all() if job.kind == "save"]) == 1
    json(await post(rig, f"/servos/{servo.uid}/save?wait=true", key="another"))
    assert len([job for job in rig.host.jobs.all() if job.kind == "save"]) == 2


@scene()
async def test_a_motion_command_with_a_key_leaves_once(rig: Rig) -> None:
    [servo] = await rig.ready()
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    go = {"type": "angle", "value": 12.0}
    first = await post(rig, f"/servos/{servo.uid}/command", go, lease=lease)
    sent = [write for write in rig.writes() if write[1] == "0x00"]
    again = await post(rig, f"/servos/{servo.uid}/command", go, lease=lease)
    assert json(again) == json(first)
    assert [write for write in rig.writes() if write[1] == "0x00"] == sent
    assert rig.writes()
    json(await post(rig, f"/servos/{servo.uid}/command", go, key="new", lease=lease))
    assert len(rig.writes()) > len(sent)


@pytest.mark.parametrize(
    ("path", "body"),
    [("/leases", {"holder": "b", "ttl_s": 5}), ("/leases?x=1", {"holder": "a", "ttl_s": 5}), ("/commissioning", {})],
)
@scene()
async def test_a_key_that_came_with_another_request_is_refused_and_nothing_is_done(
    rig: Rig, path: str, body: object
) -> None:
    json(await post(rig, "/leases", {"holder": "a", "ttl_s": 5}), 201)
    problem(await post(rig, path, body), "idempotency_key_reused", 422)
    assert len(json(await rig.call("GET", "/leases"))) == 1
    assert json(await rig.call("GET", "/leases"))[0]["holder"] == "a"


@scene()
async def test_a_refusal_stays_a_refusal_so_that_a_late_copy_of_it_moves_nothing(rig: Rig) -> None:
    [servo] = await rig.ready()
    path, go = f"/servos/{servo.uid}/command", {"type": "angle", "value": 12.0}
    lease = await rig.lease()
    json(await rig.call("POST", "/stop"))
    problem(await post(rig, path, go, lease=lease), "stopped", 423)
    json(await rig.call("DELETE", "/stop"))
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    before = len(rig.writes())
    problem(await post(rig, path, go, lease=lease), "stopped", 423)
    assert len(rig.writes()) == before


@scene()
async def test_a_stop_with_a_key_is_a_stop_every_time(rig: Rig) -> None:
    await rig.ready()
    json(await post(rig, "/stop"))
    json(await rig.call("DELETE", "/stop"))
    assert json(await post(rig, "/stop"))["latched"] is True


@scene()
async def test_a_lease_is_answered_as_it_is_now_and_never_as_live_when_it_has_ended(rig: Rig) -> None:
    wanted = {"holder": "rig", "ttl_s": 5.0}
    first = json(await post(rig, "/leases", wanted), 201)
    await asyncio.sleep(2)
    again = json(await post(rig, "/leases", wanted), 201)
    assert (again["id"], again["expires_at"]) == (first["id"], pytest.approx(first["expires_at"]))
    assert again["expires_in_s"] < 3.1
    await asyncio.sleep(4)
    problem(await post(rig, "/leases", wanted), "unknown_lease", 404)
    other = await rig.lease()
    assert other != first["id"]
    problem(await post(rig, "/leases", wanted), "unknown_lease", 404)


@scene()
async def test_a_request_for_the_lease_is_answered_as_it_stands_now(rig: Rig) -> None:
    lease = await rig.lease()
    ask = {"holder": "other", "ttl_s": 5.0, "reason": "", "timeout_s": 3.0}
    first = json(await post(rig, "/leases/requests", ask), 202)
    assert first["state"] == "waiting"
    shown = json(await rig.call("GET", "/leases"))[0]["request"]["id"]
    assert (await rig.call("POST", f"/leases/requests/{shown}/refuse", lease=lease)).status_code == 204
    again = json(await post(rig, "/leases/requests", ask), 202)
    assert (again["id"], again["state"]) == (first["id"], "refused")


@scene()
async def test_two_at_once_are_one_and_both_hear_how_it_ended(rig: Rig) -> None:
    [servo] = await rig.ready()
    path = f"/servos/{servo.uid}/restart?wait=true"
    answers = await asyncio.gather(*(post(rig, path) for _ in range(5)))
    assert {answer.content for answer in answers} == {answers[0].content}
    assert json(answers[0])["state"] == "succeeded"
    assert len([job for job in rig.host.jobs.all() if job.kind == "restart"]) == 1
    assert sorted("idempotency-replayed" in one.headers for one in answers) == [False, True, True, True, True]


@scene()
async def test_a_key_with_another_request_is_refused_while_the_first_is_under_way(rig: Rig) -> None:
    [servo] = await rig.ready()
    first = asyncio.create_task(post(rig, f"/servos/{servo.uid}/restart?wait=true"))
    await asyncio.sleep(0.01)
    problem(await post(rig, f"/servos/{servo.uid}/save"), "idempotency_key_reused", 422)
    assert not first.done()
    json(await first)


def test_after_a_restart_of_the_server_the_answer_is_still_the_first(tmp_path: Path) -> None:
    async def save(rig: Rig) -> tuple[bytes, int]:
        [servo] = await rig.ready()
        answer = await post(rig, f"/servos/{servo.uid}/save?wait=true")
        return answer.content, len([job for job in rig.host.jobs.all() if job.kind == "save"])

    before, after = play(save, store=str(tmp_path)), play(save, store=str(tmp_path))
    assert before == after
    assert before[1] == 1


def test_what_a_server_did_not_live_to_answer_is_not_done_again_and_not_called_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def die(rig: Rig) -> None:
        [servo] = await rig.ready()
        with monkeypatch.context() as patch:
            patch.setattr(Responses, "end", nothing)
            json(await post(rig, f"/servos/{servo.uid}/restart"), 202)

    async def ask(rig: Rig) -> None:
        [servo] = await rig.ready()
        before = len(rig.host.jobs.all())
        told = problem(await post(rig, f"/servos/{servo.uid}/restart"), "interrupted", 500)
        assert "unknown" in told["detail"]
        assert len(rig.host.jobs.all()) == before

    play(die, store=str(tmp_path))
    play(ask, store=str(tmp_path))


@scene()
async def test_what_ended_without_an_answer_is_not_done_again(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    [servo] = await rig.ready()

    def fail(*_: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as patch:
        patch.setattr(Host, "connected", fail)
        with pytest.raises(ZeroDivisionError):
            await post(rig, f"/servos/{servo.uid}/restart")
    problem(await post(rig, f"/servos/{servo.uid}/restart"), "interrupted", 500)
    assert rig.host.jobs.all() == []


def test_keys_of_two_tokens_are_two_keys() -> None:
    async def scene(door: Door) -> None:
        tokens = [await door.token(name, "configure") for name in ("a", "b")]
        bodies: list[Any] = []
        for token in tokens:
            async with door.somebody(token) as one:
                ask = {"holder": "x", "ttl_s": 5}
                bodies.append(json(await one.post("/leases", json=ask, headers=KEY), 201))
                await one.delete(f"/leases/{bodies[-1]['id']}")
        assert bodies[0]["id"] != bodies[1]["id"]

    through(scene, given="the-token-of-the-command-line")


def test_a_key_cannot_be_read_from_what_is_kept(tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        json(await rig.call("POST", "/leases", {"holder": "a", "ttl_s": 5}, **KEY), 201)

    play(scene, store=str(tmp_path))
    for file in tmp_path.iterdir():
        assert KEY["Idempotency-Key"].encode() not in file.read_bytes(), file


@pytest.mark.parametrize("path", sorted(WITHOUT_KEY.keys() - {"/api/v1/stop"}))
def test_what_answers_with_a_secret_keeps_nothing(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Responses, "begin", kept)

    async def scene(rig: Rig) -> None:
        await post(rig, path.removeprefix("/api/v1"), {})

    play(scene)


@pytest.mark.parametrize("key", ["", " ", "a b", "x" * 256, "é"])
@scene()
async def test_a_key_that_is_none_is_refused(rig: Rig, key: str) -> None:
    answer = await rig.http.post(
        "/leases", json={"holder": "a", "ttl_s": 5}, headers=[(b"Idempotency-Key", key.encode("latin-1"))]
    )
    problem(answer, "invalid_value", 422)
    assert json(await rig.call("GET", "/leases")) == []


@scene()
async def test_two_keys_in_one_request_are_refused(rig: Rig) -> None:
    two = [("Idempotency-Key", "a"), ("Idempotency-Key", "b")]
    problem(await rig.http.post("/bus/log", json={}, headers=two), "invalid_value", 422)


def test_a_store_that_cannot_keep_the_key_does_nothing_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    from hornbill.errors import StoreFailed

    def full(*_: object) -> None:
        raise StoreFailed("The disk is full, so nothing can be kept.", cause=None)

    async def scene(rig: Rig) -> None:
        with monkeypatch.context() as patch:
            patch.setattr(Responses, "begin", full)
            problem(await post(rig, "/leases", {"holder": "a", "ttl_s": 5}), "store_failed", 500)
        assert json(await rig.call("GET", "/leases")) == []

        with monkeypatch.context() as patch:
            patch.setattr(Responses, "end", full)
            json(await post(rig, "/leases", {"holder": "a", "ttl_s": 5}), 201)
        problem(await post(rig, "/leases", {"holder": "a", "ttl_s": 5}), "interrupted", 500)

    play(scene)


SENT = st.lists(st.tuples(st.sampled_from("kl"), st.sampled_from("ab"), st.booleans()), min_size=1, max_size=12)


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(sent=SENT)
@scene(fast=True)
async def test_whatever_is_sent_each_key_is_done_once_for_its_first_request(
    rig: Rig, sent: list[tuple[str, str, bool]]
) -> None:
    """Two keys, two requests, at once or one after the other: a model of one dictionary says what must come."""
    [servo] = await rig.ready()
    model: dict[str, str] = {}
    under_way: list[tuple[str, str, asyncio.Task[Answer]]] = []
    for key, what, at_once in sent:
        model.setdefault(key, what)
        task = asyncio.create_task(post(rig, f"/servos/{servo.uid}/snapshots", {"reason": what}, key=key))
        under_way.append((key, what, task))
        if at_once:
            await asyncio.sleep(0)
        else:
            await task
    answers: dict[str, bytes] = {}
    for key, what, task in under_way:
        answer = await task
        if model[key] != what:
            problem(answer, "idempotency_key_reused", 422)
        else:
            assert answers.setdefault(key, answer.content) == answer.content
    taken = [one.reason for one in rig.host.store.snapshots.of(servo.uid) if not one.automatic]
    assert sorted(taken) == sorted(model.values())

"""Who may come in and what they may do, through the whole API: tokens, roles, logins, tickets, bodies, names."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar

import httpx
import pytest
from fastapi import FastAPI

from behaviour.rig import CATALOG, Rig, json, play, problem
from hornbill.api.http import create_api
from hornbill.api.security.access import Access
from hornbill.api.security.origin import LOCAL_NAMES, local_policy
from hornbill.api.security.sessions import IDLE_S, TRIES
from hornbill.app.composition import bus_log_of
from hornbill.bus.recordings.folder import RECORDINGS, FileFolder

T = TypeVar("T")
FAR = ("192.0.2.9", 5000)
HERE = ("127.0.0.1", 5000)
GIVEN = "a-token-of-the-command-line"


class Door:
    """The whole application in front of a rig's host, and people in front of it."""

    def __init__(self, rig: Rig, given: str | None = None, root_path: str = "", behind_proxy: bool = False) -> None:
        self.now = 0.0
        self.access = Access(given=given, now=lambda: self.now, wall=lambda: 1000.0 + self.now)
        self.access.open(rig.host.store)
        self.rig = rig
        self.app: FastAPI = create_api(
            CATALOG, policy=local_policy(LOCAL_NAMES), access=self.access, root_path=root_path,
            behind_proxy=behind_proxy,
        )  # fmt: skip
        self.app.state.host, self.app.state.adapters, self.app.state.bench = rig.host, rig.app.state.adapters, rig.bench

    async def token(self, name: str, role: str) -> str:
        """A token, known at once."""
        secret = self.rig.host.store.tokens.add(name, role)[1]
        await self.access.refresh()
        return secret

    @asynccontextmanager
    async def somebody(
        self, token: str | None = None, client: tuple[str, int] = FAR
    ) -> AsyncGenerator[httpx.AsyncClient]:
        """Somebody from `client`, with a cookie jar of their own."""
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        transport = httpx.ASGITransport(self.app, client=client)
        async with httpx.AsyncClient(
            transport=transport, base_url="http://localhost/api/v1", headers=headers, timeout=None
        ) as made:
            yield made


class Socket:
    """One WebSocket through the whole application."""

    def __init__(self, app: FastAPI, *headers: tuple[str, str], query: str = "", path: str = "/api/v1/ws") -> None:
        self._to: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._from: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        pairs = [(name.lower().encode(), value.encode()) for name, value in (("host", "localhost"), *headers)]
        self.scope: dict[str, Any] = {
            "type": "websocket", "path": path, "raw_path": path.encode(), "query_string": query.encode(),
            "headers": pairs, "subprotocols": [], "root_path": "", "scheme": "ws", "client": FAR,
            "server": ("test", 80), "extensions": {"websocket.http.response": {}},
        }  # fmt: skip
        self.task = asyncio.create_task(app(self.scope, self._to.get, self._from.put))  # pyright: ignore[reportArgumentType]
        self._to.put_nowait({"type": "websocket.connect"})

    async def first(self) -> str | int:
        """The type of the first answer, or the status of a refusal."""
        event = await asyncio.wait_for(self._from.get(), 10)
        return int(event["status"]) if event["type"] == "websocket.http.response.start" else str(event["type"])

    def say(self, text: str) -> None:
        self._to.put_nowait({"type": "websocket.receive", "text": text})

    async def until(self, wanted: str) -> dict[str, Any]:
        """The next event with this text in it."""
        async with asyncio.timeout(20):
            while wanted not in str(event := await self._from.get()):
                pass
        return event

    async def close(self) -> None:
        self._to.put_nowait({"type": "websocket.disconnect", "code": 1001})
        await self.task


def through(scene: Callable[[Door], Awaitable[T]], **options: Any) -> T:
    async def run(rig: Rig) -> T:
        await rig.ready()
        return await scene(Door(rig, **options))

    return play(run)


def test_without_any_token_everybody_may_do_everything() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            state = json(await one.get("/session"))
            assert (state["required"], state["role"], state["name"]) == (False, "admin", None)
            json(await one.post("/leases", json={"holder": "x", "ttl_s": 5}), 201)
            json(await one.get("/tokens"))

    through(scene)


def test_from_the_first_token_on_everybody_needs_one_and_it_is_an_admins() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            problem(await one.post("/tokens", json={"name": "rig", "role": "operate"}), "conflict", 409)
            made = json(await one.post("/tokens", json={"name": "boss", "role": "admin"}), 201)
            problem(await one.get("/servos"), "unauthorized", 401)
            async with door.somebody(made["token"]) as boss:
                listed = json(await boss.get("/tokens"))
                assert [(row["name"], row["role"]) for row in listed] == [("boss", "admin")]
                assert "token" not in listed[0]
                assert (await boss.delete("/tokens/boss")).status_code == 204
                problem(await boss.get("/servos"), "unauthorized", 401)
            problem(await one.get("/servos"), "unauthorized", 401)  # revoking the last one opens nothing

    through(scene)


STEPS: list[tuple[str, str, Any]] = [
    ("GET", "/servos", None),
    ("POST", "/leases", {"holder": "x", "ttl_s": 5}),
    ("PATCH", "/servos/{uid}/parameters", {"values": {"smoothing": True}}),
    ("GET", "/tokens", None),
]


@pytest.mark.parametrize("reach", [1, 2, 3, 4])
def test_a_role_reaches_as_far_as_it_says_and_no_farther(reach: int) -> None:
    role = ("view", "operate", "configure", "admin")[reach - 1]

    async def scene(door: Door) -> None:
        uid = door.rig.host.fleet.all()[0].uid
        async with door.somebody(await door.token("me", role)) as me:
            for at, (verb, path, body) in enumerate(STEPS):
                before = len(door.rig.writes())
                headers: dict[str, str] = {}
                if at == 2 and reach >= 2:  # the lease of the step before
                    lease = json(await me.get("/leases"))
                    assert lease[0]["holder"] == "me · x"
                    await door.rig.host.motion_control.force("t", 0.1, "test")
                    await asyncio.sleep(0.2)
                answer = await me.request(verb, path.format(uid=uid), json=body, headers=headers)
                if at < reach:
                    assert answer.is_success, answer.text
                else:
                    refused = problem(answer, "forbidden_role", 403)
                    assert (refused["role"], refused["needed"]) == (role, ("view", "operate", "configure", "admin")[at])
                    assert len(door.rig.writes()) == before, "a refused request reached the bus"

    through(scene)


@pytest.mark.parametrize("role", ["view", "operate", "configure", "admin"])
def test_every_token_may_stop(role: str) -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(await door.token("rig 3", role)) as me:
            state = json(await me.post("/stop?by=button", json={}))
            assert state["latched"]
            assert state["by"] == "rig 3 · button"

    through(scene)


def test_without_a_token_only_the_machine_itself_may_stop() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(client=FAR) as far, door.somebody(client=HERE) as near:
            problem(await far.post("/stop"), "unauthorized", 401)
            problem(await near.post("/stop", headers={"X-Forwarded-For": "127.0.0.1"}), "unauthorized", 401)
            problem(await near.post("/stop", headers={"Origin": "http://evil.example"}), "forbidden_origin", 403)
            assert not door.rig.host.stop.latched
            problem(await far.get("/health"), "unauthorized", 401)
            json(await near.get("/health"))
            json(await near.post("/stop"))
            assert door.rig.host.stop.latched
            problem(await near.delete("/stop"), "unauthorized", 401)
            problem(await near.get("/servos"), "unauthorized", 401)

    through(scene, given=GIVEN)


def test_behind_a_proxy_nobody_is_on_the_machine_itself() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(client=HERE) as through_it:
            problem(await through_it.post("/stop"), "unauthorized", 401)
            for spoofed in ("127.0.0.1", "127.0.0.1, 192.0.2.4"):
                problem(await through_it.post("/stop", headers={"X-Forwarded-For": spoofed}), "unauthorized", 401)

    through(scene, given=GIVEN, behind_proxy=True)


def test_a_login_that_has_run_out_still_stops_and_does_nothing_else() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as page:
            json(await page.post("/session", json={"token": await door.token("me", "operate")}))
            json(await page.get("/servos"))
            door.now += IDLE_S + 1
            problem(await page.get("/servos"), "unauthorized", 401)
            problem(await page.post("/leases", json={"holder": "x", "ttl_s": 5}), "unauthorized", 401)
            assert json(await page.post("/stop"))["by"] == "me · REST"
            door.rig.host.store.tokens.drop("me")
            await door.access.refresh()
            problem(await page.post("/stop"), "unauthorized", 401)

    through(scene)


def test_the_cookie_is_out_of_reach_of_scripts_and_of_other_sites() -> None:
    async def scene(door: Door) -> None:
        secret = await door.token("me", "view")
        async with door.somebody() as page:
            answer = await page.post("/session", json={"token": f" {secret}\n"})
            said = answer.headers["set-cookie"]
            assert said.startswith("hornbill_session=")
            parts = {part.strip().lower() for part in said.split(";")}
            assert {"httponly", "samesite=strict", "path=/"} <= parts
            assert "secure" not in parts
            assert secret not in said
            state = json(await page.get("/session"))
            assert (state["name"], state["role"]) == ("me", "view")
            assert 0 < state["expires_in_s"] <= IDLE_S
            assert (await page.delete("/session")).status_code == 204
            problem(await page.get("/servos"), "unauthorized", 401)

    through(scene)


def test_under_tls_and_a_sub_path_the_cookie_is_secure_and_goes_nowhere_else() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as page:
            answer = await page.post("/session", json={"token": GIVEN}, headers={"X-Forwarded-Proto": "https"})
            parts = {part.strip().lower() for part in answer.headers["set-cookie"].split(";")}
            assert {"secure", "path=/hornbill"} <= parts

    through(scene, given=GIVEN, root_path="/hornbill", behind_proxy=True)


def test_logins_that_fail_too_often_have_to_wait_and_programs_with_a_token_do_not() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as page, door.somebody(GIVEN) as program:
            for _ in range(TRIES):
                problem(await page.post("/session", json={"token": "wrong"}), "unauthorized", 401)
            refused = problem(await page.post("/session", json={"token": GIVEN}), "too_many_attempts", 429)
            assert refused["retry_after_s"] > 0
            json(await program.get("/servos"))
            door.now += 61
            json(await page.post("/session", json={"token": GIVEN}))

    through(scene, given=GIVEN)


def test_a_ticket_opens_one_socket_once() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(GIVEN) as me:
            ticket = json(await me.post("/tickets"), 201)["ticket"]
        opened = Socket(door.app, query=f"ticket={ticket}&x=1")
        assert await opened.first() == "websocket.accept"
        assert ticket.encode() not in opened.scope["query_string"]
        await opened.close()
        for query in (f"ticket={ticket}", "ticket=", "ticket=x", ""):
            assert await Socket(door.app, query=query).first() == 401

    through(scene, given=GIVEN)


def test_a_socket_obeys_the_role_it_came_with() -> None:
    async def scene(door: Door) -> None:
        uid = door.rig.host.fleet.all()[0].uid
        bearer = ("Authorization", f"Bearer {await door.token('watcher', 'view')}")
        socket = Socket(door.app, bearer)
        assert await socket.first() == "websocket.accept"
        for said in (
            f'{{"type":"command","lease":"x","commands":[{{"uid":"{uid}","type":"angle","value":1}}]}}',
            '{"type":"heartbeat","lease":"x"}',
        ):
            socket.say(said)
            await socket.until("forbidden_role")
        socket.say('{"type":"stop","mode":"off","by":"page","reason":"test"}')
        await socket.until("watcher · page")
        assert door.rig.host.stop.latched
        await socket.close()

    through(scene)


def test_revoking_a_token_ends_its_sockets_and_logging_out_those_of_the_page() -> None:
    async def scene(door: Door) -> None:
        secret = await door.token("me", "view")
        by_header = Socket(door.app, ("Authorization", f"Bearer {secret}"))
        async with door.somebody() as page:
            json(await page.post("/session", json={"token": secret}))
            by_cookie = Socket(door.app, ("Cookie", f"other=1; hornbill_session={page.cookies['hornbill_session']}"))
            assert await by_header.first() == await by_cookie.first() == "websocket.accept"
            await page.delete("/session")
            assert (await by_cookie.until("websocket.close"))["code"] == 4401
            assert not by_header.task.done()
        door.rig.host.store.tokens.drop("me")
        await door.access.refresh()
        assert (await by_header.until("websocket.close"))["code"] == 4401
        await asyncio.wait_for(asyncio.gather(by_header.task, by_cookie.task), 5)

    through(scene)


def test_a_page_that_is_thrown_out_gives_up_its_lease_as_a_closed_one_does() -> None:
    async def scene(door: Door) -> None:
        secret = await door.token("me", "operate")
        socket = Socket(door.app, ("Authorization", f"Bearer {secret}"))
        assert await socket.first() == "websocket.accept"
        async with door.somebody(secret) as me:
            lease = json(await me.post("/leases", json={"holder": "page", "ttl_s": 60}), 201)["id"]
            socket.say(f'{{"type":"heartbeat","lease":"{lease}"}}')
            await asyncio.sleep(0.2)
        door.rig.host.store.tokens.drop("me")
        await door.access.refresh()
        await socket.until("websocket.close")
        assert door.rig.host.leases.current(door.rig.host.base.now()) is None

    through(scene)


def test_a_socket_of_a_foreign_page_is_refused_whatever_it_brings() -> None:
    async def scene(door: Door) -> None:
        for path in ("/api/v1/ws", "/viser", "/viser/0123"):
            headers = (("Authorization", f"Bearer {GIVEN}"), ("Origin", "http://localhost:9000"))
            assert await Socket(door.app, *headers, path=path).first() == 403

    through(scene, given=GIVEN)


def test_audit_and_lease_bear_the_name_that_was_proved_not_the_one_that_is_said() -> None:
    async def scene(door: Door) -> None:
        uid = door.rig.host.fleet.all()[0].uid
        async with door.somebody(await door.token("alice", "admin")) as alice:
            json(await alice.patch(f"/servos/{uid}", json={"label": "left"}))
            lease = json(await alice.post("/leases", json={"holder": "bob · page 1", "ttl_s": 60}), 201)
            assert lease["holder"] == "alice · bob · page 1"
            await alice.delete(f"/leases/{lease['id']}")
            own = json(await alice.post("/leases", json={"holder": "alice · page 1", "ttl_s": 60}), 201)
            assert own["holder"] == "alice · page 1"
            json(await alice.post("/tokens", json={"name": "new", "role": "view"}), 201)
            rows = json(await alice.get("/audit"))
            assert ("alice", "label") in {(row["by"], row["action"]) for row in rows}
            assert ("alice", "token", "new") in {(row["by"], row["action"], row["key"]) for row in rows}

    through(scene)


def test_when_a_token_was_used_last_is_shown_and_kept() -> None:
    async def scene(door: Door) -> None:
        secret = await door.token("me", "admin")
        async with door.somebody(secret) as me:
            assert json(await me.get("/tokens"))[0]["last_used_at"] == 1000.0
            door.now = 61.0
            json(await me.get("/servos"))
            await door.access.refresh()
            assert door.rig.host.store.tokens.all()[0].last_used_at == 1061.0

    through(scene)


@pytest.mark.parametrize(
    ("media", "body"),
    [
        ("text/plain", b'{"mode":"off"}'),
        ("application/x-www-form-urlencoded", b"mode=off"),
        ("multipart/form-data; boundary=x", b"--x--"),
        ("", b'{"mode":"off"}'),
        ("application/jsonp", b"{}"),
    ],
)
def test_a_body_that_is_not_declared_as_json_is_refused_and_does_nothing(media: str, body: bytes) -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            answer = await one.post("/stop", content=body, headers={"Content-Type": media})
            problem(answer, "unsupported_media_type", 415)
            assert not door.rig.host.stop.latched
            for path in ("/profiles/x/file", "/recorder/recordings/x.zip"):
                sent = media or "text/plain"
                if sent != "application/jsonp":
                    problem(
                        await one.put(path, content=body, headers={"Content-Type": sent}), "unsupported_media_type", 415
                    )

    through(scene)


def test_a_body_beyond_the_limit_is_refused_told_or_not() -> None:
    async def chunks() -> AsyncIterator[bytes]:
        for _ in range(3):
            yield b" " * (1 << 19)

    async def scene(door: Door) -> None:
        kind = {"Content-Type": "application/json"}
        async with door.somebody() as one:
            refused = problem(await one.post("/stop", content=b" " * ((1 << 20) + 1), headers=kind), "too_large", 413)
            assert refused["limit_bytes"] == 1 << 20
            problem(await one.post("/stop", content=chunks(), headers=kind), "too_large", 413)
            assert not door.rig.host.stop.latched

    through(scene)


def test_every_answer_says_that_it_is_no_page_and_not_to_be_kept() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            for path in ("/servos", "/nothing", "/audit.csv", "/stop", "/openapi.json"):
                headers = (await one.get(path)).headers
                assert headers["content-security-policy"] == "default-src 'none'; frame-ancestors 'none'", path
                assert headers["x-content-type-options"] == "nosniff"
                assert headers["referrer-policy"] == "no-referrer"
                assert headers["cross-origin-resource-policy"] == "same-origin"
                assert headers["cache-control"] == "no-store"
                assert not any(name.startswith("access-control-") for name in headers)

    through(scene)


def test_no_secret_is_in_what_a_refusal_or_an_error_says() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody("hb_secret-in-the-header") as one:
            answers = [
                await one.get("/servos"),
                await one.post("/session", json={"token": "hb_secret-in-the-body"}),
                await one.post("/session", json={"token": ["hb_secret-in-the-body"]}),
                await one.post("/session", json={"token": "hb_secret" * 50}),
            ]
        assert [one.status_code for one in answers] == [401, 401, 422, 422]
        assert not any("hb_secret" in answer.text for answer in answers)

    through(scene, given=GIVEN)


@pytest.mark.parametrize("name", ["..%2f..%2fhornbill.sqlite3", "%2e%2e%2fx", "a%00b", "..%5cx", "%2fetc%2fpasswd"])
def test_no_name_in_an_address_leads_out_of_a_folder(name: str, tmp_path: Path) -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            for path in (f"/bus/logs/{name}", f"/recorder/recordings/{name}", f"/recorder/recordings/{name}/content"):
                answer = await one.get(path)
                assert answer.status_code in (404, 422), (path, answer.text)
                assert b"SQLite format" not in answer.content

    async def run(rig: Rig) -> None:
        (tmp_path / "hornbill.sqlite3").write_bytes(b"SQLite format")
        (tmp_path / "logs").mkdir()
        door = Door(rig)
        door.app.state.bus_log = bus_log_of(rig.host, tmp_path / "logs")
        door.app.state.recordings = FileFolder(tmp_path / "logs", RECORDINGS)
        await scene(door)

    play(run, connect=False)

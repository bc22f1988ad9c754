"""Access to the API: tokens, roles, logins, tickets, local clients, bodies, addresses and file names."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from behaviour.secured import GIVEN, LOCAL, REMOTE, RawSocket, SecuredServer, secured
from hornbill.api.security.sessions import IDLE_S, TRIES
from hornbill.app.composition import bus_log_of
from hornbill.bus.recordings.folder import RECORDINGS, FileFolder


@secured()
async def test_without_tokens_the_api_is_open_and_the_first_one_must_be_an_admins(
    server: SecuredServer, client: httpx.AsyncClient
) -> None:
    state = json(await client.get("/session"))
    assert (state["required"], state["role"], state["name"]) == (False, "admin", None)
    json(await client.post("/leases", json={"holder": "x", "ttl_s": 5}), 201)
    problem(await client.post("/tokens", json={"name": "rig", "role": "operate"}), "conflict", 409)
    made = json(await client.post("/tokens", json={"name": "boss", "role": "admin"}), 201)
    problem(await client.get("/servos"), "unauthorized", 401)
    async with server.client(made["token"]) as boss:
        listed = json(await boss.get("/tokens"))
        assert [(row["name"], row["role"]) for row in listed] == [("boss", "admin")]
        assert "token" not in listed[0]
        assert (await boss.delete("/tokens/boss")).status_code == 204
        problem(await boss.get("/servos"), "unauthorized", 401)
    problem(await client.get("/servos"), "unauthorized", 401)  # revoking the last token does not open the API


ROLES = ("view", "operate", "configure", "admin")
STEPS: list[tuple[str, str, Any]] = [
    ("GET", "/servos", None),
    ("POST", "/leases", {"holder": "x", "ttl_s": 5}),
    ("PATCH", "/servos/{uid}/parameters", {"values": {"smoothing": True}}),
    ("GET", "/tokens", None),
]
"""What each role is needed for."""


@pytest.mark.parametrize("role", ROLES)
@secured()
async def test_a_role_allows_what_it_includes_and_a_stop_and_nothing_more(server: SecuredServer, role: str) -> None:
    uid, headers = server.rig.host.fleet.all()[0].uid, dict[str, str]()
    async with server.client(await server.token("rig 3", role)) as me:
        for needed, (verb, path, body) in zip(ROLES, STEPS, strict=True):
            before = len(server.rig.writes())
            response = await me.request(verb, path.format(uid=uid), json=body, headers=headers)
            if ROLES.index(needed) > ROLES.index(role):
                refused = problem(response, "forbidden_role", 403)
                assert (refused["role"], refused["needed"]) == (role, needed)
                assert len(server.rig.writes()) == before, "a refused request reached the bus"
                continue
            assert response.is_success, response.text
            if path == "/leases":
                assert response.json()["holder"] == "rig 3 · x"
                headers["Lease"] = response.json()["id"]
        state = json(await me.post("/stop?by=button", json={}))
        assert (state["latched"], state["by"]) == (True, "rig 3 · button")


@secured(given=GIVEN)
async def test_without_a_token_only_a_local_client_may_stop(server: SecuredServer, client: httpx.AsyncClient) -> None:
    for host in (REMOTE[0], "::ffff:192.0.2.9", "127.0.0.1.example", ""):
        async with server.client(address=(host, 5000)) as far:
            problem(await far.post("/stop"), "unauthorized", 401)
            problem(await far.get("/servos"), "unauthorized", 401)
    problem(await client.get("/health"), "unauthorized", 401)
    async with server.client(address=LOCAL) as near:
        problem(await near.post("/stop", headers={"X-Forwarded-For": "127.0.0.1"}), "unauthorized", 401)
        problem(await near.post("/stop", headers={"Origin": "http://evil.example"}), "forbidden_origin", 403)
        assert not server.rig.host.stop.latched
        json(await near.get("/health"))
    for host in (LOCAL[0], "::ffff:127.0.0.1", "::1", "127.0.0.9"):
        async with server.client(address=(host, 5000)) as near:
            json(await near.post("/stop"))
            assert server.rig.host.stop.latched
            problem(await near.delete("/stop"), "unauthorized", 401)
            problem(await near.get("/servos"), "unauthorized", 401)
        server.rig.host.stop.clear("test")


@secured(given=GIVEN, behind_proxy=True)
async def test_behind_a_proxy_no_client_counts_as_local(server: SecuredServer) -> None:
    async with server.client(address=LOCAL) as proxied:
        problem(await proxied.post("/stop"), "unauthorized", 401)
        for spoofed in ("127.0.0.1", "127.0.0.1, 192.0.2.4"):
            problem(await proxied.post("/stop", headers={"X-Forwarded-For": spoofed}), "unauthorized", 401)


@secured()
async def test_a_login_has_a_cookie_for_this_site_alone_and_once_expired_can_only_stop(server: SecuredServer) -> None:
    secret = await server.token("me", "operate")
    async with server.client() as page:
        response = await page.post("/session", json={"token": f" {secret}\n"})
        cookie = response.headers["set-cookie"]
        assert cookie.startswith("hornbill_session=")
        parts = {part.strip().lower() for part in cookie.split(";")}
        assert {"httponly", "samesite=strict", "path=/"} <= parts
        assert "secure" not in parts
        assert secret not in cookie
        state = json(await page.get("/session"))
        assert (state["name"], state["role"]) == ("me", "operate")
        assert 0 < state["expires_in_s"] <= IDLE_S
        assert (await page.delete("/session")).status_code == 204
        problem(await page.get("/servos"), "unauthorized", 401)
        json(await page.post("/session", json={"token": secret}))
        json(await page.get("/servos"))
        server.now += IDLE_S + 1
        problem(await page.get("/servos"), "unauthorized", 401)
        problem(await page.post("/leases", json={"holder": "x", "ttl_s": 5}), "unauthorized", 401)
        assert json(await page.post("/stop"))["by"] == "me · REST"
        await server.revoke("me")
        problem(await page.post("/stop"), "unauthorized", 401)


@secured(given=GIVEN, root_path="/hornbill", behind_proxy=True)
async def test_under_tls_the_cookie_is_secure_and_scoped(server: SecuredServer, client: httpx.AsyncClient) -> None:
    response = await client.post("/session", json={"token": GIVEN}, headers={"X-Forwarded-Proto": "https"})
    parts = {part.strip().lower() for part in response.headers["set-cookie"].split(";")}
    assert {"secure", "path=/hornbill"} <= parts


@secured(given=GIVEN)
async def test_too_many_failed_logins_must_wait_but_bearer_tokens_do_not(server: SecuredServer) -> None:
    async with server.client() as page, server.client(GIVEN) as program:
        for _ in range(TRIES):
            problem(await page.post("/session", json={"token": "wrong"}), "unauthorized", 401)
        refused = problem(await page.post("/session", json={"token": GIVEN}), "too_many_attempts", 429)
        assert refused["retry_after_s"] > 0
        json(await program.get("/servos"))
        server.now += 61
        json(await page.post("/session", json={"token": GIVEN}))


@secured()
async def test_a_socket_has_the_role_of_its_token(server: SecuredServer) -> None:
    uid = server.rig.host.fleet.all()[0].uid
    bearer = ("Authorization", f"Bearer {await server.token('watcher', 'view')}")
    socket = RawSocket(server.app, bearer)
    assert await socket.first() == "websocket.accept"
    for message in (
        f'{{"type":"command","lease":"x","commands":[{{"uid":"{uid}","type":"angle","value":1}}]}}',
        '{"type":"heartbeat","lease":"x"}',
    ):
        socket.send(message)
        await socket.until("forbidden_role")
    socket.send('{"type":"stop","mode":"off","by":"page","reason":"test"}')
    await socket.until("watcher · page")
    assert server.rig.host.stop.latched
    await socket.close()


@secured()
async def test_the_first_token_a_logout_and_a_revocation_close_sockets(server: SecuredServer) -> None:
    def leased() -> bool:
        return server.rig.host.leases.current(server.rig.host.base.now()) is not None

    async def hold(socket: RawSocket, lease: str) -> None:
        socket.send(f'{{"type": "heartbeat", "lease": "{lease}"}}')
        await socket.until("expires_in_s")

    early = RawSocket(server.app)
    assert await early.first() == "websocket.accept"
    await hold(early, server.rig.host.leases.grant("early", 60.0, server.rig.host.base.now()).id)
    secret = await server.token("me", "operate")
    assert (await early.until("websocket.close"))["code"] == 4401
    assert not leased()

    by_header = RawSocket(server.app, ("Authorization", f"Bearer {secret}"))
    async with server.client() as page:
        json(await page.post("/session", json={"token": secret}))
        by_cookie = RawSocket(server.app, ("Cookie", f"other=1; hornbill_session={page.cookies['hornbill_session']}"))
        assert await by_header.first() == await by_cookie.first() == "websocket.accept"
        await hold(by_header, json(await page.post("/leases", json={"holder": "page", "ttl_s": 60}), 201)["id"])
        await page.delete("/session")
        assert (await by_cookie.until("websocket.close"))["code"] == 4401
        assert not by_header.task.done()
    assert leased()
    await server.revoke("me")
    assert (await by_header.until("websocket.close"))["code"] == 4401
    await asyncio.wait_for(asyncio.gather(by_header.task, by_cookie.task), 5)
    assert not leased()


@secured(given=GIVEN)
async def test_a_ticket_opens_one_socket_once_and_a_foreign_origin_none(server: SecuredServer) -> None:
    async with server.client(GIVEN) as me:
        ticket = json(await me.post("/tickets"), 201)["ticket"]
    opened = RawSocket(server.app, query=f"ticket={ticket}&x=1")
    assert await opened.first() == "websocket.accept"
    assert ticket.encode() not in opened.scope["query_string"]
    await opened.close()
    for query in (f"ticket={ticket}", "ticket=", "ticket=x", ""):
        assert await RawSocket(server.app, query=query).first() == 401
    for path in ("/api/v1/ws", "/viser", "/viser/0123"):
        headers = (("Authorization", f"Bearer {GIVEN}"), ("Origin", "http://localhost:9000"))
        assert await RawSocket(server.app, *headers, path=path).first() == 403


@secured()
async def test_audit_leases_and_tokens_record_who_used_a_token_and_when(server: SecuredServer) -> None:
    uid = server.rig.host.fleet.all()[0].uid
    async with server.client(await server.token("alice", "admin")) as alice:
        assert json(await alice.get("/tokens"))[0]["last_used_at"] == 1000.0
        server.now = 61.0
        json(await alice.patch(f"/servos/{uid}", json={"label": "left"}))
        await server.access.refresh()
        assert server.rig.host.store.tokens.all()[0].last_used_at == 1061.0
        for holder in ("bob · page 1", "alice · page 1"):
            lease = json(await alice.post("/leases", json={"holder": holder, "ttl_s": 60}), 201)
            assert lease["holder"] == f"alice · {holder.removeprefix('alice · ')}"
            await alice.delete(f"/leases/{lease['id']}")
        json(await alice.post("/tokens", json={"name": "new", "role": "view"}), 201)
        rows = json(await alice.get("/audit"))
        assert {("alice", "label", "label"), ("alice", "token", "new")} <= {
            (row["by"], row["action"], row["key"] or row["action"]) for row in rows
        }


@secured()
async def test_a_body_not_declared_as_json_or_above_the_limit_is_rejected(
    server: SecuredServer, client: httpx.AsyncClient
) -> None:
    async def chunks() -> AsyncIterator[bytes]:
        for _ in range(3):
            yield b" " * (1 << 19)

    for media, body in (
        ("text/plain", b'{"mode":"off"}'), ("application/x-www-form-urlencoded", b"mode=off"),
        ("multipart/form-data; boundary=x", b"--x--"), ("", b'{"mode":"off"}'), ("application/jsonp", b"{}"),
    ):  # fmt: skip
        headers = {"Content-Type": media}
        problem(await client.post("/stop", content=body, headers=headers), "unsupported_media_type", 415)
        for path in ("/profiles/x/file", "/recorder/recordings/x.zip"):
            if media and media != "application/jsonp":
                response = await client.put(path, content=body, headers=headers)
                problem(response, "unsupported_media_type", 415)
    headers = {"Content-Type": "application/json"}
    for content in (b" " * ((1 << 20) + 1), chunks()):
        refused = problem(await client.post("/stop", content=content, headers=headers), "too_large", 413)
        assert refused["limit_bytes"] == 1 << 20
    assert not server.rig.host.stop.latched


@secured(given=GIVEN)
async def test_no_rejection_repeats_a_secret_and_every_response_forbids_framing_and_caching(
    server: SecuredServer,
) -> None:
    async with server.client("hb_secret-in-the-header") as guess, server.client(GIVEN) as client:
        responses = [
            await guess.get("/servos"),
            await guess.post("/session", json={"token": "hb_secret-in-the-body"}),
            await guess.post("/session", json={"token": ["hb_secret-in-the-body"]}),
            await guess.post("/session", json={"token": "hb_secret" * 50}),
        ]
        assert [one.status_code for one in responses] == [401, 401, 422, 422]
        assert not any("hb_secret" in response.text for response in responses)
        responses += [await client.get(path) for path in ("/servos", "/nothing", "/audit.csv", "/stop")]
    for headers in (response.headers for response in responses):
        assert headers["content-security-policy"] == "default-src 'none'; frame-ancestors 'none'"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert headers["cache-control"] == "no-store"
        assert not any(name.startswith("access-control-") for name in headers)


@scene(connect=False)
async def test_no_file_name_escapes_its_folder(rig: Rig, tmp_path: Path) -> None:
    (tmp_path / "hornbill.sqlite3").write_bytes(b"SQLite format")
    (tmp_path / "logs").mkdir()
    server = SecuredServer(rig)
    server.app.state.bus_log = bus_log_of(rig.host, tmp_path / "logs")
    server.app.state.recordings = FileFolder(tmp_path / "logs", RECORDINGS)
    async with server.client() as client:
        for name in (
            "..%2f..%2fhornbill.sqlite3", "..%2Fhornbill.sqlite3", "%2e%2e/hornbill.sqlite3", "%2e%2e%2fx", "a%00b",
            "..%5cx", "..\\hornbill.log", "%2fetc%2fpasswd", ".log",
        ):  # fmt: skip
            for path in (f"/bus/logs/{name}", f"/recorder/recordings/{name}", f"/recorder/recordings/{name}/content"):
                for verb in ("GET", "DELETE"):
                    response = await client.request(verb, path)
                    assert response.status_code in (404, 405, 422), (path, response.text)
                    assert b"SQLite format" not in response.content
    assert (tmp_path / "hornbill.sqlite3").exists()


@pytest.mark.parametrize("chunked", [True, False])
@secured()
async def test_a_body_after_the_revocation_of_its_token_has_no_effect(server: SecuredServer, chunked: bool) -> None:
    boss, leaving = await server.token("boss", "admin"), await server.token("leaving", "admin")
    body = b'{"name": "backdoor", "role": "admin"}'
    started = asyncio.Event()

    async def slowly() -> AsyncIterator[bytes]:
        yield body[:5]
        started.set()
        await asyncio.sleep(60)
        yield body[5:]

    headers = {"Content-Type": "application/json"} | ({} if chunked else {"Content-Length": str(len(body))})
    async with server.client(leaving) as client, server.client(boss) as other:
        posting = asyncio.create_task(client.post("/tokens", content=slowly(), headers=headers))
        await started.wait()
        assert (await other.delete("/tokens/leaving")).status_code == 204
        problem(await posting, "unauthorized", 401)
        assert [each["name"] for each in json(await other.get("/tokens"))] == ["boss"]


@scene()
async def test_a_stop_with_overlong_texts_stops(rig: Rig) -> None:
    await rig.ready()
    for query, body in (
        ("?by=" + "x" * 5000, None),
        ("", {"reason": "x" * 5000}),
        ("?by=rig", {"mode": "brake", "reason": "é" * 300}),
    ):
        state = json(await rig.call("POST", f"/stop{query}", body))
        assert state["latched"]
        assert len(state["by"]) <= 80
        assert len(state["reason"]) <= 200
        json(await rig.call("DELETE", "/stop"))
    page = Socket(rig.app)
    page.send(type="stop", by="x" * 500, reason="y" * 5000)
    await asyncio.sleep(0.1)
    assert rig.host.stop.latched
    await page.close()


ODD = (
    "//api/v1/tokens", "/api//v1/tokens", "/api/v1/tokens/", "/api/v1/tokens%0a", "/api/v1/tokens;x", "/API/v1/tokens",
    "/api/v1/%74okens", "/api/v1/session/../tokens", "/viser/../api/v1/tokens", "/api/v1/session%2f..%2ftokens",
    "/api/v1/servos%00", "/api/v1/./servos", "/api/v1/servos/", "/api/v1/servos%0a", "/metrics/", "/metrics%0a",
)  # fmt: skip


@secured()
async def test_no_spelling_of_a_path_bypasses_authentication(server: SecuredServer) -> None:
    secret = await server.token("boss", "admin")
    transport = httpx.ASGITransport(server.app, client=REMOTE)
    async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
        for path in ODD:
            for verb in ("GET", "HEAD", "OPTIONS", "POST", "PUT", "DELETE", "TRACE", "get", "HeLLo"):
                response = await client.request(verb, httpx.URL("http://localhost", raw_path=path.encode()), json={})
                # 503: the page's own file, which is not built here
                assert response.status_code in (401, 404, 405, 503), f"{verb} {path}: {response.text}"
                assert "boss" not in response.text
                assert secret not in response.text
    assert [each.name for each in server.rig.host.store.tokens.all()] == ["boss"]

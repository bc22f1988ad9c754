"""Odd ways in: sockets from before the first token, bodies that never end, a stop with too much to say, odd paths."""

import asyncio
from collections.abc import AsyncIterator

import httpx
import pytest

from behaviour.rig import Rig, json, problem
from behaviour.rig import Socket as Plain
from behaviour.scene import scene
from behaviour.test_access import FAR, HERE, Door, Socket, through

MAPPED = ("::ffff:127.0.0.1", 5000)


def test_a_socket_from_before_the_first_token_ends_with_it_and_lets_go() -> None:
    async def scene(door: Door) -> None:
        early = Socket(door.app)
        assert await early.first() == "websocket.accept"
        lease = door.rig.host.leases.grant("early", 60.0, door.rig.host.base.now())
        early.say(f'{{"type": "heartbeat", "lease": "{lease.id}"}}')
        await early.until("expires_in_s")
        await door.token("me", "admin")
        ended = await early.until("websocket.close")
        assert ended["code"] == 4401
        assert door.rig.host.leases.current(door.rig.host.base.now()) is None

    through(scene)


@pytest.mark.parametrize("chunked", [True, False])
def test_a_body_that_comes_after_the_token_was_revoked_does_nothing(chunked: bool) -> None:
    async def scene(door: Door) -> None:
        boss, leaving = await door.token("boss", "admin"), await door.token("leaving", "admin")
        body = b'{"name": "backdoor", "role": "admin"}'
        asked = asyncio.Event()

        async def slowly() -> AsyncIterator[bytes]:
            yield body[:5]
            asked.set()
            await asyncio.sleep(60)
            yield body[5:]

        headers = {"Content-Type": "application/json"} | ({} if chunked else {"Content-Length": str(len(body))})
        async with door.somebody(leaving) as one, door.somebody(boss) as other:
            posting = asyncio.create_task(one.post("/tokens", content=slowly(), headers=headers))
            await asked.wait()
            assert (await other.delete("/tokens/leaving")).status_code == 204
            problem(await posting, "unauthorized", 401)
            assert [each["name"] for each in json(await other.get("/tokens"))] == ["boss"]

    through(scene)


@pytest.mark.parametrize("address", [HERE, MAPPED, ("::1", 5000), ("127.0.0.9", 5000)])
def test_the_machine_itself_stops_without_a_token_however_its_address_is_written(address: tuple[str, int]) -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(client=address) as one:
            assert json(await one.post("/stop"))["latched"]
            problem(await one.get("/servos"), "unauthorized", 401)

    through(scene, given="a-token-of-the-command-line")


@pytest.mark.parametrize("address", [FAR, ("::ffff:192.0.2.9", 5000), ("127.0.0.1.example", 5000), ("", 0)])
def test_nobody_else_does(address: tuple[str, int]) -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(client=address) as one:
            problem(await one.post("/stop"), "unauthorized", 401)

    through(scene, given="a-token-of-the-command-line")


@pytest.mark.parametrize(
    ("query", "body"),
    [("?by=" + "x" * 5000, None), ("", {"reason": "x" * 5000}), ("?by=rig", {"mode": "brake", "reason": "é" * 300})],
)
@scene()
async def test_a_stop_that_has_too_much_to_say_stops_all_the_same(rig: Rig, query: str, body: object) -> None:
    await rig.ready()
    said = json(await rig.call("POST", f"/stop{query}", body))
    assert said["latched"]
    assert len(said["by"]) <= 80
    assert len(said["reason"]) <= 200


@scene()
async def test_a_stop_over_the_socket_that_has_too_much_to_say_stops_all_the_same(rig: Rig) -> None:
    await rig.ready()
    page = Plain(rig.app)
    page.say(type="stop", by="x" * 500, reason="y" * 5000)
    await asyncio.sleep(0.1)
    assert rig.host.stop.latched
    await page.close()


ODD = (
    "//api/v1/tokens", "/api//v1/tokens", "/api/v1/tokens/", "/api/v1/tokens%0a", "/api/v1/tokens;x", "/API/v1/tokens",
    "/api/v1/%74okens", "/api/v1/session/../tokens", "/viser/../api/v1/tokens", "/api/v1/session%2f..%2ftokens",
    "/api/v1/servos%00", "/api/v1/./servos", "/api/v1/servos/", "/api/v1/servos%0a", "/metrics/", "/metrics%0a",
)  # fmt: skip


def test_no_way_of_writing_a_path_reads_or_does_anything_without_a_token() -> None:
    async def scene(door: Door) -> None:
        kept = await door.token("boss", "admin")
        transport = httpx.ASGITransport(door.app, client=FAR)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as one:
            for path in ODD:
                for verb in ("GET", "HEAD", "OPTIONS", "POST", "PUT", "DELETE", "TRACE", "get", "HeLLo"):
                    answer = await one.request(verb, httpx.URL("http://localhost", raw_path=path.encode()), json={})
                    # 503: that is the page's own file, which is not built here
                    assert answer.status_code in (401, 404, 405, 503), f"{verb} {path}: {answer.text}"
                    assert "boss" not in answer.text
                    assert kept not in answer.text
        assert [each.name for each in door.rig.host.store.tokens.all()] == ["boss"]

    through(scene)

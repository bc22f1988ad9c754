"""Guessed tokens: how many may be wrong, who must wait then, and that Stop and authenticated clients never do."""

import httpx

from behaviour.rig import json, problem
from behaviour.secured import GIVEN, LOCAL, RawSocket, SecuredServer, secured
from hornbill.api.security.sessions import TRIES

OTHER = ("192.0.2.10", 5000)


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


async def guess(client: httpx.AsyncClient, count: int = TRIES, path: str = "/servos", name: str = "guess") -> None:
    for n in range(count):
        problem(await client.get(path, headers=bearer(f"{name}-{n}")), "unauthorized", 401)


def refused(response: httpx.Response) -> int:
    """Seconds to wait, given in the header and the body of a rejection."""
    found = problem(response, "too_many_attempts", 429)
    assert response.headers["retry-after"] == str(found["retry_after_s"])
    return int(found["retry_after_s"])


@secured(given=GIVEN)
async def test_too_many_wrong_tokens_block_every_token(server: SecuredServer, client: httpx.AsyncClient) -> None:
    await guess(client)
    assert refused(await client.get("/servos", headers=bearer("one-more"))) == 60
    refused(await client.get("/servos", headers=bearer(GIVEN)))  # or the response would reveal the right guess
    refused(await client.get("/session", headers=bearer(GIVEN)))
    refused(await client.post("/leases", headers=bearer(GIVEN), json={"holder": "x", "ttl_s": 5}))
    problem(await client.get("/servos"), "unauthorized", 401)  # without a token, that is the error
    server.now += 59
    assert refused(await client.get("/servos", headers=bearer(GIVEN))) == 1
    server.now += 1
    json(await client.get("/servos", headers=bearer(GIVEN)))


@secured()
async def test_an_authenticated_client_continues_beside_guesses_from_the_same_address(server: SecuredServer) -> None:
    async with server.client() as client, server.client(await server.token("rig", "operate")) as rig:
        json(await rig.get("/servos"))
        await guess(client)
        refused(await client.get("/servos", headers=bearer("one-more")))
        json(await rig.get("/servos"))
        json(await rig.post("/leases", json={"holder": "x", "ttl_s": 5}), 201)
        await server.revoke("rig")
        problem(await rig.get("/servos"), "unauthorized", 401)
        refused(await rig.get("/servos"))  # once revoked, it is a guess


@secured()
async def test_a_stop_with_a_valid_token_never_waits_and_with_a_wrong_one_counts(
    server: SecuredServer, client: httpx.AsyncClient
) -> None:
    secrets = [await server.token(role, role) for role in ("view", "admin")]
    for n in range(TRIES):
        problem(await client.post("/stop", headers=bearer(f"guess-{n}")), "unauthorized", 401)
    for secret in secrets:
        refused(await client.get("/servos", headers=bearer(secret)))
        problem(await client.post("/stop", headers=bearer("wrong")), "unauthorized", 401)
        assert not server.rig.host.stop.latched
        assert json(await client.post("/stop", headers=bearer(secret)))["latched"]
        server.rig.host.stop.clear("test")


@secured(given=GIVEN)
async def test_a_program_that_repeats_a_revoked_token_locks_out_no_one(server: SecuredServer) -> None:
    async with server.client("revoked-long-ago") as old, server.client(GIVEN) as new:
        for _ in range(TRIES * 3):
            problem(await old.get("/servos"), "unauthorized", 401)
        json(await new.get("/servos"))


@secured(given=GIVEN)
async def test_an_address_or_ipv6_network_is_limited_alone_and_a_local_stop_never(server: SecuredServer) -> None:
    async with server.client(address=LOCAL) as client:
        await guess(client)
        refused(await client.get("/servos", headers=bearer(GIVEN)))
        json(await client.get("/health"))
        assert json(await client.post("/stop", headers=bearer("wrong")))["latched"]
    for n in range(TRIES):
        async with server.client(address=(f"2001:db8:0:7::{n:x}", 5000)) as client:
            await guess(client, 1, name=f"from-{n}")
    async with server.client(address=("2001:db8:0:7:ffff::1", 5000)) as client:
        refused(await client.get("/servos", headers=bearer(GIVEN)))
    async with server.client(address=("2001:db8:0:8::1", 5000)) as neighbour:
        json(await neighbour.get("/servos", headers=bearer(GIVEN)))


@secured(given=GIVEN)
async def test_guesses_over_sockets_count(server: SecuredServer) -> None:
    for n in range(TRIES):
        assert await RawSocket(server.app, ("Authorization", f"Bearer guess-{n}")).first() == 401
    assert await RawSocket(server.app, ("Authorization", f"Bearer {GIVEN}")).first() == 429
    async with server.client() as client:
        refused(await client.get("/servos", headers=bearer(GIVEN)))


@secured()
async def test_an_open_api_counts_no_wrong_tokens(server: SecuredServer, client: httpx.AsyncClient) -> None:
    for n in range(TRIES * 2):
        json(await client.get("/servos", headers=bearer(f"left-over-{n}")))

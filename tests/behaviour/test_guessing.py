"""Tokens that are guessed: how many may be wrong, who has to wait then, and that Stop and who is at work never do."""

import httpx
import pytest

from behaviour.rig import json, problem
from behaviour.test_access import FAR, GIVEN, HERE, Door, Socket, through
from hornbill.api.security.sessions import TRIES

OTHER = ("192.0.2.10", 5000)


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


async def guess(one: httpx.AsyncClient, count: int = TRIES, path: str = "/servos", name: str = "guess") -> None:
    for n in range(count):
        problem(await one.get(path, headers=bearer(f"{name}-{n}")), "unauthorized", 401)


def refused(answer: httpx.Response) -> int:
    """Seconds to wait, of a refusal that says so in both places."""
    found = problem(answer, "too_many_attempts", 429)
    assert answer.headers["retry-after"] == str(found["retry_after_s"])
    return int(found["retry_after_s"])


def test_after_too_many_wrong_tokens_the_next_one_is_not_even_looked_at() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            await guess(one)
            assert refused(await one.get("/servos", headers=bearer("one-more"))) == 60
            refused(await one.get("/servos", headers=bearer(GIVEN)))  # else the right guess would be told apart
            refused(await one.get("/session", headers=bearer(GIVEN)))
            refused(await one.post("/leases", headers=bearer(GIVEN), json={"holder": "x", "ttl_s": 5}))
            problem(await one.get("/servos"), "unauthorized", 401)  # whoever guesses nothing is told what is missing
            door.now += 59
            assert refused(await one.get("/servos", headers=bearer(GIVEN))) == 1
            door.now += 1
            json(await one.get("/servos", headers=bearer(GIVEN)))

    through(scene, given=GIVEN)


def test_who_is_at_work_with_a_right_token_goes_on_beside_somebody_who_guesses_from_the_same_address() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one, door.somebody(await door.token("rig", "operate")) as rig:
            json(await rig.get("/servos"))
            await guess(one)
            refused(await one.get("/servos", headers=bearer("one-more")))
            json(await rig.get("/servos"))
            json(await rig.post("/leases", json={"holder": "x", "ttl_s": 5}), 201)
            door.rig.host.store.tokens.drop("rig")
            await door.access.refresh()
            problem(await rig.get("/servos"), "unauthorized", 401)
            refused(await rig.get("/servos"))  # revoked, it is a guess like any other

    through(scene)


@pytest.mark.parametrize("role", ["view", "admin"])
def test_a_stop_with_a_right_token_never_waits_for_guesses_of_others(role: str) -> None:
    async def scene(door: Door) -> None:
        secret = await door.token("me", role)
        async with door.somebody() as one:
            await guess(one)
            refused(await one.get("/servos", headers=bearer(secret)))
            problem(await one.post("/stop", headers=bearer("wrong")), "unauthorized", 401)
            assert not door.rig.host.stop.latched
            assert json(await one.post("/stop", headers=bearer(secret)))["latched"]

    through(scene)


def test_stop_and_health_on_the_machine_itself_need_no_token_whatever_is_guessed_there() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(client=HERE) as one:
            await guess(one)
            json(await one.get("/health"))
            assert json(await one.post("/stop", headers=bearer("wrong")))["latched"]

    through(scene, given=GIVEN)


def test_a_stop_that_guesses_counts_as_any_other_guess() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            for n in range(TRIES):
                problem(await one.post("/stop", headers=bearer(f"guess-{n}")), "unauthorized", 401)
            refused(await one.get("/servos", headers=bearer(GIVEN)))

    through(scene, given=GIVEN)


def test_an_old_token_that_a_program_keeps_sending_is_no_guess_and_locks_nobody_out() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody("revoked-long-ago") as old, door.somebody(GIVEN) as new:
            for _ in range(TRIES * 3):
                problem(await old.get("/servos"), "unauthorized", 401)
            json(await new.get("/servos"))

    through(scene, given=GIVEN)


def test_guesses_from_one_address_are_nothing_to_another_and_from_many_they_are_counted_together() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody(client=FAR) as one, door.somebody(client=OTHER) as other:
            await guess(one)
            json(await other.get("/servos", headers=bearer(GIVEN)))
            for n in range(9):
                async with door.somebody(client=(f"198.51.100.{n}", 5000)) as many:
                    await guess(many, name=f"from-{n}")
            async with door.somebody(client=("203.0.113.1", 5000)) as late:
                refused(await late.get("/servos", headers=bearer(GIVEN)))
            json(await other.get("/servos", headers=bearer(GIVEN)))

    through(scene, given=GIVEN)


def test_a_household_of_ipv6_is_one_address() -> None:
    async def scene(door: Door) -> None:
        for n in range(TRIES):
            async with door.somebody(client=(f"2001:db8:0:7::{n:x}", 5000)) as one:
                await guess(one, 1, name=f"from-{n}")
        async with door.somebody(client=("2001:db8:0:7:ffff::1", 5000)) as one:
            refused(await one.get("/servos", headers=bearer(GIVEN)))
        async with door.somebody(client=("2001:db8:0:8::1", 5000)) as neighbour:
            json(await neighbour.get("/servos", headers=bearer(GIVEN)))

    through(scene, given=GIVEN)


def test_sockets_are_no_way_around_it() -> None:
    async def scene(door: Door) -> None:
        for n in range(TRIES):
            assert await Socket(door.app, ("Authorization", f"Bearer guess-{n}")).first() == 401
        assert await Socket(door.app, ("Authorization", f"Bearer {GIVEN}")).first() == 429
        async with door.somebody() as one:
            refused(await one.get("/servos", headers=bearer(GIVEN)))

    through(scene, given=GIVEN)


def test_where_no_token_is_needed_a_wrong_one_is_nothing() -> None:
    async def scene(door: Door) -> None:
        async with door.somebody() as one:
            for n in range(TRIES * 2):
                json(await one.get("/servos", headers=bearer(f"left-over-{n}")))

    through(scene)

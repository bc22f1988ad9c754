"""Sessions, tickets and failed attempts expire."""

import pytest

from hornbill.api.security.sessions import IDLE_S, LASTING_S, TICKET_S, TRIES, WINDOW_S, Attempts, Sessions, Tickets
from hornbill.errors import TooManyAttempts


def test_an_idle_session_expires() -> None:
    sessions = Sessions()
    made, secret = sessions.begin("digest", 0.0)
    assert made.token == "digest"
    assert sessions.get(secret, IDLE_S - 1) is made
    assert sessions.get(secret, IDLE_S - 1 + IDLE_S - 1) is made
    assert sessions.get(secret, 3 * IDLE_S) is None


def test_a_session_in_use_expires_after_a_week() -> None:
    sessions = Sessions()
    made, secret = sessions.begin("digest", 0.0)
    now = 0.0
    while now < LASTING_S - 100:
        assert sessions.get(secret, now) is made
        now += IDLE_S / 2
    assert sessions.get(secret, LASTING_S) is None


def test_an_expired_session_can_stop_until_it_is_logged_out() -> None:
    sessions = Sessions()
    made, secret = sessions.begin("digest", 0.0)
    assert sessions.get(secret, LASTING_S + 1) is None
    assert sessions.spent(secret) is made
    assert sessions.end(secret) is made
    assert sessions.spent(secret) is None


def test_only_the_secret_opens_a_session() -> None:
    sessions = Sessions()
    made, secret = sessions.begin("digest", 0.0)
    for other in ("", "x", secret[:-1], secret + "x", made.key, "\ud800"):
        assert sessions.get(other, 1.0) is None
        assert sessions.spent(other) is None


def test_the_number_of_sessions_is_limited() -> None:
    sessions = Sessions()
    secrets = [sessions.begin("digest", 0.0)[1] for _ in range(1001)]
    assert sessions.get(secrets[0], 1.0) is None
    assert sessions.get(secrets[1], 1.0) is not None


def test_a_ticket_can_be_used_once_and_expires() -> None:
    tickets = Tickets()
    first, second = tickets.issue("token", "session", 0.0), tickets.issue("token", "session", 0.0)
    assert tickets.take(first, TICKET_S - 1) == ("token", "session")
    assert tickets.take(first, TICKET_S - 1) is None
    assert tickets.take(second, TICKET_S) is None
    assert tickets.take("", 0.0) is None


def test_failures_from_one_address_are_limited() -> None:
    attempts = Attempts()
    for _ in range(TRIES):
        attempts.allow("bad", 0.0)
        attempts.failed("bad", 0.0)
    with pytest.raises(TooManyAttempts) as refused:
        attempts.allow("bad", 1.0)
    assert refused.value.facts["retry_after_s"] == WINDOW_S - 1
    attempts.allow("good", 1.0)
    attempts.allow("bad", WINDOW_S)


def test_failures_from_many_addresses_are_limited() -> None:
    attempts = Attempts()
    for n in range(TRIES * 10):
        attempts.allow(f"10.0.0.{n}", 0.0)
        attempts.failed(f"10.0.0.{n}", 0.0)
    with pytest.raises(TooManyAttempts):
        attempts.allow("10.0.1.1", 1.0)
    attempts.allow("10.0.1.1", WINDOW_S)

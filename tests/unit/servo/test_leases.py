"""Leases: one holder of a servo at a time, until the lease is released or expires."""

from collections.abc import Callable, Mapping
from contextvars import Context

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import Busy, HornbillError, LeaseHeld, LeaseRequired, Unknown
from hornbill.servo.runtime.actor import act_as
from hornbill.servo.runtime.leases import Leases

HELD = (LeaseHeld, {"cause": "lease_held_by_other", "holder": "Rig 3", "expires_in_s": 17.877})
PROMISED = (Busy, {"cause": "control_transfer_pending", "by": "Page 2"})
NONE = (LeaseRequired, {"cause": "lease_missing"})
ENDED_LEASE = (LeaseRequired, {"cause": "lease_ended"})
UNKNOWN = (Unknown, {"cause": "lease_ended"})
IS_HELD = "Rig 3 has motion control for 18 s more. Request it, or wait."
ENDED = "This lease has ended. Take a new one."
OTHER = "0" * 32


def promise(leases: Leases) -> Leases:
    leases.promised_to = "Page 2"
    return leases


Refusal = tuple[type[HornbillError], Mapping[str, object]]
REFUSED: tuple[tuple[float, Callable[[Leases], object], Refusal, str], ...] = (
    (20, lambda leases: leases.grant("Page 1", 3.0, 102.1234), HELD, IS_HELD),
    (20, lambda leases: leases.hand_over("Page 1", 3.0, 102.1234, grace_s=5.0), HELD, IS_HELD),
    (20, lambda leases: leases.require(None, 102.1234), HELD, IS_HELD),
    (20, lambda leases: leases.require(OTHER, 102.1234), HELD, IS_HELD),
    (20, lambda leases: leases.require("é\ud800", 102.1234), HELD, IS_HELD),
    (20, lambda leases: leases.allow_write(None, 102.1234), HELD, IS_HELD),
    (20, lambda leases: leases.allow_write(OTHER, 102.1234), HELD, IS_HELD),
    (20, lambda leases: leases.renew(OTHER, 102.1234), UNKNOWN, ENDED),
    (20, lambda leases: leases.release(OTHER, 102.1234), UNKNOWN, ENDED),
    (2.5, lambda leases: leases.grant("Page 1", 3.0, 102.0),
     (LeaseHeld, {"cause": "lease_held_by_other", "holder": "Rig 3", "expires_in_s": 0.5}),
     "Rig 3 has motion control for 1 s more. Request it, or wait."),
    (2, lambda leases: leases.require(None, 102.0), NONE, "Motion requires a valid lease."),
    (2, lambda leases: leases.require(OTHER, 102.0), ENDED_LEASE,
     "This lease has ended, and torque is off on the servos it commanded. Take a new one."),
    (2, lambda leases: leases.renew(OTHER, 102.0), UNKNOWN, ENDED),
    (2, lambda leases: promise(leases).grant("Page 1", 3.0, 102.0), PROMISED,
     "Motion control is being passed to Page 2, who requested it. Try again in 1 s."),
)  # fmt: skip


@pytest.mark.parametrize(("ttl_s", "act", "expected", "detail"), REFUSED)
def test_a_refusal_has_a_cause_and_a_remedy(
    ttl_s: float, act: Callable[[Leases], object], expected: Refusal, detail: str
) -> None:
    leases = Leases()
    leases.grant("Rig 3", ttl_s, now=100.0)
    with pytest.raises(HornbillError) as caught:
        act(leases)
    assert (type(caught.value), caught.value.facts, caught.value.detail) == (*expected, detail)
    assert leases.counts == {"taken": 1}, "a refusal changes nothing"
    if isinstance(caught.value, Unknown):
        assert caught.value.code == "unknown_lease"


@pytest.mark.parametrize(("ttl_s", "grace_s", "first_s"), [(2.0, 5.0, 5.0), (8.0, 5.0, 8.0)])
def test_a_transferred_lease_lasts_for_the_grace_period(ttl_s: float, grace_s: float, first_s: float) -> None:
    leases = promise(Leases())
    lease = leases.hand_over("Page 2", ttl_s, 10.0, grace_s=grace_s)
    assert (lease.holder, lease.ttl_s, lease.expires_at, leases.promised_to) == ("Page 2", ttl_s, 10.0 + first_s, None)
    assert leases.renew(lease.id, 11.0).expires_at == 11.0 + ttl_s
    assert leases.current(11.0) is lease


def test_every_end_of_a_lease_is_counted_and_only_an_expired_one_is_expired() -> None:
    leases = Leases()
    for at in (0.0, 10.0):
        assert leases.revoke(at) is None
        first = leases.grant("Rig", 2.0, at)
        assert leases.revoke(at + 1) is first
        second = leases.grant("Rig", 2.0, at + 1)
        assert leases.release(second.id, at + 2) is second
        assert leases.current(at + 2) is None
        third = leases.grant("Rig", 2.0, at + 2)
        assert [leases.expired(at + n) for n in (3.9, 4.0, 4.1)] == [None, third, None]
    last = [leases.grant("Rig", 1.0, now) for now in (20.0, 22.0, 24.0)]
    assert [leases.expired(24.5) for _ in range(3)] == [*last[:2], None], (
        "oldest first, also after the next was granted"
    )
    assert leases.current(24.5) is last[2]
    assert leases.counts == {"taken": 9, "revoked": 2, "released": 2, "expired": 4}


@pytest.mark.parametrize(
    ("token", "own", "name"),
    [(None, False, "no lease"), ("ci", False, "ci"), (None, True, "Rig 3"), ("ci", True, "ci · Rig 3")],
)
def test_the_audit_names_the_holder_or_the_token(token: str | None, own: bool, name: str) -> None:
    leases = Leases()
    lease = leases.grant("Rig 3", 20.0, now=100.0)
    lease_id = lease.id if own else OTHER

    def names() -> tuple[str, str]:
        act_as(token)
        return leases.who(lease_id, 101.0), leases.who(lease_id, 120.0)

    assert Context().run(names) == (name, token or "no lease")


def test_the_shown_id_of_a_lease_is_unique_and_cannot_be_used() -> None:
    leases = Leases()
    lease = leases.grant("Page 1", 3.0, now=0.0)
    assert (lease.shown_id, len(lease.id)) == (lease.id[:8], 32), "96 bits are secret"
    with pytest.raises(LeaseHeld):
        leases.require(lease.shown_id, now=1.0)
    leases.release(lease.id, now=1.0)
    assert leases.grant("Page 1", 3.0, now=1.0).shown_id != lease.shown_id


def test_a_lease_allows_motion_and_writes_and_without_one_writes_are_allowed() -> None:
    leases = Leases()
    leases.allow_write(None, now=0.0)
    lease = leases.grant("Rig", 1.0, now=0.0)
    leases.allow_write(lease.id, now=0.5)
    assert leases.require(lease.id, now=0.5) is lease
    leases.allow_write(None, now=1.0)


@given(ttl=st.floats(0.2, 60), beats=st.lists(st.floats(0.0, 80.0), max_size=20))
def test_a_lease_expires_ttl_after_its_last_renewal(ttl: float, beats: list[float]) -> None:
    leases, now = Leases(), 0.0
    lease = leases.grant("Rig", ttl, now)
    for beat in beats:
        if beat < ttl * 0.999:
            now += beat
            leases.renew(lease.id, now)
        else:
            break
    assert leases.current(now + ttl * 0.999) is lease
    end = now + ttl * 1.001
    assert leases.current(end) is None
    with pytest.raises(LeaseRequired, match="has ended"):
        leases.require(lease.id, end)
    with pytest.raises(Unknown):
        leases.renew(lease.id, end)

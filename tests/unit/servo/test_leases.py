"""One writer at a time, and never a moment longer than its last sign of life."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import LeaseHeld, LeaseRequired, Unknown
from hornbill.servo.runtime.leases import Leases


def test_a_second_holder_is_told_who_has_it_and_for_how_long() -> None:
    leases = Leases()
    leases.grant("Rig 3", 20.0, now=100.0)
    with pytest.raises(LeaseHeld) as caught:
        leases.grant("Page 1", 3.0, now=102.0)
    assert caught.value.facts == {"holder": "Rig 3", "expires_in_s": 18.0}
    assert "Rig 3 has motion control for 18 s more" in caught.value.detail


def test_motion_without_a_lease_is_refused_with_the_remedy() -> None:
    with pytest.raises(LeaseRequired, match="POST /api/v1/leases"):
        Leases().require(None, now=0.0)


def test_what_everybody_sees_of_a_leases_id_tells_it_from_others_and_lets_nobody_use_it() -> None:
    leases = Leases()
    lease = leases.grant("Page 1", 3.0, now=0.0)
    assert lease.id.startswith(lease.shown_id)
    assert len(lease.id) - len(lease.shown_id) >= 24, "96 bits nobody is told"
    with pytest.raises(LeaseHeld):
        leases.require(lease.shown_id, now=1.0)
    leases.release(lease.id, now=1.0)
    assert leases.grant("Page 1", 3.0, now=1.0).shown_id != lease.shown_id


def test_a_lapsed_lease_is_no_lease_and_is_handed_out_once() -> None:
    leases = Leases()
    lease = leases.grant("Rig", 2.0, now=10.0)
    assert leases.lapsed(11.9) is None
    with pytest.raises(LeaseRequired, match="has ended"):
        leases.require(lease.id, now=12.0)
    assert leases.lapsed(12.0) is lease
    assert leases.lapsed(12.1) is None
    with pytest.raises(Unknown):
        leases.renew(lease.id, now=12.1)


def test_a_lapse_is_seen_even_when_somebody_else_was_quicker_with_a_new_lease() -> None:
    leases = Leases()
    old = leases.grant("Rig", 1.0, now=0.0)
    new = leases.grant("Page", 5.0, now=1.01)
    assert leases.lapsed(1.02) is old
    assert leases.lapsed(1.03) is None
    assert leases.current(1.03) is new


def test_somebody_elses_id_moves_nothing() -> None:
    leases = Leases()
    leases.grant("Rig", 5.0, now=0.0)
    with pytest.raises(LeaseHeld):
        leases.require("0" * 32, now=1.0)
    with pytest.raises(LeaseHeld):
        leases.allow_write(None, now=1.0)


def test_parameters_need_no_lease_while_nobody_holds_one() -> None:
    leases = Leases()
    leases.allow_write(None, now=0.0)
    lease = leases.grant("Rig", 1.0, now=0.0)
    leases.allow_write(lease.id, now=0.5)
    leases.allow_write(None, now=1.0)


@given(ttl=st.floats(0.2, 60), beats=st.lists(st.floats(0.0, 80.0), max_size=20))
def test_a_lease_lives_exactly_ttl_after_its_last_renewal(ttl: float, beats: list[float]) -> None:
    leases, now = Leases(), 0.0
    lease = leases.grant("Rig", ttl, now)
    for beat in beats:
        if beat < ttl * 0.999:
            now += beat
            leases.renew(lease.id, now)
        else:
            break
    assert leases.current(now + ttl * 0.999) is lease
    assert leases.current(now + ttl * 1.001) is None

"""Reassembly under whatever a bus can do: mixed, lost, repeated, damaged, late and senseless frames."""

from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.wire import types
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split
from unit.wire.damage import damage
from unit.wire.reference import transfers_in
from unit.wire.structures import structures, transfer

MAX_SESSIONS = 4
FRAME_S = 0.00014


def frames_of(sent: Transfer) -> list[Frame]:
    return split(sent, types.BY_KEY[bool(sent.kind), sent.type_id])


@st.composite
def senders(draw: st.DrawFn) -> list[list[Transfer]]:
    """Up to five nodes with a few transfers each, one after the other, transfer ids counting up past 31."""
    talks: list[list[Transfer]] = []
    for source in range(1, 1 + draw(st.integers(1, 5))):
        talk = draw(st.lists(structures, min_size=1, max_size=4))
        first = draw(st.integers(0, 31))
        talks.append([transfer(s, source=source, transfer_id=(first + n) % 32) for n, s in enumerate(talk)])
    return talks


def mix(draw: st.DrawFn, talks: list[list[Transfer]]) -> list[tuple[Transfer, Frame]]:
    """All frames in one row; the frames of one node keep their order."""
    rows = [[(sent, frame) for sent in talk for frame in frames_of(sent)] for talk in talks]
    mixed: list[tuple[Transfer, Frame]] = []
    while rows:
        row = rows[draw(st.integers(0, len(rows) - 1))]
        mixed.append(row.pop(0))
        rows = [row for row in rows if row]
    return mixed


@given(st.data(), senders())
@settings(max_examples=60)
def test_mixed_transfers_all_come_out(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    received = Reassembler().feed([frame for _, frame in mixed])
    assert [[t for t in received if t.source == n] for n in range(1, len(talks) + 1)] == talks


@given(st.data(), senders())
@settings(max_examples=60)
def test_a_loss_costs_its_own_transfer_and_no_other(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    lost = data.draw(st.sets(st.integers(0, len(mixed) - 1), max_size=4))
    hit = [mixed[n][0] for n in lost]
    received = Reassembler().feed([frame for n, (_, frame) in enumerate(mixed) if n not in lost])
    assert sorted(received) == sorted(t for talk in talks for t in talk if t not in hit)


@given(st.data(), senders())
@settings(max_examples=60)
def test_repeated_frames_change_no_longer_transfer(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    times = data.draw(st.lists(st.integers(1, 3), min_size=len(mixed), max_size=len(mixed)))
    received = Reassembler().feed([frame for (_, frame), count in zip(mixed, times, strict=True) for _ in range(count)])
    sent = [t for talk in talks for t in talk]
    longer = [t for t in received if len(t.payload) > 7]
    assert sorted(longer) == sorted(t for t in sent if len(t.payload) > 7)
    assert all(t in sent for t in received)


@given(st.data(), senders(), st.integers(0, 1 << 32), st.integers(1, 8))
@settings(max_examples=200)
def test_of_damaged_frames_comes_what_a_plain_receiver_finds(
    data: st.DataObject, talks: list[list[Transfer]], seed: int, times: int
) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    row = [frame._replace(at=100.0 + n * FRAME_S) for n, (_, frame) in enumerate(mixed)]
    damage(row, Random(seed), times)
    expected = transfers_in(row)
    whole, single = Reassembler(), Reassembler()
    assert whole.feed(row) == expected
    assert [found for frame in row for found in single.feed([frame])] == expected
    assert whole.counters.frames == len(row)
    for found in expected:
        types.decode(found)


frames_of_garbage = st.builds(
    Frame,
    st.sampled_from([0x1003F301, 0x100B8A94, 0x100B948A, 0x10015501, 0x18058100]) | st.integers(-1, 1 << 32),
    st.binary(max_size=8) | st.binary(max_size=70),
    st.floats(allow_nan=True, allow_infinity=True) | st.just(0.0),
)


@given(st.lists(frames_of_garbage, max_size=60), st.none() | st.floats(), st.none() | st.integers(1, 127))
@settings(max_examples=300)
def test_garbage_never_raises(garbage: list[Frame], now: float | None, node_id: int | None) -> None:
    reassembler = Reassembler(node_id, max_sessions=MAX_SESSIONS)
    received = reassembler.feed(garbage, now)
    for found in received:
        types.decode(found)
    assert reassembler.counters.frames == len(garbage)
    assert reassembler.counters.transfers == len(received)
    assert reassembler.sessions <= MAX_SESSIONS


def test_identifiers_never_met_again_are_not_remembered_for_ever() -> None:
    reassembler = Reassembler()
    chance = Random(1)
    most = 0
    for _ in range(30):
        reassembler.feed([Frame(chance.getrandbits(29), chance.randbytes(8), 1.0) for _ in range(1000)])
        most = max(most, reassembler.routes)
    assert 1000 < most <= 8192

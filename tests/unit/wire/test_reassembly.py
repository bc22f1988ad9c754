"""Reassembly: returned transfers, dropped frames, and the counter of each reason."""

import logging
from collections import Counter
from dataclasses import fields
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.wire import types
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import make_anonymous_id, make_message_id, make_service_id
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus
from hornbill.wire.reassembly import Reassembler, ReassemblyCounters
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, integer
from hornbill.wire.transfer import Transfer, split
from unit.wire.damage import damage
from unit.wire.reference import transfers_in
from unit.wire.structures import frames, structures, transfer

STATUS = ActuatorStatus(1, 90.0, 0.0, 0.0, 127)
RESPONSE = GetSetResponse(integer(1234), EMPTY, EMPTY, EMPTY, "0x20")
ALIVE = NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL)
ONE, TWO, THREE = frames(RESPONSE)


def test_frames_may_arrive_in_any_batches() -> None:
    reassembler = Reassembler()
    first, second, third = frames(RESPONSE)
    assert reassembler.feed([]) == []
    assert reassembler.feed([first]) == []
    assert reassembler.feed([second, *frames(ALIVE)]) == [transfer(ALIVE)]
    assert reassembler.sessions == 1
    assert reassembler.feed([third]) == [transfer(RESPONSE)]
    assert reassembler.sessions == 0
    assert reassembler.counters == ReassemblyCounters(frames=4, transfers=2)


def test_a_transfer_has_the_instant_of_its_last_frame() -> None:
    sent = [frame._replace(at=5.0 + n) for n, frame in enumerate(frames(STATUS))]
    (received,) = Reassembler().feed(sent, now=9.0)
    assert received.at == 6.0


def test_frames_without_a_timestamp_get_the_current_time() -> None:
    (received,) = Reassembler().feed(frames(ALIVE), now=7.5)
    assert received.at == 7.5


def test_the_same_type_from_two_nodes_at_once() -> None:
    one, two = frames(STATUS, source=1, transfer_id=3), frames(STATUS, source=2, transfer_id=3)
    received = Reassembler().feed([one[0], two[0], two[1], one[1]])
    assert [t.source for t in received] == [2, 1]


def test_request_and_response_of_one_pair_at_once() -> None:
    request = frames(GetSetRequest(0, integer(5), "0x20"), source=127, destination=10)
    response = frames(RESPONSE, source=127, destination=10)
    received = Reassembler().feed([f for pair in zip(request, response, strict=True) for f in pair])
    assert [t.kind for t in received] == [Kind.REQUEST, Kind.RESPONSE]


def test_an_urgent_transfer_overtakes_a_slow_one_of_the_same_type() -> None:
    slow, urgent = frames(STATUS, priority=24, transfer_id=1), frames(STATUS, priority=16, transfer_id=2)
    received = Reassembler().feed([slow[0], *urgent, slow[1]])
    assert [t.transfer_id for t in received] == [2, 1]


def test_a_new_transfer_id_starts_a_new_transfer() -> None:
    reassembler = Reassembler()
    received = reassembler.feed([frames(STATUS, transfer_id=1)[0], *frames(STATUS, transfer_id=2)])
    assert [t.transfer_id for t in received] == [2]
    assert reassembler.counters.interrupted == 1


def test_a_continuation_with_another_transfer_id_ends_the_session() -> None:
    reassembler = Reassembler()
    one, two = frames(RESPONSE, transfer_id=1), frames(RESPONSE, transfer_id=2)
    assert reassembler.feed([one[0], two[1], one[1], one[2]]) == []
    assert reassembler.counters.interrupted == 1
    assert reassembler.counters.unexpected == 2
    assert reassembler.sessions == 0


@pytest.mark.parametrize(("repeated", "counter"), [(0, "duplicates"), (1, "duplicates"), (2, "unexpected")])
def test_a_repeated_frame_is_ignored(repeated: int, counter: str) -> None:
    reassembler = Reassembler()
    sent = [ONE, TWO, THREE]
    sent.insert(repeated, sent[repeated])
    assert reassembler.feed(sent) == [transfer(RESPONSE)]
    assert getattr(reassembler.counters, counter) == 1


def test_a_transfer_times_out_after_two_seconds() -> None:
    reassembler = Reassembler()
    first, last = frames(STATUS)
    assert reassembler.feed([first._replace(at=10.0), last._replace(at=12.0)]) != []
    assert reassembler.feed([first._replace(at=20.0)]) == []
    assert reassembler.feed([last._replace(at=22.1)]) == []
    assert reassembler.counters.timed_out == 1
    assert reassembler.sessions == 0


def test_a_first_frame_repeated_later_starts_a_new_transfer() -> None:
    reassembler = Reassembler()
    first, last = frames(STATUS)
    received = reassembler.feed([first._replace(at=10.0), first._replace(at=11.9), last._replace(at=13.0)])
    assert len(received) == 1


def test_a_silent_sender_times_out_while_others_continue() -> None:
    reassembler = Reassembler()
    reassembler.feed(frames(STATUS, at=10.0)[:1])
    assert reassembler.sessions == 1
    reassembler.feed(frames(ALIVE, at=12.5))
    assert reassembler.sessions == 0
    assert reassembler.counters.timed_out == 1


def test_sessions_are_limited_and_the_oldest_is_dropped() -> None:
    reassembler = Reassembler(max_sessions=8)
    begun = [frames(STATUS, source=source) for source in range(1, 101)]
    reassembler.feed([first for first, _ in begun])
    assert reassembler.sessions == 8
    assert reassembler.counters.evicted == 92
    received = reassembler.feed([last for _, last in begun])
    assert [t.source for t in received] == list(range(93, 101))


def test_services_for_other_nodes_are_ignored() -> None:
    reassembler = Reassembler(node_id=127)
    theirs = frames(RESPONSE, source=10, destination=126)
    ours = frames(RESPONSE, source=10, destination=127)
    assert reassembler.feed([*theirs, *ours]) == [transfer(RESPONSE, destination=127)]
    assert reassembler.counters.not_ours == 3
    assert reassembler.feed(frames(STATUS)) != []


def test_a_monitor_receives_services_of_all_nodes() -> None:
    assert len(Reassembler().feed(frames(RESPONSE, destination=126) + frames(RESPONSE, destination=3))) == 2


def test_single_frames_of_unknown_types_are_returned() -> None:
    reassembler = Reassembler()
    can_id = make_message_id(16, 20000, 5)
    (received,) = reassembler.feed([Frame(can_id, b"abc\xc1", 1.0)])
    assert received == Transfer(Kind.MESSAGE, 20000, 5, 0, 16, 1, b"abc", 1.0)
    assert types.decode(received) is None


@pytest.mark.parametrize(
    ("received", "counter"),
    [
        ([Frame(make_message_id(16, 341, 5), b"")], "bad_tail"),
        ([Frame(make_message_id(16, 341, 5), bytes(7) + b"\xe0")], "bad_toggle"),
        ([Frame(make_message_id(16, 1011, 5), bytes(7) + b"\xa0")], "bad_toggle"),
        ([Frame(make_message_id(16, 1011, 5), b"\x00\x00\x80")], "bad_tail"),
        ([Frame(make_anonymous_id(16, 5, 1), bytes(7) + b"\x80")], "bad_tail"),
        ([Frame(make_message_id(16, 1011, 5), bytes(7) + b"\x20")], "unexpected"),
        ([Frame(0x100B8085, b"\xc0")], "bad_identifier"),
        ([Frame(0x100B8580, b"\xc0")], "bad_identifier"),
        ([Frame(1 << 29 | make_message_id(16, 341, 5), bytes(7) + b"\xc0")], "bad_identifier"),
        ([Frame(-1, bytes(7) + b"\xc0")], "bad_identifier"),
        ([ONE, THREE._replace(data=THREE.data[:-1] + b"\x60")], "bad_crc"),
        ([ONE, THREE], "bad_toggle"),
        ([ONE, TWO._replace(data=b"\xff" + TWO.data[1:]), THREE], "bad_crc"),
        ([Frame(ONE.id, bytes(7) + bytes((n % 2 << 5 if n else 0x80,))) for n in range(2000)], "too_long"),
        (
            [Frame(make_service_id(16, 200, True, 6, 5), bytes(7) + bytes((n,))) for n in (0x80, 0x20, 0x00, 0x60)],
            "unknown_type",
        ),
    ],
)
def test_invalid_frames_are_dropped(received: list[Frame], counter: str) -> None:
    reassembler = Reassembler()
    assert reassembler.feed(received) == []
    assert getattr(reassembler.counters, counter) == 1
    assert reassembler.counters.frames == len(received)
    assert (reassembler.counters.transfers, reassembler.sessions) == (0, 0)


def test_a_drop_is_logged_at_debug_level(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG, "hornbill.wire.reassembly"):
        Reassembler().feed(frames(STATUS)[1:])
    assert "unexpected" in caplog.text
    assert "1003f30a" in caplog.text


@pytest.mark.parametrize(("node_id", "timeout", "sessions"), [(0, 2.0, 1), (128, 2.0, 1), (1, 0.0, 1), (1, 2.0, 0)])
def test_invalid_limits_are_refused(node_id: int, timeout: float, sessions: int) -> None:
    with pytest.raises(ValueError, match=r"Use|above 0"):
        Reassembler(node_id, timeout=timeout, max_sessions=sessions)


identifiers = st.sampled_from([0x100BB4FF, 0x1001550B, 0x104E2314, 0x18000100, 0x1000_0080, 0x0000_01FF]) | st.integers(
    0, (1 << 29) - 1
)
any_frames = st.lists(st.builds(Frame, identifiers, st.binary(max_size=8), st.floats(1.0, 9.0)), max_size=40)


def test_a_wrong_toggle_bit_is_reported_with_its_frame() -> None:
    one, two, three = frames(GetSetRequest(0, integer(5), "0x2C"), at=1.0)
    wrong = two._replace(data=two.data[:-1] + bytes((two.data[-1] ^ 0x20,)))
    reported: list[tuple[str, int, bytes]] = []
    reassembler = Reassembler(on_drop=lambda reason, can_id, data: reported.append((reason, can_id, data)))
    assert reassembler.feed([one, wrong, three]) == []
    assert reported == [("bad_toggle", wrong.id, wrong.data), ("unexpected", three.id, three.data)]


def test_nothing_is_reported_on_a_healthy_bus() -> None:
    reported: list[str] = []
    reassembler = Reassembler(on_drop=lambda reason, _id, _data: reported.append(reason))
    received = [
        *frames(NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL), at=1.0),
        *frames(GetSetRequest(0, integer(5), "0x2C")),
    ]
    assert len(reassembler.feed(received)) == 2
    assert reported == []


@given(any_frames)
def test_every_counted_drop_was_reported(received: list[Frame]) -> None:
    reported: Counter[str] = Counter()
    reassembler = Reassembler(
        timeout=0.5, max_sessions=2, on_drop=lambda reason, _id, _data: reported.update((reason,))
    )
    for frame in received:
        reassembler.feed([frame])
    counters = reassembler.counters
    counted = {field.name: getattr(counters, field.name) for field in fields(ReassemblyCounters)}
    del counted["frames"], counted["transfers"]
    assert reported == Counter(counted)


MAX_SESSIONS = 4
FRAME_S = 0.00014


def frames_of(sent: Transfer) -> list[Frame]:
    return split(sent, types.BY_KEY[bool(sent.kind), sent.type_id])


@st.composite
def senders(draw: st.DrawFn) -> list[list[Transfer]]:
    """Transfers of up to five nodes, a few each in sequence; transfer IDs wrap after 31."""
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
def test_a_loss_affects_only_its_own_transfer(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    lost = data.draw(st.sets(st.integers(0, len(mixed) - 1), max_size=4))
    hit = [mixed[n][0] for n in lost]
    received = Reassembler().feed([frame for n, (_, frame) in enumerate(mixed) if n not in lost])
    assert [[t for t in received if t.source == source] for source in range(1, len(talks) + 1)] == [
        [t for t in talk if t not in hit] for talk in talks
    ]


@given(st.data(), senders())
@settings(max_examples=60)
def test_repeated_frames_do_not_change_multi_frame_transfers(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    times = data.draw(st.lists(st.integers(1, 3), min_size=len(mixed), max_size=len(mixed)))
    received = Reassembler().feed([frame for (_, frame), count in zip(mixed, times, strict=True) for _ in range(count)])
    sent = [t for talk in talks for t in talk]
    longer = [t for t in received if len(t.payload) > 7]
    assert sorted(longer) == sorted(t for t in sent if len(t.payload) > 7)
    assert all(t in sent for t in received)


@given(st.data(), senders(), st.integers(0, 1 << 32), st.integers(1, 8))
@settings(max_examples=200)
def test_damaged_frames_yield_what_the_reference_receiver_finds(
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
def test_arbitrary_frames_never_raise(garbage: list[Frame], now: float | None, node_id: int | None) -> None:
    reassembler = Reassembler(node_id, max_sessions=MAX_SESSIONS)
    received = reassembler.feed(garbage, now)
    for found in received:
        types.decode(found)
    assert reassembler.counters.frames == len(garbage)
    assert reassembler.counters.transfers == len(received)
    assert reassembler.sessions <= MAX_SESSIONS


def test_identifiers_not_seen_again_are_forgotten() -> None:
    reassembler = Reassembler()
    chance = Random(1)
    most = 0
    for _ in range(30):
        reassembler.feed([Frame(chance.getrandbits(29), chance.randbytes(8), 1.0) for _ in range(1000)])
        most = max(most, reassembler.routes)
    assert 1000 < most <= 8192

"""Reassembly: returned transfers, dropped frames, and the counter of each reason."""

import logging
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
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
OTHERS = frames(RESPONSE, destination=126)
OURS = frames(RESPONSE, destination=127)
MESSAGE, LONG = make_message_id(16, 341, 5), make_message_id(16, 1011, 5)
SEVEN = bytes(7)


def status(source: int = 10, transfer_id: int = 0, at: Sequence[float] = (0.0, 0.0), priority: int = 16) -> list[Frame]:
    """The two frames of a status, at these times."""
    sent = frames(STATUS, source=source, transfer_id=transfer_id, priority=priority)
    return [frame._replace(at=when) for frame, when in zip(sent, at, strict=True)]


def tailed(frame: Frame, tail: int) -> Frame:
    return frame._replace(data=frame.data[:-1] + bytes((tail,)))


def continued(count: int) -> list[Frame]:
    """A first frame and `count` - 1 continuations of 7 bytes."""
    return [Frame(LONG, SEVEN + bytes((n % 2 << 5 if n else 0x80,))) for n in range(count)]


A, B = status(1), status(2)
ONE_1, TWO_1, THREE_1 = frames(RESPONSE, transfer_id=1)
TWO_2 = frames(RESPONSE, transfer_id=2)[1]
REQUEST = frames(GetSetRequest(0, integer(5), "0x20"))
SLOW, URGENT = status(transfer_id=1, priority=24), status(transfer_id=2)
LATE, IN_TIME = status(at=(20.0, 22.1)), status(at=(10.0, 12.0))
AGAIN = status(at=(10.0, 13.0))
WAITING, LATER = status(1, at=(10.0, 12.5)), status(2, at=(10.5, 12.5))
TEN = [status(source) for source in range(1, 11)]
UNKNOWN = [Frame(make_service_id(16, 200, True, 6, 5), SEVEN + bytes((n,))) for n in (0x80, 0x20, 0x00, 0x60)]
AT_512 = Frame(LONG, b"\0\x20")
OVER_512 = Frame(LONG, b"\0\0")
SHORTEST = Frame(LONG, b"\0\0\0\x80")
END = Frame(LONG, b"\0\x60")
CHANGED = TWO._replace(data=b"\xff" + TWO.data[1:])
OWN = Frame(make_message_id(16, 341, 127), SEVEN + b"\xc0", 3.0)


@pytest.mark.parametrize(
    ("sent", "returned", "drops"),
    [
        # Transfers at once: two nodes, request and response of one pair, and an urgent one of the same type.
        ([A[0], B[0], B[1], A[1]], [(2, 0), (1, 0)], []),
        ([each for pair in zip(REQUEST, [ONE, TWO, THREE], strict=True) for each in pair], [(10, 0), (10, 0)], []),
        ([SLOW[0], *URGENT, SLOW[1]], [(10, 2), (10, 1)], []),
        # A monitor receives services of all nodes; a node its own, and sees who else uses its ID.
        ([*OTHERS, *OURS], [(10, 0), (10, 0)], []),
        # Repeated frames are ignored.
        ([ONE, ONE, TWO, THREE], [(10, 0)], [("duplicates", ONE)]),
        ([ONE, TWO, TWO, THREE], [(10, 0)], [("duplicates", TWO)]),
        ([ONE, TWO, THREE, THREE], [(10, 0)], [("unexpected", THREE)]),
        ([AGAIN[0], AGAIN[0]._replace(at=11.9), AGAIN[1]], [(10, 0)], [("duplicates", AGAIN[0])]),
        ([ONE._replace(at=10.0), TWO._replace(at=11.0), TWO._replace(at=12.0)], [], [("duplicates", TWO)]),
        # Another transfer ID, toggle or content.
        ([SLOW[0], *status(transfer_id=2, priority=24)], [(10, 2)],
         [("interrupted", status(transfer_id=2, priority=24)[0])]),
        ([ONE_1, TWO_2, TWO_1, THREE_1], [], [("interrupted", TWO_2), ("unexpected", TWO_1), ("unexpected", THREE_1)]),
        ([ONE, THREE, TWO], [], [("bad_toggle", THREE), ("unexpected", TWO)]),
        ([ONE, tailed(THREE, 0x60)], [], [("bad_crc", tailed(THREE, 0x60))]),
        ([ONE, CHANGED, THREE], [], [("bad_crc", THREE)]),
        # Two seconds from the first frame, looked for at every batch.
        (IN_TIME, [(10, 0)], []),
        (LATE, [], [("timed_out", LATE[1])]),
        ([WAITING[0], LATER[0], *frames(ALIVE, at=12.5), LATER[1]], [(10, 0), (2, 0)], [("timed_out", WAITING[0])]),
        # Eight sessions: the oldest is dropped.
        ([frame for number in (0, 1) for frame in [each[number] for each in TEN]], [(n, 0) for n in range(3, 11)],
         [("evicted", TEN[0][0]), ("evicted", TEN[1][0]), ("unexpected", TEN[0][1]), ("unexpected", TEN[1][1])]),
        ([*continued(73), AT_512, tailed(END, 0x40)], [], [("bad_crc", tailed(END, 0x40))]),
        ([*continued(73), AT_512, OVER_512, END], [], [("too_long", OVER_512), ("unexpected", END)]),
        ([SHORTEST, END], [], [("bad_crc", END)]),
        (UNKNOWN, [], [("unknown_type", UNKNOWN[0])]),
        ([Frame(make_message_id(16, 20000, 5), b"abc\xc1")], [(5, 1)], []),
        *(([frame], [], [(reason, frame)]) for reason, frame in (
            ("bad_tail", Frame(MESSAGE, b"")),
            ("bad_toggle", Frame(MESSAGE, SEVEN + b"\xe0")),
            ("bad_toggle", Frame(LONG, SEVEN + b"\xa0")),
            ("bad_tail", Frame(LONG, b"\0\0\x80")),
            ("bad_tail", Frame(make_anonymous_id(16, 5, 1), SEVEN + b"\x80")),
            ("unexpected", Frame(LONG, SEVEN + b"\x20")),
            ("bad_identifier", Frame(0x100B8085, b"\xc0")),
            ("bad_identifier", Frame(0x100B8580, b"\xc0")),
            ("bad_identifier", Frame(1 << 29 | MESSAGE, SEVEN + b"\xc0")),
            ("bad_identifier", Frame(1 << 29 | ONE.id, SEVEN + b"\xc0")),
            ("bad_identifier", Frame(-1, SEVEN + b"\xc0")),
        )),
    ],
)  # fmt: skip
def test_frames_yield_transfers_or_a_reported_and_counted_drop(
    sent: list[Frame], returned: list[tuple[int, int]], drops: list[tuple[str, Frame]]
) -> None:
    reported: list[tuple[str, int, bytes]] = []
    reassembler = Reassembler(
        max_sessions=8, on_drop=lambda reason, can_id, data: reported.append((reason, can_id, data))
    )
    received = [one for frame in sent for one in reassembler.feed([frame])]
    assert [(one.source, one.transfer_id) for one in received] == returned
    assert reported == [(reason, frame.id, frame.data) for reason, frame in drops]
    counts = Counter(reason for reason, _ in drops)
    assert reassembler.counters == ReassemblyCounters(len(sent), len(returned), **counts)


@pytest.mark.parametrize(
    ("sent", "returned", "not_ours", "own", "drops"),
    [
        ([*OTHERS, *OURS, *status()], [Kind.RESPONSE, Kind.MESSAGE], 3, [], []),
        ([OTHERS[0]._replace(data=b"")], [], 1, [], []),
        ([OWN, OWN._replace(at=0.0), OWN._replace(data=b"")], [], 3,
         [OWN, OWN._replace(at=7.5), OWN._replace(data=b"")], []),
        *(([OWN._replace(id=can_id)], [], 0, [], ["bad_identifier"]) for can_id in (-1, 1 << 29 | OWN.id)),
    ],
)  # fmt: skip
def test_a_node_ignores_services_for_others_and_learns_who_uses_its_id(
    sent: list[Frame], returned: list[Kind], not_ours: int, own: list[Frame], drops: list[str]
) -> None:
    reported, with_own = list[str](), list[Frame]()
    reassembler = Reassembler(
        127, on_drop=lambda reason, _id, _data: reported.append(reason), on_own_id=with_own.append
    )
    assert [one.kind for one in reassembler.feed(sent, 7.5)] == returned
    assert (reassembler.counters.not_ours, with_own, reported) == (not_ours, own, drops)
    assert Reassembler(127).feed([OWN]) == []


def test_frames_may_arrive_in_any_batches() -> None:
    reassembler = Reassembler()
    assert reassembler.feed([]) == []
    assert reassembler.feed([ONE]) == []
    assert reassembler.feed([TWO, *frames(ALIVE)]) == [transfer(ALIVE)]
    assert reassembler.sessions == 1
    assert reassembler.feed([THREE]) == [transfer(RESPONSE)]
    assert reassembler.sessions == 0


@pytest.mark.parametrize(("sent", "now", "at"), [(LATER, 9.0, 12.5), (A, 7.5, 7.5), (A, None, 0.0)])
def test_a_transfer_has_the_time_of_its_last_frame_or_the_current_one(
    sent: list[Frame], now: float | None, at: float
) -> None:
    (received,) = Reassembler().feed(sent, now)
    assert received.at == at


def test_an_empty_batch_ends_transfers_that_timed_out() -> None:
    reassembler = Reassembler()
    reassembler.feed(LATER[:1])
    sessions: list[int] = []
    for now in (12.5, 12.6):
        reassembler.feed([], now)
        sessions.append(reassembler.sessions)
    assert (sessions, reassembler.counters.timed_out) == ([1, 0], 1)


def test_a_drop_is_logged_at_debug_level(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG, "hornbill.wire.reassembly"):
        Reassembler().feed(status()[1:])
    assert caplog.messages == ["dropped (unexpected): 1003f30a 00007f60"]


@pytest.mark.parametrize(("node_id", "timeout", "sessions"), [(0, 2.0, 1), (128, 2.0, 1), (1, 0.0, 1), (1, 2.0, 0)])
def test_invalid_limits_are_refused(node_id: int, timeout: float, sessions: int) -> None:
    with pytest.raises(ValueError, match=r"Use|above 0"):
        Reassembler(node_id, timeout=timeout, max_sessions=sessions)
    Reassembler(node_id=127, timeout=0.001, max_sessions=1)


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
def test_arbitrary_frames_never_raise_and_every_drop_is_counted_and_reported(
    garbage: list[Frame], now: float | None, node_id: int | None
) -> None:
    reported: Counter[str] = Counter()
    reassembler = Reassembler(
        node_id, max_sessions=MAX_SESSIONS, on_drop=lambda reason, _id, _data: reported.update((reason,))
    )
    received = reassembler.feed(garbage, now)
    for found in received:
        types.decode(found)
    counted = asdict(reassembler.counters)
    assert (counted.pop("frames"), counted.pop("transfers")) == (len(garbage), len(received))
    del counted["not_ours"]
    assert reported == Counter(counted)
    assert reassembler.sessions <= MAX_SESSIONS


def test_identifiers_not_seen_again_are_forgotten() -> None:
    reassembler = Reassembler()
    chance = Random(1)
    most = 0
    for _ in range(30):
        reassembler.feed([Frame(chance.getrandbits(29), chance.randbytes(8), 1.0) for _ in range(1000)])
        most = max(most, reassembler.routes)
    assert 1000 < most <= 8192

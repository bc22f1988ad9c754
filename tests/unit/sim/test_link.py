"""Frames received by a servo: frames for other nodes are ignored, and no frame raises."""

from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.sim.link import SimNode
from hornbill.units import NodeId
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse
from unit.sim.desk import NODE, Desk


def request_id(type_id: int, source: int) -> int:
    return 20 << 24 | type_id << 16 | 1 << 15 | NODE << 8 | 1 << 7 | source


def array_command_id(source: int) -> int:
    return 16 << 24 | 1010 << 8 | source


def allocation_id(discriminator: int) -> int:
    return 24 << 24 | discriminator << 10 | 1 << 8


# Any frame, and often enough one that the servo's filter lets through.
any_frames = st.lists(
    st.builds(
        Frame,
        st.one_of(
            st.integers(0, (1 << 29) - 1),
            st.builds(request_id, st.sampled_from([1, 5, 10, 11]), st.integers(0, 127)),
            st.builds(array_command_id, st.integers(1, 127)),
            st.builds(allocation_id, st.integers(0, 0x3FFF)),
        ),
        st.binary(max_size=8),
    ),
    max_size=40,
)


@settings(max_examples=60, deadline=None)
@given(any_frames, st.sampled_from([0, NODE]))
def test_arbitrary_frames_never_raise(frames: list[Frame], node_id: int) -> None:
    desk = Desk(node_id=node_id)
    desk.raw_frames(frames)
    desk.wait(1.5)
    assert desk.servo.starts >= 1


def test_transfers_of_other_nodes_are_ignored() -> None:
    desk = Desk()
    link = SimNode(desk.servo.uid, Random(1), desk.servo.conditions)
    link.join(NodeId(desk.servo.node_id), desk.now)
    for message in (ActuatorStatus(1, 0.5, 0.0, 0.0, 0), NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL)):
        assert link.accept(desk.frames_of(message, source=17)) == []
    response = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")
    assert link.accept(desk.frames_of(response, source=17)) == []
    assert link.accept(desk.frames_of(GetSetRequest(0, EMPTY, "0x50")))


def test_interleaved_requests_of_two_testers_both_get_responses() -> None:
    desk = Desk()
    one = desk.frames_of(GetSetRequest(0, EMPTY, "a long name that takes several frames"), source=100)
    two = desk.frames_of(GetSetRequest(0, EMPTY, "another name that takes several frames"), source=101)
    mixed = [frame for pair in zip(one, two, strict=True) for frame in pair]
    assert sorted(response.destination for response in desk.raw_frames(mixed)) == [100, 101]


def test_nothing_is_received_while_it_starts() -> None:
    desk = Desk()
    desk.restart()
    assert desk.get_set("0x50") is None
    desk.wait(0.2)
    assert desk.read("0x50") == 61

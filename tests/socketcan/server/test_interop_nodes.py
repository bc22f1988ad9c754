"""Our server among nodes of the public Python stack on a Linux CAN bus: node IDs, standby and the list of nodes."""

from pathlib import Path
from typing import Any

import pytest
from dronecan.app.dynamic_node_id import CentralizedServer  # pyright: ignore[reportUnknownVariableType]
from dronecan.app.node_monitor import NodeMonitor  # pyright: ignore[reportUnknownVariableType]

from socketcan.applicant import Applicant
from socketcan.peer import Peer, live_together, run_until, uavcan
from socketcan.server.bench import Bench

pytestmark = pytest.mark.release

NODE_STATUS = uavcan.protocol.NodeStatus()
OURS = 127
"""The server's own node id by default."""


def uid(number: int) -> bytes:
    """A unique id of sixteen bytes that differs from others in its first, second and third part."""
    return bytes(number + place for place in range(16))


def test_our_node_is_conforming_and_ignores_unknown_services(bench: Bench) -> None:
    with Peer(101) as peer:
        node_status = peer.listen(uavcan.protocol.NodeStatus)
        first, unknown, again = (
            uavcan.protocol.GetNodeInfo.Request(), uavcan.protocol.GetTransportStats.Request(),
            uavcan.protocol.GetNodeInfo.Request(),
        )  # fmt: skip
        (before,) = peer.request((OURS, first), priority=30)
        unanswered: list[object] = []
        peer.node.request(unknown, OURS, unanswered.append, timeout=0.5)
        peer.run_until(lambda: unanswered, "the timeout of a service it does not have")
        assert unanswered == [None]
        (after,) = peer.request((OURS, again))
        peer.run_until(lambda: len([each for each in node_status if each.source == OURS]) >= 2, "NodeStatus twice")
    assert bytes(list(before.message.name)).decode() == "org.hornbill"
    assert before.priority == 30
    own_uid, later_uid = (list(each.message.hardware_version.unique_id) for each in (before, after))
    assert own_uid == later_uid != [0] * 16
    said = [each.message for each in node_status if each.source == OURS]
    for each in said:
        assert (each.health, each.mode, each.sub_mode) == (each.HEALTH_OK, each.MODE_OPERATIONAL, 0)
    assert said[-1].uptime_sec >= said[0].uptime_sec
    assert after.message.status.uptime_sec >= before.message.status.uptime_sec


def test_simultaneous_nodes_get_different_ids_near_their_preference(bench: Bench) -> None:
    with Applicant(uid(1)) as undecided, Applicant(uid(2), 42) as first, Applicant(uid(3), 42) as second:
        applicants = [undecided, first, second]
        run_until([*applicants], lambda: all(each.node_id for each in applicants), "each of three has its node id")
    assert {first.node_id, second.node_id} == {42, 43}, "upward from what they prefer"
    assert undecided.node_id == 124, "no preference: the highest free one, as the servo has 125"
    for each in applicants:
        assert {source for source, _ in each.said} == {OURS}
        assert [length for _, length in each.said][-3:] == [6, 12, 16], "one response for each part of the unique id"
    given = {uid(number).hex(): each.node_id for number, each in enumerate(applicants, 1)}
    assert given.items() <= bench.allocations().items()
    state = bench.bus()["allocator"]
    assert (state["state"], state["granted"]) == ("on", len(bench.allocations()))


def test_a_tool_id_is_not_allocated_to_a_node_that_prefers_it(bench: Bench) -> None:
    with Applicant(uid(4), 126) as tool:
        tool.run_until(lambda: tool.node_id, "a node id")
        assert tool.node_id == 123


def test_a_restarted_node_gets_its_former_id_regardless_of_its_preference(bench: Bench) -> None:
    with Applicant(uid(20), 60) as before:
        before.run_until(lambda: before.node_id, "a node id")
        given = before.node_id
    with Applicant(uid(20), 99) as after:
        after.run_until(lambda: after.node_id, "a node id again")
        assert after.node_id == given == bench.allocations()[uid(20).hex()] == 60


def test_an_id_in_use_is_not_allocated_to_another_node(bench: Bench) -> None:
    with Peer(70, name="org.example.resident", unique_id=uid(30)) as resident, Applicant(uid(31), 70) as newcomer:
        resident.live(1.3)
        run_until([resident, newcomer], lambda: newcomer.node_id, "a node id")
        assert newcomer.node_id == 71
    assert uid(30).hex() not in bench.allocations(), "it never requested"


def test_foreign_nodes_are_listed_and_not_mistaken_for_servos(bench: Bench) -> None:
    pilot = Peer(50, name="org.example.autopilot", unique_id=uid(60))
    gripper = Peer(51, name="org.example.gripper", unique_id=uid(80))
    pilot.node.health, gripper.node.mode = NODE_STATUS.HEALTH_WARNING, NODE_STATUS.MODE_MAINTENANCE

    def say_status() -> None:
        said = uavcan.equipment.actuator.Status()
        said.actuator_id, said.position = 7, 0.25
        gripper.node.broadcast(said)

    with pilot, gripper:
        gripper.node.periodic(0.1, say_status)
        nodes: dict[int, dict[str, Any]] = {}
        for _ in range(90):
            live_together([pilot, gripper], 1.0)
            nodes = {each["node_id"]: each for each in bench.api.get("/nodes").json()}
            known = all(each in nodes and nodes[each]["name"] and nodes[each]["note"] for each in (50, 51))
            if known and nodes[50]["kind"] == "foreign":
                break
        servos = {each["uid"] for each in bench.api.get("/servos").json()}
    said = {node_id: (nodes[node_id]["name"], nodes[node_id]["health"], nodes[node_id]["mode"]) for node_id in (50, 51)}
    assert said == {
        50: ("org.example.autopilot", "warning", "operational"),
        51: ("org.example.gripper", "ok", "maintenance"),
    }
    assert [nodes[each]["uid"] for each in (50, 51)] == [uid(60).hex(), uid(80).hex()]
    assert nodes[50]["kind"] == "foreign"
    assert nodes[51]["kind"] in ("foreign", "unknown"), "an actuator that does not respond may still be a servo"
    assert nodes[51]["note"]
    assert nodes[OURS]["kind"] == "hornbill"
    assert {nodes[each["node_id"]]["kind"] for each in bench.ready()} == {"servo"}
    assert servos == bench.uids


def test_beside_another_allocator_ours_is_in_standby_until_it_is_gone(bench: Bench, tmp_path: Path) -> None:
    with Peer(110, name="org.example.allocator", unique_id=uid(40), monitors=True) as competitor:
        monitor: Any = NodeMonitor(competitor.node)
        theirs: Any = CentralizedServer(competitor.node, monitor, database_storage=str(tmp_path / "table.db"))
        competitor.run_until(lambda: monitor.exists(OURS) and monitor.are_all_nodes_discovered(), "it knows the bus")
        with Applicant(uid(41), 80) as first, Applicant(uid(42), 80) as second:
            run_until([competitor, first], lambda: first.node_id, "a node id from either")
            state = bench.bus()["allocator"]
            assert (state["state"], state["competing_node_id"]) == ("standby", 110)
            run_until([competitor, first, second], lambda: second.node_id, "a node id from the other one")
            assert {source for source, _ in second.said} == {110}
            assert first.node_id != second.node_id
            assert uid(42).hex() not in bench.allocations()
        theirs.close()
        monitor.close()
    with Applicant(uid(43), 90) as third:
        third.run_until(lambda: third.node_id, "a node id from ours")
        assert third.node_id == 90
        assert third.said[-1][0] == OURS
        assert third.requests > 1, "it left a few requests to the other one"
    state = bench.bus()["allocator"]
    assert (state["state"], state["competing_node_id"]) == ("on", None)

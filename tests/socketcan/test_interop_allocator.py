"""The allocator of the public Python stack gives our simulated servos their node IDs on a Linux CAN bus."""

import time
from pathlib import Path
from typing import Any

import pytest
from dronecan.app.dynamic_node_id import CentralizedServer  # pyright: ignore[reportUnknownVariableType]
from dronecan.app.node_monitor import NodeMonitor  # pyright: ignore[reportUnknownVariableType]

from hornbill.wire.services import MAGIC
from socketcan.peer import Peer, uavcan
from socketcan.processes import hornbill, line

pytestmark = pytest.mark.release

OWN = 120


class Allocation:
    """The stack's allocator with its table in a file, and what its node monitor knows of the bus."""

    def __init__(self, peer: Peer, table: Path) -> None:
        self.peer = peer
        self.node_status = peer.listen(uavcan.protocol.NodeStatus)
        self.monitor: Any = NodeMonitor(peer.node)
        self.server: Any = CentralizedServer(peer.node, self.monitor, database_storage=str(table))

    def table(self) -> dict[str, int]:
        """Node ids by unique id, as it keeps them."""
        entries = self.server.get_allocation_table()
        return {bytes(uid).hex(): node_id for uid, node_id in entries if uid is not None}

    def uptime(self, node_id: int) -> int:
        """What the last NodeStatus of a node said; -1 when it never said any."""
        said = (each.message.uptime_sec for each in reversed(self.node_status) if each.source == node_id)
        return next(said, -1)

    def started_since(self, instant: float) -> set[int]:
        """Nodes whose NodeStatus says that they were started after an instant, in seconds since 1970."""
        return {each.source for each in self.node_status if each.at - each.message.uptime_sec > instant}

    def until_up(self, requesting: set[str]) -> dict[str, int]:
        """The node ids of servos that requested one, once each is in use."""
        self.peer.run_until(lambda: requesting <= self.table().keys(), "every servo has its node id")
        given = {uid: node_id for uid, node_id in self.table().items() if uid in requesting}
        self.peer.run_until(lambda: all(self.uptime(each) > 0 for each in given.values()), "they are on the bus")
        return given


def test_simultaneous_servos_get_ids_and_the_same_after_a_restart(vcan0: str, tmp_path: Path) -> None:
    with Peer(OWN, name="org.example.allocator") as peer:
        allocation = Allocation(peer, tmp_path / "table.db")
        with hornbill("sim", "--bus", vcan0, "--servos", "6", "--seed", "5") as process:
            printed = [line(process) for _ in range(6)]
            requesting = {each.split()[0] for each in printed if each.endswith("requested")}
            assert len(requesting) == 3
            given = allocation.until_up(requesting)
            assert sorted(given.values()) == [123, 124, 125], "no preference: from the highest free one down"
            for uid, node_id in given.items():
                (response,) = peer.request((node_id, uavcan.protocol.GetNodeInfo.Request()))
                assert bytes(list(response.message.hardware_version.unique_id)).hex() == uid

            restart = uavcan.protocol.RestartNode.Request()
            restart.magic_number = MAGIC
            requested = time.time()
            responses = peer.request(*((node_id, restart) for node_id in given.values()))
            assert all(each.message.ok for each in responses)

            peer.run_until(lambda: allocation.started_since(requested) >= set(given.values()), "the three are back")
            assert allocation.until_up(requesting) == given
        allocation.server.close()
        allocation.monitor.close()

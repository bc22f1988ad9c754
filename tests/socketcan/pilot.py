"""An autopilot of the public Python stack on vcan0, in its own process: node 10, allocator, ArrayCommand.

Reads lines from standard input: `rate HZ`, `value X` (UNITLESS, for servo ID 1), `safety on`, `safety off`.
"""

# The stack is dynamic and has no type hints.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportUnknownMemberType=false, reportMissingTypeStubs=false

import os
import select
import sys
import time
from pathlib import Path
from typing import Any

from dronecan.app.dynamic_node_id import CentralizedServer
from dronecan.app.node_monitor import NodeMonitor

from socketcan.peer import Peer, uavcan

AUTOPILOT = 10
PRIORITY = 16
CHECK_S = 0.02


def main(table: Path) -> None:
    """Run until standard input ends. `table`: database of the allocator."""
    with Peer(AUTOPILOT, name="org.ardupilot:0", unique_id=bytes(range(16)), monitors=True) as pilot:
        monitor: Any = NodeMonitor(pilot.node)
        server: Any = CentralizedServer(pilot.node, monitor, database_storage=str(table))
        print("ready", flush=True)
        rate_hz, value, silent = 50.0, 0.0, True
        due = checked = time.monotonic()
        while True:
            now = time.monotonic()
            if now - checked > CHECK_S:
                checked = now
                if select.select([sys.stdin], [], [], 0)[0]:
                    told = os.read(sys.stdin.fileno(), 4096).decode()
                    if not told:
                        break
                    for words in map(str.split, told.splitlines()):
                        match words:
                            case ["rate", hz]:
                                rate_hz = float(hz)
                            case ["value", one]:
                                value = float(one)
                            case _:
                                silent = words[1] == "on"
                    due = now
            if now >= due:
                if not silent:
                    pilot.node.broadcast(_array_command(value), priority=PRIORITY)
                due = max(due + 1 / rate_hz, now - 0.05)
            pilot.node.spin(max(0.0, min(due - time.monotonic(), CHECK_S)))
        server.close()
        monitor.close()


def _array_command(value: float) -> Any:
    command = uavcan.equipment.actuator.Command()
    command.actuator_id, command.command_type, command.command_value = 1, command.COMMAND_TYPE_UNITLESS, value
    message = uavcan.equipment.actuator.ArrayCommand()
    message.commands.append(command)
    return message


if __name__ == "__main__":
    main(Path(sys.argv[1]))

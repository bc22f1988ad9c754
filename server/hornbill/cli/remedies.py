"""Remedies in terms of the command line, by cause of an error and advice of a finding.

The layers below name no commands.
"""

import re
from collections.abc import Mapping
from typing import Final

from hornbill.errors import HornbillError

_AT_START: Final[Mapping[str, str]] = {
    "damaged": "hornbill restore FILE",
    "newer": "hornbill restore FILE, with a backup made before the upgrade",
    "driver": "pip install 'hornbill[postgres]'",
    "data_folder": "--data-dir FOLDER",
    "address": "--database URL",
}
"""By `reason` of a database or data folder that cannot be used."""

COMMANDS: Final[Mapping[str, str]] = {
    "motion_command": "hornbill move",
    "beyond_array_command_range": "hornbill move",
    "id_not_addressable": "hornbill move",
    "job_not_found": "hornbill jobs list",
    "lease_ended": "the command again",
    "log_running": "hornbill logs stop",
    "mode_off": "hornbill set {uid} speed_torque_control=true",
    "servo_never_seen": "hornbill inventory list",
    "fault_never_seen": "hornbill faults list {uid}",
    "register_forbidden": "hornbill get {uid}",
    "no_bus": "hornbill bus connect INTERFACE:CHANNEL",
    "lease_missing": "hornbill leases",
    "profile_not_found": "hornbill profiles list",
    "run_not_found": "hornbill runs list",
    "token_not_found": "hornbill tokens list",
    "node_id_reassigned": "hornbill bus show",
    "node_id_still_in_use": "hornbill commission",
    "address_is_recording": "hornbill bus connect INTERFACE:CHANNEL",
    "recorded_servo": "hornbill bus connect INTERFACE:CHANNEL",
    "runs_on_defaults": "hornbill snapshots restore {uid} {snapshot_id}",
    "shared_servo_id": "hornbill move",
    "snapshot_not_found": "hornbill snapshots list {uid}",
    "stopped": "hornbill stop --clear",
    "timeout_needs_lease": "hornbill leases",
    "torque_is_off": "hornbill move --torque-on, or hornbill torque {uid} on",
    "position_unit_conflict": "hornbill position-unit {uid}",
}
"""By cause of a problem of the server. Parts in braces are filled with facts of the problem if it has them."""

ADVISED: Final[Mapping[str, str]] = {
    "check_adapter": "hornbill bus connect INTERFACE:CHANNEL",
    "check_timing_and_wiring": "hornbill bus connect INTERFACE:CHANNEL",
    "connect_adapter": "hornbill bus adapters, hornbill bus connect INTERFACE:CHANNEL",
    "free_node_id": "hornbill node-ids list, hornbill node-ids release SERVO",
    "keep_one_allocator": "hornbill node-ids set-allocator off",
    "turn_allocator_on": "hornbill node-ids set-allocator on",
}
"""By advice of a finding, if the server names a request for programs."""

_REQUEST: Final = " Use: "
"""Start of the request in a remedy of the server."""

_PART: Final = re.compile(r"\{(\w+)\}")
_METAVARS: Final = {"uid": "SERVO", "snapshot_id": "SNAPSHOT"}


def detail(error: HornbillError) -> str:
    """Text of an error, followed by the command that resolves it, in place of the request for programs."""
    command = COMMANDS.get(error.facts.get("cause", "")) or _AT_START.get(error.facts.get("reason", ""))
    if command is None:
        return error.detail
    filled = _PART.sub(lambda part: str(error.facts.get(part[1]) or _METAVARS[part[1]]), command)
    return f"{error.summary or error.detail} Use: {filled}."


def of_finding(remedy: str | None, advice: str | None) -> str | None:
    """Remedy of a finding with the command that applies it, in place of the request for programs. None if none."""
    command = ADVISED.get(advice or "")
    if remedy is None or command is None:
        return remedy
    return f"{remedy.partition(_REQUEST)[0]}{_REQUEST}{command}."

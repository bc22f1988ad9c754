"""Requests that resolve a problem or a finding, for programs. The layers below know no routes."""

import re
from collections.abc import Mapping
from typing import Final

from hornbill.domain.bus import Advice, Finding
from hornbill.errors import Cause, HornbillError

REQUESTS: Final[Mapping[Cause, str]] = {
    "motion_command": "POST /api/v1/servos/{uid}/command",
    "beyond_array_command_range": "POST /api/v1/servos/{uid}/command",
    "id_not_addressable": "POST /api/v1/servos/{uid}/command",
    "job_not_found": "GET /api/v1/jobs",
    "lease_ended": "POST /api/v1/leases",
    "log_running": "DELETE /api/v1/bus/log",
    "mode_off": "PUT /api/v1/servos/{uid}/parameters/speed_torque_control",
    "servo_never_seen": "GET /api/v1/inventory",
    "fault_never_seen": "GET /api/v1/servos/{uid}/faults",
    "register_forbidden": "GET /api/v1/schema",
    "no_bus": "PUT /api/v1/bus",
    "lease_missing": "POST /api/v1/leases, then its ID in the header 'Lease'",
    "profile_not_found": "GET /api/v1/profiles",
    "run_not_found": "GET /api/v1/runs",
    "stream_not_found": "GET /api/v1/streams",
    "token_not_found": "GET /api/v1/tokens",
    "node_id_reassigned": "GET /api/v1/bus",
    "node_id_still_in_use": "POST /api/v1/commissioning",
    "address_is_recording": "PUT /api/v1/bus",
    "commanded_by_other_stream": "DELETE /api/v1/streams/{stream_id}",
    "recorded_servo": "PUT /api/v1/bus",
    "control_request_not_found": "POST /api/v1/leases/requests",
    "runs_on_defaults": "POST /api/v1/servos/{uid}/snapshots/{snapshot_id}/restore",
    "shared_servo_id": "POST /api/v1/servos/{uid}/command",
    "snapshot_not_found": "GET /api/v1/servos/{uid}/snapshots",
    "stopped": "DELETE /api/v1/stop",
    "timeout_needs_lease": "POST /api/v1/leases, then its ID in the header 'Lease'",
    "torque_is_off": 'POST /api/v1/servos/{uid}/torque {"mode": "on"}',
    "position_unit_conflict": "PUT /api/v1/servos/{uid}/position-unit",
}
"""By cause of a problem. Parts in braces are filled with facts of the problem if it has them."""

ADVISED: Final[Mapping[Advice, str]] = {
    "change_own_node_id": "HORNBILL_NODE_ID={other_id} hornbill serve",
    "check_adapter": "PUT /api/v1/bus",
    "check_timing_and_wiring": "PUT /api/v1/bus",
    "close_program": "HORNBILL_NODE_ID={other_id} hornbill serve",
    "connect_adapter": 'GET /api/v1/bus/adapters, PUT /api/v1/bus {"address": "socketcan:can0"}',
    "free_node_id": "GET /api/v1/allocations, DELETE /api/v1/allocations/{uid}",
    "keep_one_allocator": 'PUT /api/v1/bus/allocator {"mode": "off"}',
    "turn_allocator_on": 'PUT /api/v1/bus/allocator {"mode": "on"}',
}
"""By advice of a finding: a request, or a command that starts the server."""


_PART: Final = re.compile(r"\{(\w+)\}")


def detail(error: HornbillError) -> str:
    """Text of a problem, followed by the request that resolves it."""
    request = REQUESTS.get(error.facts.get("cause"))  # pyright: ignore[reportArgumentType]
    return error.detail + (_confirmation(error) or _named(request, error.facts))


def remedy(finding: Finding) -> str | None:
    """Remedy of a finding, followed by the request that applies it."""
    if finding.remedy is None or finding.advice is None:
        return finding.remedy
    return finding.remedy + _named(ADVISED.get(finding.advice), finding.params)


def _named(request: str | None, values: Mapping[str, object]) -> str:
    if request is None:
        return ""
    return f" Use: {_PART.sub(lambda part: str(values.get(part[1], part[0])), request)}."


def _confirmation(error: HornbillError) -> str:
    """Instruction for programs: repeat the request with every code, or with one of several choices."""
    if error.code != "needs_confirmation":
        return ""
    choices: list[str] = error.facts.get("choices") or []
    if len(choices) > 1:
        return f" Repeat the request with confirm: {' or '.join(map(_list, choices))}."
    words: list[str] = error.facts.get("words") or [*filter(None, [error.facts.get("confirm")])]
    return f" To confirm, repeat the request with confirm: {_list(*words)}." if words else ""


def _list(*words: str) -> str:
    return "[" + ", ".join(f'"{word}"' for word in words) + "]"

"""Codes of events, and of reasons why a lease ended."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from typing_extensions import TypeAliasType

from hornbill.domain.fields import Param, known

EventCode = TypeAliasType(
    "EventCode",
    Literal[
        # bus
        "connected",
        "disconnected",
        "bus_lost",
        "bus_trouble",
        "bus_back",
        "sample_point",
        # node IDs
        "allocator_mode",
        "allocated",
        "node_ids_freed",
        "node_id_recycled",
        "no_node_id",
        "second_allocator",
        "second_allocator_gone",
        "own_node_id",
        "own_node_id_alone",
        # servos
        "ready",
        "offline",
        "restarted",
        "fault",
        "fault_cleared",
        "hunting",
        "hunting_ended",
        "saturated",
        "saturated_ended",
        "turns_lost",
        "drift",
        "ram_values_lost",
        "position_unit",
        "not_rolled_back",
        "not_restored",
        "restored_later",
        # motion control
        "lease_requested",
        "lease_withdrawn",
        "lease_refused",
        "lease_passed",
        "lease_forced",
        "lease_ended",
        "hold_ended",
        "move_ended",
        "stream_ended",
        "command_ended",
        "commanded_elsewhere",
        "command_lost",
        "motion_yielded",
        # torque off
        "stopped",
        "stopped_late",
        "stop_cleared",
        "no_response",
        "torque_off",
        # recordings, store
        "recording_written",
        "recording_failed",
        "recordings_deleted",
        "log_started",
        "log_stopped",
        "log_full",
        "log_failed",
        "store_failed",
        "bench_taken",
    ],
)
"""Code of an event. With its `params` a page words it in its language."""

Unstored = Literal["audit", "faults", "changes", "stop", "servo", "lost_values", "position_unit"]
"""Data that could not be stored: parameter `what` of the event store_failed."""


LeaseEndCode = Literal["expired", "released", "page_closed", "job_ended", "passed", "forced"]


@dataclass(frozen=True, slots=True)
class LeaseEnd:
    """Reason why a lease ended, as a code with parameters and as text. `holder`: client that had or took it."""

    code: LeaseEndCode
    holder: str
    reason: str = ""
    """Reason for a forced takeover, in the client's words."""

    @property
    def text(self) -> str:
        """One sentence."""
        return _LEASE_ENDS[self.code].format(holder=self.holder, because=because(self.reason))

    @property
    def params(self) -> dict[str, Param]:
        """Parameters of the text."""
        return known(why=self.code, holder=self.holder, reason=self.reason or None)


_LEASE_ENDS: Final[Mapping[LeaseEndCode, str]] = {
    "expired": "The lease of {holder} expired.",
    "released": "{holder} released motion control.",
    "page_closed": "The page of {holder} closed.",
    "job_ended": "{holder} ended.",
    "passed": "Motion control passes to {holder} on request.",
    "forced": "{holder} took motion control by force{because}",
}


def because(reason: str) -> str:
    """The end of a sentence, with a client's reason if given."""
    return f": {reason.rstrip('.')}." if reason.strip() else "."

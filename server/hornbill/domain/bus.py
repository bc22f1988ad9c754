"""The bus: findings of the doctor."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from hornbill.domain.fields import STRICT, Param, Params

Severity = Literal["ok", "notice", "warning", "failure"]
"""ok: checked, without finding. notice: worth knowing, nothing to repair."""


Check = Literal[
    "adapter",
    "bus_off",
    "bit_rate",
    "no_traffic",
    "own_node_id",
    "duplicate_node_id",
    "duplicate_servo_id",
    "servos_without_id",
    "other_commands",
    "second_allocator",
    "allocation_stuck",
    "frames_dropped",
    "errors_rising",
    "load_over_budget",
    "serial_line_full",
    "silent_node",
    "answers_lost",
    "answers_slow",
    "servo_offline",
    "foreign_frames",
]
"""Code of a check that may be without finding."""

FindingCode = Literal[
    Check,
    "no_bus",
    "adapter_failed",
    "adapter_lost",
    "interface_down",
    "sample_point",
    "only_errors",
    "unacknowledged",
    "nothing_received",
    "makers_program",
    "allocator_off",
    "allocation_refused",
    "adapter_silent",
    "bit_rate_fixed",
    "baud_unknown",
    "adapter_echoes",
    "line_noise",
    "latency_timer",
]

Advice = Literal[
    "connect_adapter",
    "check_adapter",
    "check_timing_and_wiring",
    "find_short",
    "set_bit_timing",
    "set_bit_rate",
    "check_wires",
    "check_wires_and_baud",
    "free_serial_line",
    "check_plugs",
    "slow_sender",
    "free_computer",
    "none_needed",
    "renumber_node",
    "change_own_node_id",
    "close_program",
    "give_servo_ids",
    "silence_commander",
    "renumber_servos",
    "keep_one_allocator",
    "turn_allocator_on",
    "free_node_id",
    "check_node_and_restart",
    "check_node",
    "check_cable_and_restart",
    "check_worst_cable",
    "check_computer",
    "check_supply",
]
"""Code of a remedy. A remedy that the adapter gives has none."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Finding:
    """One check of the doctor. `ok` only with `all=true`."""

    code: FindingCode = Field(description="Code for programs. Stable.")
    severity: Severity = Field(description="Severity.")
    text: str = Field(description="One sentence for users.")
    evidence: str = Field(description="Observed values.")
    remedy: str | None = Field(description="What to do about it. Null if nothing.")
    node_ids: tuple[int, ...] = Field(default_factory=tuple[int, ...], description="IDs of the nodes concerned.")
    uids: tuple[str, ...] = Field(default_factory=tuple[str, ...], description="Unique IDs of the servos concerned.")
    advice: Advice | None = Field(
        default=None, description="Code of `remedy`. Null if there is none, or if the adapter gives it."
    )
    params: Params = Field(default_factory=dict[str, Param])

"""Notes: short sentences on a value, each with its code."""

from typing import Literal, Self

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Param, Params
from hornbill.errors import HornbillError

NoteCode = TypeAliasType(
    "NoteCode",
    Literal[
        "problem",
        "text",
        # connection role
        "heard",
        # rows left out
        "not_in_servo",
        "side_unknown",
        "identity_row",
        "torque_row",
        "torque_never_on",
        # lines of profile files
        "too_many_dots",
        "invalid_syntax",
        "nested_too_deeply",
        "not_an_object",
        "not_a_table",
        "too_many_entries",
        "values_missing",
        "unknown_field",
        "not_text",
        "too_long",
        "lone_surrogate",
        "other_tables",
        "unit_not_text",
        "unit_without_value",
        # node IDs
        "pin_unchanged",
        "pin_at_restart",
        "pin_after_fixed",
        "id_freed",
        "id_changes_at_restart",
        # nodes
        "no_status",
        "this_server",
        "another_hornbill",
        "requesting_id",
        "no_model_number",
        "no_parameters",
        "no_info",
        "identity_not_received",
        # polling
        "not_pollable_yet",
        "polled_when_ready",
        "not_polled_as_observer",
        # logs
        "log_limit",
        "disk_slow",
        "disk_full",
        "write_failed",
        # the unit of positions
        "unit_unchecked",
        "unit_agreed",
        "unit_changed",
        "unit_none_fits",
        "unit_forced",
        # the audit
        "reason",
        "stop_reason",
        "stop_of",
        "stop_confirmed",
        "lease_taken",
        "lease_ended",
        "profile_stored",
        "profile_replaced",
        "profile_deleted",
        "ram_only",
        "servo_id_zero",
        "login_from",
        "servo_forgotten",
        "not_seen_for",
        # results of jobs
        "commissioned",
        # improve
        "improved",
        "not_better",
        # ends of streams
        "ended_by_request",
        "server_shutdown",
        # step tests
        "smoothing_on",
        "limit_reached",
        "limit_unknown",
        # runs that cannot be compared
        "other_servo",
        "other_set_up",
        "other_procedure",
        "other_step",
        # what to try after a run
        "try_check_free",
        "try_lower_boost",
        "try_lower_p",
        "try_higher_p",
        "try_supply",
        "try_smoothing_off",
        "try_smaller_step",
        "try_narrow_deadband",
        "try_raise_torque",
        "try_longer",
        "try_check_bus",
        "try_larger_amplitude",
        # dependence of a frequency response on the amplitude
        "deadband_dependence",
        "saturation_dependence",
        # mechanics
        "unknowable_loaded_backlash",
        "unknowable_elasticity",
        "unknowable_torque",
        "unknowable_resolution",
        "gear_on_one_side",
        "no_stop_in_range",
        "too_little_torque",
        "too_few_samples",
    ],
)
"""Code of a note. With its `params` a page words it in its language. `problem`: its params are those of a problem.
`text`: text of a user or of an older hornbill."""


@dataclass(
    frozen=True, slots=True, config=ConfigDict(json_schema_serialization_defaults_required=True, defer_build=True)
)
class Note:
    """One sentence for users, with its code and its values."""

    text: str = Field(description="One sentence for users.")
    code: NoteCode = Field(description="Code of `text`.")
    params: Params = Field(default_factory=dict[str, Param])

    @classmethod
    def of(cls, problem: HornbillError) -> Self:
        """A problem as a note."""
        return cls(problem.detail, "problem", problem.note_params)

    @classmethod
    def words(cls, text: str) -> tuple[Self, ...]:
        """A user's text as a note, if not empty."""
        return (cls(text, "text"),) if text else ()

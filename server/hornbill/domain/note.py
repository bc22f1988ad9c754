"""Notes: short sentences of the server beside a value, each with its code."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Param

NoteCode = TypeAliasType(
    "NoteCode",
    Literal[
        "problem",
        # rows left out
        "not_in_servo",
        "side_unknown",
        "identity_row",
        "torque_row",
        "torque_never_on",
        # lines of profile files
        "too_many_dots",
        "no_syntax",
        "nested_too_deeply",
        "no_object",
        "no_table",
        "too_many_entries",
        "no_value",
        "unknown_field",
        "no_text",
        "too_long",
        "half_character",
        "other_tables",
        "unit_no_text",
        "unit_without_value",
        # node IDs
        "pin_kept",
        "pin_at_start",
        "pin_after_fixed",
        "id_free",
        "id_kept_until_start",
        # nodes
        "no_status",
        "this_server",
        "another_hornbill",
        "asking_for_id",
        "no_model_number",
        "no_parameters",
        "no_info",
        # polling
        "not_pollable_yet",
        "polled_when_ready",
        # logs
        "log_limit",
        "disk_slow",
        "disk_full",
        "write_failed",
        # results of jobs
        "commissioned",
    ],
)
"""Code of a note; with its `params` a page words it in its language. `problem`: they are those of a problem."""


@dataclass(frozen=True, slots=True)
class Note:
    """One sentence for people, with its code and the values in it."""

    text: str
    code: NoteCode
    params: dict[str, Param] = Field(default_factory=dict[str, Param])

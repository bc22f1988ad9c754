"""The error tree. Every class carries the code that REST, WebSocket and the command line answer with.

HornbillError
├── TableError            a mistake in schemas/, with file and row
├── StoreFailed           store_failed: the database cannot be opened, is damaged, or is from a newer hornbill
├── LogFailed             log_failed: a recording of frames cannot be read or written
├── PortError             bus_trouble: what a port says is wrong with its adapter or bus
│   ├── PortOpenFailed    bus_open_failed: an address that cannot be opened, and the remedy
│   └── BusDisconnected   bus_disconnected: no bus, or the bus was lost while we waited
│       └── BusReadOnly   bus_read_only: the bus is a recording, so nothing can be sent
├── NoResponse              no_response: asked, and nothing came back in any of the tries
├── Refused               refused_by_servo: the servo answered, and said no
├── DidNotMove            did_not_move: the horn was commanded, and did not do it
├── NotAsWanted           not_as_wanted: RAM or ROM was found to hold something else than what was written
├── Interrupted           interrupted: the server ended while a job, or a request with a key, was under way
├── ForbiddenParameter    forbidden_parameter: 0x49, or a reserved register
├── NotAvailable          not_available: needs something that is not installed here; the message names it
└── BadRequest            what was asked cannot be done, and nothing was changed
    ├── Unknown           unknown_servo, unknown_parameter, unknown_job, unknown_lease, unknown_uid, unknown_log,
    │                     unknown_snapshot, unknown_profile, unknown_run, unknown_stream, unknown_fault,
    │                     unknown_recording, unknown_token, no_simulator
    ├── NotInThisModel    not_in_this_model
    ├── ReadOnly          read_only
    ├── OutOfRange        out_of_range
    ├── InvalidValue      invalid_value
    ├── ModeOff           mode_off
    ├── TorqueOff         torque_off
    ├── TorqueOn          torque_on
    ├── PositionUnitUnknown position_unit_unconfirmed: an angle by ArrayCommand, and its unit is in conflict
    ├── LeaseRequired     lease_required
    ├── LeaseHeld         lease_held
    ├── Stopped           stopped
    ├── Busy              busy
    ├── Conflict          conflict: an id that belongs to another servo
    ├── BusBudget         bus_budget: more than the bus has left; facts: bus_share, left, possible_hz
    ├── NeedsConfirmation needs_confirmation: it would switch the servo off, or worse
    ├── ConfigurationLost configuration_lost: it runs on defaults, because ROM could not be loaded
    ├── ForbiddenOrigin   forbidden_origin
    ├── Unauthorized      unauthorized: a token is needed, or this one is not known
    ├── ForbiddenRole     forbidden_role: the token's role does not reach so far; facts: role, needed
    ├── TooManyAttempts   too_many_attempts: logins or tokens that were wrong; facts: retry_after_s
    ├── WrongMediaType    unsupported_media_type: a body that is not JSON
    ├── TooLarge          too_large: a body beyond its limit; facts: limit_bytes
    ├── KeyReused         idempotency_key_reused: the key came with another request before
    └── StaleRevision     stale_revision
"""

from typing import Any, ClassVar, Literal, Self, TypeAlias, cast

Cause: TypeAlias = Literal[
    "adapter_ambiguous", "adapter_lost", "adapter_not_found", "adapter_removed", "adapter_unconfirmed",
    "address_is_recording", "allocation_busy", "allocation_not_found", "already_requested", "angle_unknown",
    "baud_unknown", "baud_unsupported", "before_out_of_range", "between_steps", "beyond_array_command_range",
    "beyond_half_turn", "beyond_model_limit", "beyond_servo_limit", "bit_rate_mismatch", "bit_rate_unsupported",
    "body_not_json", "body_too_large", "brake_not_acknowledged", "broadcast_id", "bus_address_invalid",
    "bus_disconnecting", "bus_lost", "bus_lost_during_command", "bus_not_connected", "bus_off", "bus_option_required",
    "candle_channel_invalid", "candle_package_missing", "changed_since_read", "channel_invalid",
    "channel_names_unavailable", "channel_not_found", "channel_not_numeric", "closed_while_opening",
    "command_in_profile", "command_superseded", "commanded_by_other_stream", "commanded_by_stream",
    "commands_interrupted", "commands_unsupported", "control_request_not_found", "control_transfer_in_progress",
    "control_transfer_pending", "could_switch_off", "data_folder_only", "delete_failed", "demo_only",
    "device_not_found", "driver_not_loaded", "driver_not_responding", "driver_open_timeout", "driver_refused",
    "duplicate_command", "duplicate_id", "duplicate_servo", "fault_never_seen", "file_name_invalid",
    "file_name_missing", "file_not_found", "file_not_toml_or_json", "file_not_written", "file_too_large",
    "file_unreadable", "firmware_invalid", "firmware_not_for_model", "firmware_unknown", "first_token_not_admin",
    "force_without_reason", "form_media_type", "frame_gap_out_of_range", "frames_missing", "frames_timeout",
    "hold_angle_unsupported", "hold_not_renewed", "horn_loaded", "horn_moved", "horn_off_position", "horn_turning",
    "horn_turning_before_save", "horn_turning_output_off", "host_not_allowed", "host_not_found",
    "id_changed_since_prepared", "id_exchange_failed", "id_in_use", "id_not_accepted", "id_not_addressable",
    "id_still_in_use", "id_used_by_other_servo", "identification_incomplete", "identity_in_profile", "in_use",
    "interface_bus_off", "interface_down", "interface_not_found", "interface_not_visible", "interface_unsupported",
    "internal_error", "job_cancelled", "job_in_progress", "job_not_found", "job_running", "kernel_without_socketcan",
    "key_malformed", "key_reused", "label_of_recorded_servo", "last_command_not_accepted", "lease_ended",
    "lease_ended_during_command", "lease_held_by_other", "lease_missing", "lease_of_key_ended", "line_not_utf8",
    "lines_invalid", "linux_only", "loaded_horns", "log_damaged", "log_format_unknown", "log_not_written",
    "log_running", "mavlink", "media_type_not_json", "message_invalid", "mode_off", "model_unknown", "motion_command",
    "multi_turn_moves", "name_in_use", "names_unknown", "no_bus", "no_data_at_baud", "no_data_at_given_baud",
    "no_data_received", "no_driver", "no_pending_request", "no_permission", "no_simulator", "node_id_in_use",
    "node_id_mismatch", "node_id_missing", "node_id_not_free_yet", "node_id_out_of_range", "node_id_reassigned",
    "node_id_reserved", "node_id_still_in_use", "node_ids_exhausted", "node_not_responding", "not_a_number",
    "not_a_recording", "not_allowed_in_profile", "not_following", "not_identified", "not_in_firmware", "not_in_source",
    "not_in_stream", "not_on_bus", "not_playable", "not_ready", "not_restorable", "not_restored_after_wiggle",
    "not_resumable", "not_simulated", "not_slcan", "not_stored_in_rom", "nothing_to_write", "offline",
    "one_source_required", "open_failed", "origin_not_allowed", "other_command_active", "outcome_unknown",
    "output_not_maintained", "output_not_switched_back", "outputs_still_off", "outside_all_models", "outside_limits",
    "own_node_id", "parameter_unknown", "playback_ended", "playback_in_progress", "playback_speed_invalid",
    "playback_stopped", "port_closed", "position_unit_conflict", "profile_angle_only", "profile_not_accepted",
    "profile_not_found", "profile_of_unknown_series", "pyarrow_missing", "ram_unknown", "read_during_soft_start",
    "read_only", "read_only_in_profile", "read_refused_before_write", "reading_not_settable", "recorded_servo",
    "recording_damaged", "recording_not_written", "recording_unreadable", "recordings_folder_missing",
    "register_forbidden", "register_refused", "released_before_settling", "released_before_start", "replay_failed",
    "request_malformed", "reset_refused", "response_gap", "restart_ignored", "restart_not_seen", "restart_refused",
    "restarted_before_save", "restarted_before_write", "restarted_during_read", "restarted_since_prepared",
    "restarts_repeatedly", "restarts_repeatedly_in_reset", "role_insufficient", "rom_differs", "rom_lost_during_save",
    "row_not_in_model", "row_not_in_servo", "rows_invalid", "rows_not_restored", "run_not_found", "runs_missing",
    "runs_on_defaults", "save_cancelled", "save_outcome_unknown", "save_refused", "server_exited",
    "server_not_responding", "server_not_running", "servo_id_in_use", "servo_id_not_restored", "servo_id_parked",
    "servo_never_seen", "servo_not_responding", "servo_online", "servo_restarted", "setting_unknown",
    "settle_angle_only", "shared_servo_id", "side_unknown", "sim_output_on", "sim_servo_invalid",
    "slcan_bit_rate_unsupported", "slcan_setting_refused", "snapshot_has_previous_values", "snapshot_not_found",
    "snapshot_not_stored", "snapshot_of_other_servo", "snapshot_of_unknown_model", "socketcand_address_invalid",
    "socketcand_refused", "soft_start_stuck", "some_servos_failed", "step_out_of_range", "step_path_differs",
    "steps_incomplete", "stopped", "store_newer", "store_timeout", "store_unusable", "stream_ended", "stream_not_found",
    "stream_too_fast", "supply_out_of_range_reset", "supply_out_of_range_save", "switched_off_during_command",
    "switched_off_during_save", "table_invalid", "timeout_needs_lease", "token_name_in_use", "token_name_invalid",
    "token_not_found", "token_required", "token_unknown", "too_many_attempts", "too_many_commands", "too_many_errors",
    "too_many_requests", "torque_in_rom_unknown", "torque_is_off", "torque_off_not_accepted", "torque_off_unconfirmed",
    "torque_on", "torque_on_not_accepted", "torque_saved_to_rom", "torque_switched_off", "torque_unverified",
    "torque_unverified_stop", "turn_count", "turns", "unassigned_id", "under_command", "under_speed_command",
    "unique_for_many", "unit_change_under_command", "unit_depends_on_other_row", "unit_mismatch", "unknown_series",
    "unplugged", "unread_after_restart", "upload_too_large", "value_changed_by_servo", "value_unknown_in_source",
    "values_differ", "values_lost_before_save", "values_missing", "values_not_retained", "wiggle_failed",
    "wiggle_range_too_small", "write_forbidden", "write_never_allowed", "wrong_type",
]  # fmt: skip
"""What exactly went wrong, where one code has several causes: with it and the facts a page words a problem in its
language."""


class HornbillError(Exception):
    """Anything hornbill raises on purpose; `detail` is a text for people, `facts` are for programs.

    What a program sends next, a route say, is added at the edge: `api.remedies`.
    """

    code: str = "internal"
    title: ClassVar[str] = "Something went wrong"
    status: int | None = None
    """The HTTP status, where a server said it: set by hornbill.client."""

    def __init__(
        self,
        detail: str,
        *,
        cause: Cause | None,
        **facts: object,
    ) -> None:
        """`cause` is one of the facts; None in programs alone, whose errors no page words, and of an older server."""
        super().__init__(detail)
        self.detail = detail
        self.facts: dict[str, Any] = facts if cause is None else {**facts, "cause": cause}

    def __copy__(self) -> Self:
        """Past its own __init__, whose arguments are no longer known."""
        made = type(self).__new__(type(self), *self.args)
        made.__dict__.update(self.__dict__)
        return made

    def extend(self, *, before: str = "", after: str = "", also: Cause, **facts: object) -> None:
        """Say more: words before and after what is said already, with their space; `also` is the code of them."""
        self.facts = {**self.facts, **facts, "also": [*self.facts.get("also", []), also]}
        self.detail = f"{before}{self.detail}{after}"

    @property
    def params(self) -> dict[str, str | int | float | list[Any]]:
        """The plain values among the facts: those of the text."""
        return {name: fact for name, fact in self.facts.items() if _is_plain(fact)}

    @property
    def told(self) -> dict[str, Any]:
        """It as values in another text: its code is the value `problem`, its text is `summary`."""
        return {**self.params, "problem": self.code, "summary": self.detail}


def _is_plain(fact: object) -> bool:
    if isinstance(fact, list):
        return all(isinstance(one, str | int | float) for one in cast("list[object]", fact))
    return isinstance(fact, str | int | float)


class TableError(HornbillError):
    """A table in schemas/ is wrong; the message names the file and the row."""

    code = "bad_table"
    title = "A parameter table is wrong"


class StoreFailed(HornbillError):
    """The database cannot be opened, is damaged, or was written by a newer hornbill."""

    code = "store_failed"
    title = "The database cannot be used"


class LogFailed(HornbillError):
    """A recording of frames cannot be read or written; the message names the file."""

    code = "log_failed"
    title = "The log cannot be used"


class PortError(HornbillError):
    """The bus cannot be opened, was lost, or is in trouble: what a port tells of itself is one, too."""

    code = "bus_trouble"
    title = "The bus is in trouble"


class PortOpenFailed(PortError):
    """The adapter could not be opened; the message says why and what to do."""

    code = "bus_open_failed"
    title = "The bus cannot be opened"


class BusDisconnected(PortError):
    """There is no bus, or it was closed or lost while a request was under way."""

    code = "bus_disconnected"
    title = "No bus"


class BusReadOnly(BusDisconnected):
    """The bus is a recording that is played back: whatever would be sent reaches nobody."""

    code = "bus_read_only"
    title = "The bus is a recording"


class NoResponse(HornbillError):
    """Every try went unanswered. Whether the servo acted is not known."""

    code = "no_response"
    title = "The servo did not answer"


class Refused(HornbillError):
    """The servo answered and said no (an empty GetSet value of table 2-16, or ok = 0)."""

    code = "refused_by_servo"
    title = "The servo refused"


class NotAsWanted(HornbillError):
    """The servo took it, and a read-back found something else; facts: `differences`, each key, wanted, found."""

    code = "not_as_wanted"
    title = "The servo holds something else"


class DidNotMove(HornbillError):
    """Every command was answered, and the horn is not where it was commanded to: blocked, or turned by something."""

    code = "did_not_move"
    title = "The horn did not do as commanded"


class Interrupted(HornbillError):
    """The server ended while it was under way; what a job had done is in its steps, of a request nobody knows."""

    code = "interrupted"
    title = "Interrupted"


class ForbiddenParameter(HornbillError):
    """A register no part of the product may touch: 0x49, or a reserved one (section 4.39, 3.1)."""

    code = "forbidden_parameter"
    title = "This register is never touched"


class NotAvailable(HornbillError):
    """It needs something that is not installed here; the message says what, and how to install it."""

    code = "not_available"
    title = "Not available here"


class BadRequest(HornbillError):
    """What was asked cannot be done; nothing was sent and nothing changed."""


class Unknown(BadRequest):
    """A servo, parameter, job or lease that does not exist; `code` is set per instance."""

    title = "Not found"

    def __init__(
        self,
        code: str,
        detail: str,
        *,
        cause: Cause | None,
        **facts: object,
    ) -> None:
        super().__init__(detail, cause=cause, **facts)
        self.code = code


class NotInThisModel(BadRequest):
    """The parameter exists, but not in this model or firmware (section 5)."""

    code = "not_in_this_model"
    title = "Not in this model or firmware"


class ReadOnly(BadRequest):
    """A write to a parameter that can only be read."""

    code = "read_only"
    title = "Read only"


class OutOfRange(BadRequest):
    """A value outside minimum..maximum of this model; facts: minimum, maximum, unit, requested."""

    code = "out_of_range"
    title = "Out of range"


class InvalidValue(BadRequest):
    """A value of the wrong kind, or between two steps of the register; facts name the nearest legal values."""

    code = "invalid_value"
    title = "Not a value of this parameter"


class ModeOff(BadRequest):
    """A speed or torque command while speed_torque_control (0x25) is off (section 4.18)."""

    code = "mode_off"
    title = "Speed and torque control is off"


class TorqueOff(BadRequest):
    """A motion command while torque_mode (0x20) is off or brake: the servo would take it and not move."""

    code = "torque_off"
    title = "Torque is off"


class TorqueOn(BadRequest):
    """A write that would move the horn while torque is on: reverse or origin (features B70)."""

    code = "torque_on"
    title = "Torque is on"


class PositionUnitUnknown(BadRequest):
    """An angle by ArrayCommand to a servo whose Status and 0x08 disagree about the position unit (errata B1)."""

    code = "position_unit_unconfirmed"
    title = "The position unit is in conflict"


class LeaseRequired(BadRequest):
    """Motion without a lease, or with one that has ended."""

    code = "lease_required"
    title = "A lease is required"


class LeaseHeld(BadRequest):
    """Somebody else holds the lease; facts: holder, expires_in_s."""

    code = "lease_held"
    title = "Somebody else has motion control"


class Stopped(BadRequest):
    """Stop is latched; motion waits until it is cleared."""

    code = "stopped"
    title = "Stopped"


class Busy(BadRequest):
    """The servo is saving, restarting, in soft start or updating; try again when it is ready."""

    code = "busy"
    title = "The servo is busy"


class Conflict(BadRequest):
    """An id that belongs to another servo, live or remembered; facts: key, requested, owner (uid), owner_title."""

    code = "conflict"
    title = "Already taken"


class BusBudget(BadRequest):
    """More than the bus has left: facts bus_share and left (0..1), possible_hz."""

    code = "bus_budget"
    title = "The bus has no room for it"


class NeedsConfirmation(BadRequest):
    """Legal, but it would switch the servo off here and now, or worse; fact `confirm`: the word that says "do it"."""

    code = "needs_confirmation"
    title = "Needs to be confirmed"


class ConfigurationLost(BadRequest):
    """ROM could not be loaded at the last start, so the servo runs on defaults and is not moved (section 4.12)."""

    code = "configuration_lost"
    title = "The configuration is lost"


class StaleRevision(BadRequest):
    """If-Match named a revision that is no longer the current one."""

    code = "stale_revision"
    title = "Somebody else changed it"


class ForbiddenOrigin(BadRequest):
    """A request from a page of another site, or for a host name that is not ours."""

    code = "forbidden_origin"
    title = "Not from here"


class Unauthorized(BadRequest):
    """No token where one is needed, or one that is not known (any more)."""

    code = "unauthorized"
    title = "A token is needed"


class ForbiddenRole(BadRequest):
    """The role of the token does not reach so far; facts: role, needed."""

    code = "forbidden_role"
    title = "This token may not do that"


class TooManyAttempts(BadRequest):
    """Too many logins failed, or tokens were wrong, from there; facts: retry_after_s (also the header Retry-After)."""

    code = "too_many_attempts"
    title = "Too many attempts"


class WrongMediaType(BadRequest):
    """A body that is not declared as JSON: a form of another site would not be, either."""

    code = "unsupported_media_type"
    title = "JSON is needed"


class TooLarge(BadRequest):
    """A body beyond the limit of its route; facts: limit_bytes."""

    code = "too_large"
    title = "Too large"


class KeyReused(BadRequest):
    """The Idempotency-Key came with another request before: with another path, query or body."""

    code = "idempotency_key_reused"
    title = "This key belongs to another request"

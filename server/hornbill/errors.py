"""Error tree. Each class has the code that REST, the WebSocket and the command line report.

HornbillError
├── TableError            bad_table: a mistake in schemas/, with file and row
├── StoreFailed           store_failed: the database cannot be opened, is damaged or was written by a newer hornbill
├── CannotStart           cannot_start: settings, access, certificate or port; the server does not start
├── LogFailed             log_failed: a recording of frames cannot be read or written
├── PortError             bus_trouble: an adapter or bus fault reported by a port
│   ├── PortOpenFailed    bus_open_failed: an address cannot be opened; with the remedy
│   └── BusDisconnected   bus_disconnected: no bus is connected, or the bus was lost during a request
│       └── BusReadOnly   bus_read_only: a recording, or the role is observer: nothing can be sent
├── NoResponse            no_response: no response to any attempt
├── Refused               refused_by_servo: the servo rejected the request
├── DidNotMove            did_not_move: the horn did not follow the command
├── UnexpectedResult      unexpected_result: a value or state of the servo differs from what was requested
├── Interrupted           interrupted: the server exited during a job or a request with an Idempotency-Key
├── ForbiddenParameter    forbidden_parameter: 0x49 or a reserved register
├── NotAvailable          not_available: needs a component that is not installed; the text names it
└── BadRequest            the request cannot be carried out; nothing was changed
    ├── Unknown           unknown_servo, unknown_parameter, unknown_job, unknown_lease, unknown_uid, unknown_log,
    │                     unknown_snapshot, unknown_profile, unknown_run, unknown_stream, unknown_fault,
    │                     unknown_recording, unknown_token, no_simulator, no_autopilot, no_verification
    ├── NotInThisModel    not_in_this_model
    ├── ReadOnly          read_only
    ├── OutOfRange        out_of_range
    ├── InvalidValue      invalid_value
    ├── ModeOff           mode_off
    ├── TorqueOff         torque_off
    ├── TorqueOn          torque_on
    ├── PositionUnitUnknown position_unit_unconfirmed: ArrayCommand angle while the position unit is in conflict
    ├── LeaseRequired     lease_required
    ├── LeaseHeld         lease_held
    ├── Stopped           stopped
    ├── Busy              busy
    ├── CommandedElsewhere commanded_elsewhere: another node commands the servo; facts: node_id, rate_hz
    ├── Conflict          conflict: an ID or name is already in use
    ├── BusBudget         bus_budget: insufficient bus capacity; facts: bus_share, left, possible_hz
    ├── NeedsConfirmation needs_confirmation: for example, a value that could switch the output off
    ├── ConfigurationLost configuration_lost: the servo runs on defaults because ROM could not be loaded
    ├── ForbiddenOrigin   forbidden_origin
    ├── Unauthorized      unauthorized: the token is missing or invalid
    ├── ForbiddenRole     forbidden_role: the token's role is insufficient; facts: role, needed
    ├── TooManyAttempts   too_many_attempts: too many failed logins or invalid tokens; facts: retry_after_s
    ├── WrongMediaType    unsupported_media_type: the body is not JSON
    ├── TooLarge          too_large: the body exceeds its limit; facts: limit_bytes
    ├── KeyReused         idempotency_key_reused: the key belongs to a different request
    └── StaleRevision     stale_revision
"""

from typing import Any, ClassVar, Literal, Self, TypeAlias, cast

Cause: TypeAlias = Literal[
    "bench_in_use", "store_rejected",
    "adapter_ambiguous", "adapter_lost", "adapter_not_found", "adapter_removed", "adapter_unconfirmed",
    "address_is_recording", "allocation_busy", "allocation_not_found", "already_requested", "amplitude_out_of_range",
    "angle_unknown", "autopilot_end_beyond_limit", "autopilot_ends_order", "autopilot_output_range",
    "autopilot_output_twice", "autopilot_servo_id", "baud_unknown", "baud_unsupported", "before_out_of_range",
    "between_steps", "beyond_array_command_range", "beyond_half_turn", "beyond_model_limit", "beyond_servo_limit",
    "bit_rate_mismatch", "bit_rate_unsupported", "blocked_at_torque", "body_not_json", "body_too_large",
    "brake_not_acknowledged", "broadcast_id", "bus_address_invalid", "bus_disconnecting", "bus_lost",
    "bus_lost_during_command", "bus_not_connected", "bus_off", "bus_option_required", "candle_channel_invalid",
    "candle_package_missing", "changed_since_read", "channel_invalid", "channel_names_unavailable", "channel_not_found",
    "channel_not_numeric", "closed_while_opening", "command_in_profile", "command_superseded",
    "commanded_by_other_stream", "commanded_by_stream", "commanded_elsewhere", "commands_interrupted",
    "commands_unsupported", "computer_busy", "control_request_not_found", "control_transfer_in_progress",
    "control_transfer_pending", "could_switch_off", "cursor_invalid", "data_folder_only", "delete_failed", "demo_only",
    "device_not_found", "driver_not_loaded", "driver_not_responding", "driver_open_timeout", "driver_refused",
    "duplicate_command", "duplicate_id", "duplicate_servo", "duration_too_short", "fault_never_seen",
    "file_name_invalid", "file_name_missing", "file_not_found", "file_not_toml_or_json", "file_not_written",
    "file_too_large", "file_unreadable", "firmware_invalid", "firmware_not_for_model", "firmware_unknown",
    "first_token_not_admin", "force_without_reason", "form_media_type", "frame_gap_out_of_range", "frames_missing",
    "frames_timeout", "frequencies_out_of_range", "guest_allocates_nothing", "hold_angle_unsupported",
    "hold_not_renewed", "horn_loaded", "horn_moved", "horn_off_position", "horn_turning", "horn_turning_before_save",
    "horn_turning_output_off", "host_not_allowed", "host_not_found", "id_changed_since_prepared", "id_exchange_failed",
    "id_in_use", "id_not_accepted", "id_not_addressable", "id_still_in_use", "id_used_by_other_servo",
    "identification_incomplete", "identity_in_profile", "improve_binding", "improve_noisy", "improve_range_too_small",
    "improve_saturated", "improve_stalled", "improve_timeout", "improve_too_few_samples", "in_use", "interface_bus_off",
    "interface_down", "interface_not_found", "interface_not_visible", "interface_unsupported", "internal_error",
    "job_cancelled", "job_in_progress", "job_not_found", "job_running", "kernel_without_socketcan", "key_malformed",
    "key_reused", "label_of_recorded_servo", "last_command_not_accepted", "lease_does_not_cover", "lease_ended",
    "lease_ended_during_command", "lease_held_by_other", "lease_missing", "lease_of_key_ended", "line_not_utf8",
    "lines_invalid", "linux_only", "loaded_horns", "log_damaged", "log_format_unknown", "log_not_written",
    "log_running", "mavcan_address_invalid", "mavcan_key_in_address", "mavcan_key_missing", "mavcan_key_wrong",
    "mavcan_not_signed", "mavcan_refused", "mavcan_silent", "mavcan_unsupported", "mavlink", "media_type_not_json",
    "message_invalid", "mode_off", "model_unknown", "motion_command", "multi_turn_moves", "multicast_bus_invalid",
    "name_in_use", "names_unknown", "no_autopilot", "no_bus", "no_data_at_baud", "no_data_at_given_baud",
    "no_data_received", "no_driver", "no_pending_request", "no_permission", "no_simulator", "no_verification",
    "node_id_in_use", "node_id_mismatch", "node_id_missing", "node_id_not_free_yet", "node_id_out_of_range",
    "node_id_reassigned", "node_id_reserved", "node_id_still_in_use", "node_ids_exhausted", "node_not_responding",
    "not_a_number", "not_a_recording", "not_allowed_in_profile", "not_following", "not_identified", "not_in_firmware",
    "not_in_source", "not_in_stream", "not_measured", "not_on_bus", "not_playable", "not_ready", "not_restorable",
    "not_restored_yet", "not_resumable", "not_simulated", "not_slcan", "not_stored_in_rom", "nothing_to_inject",
    "nothing_to_write", "observer_sends_nothing", "offline", "one_source_required", "open_failed", "origin_not_allowed",
    "other_command_active", "outcome_unknown", "output_not_maintained", "output_not_switched_back", "outputs_still_off",
    "outside_all_models", "outside_limits", "outside_range", "own_node_id", "package_missing", "parameter_file_line",
    "parameter_file_no_output", "parameter_file_too_long", "parameter_unknown", "plan_limit_exceeded",
    "plan_torque_not_on", "plant_invalid", "playback_ended", "playback_in_progress", "playback_speed_invalid",
    "playback_stopped", "port_closed", "position_unit_conflict", "profile_angle_only", "profile_not_accepted",
    "profile_not_found", "profile_of_unknown_series", "pyarrow_missing", "query_parameter_repeated",
    "query_parameter_unknown", "ram_unknown", "range_not_possible", "read_during_soft_start", "read_only",
    "read_only_in_profile", "read_refused_before_write", "reading_not_settable", "real_time", "recorded_servo",
    "recording_damaged", "recording_not_written", "recording_unreadable", "recordings_folder_missing",
    "register_forbidden", "register_refused", "released_before_settling", "released_before_start", "replay_failed",
    "request_malformed", "reset_refused", "response_gap", "restart_ignored", "restart_not_seen", "restart_refused",
    "restarted_before_save", "restarted_before_write", "restarted_during_read", "restarted_since_prepared",
    "restarts_repeatedly", "restarts_repeatedly_in_reset", "role_insufficient", "rom_differs", "rom_lost_during_save",
    "rom_unverified", "row_not_in_model", "row_not_in_servo", "rows_invalid", "rows_not_restored", "run_not_found",
    "runs_missing", "runs_on_defaults", "save_cancelled", "save_outcome_unknown", "save_refused", "server_exited",
    "server_not_responding", "server_not_running", "servo_ambiguous", "servo_id_in_use", "servo_id_not_restored",
    "servo_id_parked", "servo_never_seen", "servo_not_responding", "servo_online", "servo_restarted",
    "settle_angle_only", "shared_servo_id", "side_unknown", "sim_output_on", "sim_servo_invalid",
    "slcan_bit_rate_unsupported", "slcan_setting_refused", "snapshot_has_previous_values", "snapshot_not_found",
    "snapshot_not_stored", "snapshot_of_other_servo", "snapshot_of_unknown_model", "socketcand_address_invalid",
    "socketcand_refused", "soft_start_stuck", "some_servos_failed", "step_out_of_range", "step_path_differs",
    "steps_incomplete", "stopped", "store_newer", "store_timeout", "store_unusable", "stream_ended", "stream_not_found",
    "stream_too_fast", "supply_out_of_range_reset", "supply_out_of_range_save", "swings_too_far",
    "switched_off_during_command", "switched_off_during_save", "table_invalid", "tests_missing", "timeout_needs_lease",
    "token_name_in_use", "token_name_invalid", "token_not_found", "token_required", "token_unknown",
    "too_many_attempts", "too_many_commands", "too_many_errors", "too_many_requests", "torque_in_rom_unknown",
    "torque_is_off", "torque_off_not_accepted", "torque_off_unconfirmed", "torque_on", "torque_on_not_accepted",
    "torque_saved_to_rom", "torque_switched_off", "torque_unverified", "torque_unverified_stop", "turn_count", "turns",
    "unassigned_id", "under_command", "under_speed_command", "unique_for_many", "unit_change_under_command",
    "unit_depends_on_other_row", "unit_mismatch", "unknown_series", "unplugged", "unread_after_restart",
    "upload_too_large", "value_changed_by_servo", "value_unknown_in_source", "values_differ", "values_lost_before_save",
    "values_missing", "values_not_retained", "values_not_storable", "values_owed", "virtual_time", "wiggle_failed",
    "wiggle_range_too_small", "write_forbidden", "write_never_allowed", "wrong_type",
]  # fmt: skip
"""Cause of a problem, more specific than its code. With the facts, the page words it in its language."""


class HornbillError(Exception):
    """Base class of expected errors; `detail` is a text for people, `facts` are for programs.

    `api.remedies` appends the request that resolves the problem.
    """

    code: str = "internal"
    title: ClassVar[str] = "Internal error"
    status: int | None = None
    """HTTP status of the response; set by hornbill.client only."""
    summary: str | None = None
    """`detail` without the request that resolves the problem; set by hornbill.client only."""

    def __init__(
        self,
        detail: str,
        *,
        cause: Cause | None,
        **facts: object,
    ) -> None:
        """`cause` becomes one of the facts. None for errors that the page never shows (command line, client) and for
        responses of older servers.
        """
        super().__init__(detail)
        self.detail = detail
        self.facts: dict[str, Any] = facts if cause is None else {**facts, "cause": cause}

    def __copy__(self) -> Self:
        """Copy without calling __init__: its arguments are not stored."""
        made = type(self).__new__(type(self), *self.args)
        made.__dict__.update(self.__dict__)
        return made

    def extend(self, *, before: str = "", after: str = "", also: Cause, **facts: object) -> None:
        """Add text before or after the detail, including the separating space; `also` is the code of the added text."""
        self.facts = {**self.facts, **facts, "also": [*self.facts.get("also", []), also]}
        self.detail = f"{before}{self.detail}{after}"

    @property
    def params(self) -> dict[str, str | int | float | list[Any]]:
        """Facts of plain type: the values used in the text."""
        return {name: fact for name, fact in self.facts.items() if _is_plain(fact)}

    @property
    def note_params(self) -> dict[str, Any]:
        """Parameters of a note that quotes this error: adds its code as `problem` and its text as `summary`."""
        return {**self.params, "problem": self.code, "summary": self.detail}


def _is_plain(fact: object) -> bool:
    if isinstance(fact, list):
        return all(isinstance(item, str | int | float) for item in cast("list[object]", fact))
    return isinstance(fact, str | int | float)


class TableError(HornbillError):
    """Mistake in a table of schemas/; the message names the file and the row."""

    code = "bad_table"
    title = "Invalid parameter table"


class StoreFailed(HornbillError):
    """The database cannot be opened, is damaged, or was written by a newer hornbill.

    Facts when opening: `reason`, and `retry`: whether the same may succeed later without a correction.
    """

    code = "store_failed"
    title = "Database unavailable"


class CannotStart(HornbillError):
    """The server cannot start. Nothing listens, and no bus was opened.

    Facts: `part` (settings, access, certificate, port, bus), and `retry`: whether the same may succeed later without a
    correction.
    """

    code = "cannot_start"
    title = "Server cannot start"


class LogFailed(HornbillError):
    """A recording of frames cannot be read or written; the message names the file."""

    code = "log_failed"
    title = "File cannot be read or written"


class PortError(HornbillError):
    """Fault of the adapter or bus, including the faults that a port reports about itself."""

    code = "bus_trouble"
    title = "Bus fault"


class PortOpenFailed(PortError):
    """The adapter could not be opened; the message gives the reason and the remedy."""

    code = "bus_open_failed"
    title = "Bus cannot be opened"


class BusDisconnected(PortError):
    """No bus is connected, or it was closed or lost during a request."""

    code = "bus_disconnected"
    title = "No bus connected"


class BusReadOnly(BusDisconnected):
    """The bus is a recording being played back, or hornbill is an observer; nothing can be sent."""

    code = "bus_read_only"
    title = "Nothing can be sent on this bus"


class NoResponse(HornbillError):
    """No response to any attempt. Whether the servo carried out the request is unknown."""

    code = "no_response"
    title = "No response from the servo"


class Refused(HornbillError):
    """The servo rejected the request (an empty GetSet value of table 2-16, or ok = 0)."""

    code = "refused_by_servo"
    title = "Rejected by the servo"


class UnexpectedResult(HornbillError):
    """Value or state differs from what was requested; facts: `differences`, each with key, wanted, found."""

    code = "unexpected_result"
    title = "Result differs from the request"


class DidNotMove(HornbillError):
    """The servo acknowledged every command, but the horn is not at its target: blocked, or moved externally."""

    code = "did_not_move"
    title = "Horn did not follow the command"


class Interrupted(HornbillError):
    """The server exited during the operation. A job's steps show what was done; a request's outcome is unknown."""

    code = "interrupted"
    title = "Interrupted"


class ForbiddenParameter(HornbillError):
    """Register that hornbill never reads or writes: 0x49 or a reserved one (sections 4.39 and 3.1)."""

    code = "forbidden_parameter"
    title = "Forbidden register"


class NotAvailable(HornbillError):
    """Needs a component that is not installed; the message names it and how to install it."""

    code = "not_available"
    title = "Not available"


class BadRequest(HornbillError):
    """The request cannot be carried out. Nothing was sent or changed."""


class Unknown(BadRequest):
    """A servo, parameter, job, lease or other resource that does not exist; `code` is set per instance."""

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
    """Write to a read-only parameter."""

    code = "read_only"
    title = "Read only"


class OutOfRange(BadRequest):
    """Value outside minimum..maximum of this model; facts: minimum, maximum, unit, requested."""

    code = "out_of_range"
    title = "Out of range"


class InvalidValue(BadRequest):
    """Value of the wrong type, or between two steps of the register; facts give the nearest valid values."""

    code = "invalid_value"
    title = "Invalid value"


class ModeOff(BadRequest):
    """Speed or torque command while speed_torque_control (0x25) is off (section 4.18)."""

    code = "mode_off"
    title = "Speed and torque control is off"


class TorqueOff(BadRequest):
    """Motion command while torque_mode (0x20) is off or brake: the servo would acknowledge it but not move."""

    code = "torque_off"
    title = "Torque is off"


class TorqueOn(BadRequest):
    """Write that would move the horn while torque is on: reverse or origin (features B70)."""

    code = "torque_on"
    title = "Torque is on"


class PositionUnitUnknown(BadRequest):
    """ArrayCommand angle for a servo whose Status and 0x08 disagree about the position unit (errata B1)."""

    code = "position_unit_unconfirmed"
    title = "Position unit conflict"


class LeaseRequired(BadRequest):
    """Motion without a lease, or with a lease that has ended."""

    code = "lease_required"
    title = "Motion control (lease) required"


class LeaseHeld(BadRequest):
    """Another client has the lease; facts: holder, expires_in_s."""

    code = "lease_held"
    title = "Another client has motion control"


class Stopped(BadRequest):
    """Stop is latched; motion is refused until it is cleared."""

    code = "stopped"
    title = "Stopped"


class Busy(BadRequest):
    """The servo is saving, restarting, in soft start or updating; retry when it is ready."""

    code = "busy"
    title = "Busy"


class CommandedElsewhere(BadRequest):
    """Another node commands the servo by ArrayCommand, so hornbill does not."""

    code = "commanded_elsewhere"
    title = "Commanded by another node"


class Conflict(BadRequest):
    """ID or name already in use, also by a servo off the bus; facts: key, requested, owner (uid), owner_title."""

    code = "conflict"
    title = "Already in use"


class BusBudget(BadRequest):
    """Insufficient bus capacity; facts: bus_share and left (0..1), possible_hz."""

    code = "bus_budget"
    title = "Insufficient bus capacity"


class NeedsConfirmation(BadRequest):
    """Valid, but with consequences to confirm, such as switching the output off; fact `confirm`: the word to send."""

    code = "needs_confirmation"
    title = "Confirmation required"


class ConfigurationLost(BadRequest):
    """ROM could not be loaded at the last start: the servo runs on defaults and must not be moved (section 4.12)."""

    code = "configuration_lost"
    title = "Configuration lost"


class StaleRevision(BadRequest):
    """The revision in If-Match is not the current one."""

    code = "stale_revision"
    title = "Changed by another client"


class ForbiddenOrigin(BadRequest):
    """Request from a page of another site, or for an unknown host name."""

    code = "forbidden_origin"
    title = "Origin or host not allowed"


class Unauthorized(BadRequest):
    """The token is missing, invalid or revoked."""

    code = "unauthorized"
    title = "Token required"


class ForbiddenRole(BadRequest):
    """The token's role is insufficient; facts: role, needed."""

    code = "forbidden_role"
    title = "Role not sufficient"


class TooManyAttempts(BadRequest):
    """Too many failed logins or invalid tokens from one address; facts: retry_after_s (also header Retry-After)."""

    code = "too_many_attempts"
    title = "Too many attempts"


class WrongMediaType(BadRequest):
    """The body is not declared as JSON. Also blocks HTML forms of other sites."""

    code = "unsupported_media_type"
    title = "JSON required"


class TooLarge(BadRequest):
    """The body exceeds the limit of its route; facts: limit_bytes."""

    code = "too_large"
    title = "Too large"


class KeyReused(BadRequest):
    """The Idempotency-Key was already used with a different path, query or body."""

    code = "idempotency_key_reused"
    title = "Idempotency key already used"

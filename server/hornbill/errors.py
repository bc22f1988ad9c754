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
    │                     unknown_snapshot, unknown_profile, unknown_run, unknown_stream, unknown_fault, unknown_bundle,
    │                     unknown_token, no_simulator
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
    "a_command", "adapter_lost", "allocation_busy", "angle_unknown", "another_servos_snapshot", "asked_already",
    "baud_not_found", "baud_not_known", "before_out_of_range", "between_steps", "beyond_array_command",
    "beyond_half_turn", "body_too_large", "brake_unanswered", "braked_meanwhile", "bundle_damaged",
    "bundle_not_written", "bundle_unreadable", "bus_is_lost", "bus_left_meanwhile", "bus_off", "bus_parting",
    "changed_since", "closed_meanwhile", "command_in_profile", "could_switch_off", "data_folder_only", "demo_only",
    "does_not_follow", "driver_hangs", "driver_refused", "driver_silent", "file_toml_or_json", "file_too_large",
    "file_unreadable", "first_token_admin", "force_without_reason", "going_away", "guarded", "holds_another",
    "holds_something_else", "horn_loaded", "horn_moved_away", "horn_strayed", "horn_turning", "horn_turns",
    "horn_turns_off", "id_changed_since_prepared", "id_kept_by_another", "id_not_addressable", "id_not_taken",
    "id_of_all", "id_of_all_new", "id_still_held", "id_taken", "id_wanted_twice", "identity_in_profile", "in_use",
    "interface_bus_off", "interface_down", "job_cancelled", "job_runs", "key_malformed", "key_reused",
    "last_not_taken", "lease_of_another", "lease_of_key_over", "lease_over", "lease_over_meanwhile",
    "let_go_at_once", "let_go_first", "line_not_utf8", "lines_wrong", "linux_only", "loaded_horns", "log_damaged",
    "log_not_written", "log_runs", "mavlink", "mode_off", "name_taken", "named_at_start", "named_twice",
    "names_no_file", "names_no_runs", "never_built_with", "never_met", "never_showed", "never_touched",
    "never_written", "no_address", "no_bit_rate", "no_bundle", "no_bundle_folder", "no_bus", "no_can_kernel",
    "no_candle_channel", "no_candle_package", "no_channel", "no_channel_of", "no_device", "no_driver",
    "no_file_name", "no_firmware", "no_frame_gap", "no_frames", "no_frames_in_time", "no_hold_for_angle", "no_host",
    "no_interface", "no_json", "no_json_type", "no_lease", "no_log", "no_message", "no_model_allows",
    "no_names_of_channels", "no_node_id", "no_node_id_left", "no_number", "no_permission", "no_pyarrow",
    "no_restart_seen", "no_room_to_wiggle", "no_row_of_profile", "no_server", "no_settling", "no_simulator",
    "no_slcan_rate", "no_snapshot_kept", "no_socketcand_address", "no_speed", "no_step_test", "no_such_adapter",
    "no_such_allocation", "no_such_baud", "no_such_channel", "no_such_commands", "no_such_file", "no_such_firmware",
    "no_such_interface", "no_such_job", "no_such_model", "no_such_names", "no_such_parameter", "no_such_profile",
    "no_such_row", "no_such_run", "no_such_setting", "no_such_side", "no_such_sim_servo", "no_such_snapshot",
    "no_such_stream", "no_such_token", "no_token_name", "no_values", "nobody_asks", "node_id_came_back",
    "node_id_held", "node_id_in_use", "node_id_leaves_later", "node_id_of_another", "node_id_out_of_range", "noise",
    "not_commanded", "not_connected", "not_deleted", "not_done", "not_for_profiles", "not_given_back",
    "not_identified", "not_identified_yet", "not_in_firmware", "not_in_source", "not_kept_in_rom", "not_of_stream",
    "not_on_bus", "not_playable", "not_read_otherwise", "not_ready", "not_restorable", "not_restored_after_wiggle",
    "not_resumable", "not_simulated", "not_taken", "not_taken_by_driver", "nothing_at_baud", "nothing_left",
    "nothing_received", "of_servos", "off_unconfirmed", "offline", "one_source", "only_a_recording", "open_failed",
    "other_bit_rate", "other_command_first", "other_host", "other_node", "other_site", "other_stream", "other_unit",
    "outcome_unknown", "output_not_kept", "output_stays", "outputs_stayed_off", "outside_limits", "own_defect",
    "own_node_id", "passing_failed", "passing_now", "passing_to", "past_model_limit", "past_own_limit",
    "perhaps_serial", "played_no_more", "plays_recording", "port_closed", "profile_for_angles", "profile_not_taken",
    "profile_of_unknown_series", "ram_unknown", "read_only", "read_only_in_profile", "recorded_label",
    "recorded_servo", "recording_not_written", "recording_over", "recording_too_large", "refused_before_write",
    "register_refused", "replay_failed", "request_malformed", "request_over", "reset_refused", "restart_refused",
    "restarted_before_save", "restarted_before_write", "restarted_meanwhile", "restarted_since_prepared",
    "restarted_while_read", "restarts_repeatedly", "restarts_repeatedly_reset", "role_too_low", "rom_differs",
    "rom_lost_in_save", "rows_do_not_fit", "runs_on", "runs_on_defaults", "save_cancelled", "save_may_have_arrived",
    "save_refused", "server_ended", "server_silent", "servo_id_not_put_back", "servo_id_parked",
    "servo_id_taken_meanwhile", "several_adapters", "shared_servo_id", "silent_node",
    "silent_servo", "silent_too_long", "sim_holds", "slcan_refuses", "snapshot_holds_before",
    "snapshot_of_unknown_model", "socketcand_refuses", "soft_start_reads", "soft_start_stuck", "step_strayed",
    "still_there", "stopped", "store_newer", "store_slow", "store_unusable", "stream_commands", "stream_over",
    "stream_too_fast", "supply_bad_reset", "supply_bad_save", "switched_off_in_save", "switched_off_meanwhile",
    "table_wrong", "taken_unseen", "timeout_needs_lease", "token_name_taken", "token_needed", "token_unknown",
    "too_many_attempts", "too_many_commands", "too_many_errors", "too_many_requests", "took_another",
    "torque_in_rom_unknown", "torque_into_rom", "torque_is_off", "torque_off_not_taken", "torque_on",
    "torque_on_not_taken", "torque_taken", "torque_unproved", "torque_unproved_stop", "turn_count", "turns",
    "turns_of_several", "two_commands", "type_of_form", "under_command", "under_speed_command", "unique_for_many",
    "unit_follows", "unit_in_conflict", "unit_under_command", "unknown_in_source", "unknown_series", "unplugged",
    "unread_after_restart", "values_gone", "wiggle_failed", "worked_on", "wrong_kind",
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

"""Renamed codes in jobs, audit, snapshots and settings."""

from collections.abc import Mapping
from typing import Any, Final, cast

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

_CAUSES: Final = """
    a_command=motion_command another_servos_snapshot=snapshot_of_other_servo asked_already=already_requested
    baud_not_found=no_data_at_given_baud baud_not_known=baud_unknown beyond_array_command=beyond_array_command_range
    brake_unanswered=brake_not_acknowledged braked_meanwhile=hold_not_renewed bundle_damaged=recording_damaged
    bundle_not_written=recording_not_written bundle_unreadable=recording_unreadable bus_is_lost=bus_lost
    bus_left_meanwhile=bus_lost_during_command bus_parting=bus_disconnecting changed_since=changed_since_read
    closed_meanwhile=closed_while_opening does_not_follow=not_following driver_hangs=driver_open_timeout
    driver_silent=driver_not_responding file_toml_or_json=file_not_toml_or_json
    first_token_admin=first_token_not_admin going_away=adapter_removed guarded=write_forbidden
    holds_another=other_command_active holds_something_else=values_differ horn_moved_away=horn_moved
    horn_strayed=horn_off_position horn_turns=horn_turning_before_save horn_turns_off=horn_turning_output_off
    id_kept_by_another=id_used_by_other_servo id_not_taken=id_not_accepted id_of_all=broadcast_id
    id_of_all_new=unassigned_id id_still_held=id_still_in_use id_taken=id_in_use id_wanted_twice=duplicate_id
    job_runs=job_running last_not_taken=last_command_not_accepted lease_of_another=lease_held_by_other
    lease_of_key_over=lease_of_key_ended lease_over=lease_ended lease_over_meanwhile=lease_ended_during_command
    let_go_at_once=released_before_start let_go_first=released_before_settling lines_wrong=lines_invalid
    log_runs=log_running name_taken=name_in_use named_at_start=bus_option_required named_twice=duplicate_servo
    names_no_file=file_name_missing names_no_runs=runs_missing never_built_with=firmware_not_for_model
    never_met=servo_never_seen never_showed=fault_never_seen never_touched=register_forbidden
    never_written=write_never_allowed no_address=bus_address_invalid no_bit_rate=bit_rate_unsupported
    no_bundle=not_a_recording no_bundle_folder=recordings_folder_missing no_can_kernel=kernel_without_socketcan
    no_candle_channel=candle_channel_invalid no_candle_package=candle_package_missing no_channel=channel_not_numeric
    no_channel_of=channel_invalid no_device=device_not_found no_file_name=file_name_invalid
    no_firmware=firmware_invalid no_frame_gap=frame_gap_out_of_range no_frames=frames_missing
    no_frames_in_time=frames_timeout no_hold_for_angle=hold_angle_unsupported no_host=host_not_found
    no_interface=interface_unsupported no_json=body_not_json no_json_type=media_type_not_json no_lease=lease_missing
    no_log=log_format_unknown no_message=message_invalid no_model_allows=outside_all_models
    no_names_of_channels=channel_names_unavailable no_node_id=node_id_missing no_node_id_left=node_ids_exhausted
    no_number=not_a_number no_pyarrow=pyarrow_missing no_restart_seen=restart_not_seen
    no_room_to_wiggle=wiggle_range_too_small no_row_of_profile=row_not_in_model no_server=server_not_running
    no_settling=settle_angle_only no_slcan_rate=slcan_bit_rate_unsupported no_snapshot_kept=snapshot_not_stored
    no_socketcand_address=socketcand_address_invalid no_speed=playback_speed_invalid no_step_test=step_out_of_range
    no_such_adapter=adapter_not_found no_such_allocation=allocation_not_found no_such_baud=baud_unsupported
    no_such_channel=channel_not_found no_such_commands=commands_unsupported no_such_file=file_not_found
    no_such_firmware=firmware_unknown no_such_interface=interface_not_found no_such_job=job_not_found
    no_such_model=model_unknown no_such_names=names_unknown no_such_parameter=parameter_unknown
    no_such_profile=profile_not_found no_such_row=row_not_in_servo no_such_run=run_not_found
    no_such_setting=setting_unknown no_such_side=side_unknown no_such_sim_servo=sim_servo_invalid
    no_such_snapshot=snapshot_not_found no_such_stream=stream_not_found no_such_token=token_not_found
    no_token_name=token_name_invalid no_values=values_missing nobody_asks=no_pending_request
    node_id_came_back=node_id_reassigned node_id_held=node_id_still_in_use node_id_leaves_later=node_id_not_free_yet
    node_id_of_another=node_id_reserved noise=not_slcan not_commanded=commands_interrupted
    not_connected=bus_not_connected not_deleted=delete_failed not_done=steps_incomplete
    not_for_profiles=not_allowed_in_profile not_given_back=rows_not_restored
    not_identified_yet=identification_incomplete not_kept_in_rom=not_stored_in_rom not_of_stream=not_in_stream
    not_read_otherwise=reading_not_settable not_taken=values_not_retained not_taken_by_driver=driver_not_loaded
    nothing_at_baud=no_data_at_baud nothing_left=nothing_to_write nothing_received=no_data_received
    of_servos=some_servos_failed off_unconfirmed=torque_off_unconfirmed one_source=one_source_required
    only_a_recording=address_is_recording other_bit_rate=bit_rate_mismatch other_command_first=command_superseded
    other_host=host_not_allowed other_node=node_id_mismatch other_site=origin_not_allowed
    other_stream=commanded_by_other_stream other_unit=unit_mismatch output_not_kept=output_not_maintained
    output_stays=output_not_switched_back outputs_stayed_off=outputs_still_off own_defect=internal_error
    passing_failed=id_exchange_failed passing_now=control_transfer_in_progress passing_to=control_transfer_pending
    past_model_limit=beyond_model_limit past_own_limit=beyond_servo_limit perhaps_serial=adapter_unconfirmed
    played_no_more=playback_stopped plays_recording=playback_in_progress profile_for_angles=profile_angle_only
    profile_not_taken=profile_not_accepted recorded_label=label_of_recorded_servo recording_over=playback_ended
    recording_too_large=upload_too_large refused_before_write=read_refused_before_write
    request_over=control_request_not_found restarted_meanwhile=servo_restarted
    restarted_while_read=restarted_during_read restarts_repeatedly_reset=restarts_repeatedly_in_reset
    role_too_low=role_insufficient rom_lost_in_save=rom_lost_during_save rows_do_not_fit=rows_invalid
    runs_on=restart_ignored save_may_have_arrived=save_outcome_unknown server_ended=server_exited
    server_silent=server_not_responding servo_id_not_put_back=servo_id_not_restored
    servo_id_taken_meanwhile=servo_id_in_use several_adapters=adapter_ambiguous silent_node=node_not_responding
    silent_servo=servo_not_responding silent_too_long=response_gap sim_holds=sim_output_on
    slcan_refuses=slcan_setting_refused snapshot_holds_before=snapshot_has_previous_values
    socketcand_refuses=socketcand_refused soft_start_reads=read_during_soft_start step_strayed=step_path_differs
    still_there=servo_online store_slow=store_timeout stream_commands=commanded_by_stream stream_over=stream_ended
    supply_bad_reset=supply_out_of_range_reset supply_bad_save=supply_out_of_range_save
    switched_off_in_save=switched_off_during_save switched_off_meanwhile=switched_off_during_command
    table_wrong=table_invalid taken_unseen=interface_not_visible token_name_taken=token_name_in_use
    token_needed=token_required took_another=value_changed_by_servo torque_into_rom=torque_saved_to_rom
    torque_off_not_taken=torque_off_not_accepted torque_on_not_taken=torque_on_not_accepted
    torque_taken=torque_switched_off torque_unproved=torque_unverified torque_unproved_stop=torque_unverified_stop
    turns_of_several=multi_turn_moves two_commands=duplicate_command type_of_form=form_media_type
    unit_follows=unit_depends_on_other_row unit_in_conflict=position_unit_conflict
    unit_under_command=unit_change_under_command unknown_in_source=value_unknown_in_source
    values_gone=values_lost_before_save worked_on=job_in_progress wrong_kind=wrong_type
"""
"""Causes of problems, old=new."""

_PROBLEMS: Final = {"no_answer": "no_response", "not_as_wanted": "unexpected_result"}
_NOTES: Final = {
    "pin_kept": "pin_unchanged",
    "pin_at_start": "pin_at_restart",
    "id_free": "id_freed",
    "id_kept_until_start": "id_changes_at_restart",
}
_EVIDENCE: Final = {
    "asked": "requested",
    "restarted_when_asked": "restarted_on_request",
    "values_hold": "values_verified",
    "values_still_hold": "values_still_verified",
    "servo_id_put_back": "servo_id_restored",
}
_CAUSE: Final = {old: new for old, _, new in (pair.partition("=") for pair in _CAUSES.split())}
_CODES: Final[Mapping[str, Mapping[str, str]]] = {
    "code": _PROBLEMS | _NOTES,
    "problem": _PROBLEMS,
    "failure": _PROBLEMS,
    "verdict": {"no_answer": "no_response"},
    "cause": _CAUSE,
    "also": _CAUSE,
    "evidence_code": _EVIDENCE,
    "why_code": _NOTES,
    "why": {"ran_out": "expired", "given_back": "released"},
    "warnings": {"timeout_on_the_way": "timeout_during_soft_start"},
}
"""Renamed codes, by the key of a code or of a list of codes."""

_KEYS: Final = {
    "held_in": "verified_in", "kept_by": "held_by", "answered": "acknowledged", "proved_at": "verified_at",
    "driven": "commanded",
}  # fmt: skip
"""Renamed keys of evidence and results."""

_CLASSES: Final = {"NoAnswer": "NoResponse", "NotAsWanted": "UnexpectedResult"}

_STEPS: Final = {
    "restart": {"ask": "request"},
    "commissioning": {"aside": "park_servo_id", "away": "park_node_id"},
    "step_test": {"there": "measure", "numbers": "evaluate"},
}
"""Renamed steps, by kind of job."""

_JOBS: Final = sa.table("jobs", sa.column("id"), sa.column("kind"), sa.column("document", sa.JSON))
_AUDIT: Final = sa.table(
    "audit", sa.column("id", sa.Integer), sa.column("action"), sa.column("outcome"), sa.column("notes", sa.JSON)
)
_SNAPSHOTS: Final = sa.table("snapshots", sa.column("reason_code"))
_SETTINGS: Final = sa.table("settings", sa.column("key"), sa.column("value", sa.JSON))
_BATCH: Final = 1000


def upgrade() -> None:
    """Replace the old codes."""
    connection = op.get_bind()
    _upgrade_jobs(connection)
    _upgrade_audit(connection)
    connection.execute(sa.update(_SNAPSHOTS).where(_SNAPSHOTS.c.reason_code == "by_hand").values(reason_code="manual"))
    found = connection.execute(sa.select(_SETTINGS.c.value).where(_SETTINGS.c.key == "allocator")).scalar_one_or_none()
    if found == "insist":
        connection.execute(sa.update(_SETTINGS).where(_SETTINGS.c.key == "allocator").values(value="force"))


def downgrade() -> None:
    """Leave the codes. An older version shows the text instead of a code that it does not know."""


def _upgrade_jobs(connection: sa.Connection) -> None:
    change = (
        sa.update(_JOBS).where(_JOBS.c.id == sa.bindparam("job")).values(document=sa.bindparam("new", type_=sa.JSON))
    )
    for job, kind, document in connection.execute(sa.select(_JOBS)).all():
        new = _renamed(document)
        steps = cast("list[dict[str, str]]", new.get("steps") or [])
        for step in steps:
            name, _, place = step["name"].partition(" ")
            step["name"] = f"{_STEPS.get(kind, {}).get(name, name)} {place}".rstrip()
        if error := new.get("error"):
            error["class"] = _CLASSES.get(error["class"], error["class"])
        if new != document:
            connection.execute(change, {"job": job, "new": new})


def _upgrade_audit(connection: sa.Connection) -> None:
    for action, old, new in (("lease", "lapsed", "expired"), (None, "no_answer", "no_response")):
        where = _AUDIT.c.outcome == old
        where = where if action is None else where & (_AUDIT.c.action == action)
        connection.execute(sa.update(_AUDIT).where(where).values(outcome=new))
    change = (
        sa.update(_AUDIT).where(_AUDIT.c.id == sa.bindparam("row")).values(notes=sa.bindparam("new", type_=sa.JSON))
    )
    last = 0
    while rows := connection.execute(
        sa.select(_AUDIT.c.id, _AUDIT.c.notes).where(_AUDIT.c.id > last).order_by(_AUDIT.c.id).limit(_BATCH)
    ).all():
        last = rows[-1][0]
        changes = [{"row": row, "new": new} for row, notes in rows if (new := _renamed(notes)) != notes]
        if changes:
            connection.execute(change, changes)


def _renamed(value: Any, key: str = "") -> Any:
    """The JSON value with renamed keys, and renamed codes in the places of codes."""
    if isinstance(value, dict):
        entries = cast("Mapping[str, Any]", value).items()
        return {_KEYS.get(name, name): _renamed(entry, name) for name, entry in entries}
    if isinstance(value, list):
        return [_renamed(entry, key) for entry in cast("list[Any]", value)]
    if isinstance(value, str):
        return _CODES.get(key, {}).get(value, value)
    return value

"""Jobs: codes of their steps, and of the evidence of a step."""

from typing import Literal

SaveStep = Literal["check", "snapshot", "write", "silence", "restart", "back", "soft_start", "read_back"]
RestartStep = Literal["ask", "silence", "restart", "back", "soft_start", "read_back"]
ResetStep = Literal["check", "snapshot", "torque_off", "erase", "read", "identity", "rows", "save", "verify"]
IdentifyStep = Literal["check", "limit", "wiggle", "return", "restore"]
StepTestStep = Literal["check", "there", "numbers"]
ProfileStep = Literal["plan", "write", "save"]
CommissionStep = Literal["check", "aside", "away", "identify", "write", "save", "verify"]
OutputStep = Literal["clear", "restore"]

StepCode = Literal[
    SaveStep, RestartStep, ResetStep, IdentifyStep, StepTestStep, ProfileStep, CommissionStep, OutputStep
]
"""Code of a step; with the kind of its job it names what is done."""

EvidenceCode = Literal[
    # any job
    "problem",
    "interrupted",
    # save, restart, factory reset
    "rows_read",
    "snapshot_taken",
    "snapshot_known",
    "snapshot_failed",
    "sent",
    "asked",
    "silent",
    "restarted",
    "restarted_when_asked",
    "back_on_node",
    "no_soft_start",
    "soft_start_over",
    "soft_start_aborted",
    "read_back",
    "all_rows_read",
    "torque_off",
    "erased",
    "rows_differ",
    "nothing_differs",
    "rows_written",
    "saved_by_job",
    "rows_verified",
    # identify
    "at_rest",
    "not_limited",
    "limited",
    "wiggled",
    "angle_unknown",
    "returned",
    "restored",
    # step test
    "test_conditions",
    "samples",
    "run_stored",
    # profile, commissioning
    "planned",
    "written",
    "saved",
    "save_not_needed",
    "identified",
    "values_hold",
    "values_still_hold",
    "servo_id_parked",
    "servo_id_put_back",
    "servo_id_lost",
    "node_id_parked",
    "failed_before",
    "job_ended",
    "values_refused",
    "other_refused",
    "other_failed",
    # restore output
    "latch_cleared",
    "not_latched",
    "held",
]
"""Code of what a step observed, or of why it was skipped or failed."""

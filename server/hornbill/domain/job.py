"""Jobs and their steps, with the codes of steps and of their evidence."""

from typing import Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Model, Param, Params, Utc
from hornbill.domain.problem import Problem

SaveStep = Literal["check", "snapshot", "write", "silence", "restart", "back", "soft_start", "read_back"]
RestartStep = Literal["request", "silence", "restart", "back", "soft_start", "read_back"]
ResetStep = Literal["check", "snapshot", "torque_off", "erase", "read", "identity", "rows", "save", "verify"]
IdentifyStep = Literal["check", "limit", "wiggle", "return", "restore"]
StepTestStep = Literal["check", "measure", "evaluate"]
FrequencyStep = Literal["check", "measure", "evaluate"]
ImproveStep = Literal["check", "baseline", "identify", "search", "confirm", "finish", "improve"]
MechanicsStep = Literal[
    "check", "deadband", "repeatability", "speed", "friction", "travel", "end_stops", "restore", "evaluate"
]  # fmt: skip
ProfileStep = Literal["plan", "write", "save"]
CommissionStep = Literal["check", "park_servo_id", "park_node_id", "identify", "write", "save", "verify"]
OutputStep = Literal["clear", "restore"]
RunPlanStep = Literal["write", "check", "torque_on", "move", "speed", "torque", "wait", "torque_off"]

StepCode = TypeAliasType(
    "StepCode",
    Literal[
        SaveStep,
        RestartStep,
        ResetStep,
        IdentifyStep,
        StepTestStep,
        FrequencyStep,
        MechanicsStep,
        ImproveStep,
        ProfileStep,
        CommissionStep,
        OutputStep,
        RunPlanStep,
    ],
)
"""Code of a step. Unique only together with the kind of its job."""

EvidenceCode = TypeAliasType(
    "EvidenceCode",
    Literal[
        # any job
        "problem",
        "interrupted",
        # save, restart, factory reset
        "rows_read",
        "snapshot_taken",
        "snapshot_known",
        "snapshot_failed",
        "sent",
        "requested",
        "silent",
        "restarted",
        "restarted_on_request",
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
        # frequency response
        "response_conditions",
        "response_measured",
        "response_stored",
        # improve
        "improve_conditions",
        "baseline_measured",
        "horn_identified",
        "gains_found",
        "gains_measured",
        "nothing_better",
        "gains_kept",
        "gains_restored",
        # mechanics
        "mechanics_conditions",
        "mechanics_measured",
        "travel_swept",
        "rows_restored",
        "mechanics_stored",
        # profile, commissioning
        "planned",
        "written",
        "saved",
        "save_not_needed",
        "identified",
        "values_verified",
        "values_still_verified",
        "servo_id_parked",
        "servo_id_restored",
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
        # test plan
        "plan_checked",
        "plan_step",
        "torque_off_pending",
    ],
)
"""Code of a step's observation, or of the reason why it was skipped or failed."""


class JobStep(Model):
    """One step of a job, with its evidence."""

    name: str = Field(description="Name for programs.")
    code: StepCode = Field(description="Code of the step, unique together with the kind of the job.")
    params: Params
    text: str = Field(description="One sentence for users.")
    uid: str | None = Field(default=None, description="Servo of this step, in a job on several servos. Null otherwise.")
    state: Literal["waiting", "running", "done", "failed", "skipped"] = Field(description="State of the step.")
    evidence: str | None = Field(default=None, description="Observed values. Null if none yet.")
    evidence_code: EvidenceCode | None = Field(
        default=None,
        description="Code of `evidence`. problem: `evidence_params` has its code as `problem`. Null if none.",
    )
    evidence_params: Params = Field(default_factory=dict[str, Param])
    ahead: str | None = Field(
        default=None,
        description="End of `evidence` that describes remaining work. Obsolete once the job has ended. Null if none.",
    )
    started_at: float | None = Field(default=None, description="Start, seconds since 1970 UTC. Null until then.")
    ended_at: float | None = Field(default=None, description="End, seconds since 1970 UTC. Null until then.")


JobState = TypeAliasType("JobState", Literal["queued", "running", "succeeded", "failed", "cancelled"])


class Job(Model):
    """A long-running operation."""

    id: str = Field(description="ID, as used in paths.")
    kind: Literal[
        "save",
        "restart",
        "factory_reset",
        "identify",
        "profile",
        "commissioning",
        "step_test",
        "frequency_response",
        "mechanics",
        "improve",
        "restore_output",
        "plan",
    ] = Field(description="Kind of job.")
    uid: str | None = Field(description="Unique ID of the servo, 32 hex digits. Null if it concerns none.")
    state: JobState = Field(description="State of the job.")
    progress: float = Field(ge=0, le=1, description="Progress, 0 to 1.")
    step: str | None = Field(description="Current step, for users. Null if none.")
    result: dict[str, object] | None = Field(description="Result, depending on the kind. Null until the job has ended.")
    error: Problem | None = Field(description="Reason for the failure. Null unless it failed.")
    steps: list[JobStep] = Field(description="Steps in order.")
    created_at: Utc
    ended_at: float | None = Field(description="End, seconds since 1970 UTC. Null until then.")
    resumable: bool = Field(default=False, description="The job can be resumed with `POST …/resume`.")

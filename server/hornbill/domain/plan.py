"""Test plans: motion of servos in cycles, with limits and stop rules. A plan file (TOML) has this form."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Model, UidText
from hornbill.domain.motion import Caution
from hornbill.domain.problem import Problem
from hornbill.domain.profile import Name
from hornbill.schema.fault import FaultLevel

PlanQuantity = TypeAliasType(
    "PlanQuantity",
    Literal["position_error_deg", "temperature_c", "torque_pct", "voltage_min_v", "voltage_max_v", "faults"],
)
"""Limit of a plan, by the name of its field."""

_Servo = Annotated[str, Field(min_length=1, max_length=64)]
_Some = Annotated[
    list[_Servo] | None, Field(min_length=1, description="Servos that take part, as named in `servos`. Null for all.")
]
_Number = Annotated[float, Field(allow_inf_nan=False)]
_Duration = Annotated[float, Field(gt=0, le=86_400, description="Duration, s.")]


class PlanMove(Model):
    """Move to an angle and wait until the horn has arrived. Servos start together."""

    do: Literal["move"] = Field(description="Kind of step.")
    angle_deg: _Number | dict[str, _Number] = Field(
        description="Target, °. For different targets, a table by the name of the servo, as named in `servos`."
    )
    servos: _Some = None
    speed_deg_s: float | None = Field(
        default=None, gt=0, le=3600, description="Speed limit, °/s. Null for the servo's own speed."
    )
    accel_deg_s2: float = Field(default=240.0, gt=0, le=100_000, description="Acceleration with `speed_deg_s`, °/s².")
    timeout_s: float = Field(default=5.0, gt=0, le=600, description="Time allowed to arrive, after the command, s.")
    dwell_s: float = Field(
        default=0.1, ge=0, le=60, description="Time within `position_error_deg` that counts as arrival, s."
    )

    def angle_of(self, name: str) -> float:
        """Target of a servo that takes part, °."""
        return self.angle_deg[name] if isinstance(self.angle_deg, dict) else self.angle_deg


class PlanSpeed(Model):
    """Turn at a speed for a while, then command 0 rpm. Requires speed and torque control (0x25)."""

    do: Literal["speed"] = Field(description="Kind of step.")
    speed_rpm: float = Field(allow_inf_nan=False, description="Speed, rpm.")
    for_s: _Duration
    servos: _Some = None


class PlanTorque(Model):
    """Push with a torque for a while, then command 0 %. Requires speed and torque control (0x25)."""

    do: Literal["torque"] = Field(description="Kind of step.")
    torque_pct: float = Field(allow_inf_nan=False, description="Torque, % of stall torque.")
    for_s: _Duration
    servos: _Some = None


class PlanWait(Model):
    """Wait while the servos hold. Limits are checked, the position error after a move as well."""

    do: Literal["wait"] = Field(description="Kind of step.")
    for_s: _Duration


PlanStep = TypeAliasType("PlanStep", Annotated[PlanMove | PlanSpeed | PlanTorque | PlanWait, Field(discriminator="do")])


class PlanLimits(Model):
    """Limits checked at least once in each step. Null: not checked."""

    position_error_deg: float = Field(
        default=1.0, gt=0, le=180, description="Greatest distance from the target at the end of a move and after it, °."
    )
    temperature_c: float | None = Field(default=None, ge=0, le=150, description="Highest temperature (0x0B), °C.")
    torque_pct: float | None = Field(
        default=None,
        gt=0,
        le=100,
        description="Greatest torque (0x0A), % of stall torque. It follows the motor current.",
    )
    voltage_min_v: float | None = Field(default=None, ge=0, le=100, description="Lowest supply (0x0C), V.")
    voltage_max_v: float | None = Field(default=None, ge=0, le=100, description="Highest supply (0x0C), V.")
    faults: list[FaultLevel] = Field(
        default=["warning", "failure"],
        description="Levels of fault bits that may not appear. Bits that are set at the start of the run do not count.",
    )


class PlanStop(Model):
    """What ends a run early. Stop, the end of the lease and a lost bus always do."""

    on_limit: Literal["stop", "drop", "continue"] = Field(
        default="stop",
        description="After an exceeded limit. stop: end the run. drop: torque off on this servo, the others continue. "
        "continue: record it. A servo that does not respond or refuses is dropped instead.",
    )
    after_exceeded: int | None = Field(
        default=None, ge=1, description="End the run after this number of exceeded limits. Null for no end."
    )
    after_s: float | None = Field(
        default=None, gt=0, description="End the run after this time in motion, s, as planned. Null for all cycles."
    )


class RunPlan(Model):
    """A test plan. Torque is turned on before the first step and off at the end, whatever ends the run."""

    name: Name = Field(description="Name of the plan.")
    description: str = Field(default="", max_length=1000, description="Purpose of the plan.")
    servos: list[_Servo] = Field(
        min_length=1, max_length=16, description="Servos by label, serial or unique ID, each once."
    )
    profile: Name | None = Field(
        default=None, description="Profile written to RAM before torque is turned on. Null for none."
    )
    cycles: int = Field(default=1, ge=1, le=10_000_000, description="Number of times that all steps are done.")
    limits: PlanLimits = Field(default_factory=PlanLimits, description="Limits.")
    stop: PlanStop = Field(default_factory=PlanStop, description="Stop rules.")
    steps: list[PlanStep] = Field(min_length=1, max_length=32, description="Steps of a cycle, in order.")

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        known = set(self.servos)
        if len(known) < len(self.servos):
            raise ValueError("A servo is listed twice. List each servo once.")
        for number, step in enumerate(self.steps, start=1):
            unknown = [name for name in self.named(step) if name not in known]
            if unknown:
                raise ValueError(f"Step {number} names {unknown[0]!r}, which is not in `servos`.")
            if isinstance(step, PlanMove) and isinstance(step.angle_deg, dict) and step.servos is not None:
                raise ValueError(f"Step {number} has servos twice. Leave out `servos`: `angle_deg` names them.")
        idle = [name for name in self.servos if all(name not in self.named(step) for step in self.steps)]
        if idle:
            raise ValueError(f"{idle[0]!r} takes part in no step. Leave it out.")
        return self

    def named(self, step: PlanStep) -> list[str]:
        """Servos that take part in a step, as named in `servos`."""
        if isinstance(step, PlanMove) and isinstance(step.angle_deg, dict):
            return list(step.angle_deg)
        if isinstance(step, PlanWait) or step.servos is None:
            return self.servos
        return step.servos


class PlanServo(Model):
    """A servo of a plan, as found by a dry run."""

    uid: UidText
    title: str = Field(description="Display name.")
    cautions: list[Caution] = Field(description="Cautions about its commands.")
    problem: Problem | None = Field(description="Reason why it would not run. Null if none.")


class PlanPreview(Model):
    """Result of a dry run of a plan."""

    name: str = Field(description="Name of the plan.")
    cycles: int = Field(description="Number of cycles.")
    steps: int = Field(description="Number of steps of a cycle.")
    least_s: float = Field(description="Duration of the waits and of speed and torque steps, over all cycles, s.")
    servos: list[PlanServo] = Field(description="Servos in the order of the plan.")
    plan: dict[str, Any] = Field(description="The plan as read, with defaults, in the form of the request.")

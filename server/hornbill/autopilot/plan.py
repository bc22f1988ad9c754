"""Plan: which output of an autopilot drives which servo, and how far."""

from typing import ClassVar, Final, TypeAlias

from pydantic import ConfigDict, Field

from hornbill.domain.autopilot import Program
from hornbill.domain.fields import Model
from hornbill.errors import InvalidValue, OutOfRange

OUTPUTS: Final[dict[str, int]] = {"ardupilot": 32, "px4": 8}
"""Highest output number. PX4 receives Status for actuator IDs 0 to 8 only."""

FIRST_ID: Final[dict[str, int]] = {"ardupilot": 1, "px4": 0}
"""Servo ID that output 1 commands: ArduPilot numbers actuators from 1, PX4 from 0."""

Bound: TypeAlias = float | None

_ONE_SCHEMA: Final = ConfigDict(json_schema_serialization_defaults_required=False)
"""The same schema in requests and responses."""


class PlanOutput(Model):
    """One output and the linkage of its servo. Angles are those of the servo, ° (positive is clockwise)."""

    model_config: ClassVar[ConfigDict] = {**Model.model_config, **_ONE_SCHEMA}

    output: int = Field(ge=1, le=32, description="Output number of the autopilot, from 1.")
    servo_id: int = Field(ge=0, le=254, description="Servo ID (0x45) of the servo.")
    label: str = Field(default="", max_length=40, description="Name of the servo, for comments.")
    low_deg: float = Field(ge=-180, le=180, allow_inf_nan=False, description="Counterclockwise end of the linkage, °.")
    high_deg: float = Field(ge=-180, le=180, allow_inf_nan=False, description="Clockwise end of the linkage, °.")
    neutral_deg: float = Field(default=0.0, ge=-180, le=180, allow_inf_nan=False, description="Neutral position, °.")
    reversed: bool = Field(
        default=False, description="A positive demand of the autopilot turns the servo counterclockwise."
    )
    function: int | None = Field(
        default=None, ge=-1, le=500,
        description="SERVOn_FUNCTION of ArduPilot or UAVCAN_SV_FUNCn of PX4. Null: not written.",
    )  # fmt: skip


class Plan(Model):
    """Outputs of one autopilot."""

    model_config: ClassVar[ConfigDict] = {**Model.model_config, **_ONE_SCHEMA}

    program: Program = Field(description="ardupilot or px4.")
    outputs: list[PlanOutput] = Field(min_length=1, max_length=32, description="Outputs, one per servo.")
    rate_hz: int = Field(default=50, ge=1, le=200, description="Rate of ArrayCommand, Hz. ArduPilot only.")


def check(plan: Plan, limits: dict[int, tuple[Bound, Bound]]) -> None:
    """Check that a linkage could take every output.

    `limits`: angle limits (0x39, 0x38) by servo ID, each None if unknown. Raises OutOfRange and InvalidValue with the
    number that is wrong.
    """
    seen: set[int] = set()
    for one in plan.outputs:
        name = f"Output {one.output}"
        most, wanted = OUTPUTS[plan.program], one.output - 1 + FIRST_ID[plan.program]
        if one.output > most:
            raise OutOfRange(
                f"{name} does not exist: {plan.program} has outputs 1 to {most}.",
                minimum=1, maximum=most, unit="", requested=one.output, cause="autopilot_output_range",
            )  # fmt: skip
        if one.output in seen:
            raise InvalidValue(
                f"{name} is listed twice. List each output once.", cause="autopilot_output_twice", output=one.output
            )
        seen.add(one.output)
        if one.servo_id != wanted:
            raise InvalidValue(
                f"{name} commands servo ID {wanted}, but its servo has {one.servo_id}. Set parameter 0x45 of the servo "
                f"to {wanted}, or use output {one.servo_id + 1 - FIRST_ID[plan.program]}.",
                cause="autopilot_servo_id", output=one.output, servo_id=one.servo_id, wanted_id=wanted,
            )  # fmt: skip
        if not one.low_deg < one.neutral_deg < one.high_deg:
            raise InvalidValue(
                f"{name}: neutral {one.neutral_deg:g}° must be between the ends {one.low_deg:g}° and "
                f"{one.high_deg:g}°.",
                cause="autopilot_ends_order", output=one.output, low_deg=one.low_deg, high_deg=one.high_deg,
                neutral_deg=one.neutral_deg,
            )  # fmt: skip
        low, high = limits.get(one.servo_id, (None, None))
        for end, limit, beyond in (
            (one.low_deg, low, low is not None and one.low_deg < low),
            (one.high_deg, high, high is not None and one.high_deg > high),
        ):
            if beyond:
                raise OutOfRange(
                    f"{name}: the end {end:g}° is beyond the angle limit of the servo, {limit:g}°. Reduce the end, or "
                    "widen the limit (0x38, 0x39).",
                    minimum=low, maximum=high, unit="°", requested=end, cause="autopilot_end_beyond_limit",
                    output=one.output,
                )  # fmt: skip

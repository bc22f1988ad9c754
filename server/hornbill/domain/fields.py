"""Base of all data models, and field types with their descriptions."""

from typing import Annotated, ClassVar, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from typing_extensions import TypeAliasType

Short = Annotated[str, AfterValidator(lambda text: text[:200])]
"""Text truncated to 200 characters, so that a long reason cannot delay a stop."""

UidField = Annotated[str, Field(pattern="^[0-9a-f]{32}$", description="Unique ID, 32 lower-case hex digits.")]
UidText = Annotated[str, Field(description="Unique ID of the servo, 32 hex digits.")]
Utc = Annotated[float, Field(description="Seconds since 1970 UTC.")]

DryRun = Annotated[bool, Field(description="Check everything and return the plan. Nothing is changed.")]
SaveAfter = Annotated[
    bool, Field(description="Then write ROM: the servo restarts, its horn may move, and all rows are read back.")
]

OnAnomaly = TypeAliasType("OnAnomaly", Literal["stop", "continue"])

Param: TypeAlias = str | int | float | bool | list[str | int | float]
Params = TypeAliasType(
    "Params",
    Annotated[
        dict[str, Param],
        Field(description="Values in the text, by name with unit. Unknown values are omitted."),
    ],
)
"""Values in a text for users, so that programs and other languages need not parse it. A separate type in the OpenAPI
document."""


def known(**params: Param | None) -> dict[str, Param]:
    """The values that are not None."""
    return {name: value for name, value in params.items() if value is not None}


_CONFIRM = "Confirmation codes of earlier `needs_confirmation` problems."

_Safety = Literal["supply", "temperature", "torque_off_in_rom", "torque_on_in_rom", "multi_turn"]
SafetyCode = TypeAliasType("SafetyCode", _Safety)
"""Confirmation codes for values that may make a servo unusable."""
SafetyConfirm = Annotated[list[SafetyCode], Field(default_factory=list[SafetyCode], description=_CONFIRM)]

_Motion = Literal["turns", "turn_count"]
MotionCode = TypeAliasType("MotionCode", _Motion)
"""Confirmation codes for motion: a move of more than 360°, and the first move after a restart that lost the turn count
(B34, B71)."""
MotionConfirms = Annotated[list[MotionCode], Field(default_factory=list[MotionCode], description=_CONFIRM)]

ConfirmCode = TypeAliasType("ConfirmCode", Literal[_Safety, _Motion])
"""All confirmation codes. A separate type in the OpenAPI document."""
Confirmed = Annotated[list[ConfirmCode], Field(description=_CONFIRM)]

STRICT = ConfigDict(extra="forbid", json_schema_serialization_defaults_required=True, defer_build=True)
"""Configuration of dataclasses: no undeclared fields, in the schema either; responses contain all fields."""


class Model(BaseModel):
    """Base of all data models and requests. Refuses unknown fields; reads objects by attribute."""

    model_config: ClassVar[ConfigDict] = {**STRICT, "from_attributes": True}

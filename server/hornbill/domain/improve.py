"""Improve: goal, bounds, and what it will move and write."""

from typing import Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Model, UidField

Goal = TypeAliasType("Goal", Literal["calm", "fast", "stiff"])


class ImproveBounds(Model):
    """Bounds of an improvement. Null: that of the servo."""

    from_deg: float | None = Field(
        default=None, ge=-36_000, le=36_000, description="Lowest angle, °. Null for 15° below the present angle."
    )
    to_deg: float | None = Field(
        default=None, ge=-36_000, le=36_000, description="Highest angle, °. Null for 15° above the present angle."
    )
    torque_pct: float | None = Field(
        default=None, ge=5, le=100, description="Largest torque, %. Effective if 0x25 is on. Null for no other limit."
    )
    speed_rpm: float | None = Field(
        default=None, ge=5, le=300, description="Highest speed, rpm. Effective if 0x25 is on. Null for no other limit."
    )
    time_s: float = Field(default=120.0, ge=10, le=600, description="Longest duration, s.")


class ImprovePreview(Model):
    """What an improvement will do. Nothing was sent that moves or writes."""

    uid: UidField
    goal: Goal = Field(description="Goal.")
    angle_deg: float = Field(description="Present angle, from which it moves and to which it returns, °.")
    from_deg: float = Field(description="Lowest angle that is permitted, °.")
    to_deg: float = Field(description="Highest angle that is permitted, °.")
    step_deg: float = Field(description="Largest step, °. Smaller ones precede it.")
    steps: int = Field(description="Maximum number of steps.")
    duration_s: float = Field(description="Maximum duration, s.")
    changes: list[str] = Field(description="Keys of rows that are changed in RAM and kept only if measured better.")
    limits: dict[str, float] = Field(
        description="Limits written for its duration and restored afterwards, by key, in the row's unit."
    )

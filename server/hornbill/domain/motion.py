"""Motion: what to know before a command."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from hornbill.domain.fields import STRICT, MotionConfirm

CautionCode = Literal["turns", "turn_count", "endless", "too_small", "held", "pwm", "timeout_too_short"]


@dataclass(frozen=True, slots=True, config=STRICT)
class Caution:
    """Something to know before a command is sent."""

    level: Literal["warning", "failure"] = Field(description="failure: the motion may never end.")
    code: CautionCode = Field(description="Code for programs. Stable.")
    text: str = Field(description="One sentence for users.")
    confirm: MotionConfirm | None = Field(description="Confirmation code required to send it. Null if none.")
    params: dict[str, float] = Field(description="Values in the text, by name with unit.")

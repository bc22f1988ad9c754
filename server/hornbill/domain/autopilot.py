"""Autopilot programs whose outputs drive servos."""

from typing import Literal

from typing_extensions import TypeAliasType

Program = TypeAliasType("Program", Literal["ardupilot", "px4"])

"""Verdict on a run: one sentence on what the servo did, and what to try next."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.fields import STRICT, Param, Params
from hornbill.domain.note import Note

VerdictCode = TypeAliasType(
    "VerdictCode",
    Literal[
        # steps
        "settles",
        "did_not_move",
        "smoothing_measured",
        "hunts",
        "supply_limited",
        "limit_reached",
        "off_target",
        "rings",
        "overshoots",
        "slow",
        "not_settled",
        # frequency responses
        "not_reliable",
        "resonant",
        "low_margin",
        "amplitude_dependent",
        "follows",
    ],
)
"""Code of a verdict. With its `params` a page words it in its language."""

Level = TypeAliasType("Level", Literal["ok", "notice", "warning", "failure"])


@dataclass(frozen=True, slots=True, config=STRICT)
class Verdict:
    """What a run shows, in one sentence. Computed on reading, from the thresholds in `docs/explanation/tuning.md`."""

    level: Level = Field(
        description="ok: nothing to improve. notice: works, with a peculiarity. warning: does not work well. "
        "failure: nothing was measured."
    )
    code: VerdictCode = Field(description="Code for programs.")
    text: str = Field(description="One sentence for users, with the decisive figures.")
    advice: Note | None = Field(default=None, description="What to try next. Null if nothing.")
    params: Params = Field(default_factory=dict[str, Param])

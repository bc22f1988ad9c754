"""Owns the JSON shapes of the recorder: how far it reaches back, and the bundles it wrote."""

from typing import Annotated, Any, Literal

from pydantic import Field

from hornbill.api.models import Model
from hornbill.servo.bundle import About, Columns

Reason = Literal["failure", "stop", "lost", "bus_lost", "by_hand"]


class BundleMark(Model):
    """A moment for which a bundle was, or will be, written."""

    at: float = Field(description="seconds since 1970 UTC")
    reason: Reason
    text: str
    uid: str | None = None


class PendingBundle(Model):
    """A bundle that still takes in what happens."""

    reason: Reason
    text: str
    marks: list[BundleMark]
    ready_in_s: float


class RecorderState(Model):
    """The recorder of the last ten minutes; it needs no starting."""

    recording: bool = Field(description="false while a recording is played: that is not recorded again")
    reach_s: float = Field(description="how far it reaches back; less than 600 when memory was full or it began lately")
    frames: int
    bytes: int
    before_s: float = Field(description="seconds a bundle holds before its first mark")
    pending: PendingBundle | None


class BundleRequest(Model):
    """What to write a bundle for."""

    reason: Annotated[str, Field(max_length=200)] = Field(
        default="By hand.", description="for people; goes in its name"
    )
    before_s: float | None = Field(
        default=None, ge=1, le=600, description="seconds before now; as configured unless told"
    )


class Bundle(Model):
    """A bundle in the data folder. `problem` says why one cannot be read; then little else is known of it."""

    name: str
    at: float = Field(description="its first mark, seconds since 1970 UTC")
    reason: Reason | None
    text: str
    bytes: int
    seconds: float | None
    marks: list[BundleMark]
    problem: str | None = None


class BundleContent(Model):
    """What a page shows of a bundle. Its frames are played: `PUT /bus` with address `bundle:NAME`."""

    about: About
    telemetry: list[Columns] = Field(description="at most 500,000 samples")
    complete: bool = Field(description="false when there was more telemetry than that")
    events: list[dict[str, Any]]
    writes: list[dict[str, str]]

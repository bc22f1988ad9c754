"""Owns the JSON shapes of the recorder: how far it reaches back, and the bundles it wrote."""

from typing import Annotated, Any

from pydantic import Field

from hornbill.domain.fields import Model
from hornbill.domain.recording import About, Columns, Reason


class BundleMark(Model):
    """A moment for which a bundle was, or will be, written."""

    at: float = Field(description="Time of the trigger, seconds since 1970 UTC.")
    reason: Reason = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    uid: str | None = Field(
        default=None, description="Unique ID of the servo, 32 hex digits. Null if it concerns none."
    )


class PendingBundle(Model):
    """A bundle that still takes in what happens."""

    reason: Reason = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    marks: list[BundleMark] = Field(description="Triggers of the recording.")
    ready_in_s: float = Field(description="Time until it is written, s.")


class RecorderState(Model):
    """The recorder of the last ten minutes; it needs no starting."""

    recording: bool = Field(description="false while a recording is played.")
    reach_s: float = Field(description="Time span recorded, s. Less than 600 after a start or if memory is full.")
    frames: int = Field(description="Number of CAN frames.")
    bytes: int = Field(description="Memory in use, bytes.")
    before_s: float = Field(description="Time a recording covers before its first trigger, s.")
    pending: PendingBundle | None = Field(description="Recording that is not complete yet. Null if none.")


class BundleRequest(Model):
    """What to write a bundle for."""

    reason: Annotated[str, Field(max_length=200)] = Field(
        default="By hand.", description="Reason, shown to users and used in the file name."
    )
    before_s: float | None = Field(
        default=None, ge=1, le=600, description="Time to cover before now, s. Null for the configured time."
    )


class Bundle(Model):
    """A bundle in the data folder. `problem` says why one cannot be read; then little else is known of it."""

    name: str = Field(description="File name.")
    at: float = Field(description="Time of its first trigger, seconds since 1970 UTC.")
    reason: Reason | None = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    bytes: int = Field(description="Size, bytes.")
    seconds: float | None = Field(description="Duration, s. Null if the file cannot be read.")
    marks: list[BundleMark] = Field(description="Triggers of the recording.")
    problem: str | None = Field(default=None, description="Reason why the file cannot be read. Null if it can.")


class BundleContent(Model):
    """What a page shows of a bundle. Its frames are played: `PUT /bus` with address `bundle:NAME`."""

    about: About
    telemetry: list[Columns] = Field(description="Telemetry, at most 500,000 samples.")
    complete: bool = Field(description="false if there is more telemetry than that.")
    events: list[dict[str, Any]] = Field(description="Events during the recording.")
    writes: list[dict[str, str]] = Field(description="Writes during the recording.")

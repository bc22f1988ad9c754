"""Facts common to all runs: a run is a unit, its set-up and a procedure, so that runs can be compared."""

from pydantic import Field

from hornbill.domain.fields import Model, UidField
from hornbill.domain.note import Note
from hornbill.domain.set_up import SetUp
from hornbill.domain.verdict import Verdict


class RunConditions(Model):
    """Conditions of a completed run."""

    id: int = Field(description="ID, as used in paths.")
    uid: UidField
    at: float = Field(description="Time of the run, seconds since 1970 UTC.")
    note: str = Field(description="Note of the user.")
    procedure: str = Field(description="Procedure and its version, such as `step/1`.")
    set_up: SetUp = Field(description="Set-up during the run.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    voltage_v: float | None = Field(description="Supply voltage at the servo before the run, V. Null if unknown.")
    temperature_c: float | None = Field(description="Servo temperature before the run, °C. Null if unknown.")
    parameters: dict[str, bool | int | float | str | None] = Field(
        description="Values of all rows during the run, by key."
    )
    warnings: list[Note] = Field(description="Conditions that make the metrics less meaningful.")
    verdict: Verdict

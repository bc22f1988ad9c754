"""Owns the JSON shapes of configuration: snapshots, comparisons, profiles, batches, drift, inventory, audit."""

from typing import Annotated, Any, Literal

from pydantic import Field

from hornbill.api.bus_models import PendingAllocation
from hornbill.api.models import Change, Confirmed, Model, ParametersPatched, Problem, Reading, Servo, UidField, Value

Name = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^/\\\x00-\x1f]+$")]
SafetyWord = Literal["supply", "temperature", "torque_off_in_rom"]
OnAnomaly = Literal["stop", "continue"]


class Save(Model):
    """What a save is asked for with."""

    confirm: Confirmed = Field(default=[])
    torque_on: bool = Field(
        default=False,
        description=(
            "ROM is to have torque on, whatever RAM has: it is turned on right before the write. The horn is held where"
            " it stands until the servo restarts, and then does what the forecast says."
        ),
    )


class Snapshot(Model):
    """What a servo held at one instant, in engineering values."""

    id: int
    uid: UidField
    at: float = Field(description="seconds since 1970 UTC")
    reason: str
    by: str
    automatic: bool
    model: str | None
    firmware: str | None
    values: dict[str, Value] = Field(description="RAM, by key")
    rom: dict[str, Value] = Field(description="what was known of ROM, by key")


class NewSnapshot(Model):
    """A snapshot to take by hand."""

    reason: str = Field(default="by hand", max_length=200)


class RowsToWrite(Model):
    """Which rows to write; identity rows (0x44 to 0x46) and torque mode only when they are named or asked for."""

    keys: list[str] | None = Field(default=None, min_length=1, description="null: every row the servo has")
    identity: bool = False
    dry_run: bool = False
    save: bool = False
    confirm: list[SafetyWord] = Field(default_factory=list[SafetyWord])


class Restore(RowsToWrite):
    """Write back what a snapshot holds of RAM, or what was known of ROM then."""

    source: Literal["ram", "rom"] = "ram"


class Copy(RowsToWrite):
    """Write what a side of a comparison holds."""

    from_: str = Field(
        alias="from",
        max_length=200,
        description="servo:UID, rom:UID, snapshot:ID, snapshot-rom:ID, profile:NAME or default:MODEL[@FIRMWARE]",
    )


class LeftOut(Model):
    """A row that was not written, and why."""

    key: str
    why: str


class Restored(ParametersPatched):
    """The outcome of a restore, as of a PATCH, and the rows that were left out of it."""

    left_out: list[LeftOut]


class Difference(Model):
    """One row that differs: null is what a side does not have (`*_has` false), or what is not known of it."""

    key: str
    left: Value
    right: Value
    left_unit: str = Field(description="0x36 follows 0x37, so that the units may differ (section 4.30)")
    right_unit: str
    left_has: bool
    right_has: bool
    identity: bool


class Comparison(Model):
    """Two sides, row by row: `servo:UID`, `rom:UID`, `snapshot:ID`, `profile:NAME`, `default:MODEL[@FIRMWARE]`, …"""

    left: str
    right: str
    same: int = Field(description="rows that both sides are known to hold alike")
    differences: list[Difference]


class Profile(Model):
    """A named set of values, in engineering units."""

    name: Name
    description: str = Field(default="", max_length=1000)
    model: str | None = Field(default=None, description="model it was made for; null: any")
    firmware: str | None = Field(default=None, description='firmware it was made for, e.g. "1.300"')
    schema_revision: str = Field(description="tables it was written with")
    values: dict[str, Value]
    units: dict[str, str] = Field(description="unit of each number")
    created_at: float
    updated_at: float


class ProfilePut(Model):
    """A profile to keep: its values, or the servo (or snapshot) to take them from."""

    description: str = Field(default="", max_length=1000)
    model: str | None = None
    firmware: str | None = None
    values: dict[str, bool | int | float | str] | None = Field(default=None, min_length=1, max_length=200)
    units: dict[str, str] | None = Field(
        default=None, max_length=200, description="of values; null: those of the schema"
    )
    from_uid: UidField | None = None
    from_snapshot: int | None = None
    keys: list[str] | None = Field(default=None, description="rows to take; null: all but identity")
    identity: bool = Field(default=False, description="take the identity rows 0x44 to 0x46 as well")


class LineVerdict(Model):
    """What became of one line of an imported file. `ok`: kept; everything else keeps the whole file out."""

    line: int = Field(description="from 1; 0 when the line is not known")
    key: str
    value: Value
    verdict: Literal[
        "ok", "unknown", "forbidden", "read_only", "identity", "out_of_range", "invalid", "not_in_this_model"
    ]
    text: str = Field(description="what is wrong and what to do; when ok, what is worth knowing")


class Imported(Model):
    """The verdict on every line of a file; `profile` is null unless all were ok."""

    profile: Profile | None
    lines: list[LineVerdict]


class ProfileApply(Model):
    """Servos to bring to a profile, one by one in this order."""

    uids: list[UidField] = Field(min_length=1, max_length=250)
    dry_run: bool = False
    save: bool = False
    on_anomaly: OnAnomaly = Field(
        default="stop", description="what to do after the first servo that did not do as told"
    )
    confirm: list[SafetyWord] = Field(default_factory=list[SafetyWord])


class BatchRead(Model):
    """Parameters × servos."""

    servos: dict[str, "BatchServo"]


class BatchServo(Model):
    """One servo's column of the matrix; `problem` instead of readings where there are none."""

    revision: str | None
    parameters: dict[str, Reading]
    problem: Problem | None = None


class BatchPatch(Model):
    """Values by servo by key. All or nothing for each servo; identity rows may be swapped within the batch."""

    servos: dict[str, dict[str, bool | int | float | str]] = Field(min_length=1, max_length=250)
    revisions: dict[str, str] = Field(default_factory=dict[str, str], description="as If-Match, by uid")
    dry_run: bool = False
    save: bool = False
    all_or_none: bool = Field(default=False, description="when one servo rejects its plan, none is written")
    confirm: list[SafetyWord] = Field(default_factory=list[SafetyWord])


class BatchOutcome(Model):
    """What became of one servo of a batch; `problem` says why it was rejected or rolled back."""

    uid: str
    outcome: Literal["applied", "rolled_back", "planned", "rejected", "not_tried"]
    changes: list[Change]
    revision: str | None
    job: str | None = Field(default=None, description="id of the save job, with save: true")
    problem: Problem | None = None


class BatchPatched(Model):
    """Outcomes in the order of the request."""

    servos: list[BatchOutcome]


class DriftRow(Model):
    """A row of ROM that changed under us."""

    key: str
    was: Value = Field(description="what ROM was known to hold")
    now: Value = Field(description="what it was found to hold")
    proved: bool = Field(
        description="false: found in RAM of a servo that restarted while nobody watched, so most likely in ROM"
    )


class Drift(Model):
    """What ROM holds otherwise than we last knew. Empty when nothing does."""

    uid: UidField
    rows: list[DriftRow]


class DriftRestore(Model):
    """Write back what ROM held; with `save`, into ROM."""

    save: bool = False
    confirm: list[SafetyWord] = Field(default_factory=list[SafetyWord])


class KnownServo(Model):
    """A servo ever seen, on the bus or not; instants in seconds since 1970 UTC."""

    uid: UidField
    label: str
    model: str | None
    serial: str | None
    firmware: str | None
    hardware_version: int | None
    production_date: str | None
    node_id: int | None = Field(description="last known")
    servo_id: int | None = Field(description="last known")
    first_seen: float | None
    last_seen: float | None
    online: bool
    rom: dict[str, Value] = Field(description="configuration last known to be in ROM")
    snapshots: int
    drift: list[str]


class AuditRow(Model):
    """Who did what, with what came of it; values in engineering units."""

    id: int
    at: float
    by: str
    action: str
    outcome: str
    uid: str | None
    key: str | None
    before: Any = None
    requested: Any = None
    after: Any = None
    detail: str
    job: str | None


class Forecast(Model):
    """What a restart would do to the horn, and what speaks against it."""

    moves: bool
    from_deg: float | None
    to_deg: float | None
    takes_s: float | None = Field(description="about; at the 30 rpm of soft start (section 4.14)")
    turn_count_lost: bool
    text: str
    warnings: list[str]


class ResetPreview(Model):
    """What a factory reset would change."""

    changes: list[Change]
    kept: dict[str, Value] = Field(description="identity rows that stay")
    restart: Forecast


class FactoryReset(Model):
    """`keep_identity`: 0x44 to 0x46 stay. The result is saved, which restarts the servo."""

    keep_identity: bool = True


class Candidate(Model):
    """A servo that looks new (servo id 0, no label), and the servo id to give it: null when none is free."""

    servo: Servo
    servo_id: int | None


class Candidates(Model):
    """Servos to commission, in the order of their serials, and nodes that still wait for a node id."""

    servos: list[Candidate]
    pending: list[PendingAllocation]


class CommissionServo(Model):
    """What one servo is to become; null and "" leave as it is."""

    uid: UidField
    servo_id: int | None = Field(default=None, ge=1, le=254)
    node_id: int | None = Field(default=None, ge=0, le=125, description="static node id; 0: dynamic")
    label: str = Field(default="", max_length=64)


class Commissioning(Model):
    """Servos to commission by one job, in this order."""

    servos: list[CommissionServo] = Field(min_length=1, max_length=125)
    profile: str | None = None
    save: bool = True
    identify: bool = Field(default=False, description="wiggle each horn before its servo is given its identity")
    on_anomaly: OnAnomaly = "stop"
    confirm: list[SafetyWord] = Field(default_factory=list[SafetyWord])

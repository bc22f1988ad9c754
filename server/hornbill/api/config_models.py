"""Owns the JSON shapes of configuration: snapshots, comparisons, profiles, batches, drift, inventory, audit."""

from typing import Annotated, Any, Literal

from pydantic import Field

from hornbill.api.bus_models import PendingAllocation
from hornbill.api.models import ParametersPatched, Problem, Servo
from hornbill.domain.change import Change, DriftRow, Forecast, LeftOut, LineVerdict, ReasonCode, SavePreview
from hornbill.domain.fields import Confirmed, DryRun, Model, Params, SafetyConfirm, SaveAfter, UidField, UidText, Utc
from hornbill.domain.servo import Reading
from hornbill.schema.scale import Value

Name = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^/\\\x00-\x1f]+$")]
OnAnomaly = Literal["stop", "continue"]


class Save(Model):
    """What a save is asked for with."""

    confirm: Confirmed = Field(default=[])
    torque_on: bool = Field(
        default=False,
        description="ROM is to have torque on, whatever it holds now. Without it, ROM keeps the torque mode it holds.",
    )
    dry_run: DryRun = False


BY_HAND = "by hand"
"""Reason of a snapshot that a user takes without giving one."""


class Snapshot(Model):
    """What a servo held at one instant, in engineering values."""

    id: int = Field(description="ID, as used in paths.")
    uid: UidField
    at: float = Field(description="Time of the snapshot, seconds since 1970 UTC.")
    reason: str = Field(description="Reason for the snapshot.")
    reason_code: ReasonCode | None = Field(
        description="Code of the reason: `by_hand`, or the operation that it preceded. Null for a user's own words."
    )
    reason_params: Params
    by: str = Field(description="Client that did it.")
    automatic: bool = Field(description="Taken automatically before a change.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    values: dict[str, Value] = Field(description="RAM, by key")
    rom: dict[str, Value] = Field(description="Values known to be in ROM, by key.")


class NewSnapshot(Model):
    """A snapshot to take by hand."""

    reason: str = Field(default=BY_HAND, max_length=200, description="Reason, shown to users and written to the audit.")


class RowsToWrite(Model):
    """Which rows to write; identity rows (0x44 to 0x46) and torque mode only when they are named or asked for."""

    keys: list[str] | None = Field(
        default=None, min_length=1, description="Keys of the rows. Null for all rows of the servo."
    )
    identity: bool = Field(default=False, description="Include origin, servo ID and node ID (0x44 to 0x46).")
    dry_run: DryRun = False
    save: SaveAfter = False
    confirm: SafetyConfirm


class Restore(RowsToWrite):
    """Write back what a snapshot holds of RAM, or what was known of ROM then."""

    source: Literal["ram", "rom"] = Field(default="ram", description="Values to write: RAM, or what was known of ROM.")


class Copy(RowsToWrite):
    """Write what a side of a comparison holds."""

    from_: str = Field(
        alias="from",
        max_length=200,
        description="Source: servo:UID, rom:UID, snapshot:ID, snapshot-rom:ID, profile:NAME or "
        "default:MODEL[@FIRMWARE].",
    )


class Restored(ParametersPatched):
    """The outcome of a restore, as of a PATCH, and the rows that were left out of it."""

    left_out: list[LeftOut] = Field(description="Rows that were not written.")


class Profile(Model):
    """A named set of values, in engineering units."""

    name: Name = Field(description="Name of the profile.")
    description: str = Field(default="", max_length=1000, description="Purpose of the profile.")
    model: str | None = Field(default=None, description="Model it is made for. Null for any.")
    firmware: str | None = Field(default=None, description="Firmware it is made for, such as `1.300`. Null for any.")
    schema_revision: str = Field(description="Revision of the parameter tables at the time of writing.")
    values: dict[str, Value] = Field(description="Values by key.")
    units: dict[str, str] = Field(description="Units of the values, by key.")
    created_at: Utc
    updated_at: Utc


class ProfilePut(Model):
    """A profile to keep: its values, or the servo (or snapshot) to take them from."""

    description: str = Field(default="", max_length=1000, description="Purpose of the profile.")
    model: str | None = Field(default=None, description="Model it is made for. Null for any.")
    firmware: str | None = Field(default=None, description="Firmware it is made for, such as `1.300`. Null for any.")
    values: dict[str, bool | int | float | str] | None = Field(
        default=None, min_length=1, max_length=200, description="Values by key, in the units of the parameter manual."
    )
    units: dict[str, str] | None = Field(
        default=None, max_length=200, description="Units of the values, by key. Null for the units of the tables."
    )
    from_uid: UidField | None = Field(default=None, description="Servo to take the values from, unique ID.")
    from_snapshot: int | None = Field(default=None, description="ID of the snapshot to take the values from.")
    keys: list[str] | None = Field(
        default=None, description="Keys of the rows to store. Null for all rows but identity."
    )
    identity: bool = Field(default=False, description="Include the identity rows 0x44 to 0x46.")


class Imported(Model):
    """The verdict on every line of a file; `profile` is null unless all were ok."""

    profile: Profile | None = Field(description="Imported profile. Null unless all lines are ok.")
    lines: list[LineVerdict] = Field(description="Verdict on each line.")


class ProfileApply(Model):
    """Servos to bring to a profile, one by one in this order."""

    uids: list[UidField] = Field(
        min_length=1, max_length=250, description="Servos in the order of writing, unique IDs."
    )
    dry_run: DryRun = False
    save: SaveAfter = False
    on_anomaly: OnAnomaly = Field(
        default="stop", description="After the first servo with an unexpected result: stop, or continue."
    )
    confirm: SafetyConfirm


class BatchRead(Model):
    """Parameters × servos."""

    servos: dict[str, "BatchServo"] = Field(description="Results by unique ID.")


class BatchServo(Model):
    """One servo's column of the matrix; `problem` instead of readings where there are none."""

    revision: str | None = Field(description="Revision of the values, for If-Match.")
    parameters: dict[str, Reading] = Field(description="Readings by key.")
    problem: Problem | None = Field(default=None, description="Reason why there are none. Null otherwise.")


class BatchPatch(Model):
    """Values by servo by key. All or nothing for each servo; identity rows may be swapped within the batch."""

    servos: dict[str, dict[str, bool | int | float | str]] = Field(
        min_length=1, max_length=250, description="Values by unique ID and key."
    )
    revisions: dict[str, str] = Field(
        default_factory=dict[str, str], description="Revisions as in If-Match, by unique ID."
    )
    dry_run: DryRun = False
    save: SaveAfter = False
    all_or_none: bool = Field(default=False, description="If one servo rejects its plan, write to none.")
    confirm: SafetyConfirm


class BatchOutcome(SavePreview):
    """What became of one servo of a batch; `problem` says why it was rejected or rolled back."""

    uid: UidText
    outcome: Literal["applied", "rolled_back", "planned", "rejected", "not_tried"] = Field(
        description="rejected: nothing was written; not_tried: an earlier servo ended the batch."
    )
    changes: list[Change] = Field(description="Changes, row by row.")
    revision: str | None = Field(description="Revision of the values afterwards. Null if nothing was read.")
    job: str | None = Field(default=None, description="ID of the save job, with `save`. Null otherwise.")
    problem: Problem | None = Field(default=None, description="Reason for rejected or rolled_back. Null otherwise.")


class BatchPatched(Model):
    """Outcomes in the order of the request."""

    servos: list[BatchOutcome] = Field(description="One entry per servo.")


class Drift(Model):
    """What ROM holds otherwise than we last knew. Empty when nothing does."""

    uid: UidField
    rows: list[DriftRow] = Field(description="Rows that changed.")


class DriftRestore(Model):
    """Write back what ROM held; with `save`, into ROM."""

    save: SaveAfter = False
    confirm: SafetyConfirm


class KnownServo(Model):
    """A servo ever seen, on the bus or not; instants in seconds since 1970 UTC."""

    uid: UidField
    label: str = Field(description="Nickname. Empty if none.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    serial: str | None = Field(description="Serial number: model number, dash, product number. Null if unknown.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    hardware_version: int | None = Field(description="Hardware version from GetNodeInfo. Null if unknown.")
    production_date: str | None = Field(description="Production date as the servo reports it. Null if unknown.")
    node_id: int | None = Field(description="Last known node ID. Null if none.")
    servo_id: int | None = Field(description="Last known servo ID (0x45). Null if unknown.")
    first_seen: float | None = Field(description="First contact, seconds since 1970 UTC. Null if unknown.")
    last_seen: float | None = Field(description="Last contact, seconds since 1970 UTC. Null if unknown.")
    online: bool = Field(description="Received recently.")
    rom: dict[str, Value] = Field(description="Values last known to be in ROM, by key.")
    snapshots: int = Field(description="Number of stored snapshots.")
    drift: list[str] = Field(description="Keys of rows whose ROM value changed unexpectedly.")


class AuditRow(Model):
    """Who did what, with what came of it; values in engineering units."""

    id: int = Field(description="ID, as used in paths.")
    at: Utc
    by: str = Field(description="Client that did it.")
    action: str = Field(description="Action, such as `write` or `save`.")
    outcome: str = Field(description="Result of the action.")
    uid: str | None = Field(description="Unique ID of the servo, 32 hex digits. Null if it concerns none.")
    key: str | None = Field(description="Parameter key. Null if the action concerns no row.")
    before: Any = Field(default=None, description="Value before.")
    requested: Any = Field(default=None, description="Requested value.")
    after: Any = Field(default=None, description="Value afterwards.")
    detail: str = Field(description="One sentence with the details.")
    job: str | None = Field(description="ID of the job it was part of. Null if none.")


class Restart(Model):
    """Options of a restart."""

    dry_run: DryRun = False


class RestartPreview(Model):
    """What a restart would change."""

    lost: list[Change] = Field(description="Rows that are in RAM only. `requested` is the value after the restart.")
    restart: Forecast


class FactoryReset(Model):
    """`keep_identity`: 0x44 to 0x46 stay. The result is saved, which restarts the servo."""

    keep_identity: bool = Field(default=True, description="Keep origin, servo ID and node ID.")
    dry_run: DryRun = False


class Candidate(Model):
    """A servo that looks new (servo id 0, no label), and the servo id to give it: null when none is free."""

    servo: Servo
    servo_id: int | None = Field(description="Next free servo ID. Null if none is free.")


class Candidates(Model):
    """Servos to commission, in the order of their serials, and nodes that still wait for a node id."""

    servos: list[Candidate] = Field(description="One entry per servo.")
    pending: list[PendingAllocation] = Field(description="Nodes that still wait for a node ID.")


class CommissionServo(Model):
    """What one servo is to become; null and "" leave as it is."""

    uid: UidField
    servo_id: int | None = Field(default=None, ge=1, le=254, description="Servo ID (0x45), 1 to 254. Null to keep it.")
    node_id: int | None = Field(
        default=None, ge=0, le=125, description="Static node ID. 0 for dynamic. Null to keep it."
    )
    label: str = Field(default="", max_length=64, description="Nickname.")


class Commissioning(Model):
    """Servos to commission by one job, in this order."""

    servos: list[CommissionServo] = Field(min_length=1, max_length=125, description="Servos to commission.")
    profile: str | None = Field(default=None, description="Name of the profile to apply to all servos. Null for none.")
    save: SaveAfter = True
    identify: bool = Field(default=False, description="Wiggle each horn before the servo gets its identity.")
    on_anomaly: OnAnomaly = Field(
        default="stop",
        description="After the first servo with an unexpected result: leave the remaining servos unchanged, or "
        "continue.",
    )
    confirm: SafetyConfirm
    dry_run: DryRun = False


class CommissionPlan(SavePreview):
    """What commissioning would do with one servo."""

    uid: UidField
    changes: list[Change] = Field(description="Rows to write.")


class CommissioningPreview(Model):
    """What commissioning would do, servo by servo, in the order of the request."""

    servos: list[CommissionPlan] = Field(description="One entry per servo.")

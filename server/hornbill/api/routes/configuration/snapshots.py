"""Routes of snapshots, comparison, restore and copy."""

from typing import Annotated, Literal, cast

from fastapi import Path, Query
from pydantic import Field

from hornbill.api.dependencies import IfMatch, LeaseHeader, TheHost, TheServo, UidPath, known_uid
from hornbill.api.paging import Page, pages
from hornbill.api.routes.configuration.parameters import PATCH_PROBLEMS, ParametersPatched, patched, revision_of
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import Comparison, LeftOut, Reason, ReasonCode
from hornbill.domain.fields import DryRun, Model, Param, Params, SafetyConfirm, SaveAfter, UidField
from hornbill.errors import Unknown
from hornbill.schema.firmware import to_text
from hornbill.schema.scale import Value
from hornbill.servo.configuration.writing import WriteOptions
from hornbill.servo.device import permission
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.profiles.comparing import FORMS, Side, compare, snapshot_side
from hornbill.store.snapshots import StoredSnapshot

routes = Routes("history")


MANUAL = "manual"
"""Default reason of a snapshot that a user takes."""


class Snapshot(Model):
    """Values of a servo at one time."""

    id: int = Field(description="ID, as used in paths.")
    uid: UidField
    at: float = Field(description="Time of the snapshot, seconds since 1970 UTC.")
    reason: str = Field(description="Reason for the snapshot.")
    reason_code: ReasonCode | None = Field(
        description="Code of the reason: `manual`, or the operation that it preceded. Null for a user's own text."
    )
    reason_params: Params
    by: str = Field(description="Client that took it.")
    automatic: bool = Field(description="Taken automatically before a change.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    values: dict[str, Value] = Field(description="Values in RAM, by key.")
    rom: dict[str, Value] = Field(description="Values known to be in ROM, by key.")


class NewSnapshot(Model):
    """Options of a new snapshot."""

    reason: str = Field(default=MANUAL, max_length=200, description="Reason, shown to users and written to the audit.")


class RowsToWrite(Model):
    """Rows to write. Torque mode is included only if named in `keys`."""

    keys: list[str] | None = Field(
        default=None, min_length=1, description="Keys of the rows. Null for all rows of the servo."
    )
    identity: bool = Field(default=False, description="Include origin, servo ID and node ID (0x44 to 0x46).")
    dry_run: DryRun = False
    save: SaveAfter = False
    confirm: SafetyConfirm


class Restore(RowsToWrite):
    """Options of restoring a snapshot."""

    source: Literal["ram", "rom"] = Field(
        default="ram", description="Values to write: those in RAM, or those known to be in ROM, at the time."
    )


class Copy(RowsToWrite):
    """Options of copying values."""

    from_: str = Field(
        alias="from",
        max_length=200,
        description="Source: servo:UID, rom:UID, snapshot:ID, snapshot-rom:ID, profile:NAME or "
        "default:MODEL[@FIRMWARE].",
    )


class Restored(ParametersPatched):
    """Result of restoring or copying values."""

    left_out: list[LeftOut] = Field(description="Rows that were not written.")


SnapshotId = Annotated[int, Path(description="ID of a snapshot of this servo.")]
SideName = Annotated[str, Query(max_length=200, description=f"One of {FORMS}.")]

RESTORE_PROBLEMS = (*PATCH_PROBLEMS, "unknown_snapshot", "unknown_profile")


@routes.get("/servos/{uid}/snapshots", Role.VIEW, "unknown_servo", "invalid_value")
async def list_snapshots(host: TheHost, uid: UidPath, page: Annotated[Page, pages(1000, 1000)]) -> list[Snapshot]:
    """List the snapshots of a servo, on the bus or not, newest first."""
    found = await host.store.run(host.store.snapshots.of, known_uid(host, uid))
    return [_shown(host, one) for one in page.of(found, lambda one: one.id)]


@routes.post(
    "/servos/{uid}/snapshots",
    Role.CONFIGURE,
    "unknown_servo",
    "busy",
    "not_in_this_model",
    "no_response",
    "bus_disconnected",
    "invalid_value",
    "refused_by_servo",
    "store_failed",
    status_code=201,
)
async def take_snapshot(
    host: TheHost, servo: TheServo, body: NewSnapshot | None = None, lease: LeaseHeader = None
) -> Snapshot:
    """Take a snapshot of a servo. It is stored until deleted. Unknown values are read from the bus first."""
    host.connected()
    permission.check_readable(servo)
    text = (body or NewSnapshot()).reason
    reason = Reason(text, "manual" if text == MANUAL else None)
    async with servo.changing:
        by = host.leases.who(lease, host.base.now())
        made = await host.history.take(host.requests, servo, reason=reason, by=by, automatic=False)
    return _shown(host, made)


@routes.get("/servos/{uid}/snapshots/{snapshot_id}", Role.VIEW, "unknown_servo", "unknown_snapshot", "invalid_value")
async def get_snapshot(host: TheHost, uid: UidPath, snapshot_id: SnapshotId) -> Snapshot:
    """Get a snapshot."""
    return _shown(host, await _of(host, uid, snapshot_id))


@routes.delete(
    "/servos/{uid}/snapshots/{snapshot_id}",
    Role.ADMIN,
    "unknown_servo",
    "unknown_snapshot",
    "invalid_value",
    status_code=204,
)
async def delete_snapshot(host: TheHost, uid: UidPath, snapshot_id: SnapshotId, lease: LeaseHeader = None) -> None:
    """Delete a snapshot. The deletion is recorded in the audit."""
    await host.history.drop(await _of(host, uid, snapshot_id), by=host.leases.who(lease, host.base.now()))


@routes.post("/servos/{uid}/snapshots/{snapshot_id}/restore", Role.CONFIGURE, *RESTORE_PROBLEMS)
async def restore_snapshot(
    host: TheHost,
    servo: TheServo,
    snapshot_id: SnapshotId,
    body: Restore | None = None,
    lease: LeaseHeader = None,
    revision: IfMatch = None,
) -> Restored:
    """Write the values of a snapshot, all rows or the given ones, all or nothing."""
    wanted = body or Restore(confirm=[])
    side = snapshot_side(host.catalog, await _of(host, servo.uid, snapshot_id), wanted.source)
    return await _restore(host, servo, side, wanted, lease, revision)


@routes.post("/servos/{uid}/copy", Role.CONFIGURE, *RESTORE_PROBLEMS)
async def copy_configuration(
    host: TheHost,
    servo: TheServo,
    body: Copy,
    lease: LeaseHeader = None,
    revision: IfMatch = None,
) -> Restored:
    """Write the values of another servo, a snapshot, a profile or the defaults, all or nothing."""
    return await _restore(host, servo, await host.sides.get(body.from_), body, lease, revision)


@routes.get(
    "/compare",
    Role.VIEW,
    "invalid_value",
    "unknown_servo",
    "unknown_snapshot",
    "unknown_profile",
    "no_response",
    operation_id="compare",
)
async def compare_sides(
    host: TheHost,
    left: SideName,
    right: SideName,
    identity: Annotated[bool, Query(description="Include the identity rows 0x44 to 0x46.")] = False,
) -> Comparison:
    """Compare two sides row by row. Unknown values (null) count as different."""
    return compare(host.catalog, await host.sides.get(left), await host.sides.get(right), identity=identity)


async def _restore(
    host: Host, servo: Servo, side: Side, wanted: RowsToWrite, lease: str | None, revision: str | None
) -> Restored:
    host.connected()
    options = WriteOptions(lease, wanted.dry_run, wanted.save, revision_of(revision), wanted.confirm)
    edit, left_out = await host.restoring.restore(servo, side, options, keys=wanted.keys, identity=wanted.identity)
    return Restored(**dict(patched(servo, edit)), left_out=left_out)


async def _of(host: Host, uid: str, snapshot_id: int) -> StoredSnapshot:
    known_uid(host, uid)
    found = await host.sides.snapshot(snapshot_id)
    if found.uid != uid:
        raise Unknown(
            "unknown_snapshot",
            f"Snapshot {snapshot_id} belongs to another servo: {found.uid}.",
            snapshot=snapshot_id,
            cause="snapshot_of_other_servo",
        )
    return found


def _shown(host: Host, one: StoredSnapshot) -> Snapshot:
    return Snapshot(
        id=one.id, uid=one.uid, at=one.at, reason=one.reason,
        reason_code=cast("ReasonCode | None", one.reason_code),
        reason_params=cast("dict[str, Param]", one.reason_params or {}),
        by=one.by, automatic=one.automatic, model=one.model,
        firmware=None if one.firmware is None else to_text(one.firmware),
        values=_known(snapshot_side(host.catalog, one, "ram")), rom=_known(snapshot_side(host.catalog, one, "rom")),
    )  # fmt: skip


def _known(side: Side) -> dict[str, Value]:
    return {key: value for key, value in side.values.items() if value is not None}

"""Owns the routes of history: snapshots, comparisons, and bringing a servo to what a side holds."""

from typing import Annotated

from fastapi import APIRouter, Header, Path, Query

from hornbill.api import PREFIX, config_models
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.models import UidField
from hornbill.api.parameters import PATCH_PROBLEMS, may_begin, patched, revision_of
from hornbill.api.problems import declared, together
from hornbill.errors import Unknown
from hornbill.schema.firmware import to_text
from hornbill.schema.scale import Value
from hornbill.servo import permission
from hornbill.servo.configuration.comparing import FORMS, Side, compare, snapshot_side
from hornbill.servo.host import Host
from hornbill.servo.servo import Servo
from hornbill.store.snapshots import Snapshot
from hornbill.units import Uid

router = APIRouter(prefix=PREFIX, tags=["history"])

UidPath = Annotated[UidField, Path(description="unique id, 32 lower-case hex digits")]
SnapshotId = Annotated[int, Path(description="number of a snapshot of this servo")]
SideName = Annotated[str, Query(max_length=200, description=f"one of {FORMS}")]
Revision = Annotated[str | None, Header(alias="If-Match")]

RESTORE_PROBLEMS = together(PATCH_PROBLEMS, declared("unknown_snapshot", "unknown_profile"))


@router.get(
    "/servos/{uid}/snapshots", operation_id="list_snapshots", responses=declared("unknown_servo", "invalid_value")
)
async def list_snapshots(host: TheHost, uid: UidPath) -> list[config_models.Snapshot]:
    """Every snapshot of a servo, on the bus or only remembered, newest first."""
    _check_known(host, uid)
    return [_shown(host, one) for one in host.store.snapshots.of(Uid(uid))]


@router.post(
    "/servos/{uid}/snapshots",
    operation_id="take_snapshot",
    status_code=201,
    responses=declared(
        "unknown_servo",
        "busy",
        "not_in_this_model",
        "no_answer",
        "bus_disconnected",
        "invalid_value",
        "refused_by_servo",
        "store_failed",
    ),
)
async def take_snapshot(
    host: TheHost, servo: TheServo, body: config_models.NewSnapshot | None = None, lease: LeaseHeader = None
) -> config_models.Snapshot:
    """Keep what the servo holds now, until somebody drops it. What is not known is read from the bus first."""
    host.connected()
    permission.check_writable(servo)
    reason = (body or config_models.NewSnapshot()).reason
    async with servo.changing:
        by = host.leases.who(lease, host.base.now())
        made = await host.history.take(host.asker, servo, reason=reason, by=by, automatic=False)
    return _shown(host, made)


@router.get(
    "/servos/{uid}/snapshots/{snapshot_id}",
    operation_id="get_snapshot",
    responses=declared("unknown_servo", "unknown_snapshot", "invalid_value"),
)
async def get_snapshot(host: TheHost, uid: UidPath, snapshot_id: SnapshotId) -> config_models.Snapshot:
    """One snapshot."""
    return _shown(host, _of(host, uid, snapshot_id))


@router.delete(
    "/servos/{uid}/snapshots/{snapshot_id}",
    operation_id="drop_snapshot",
    status_code=204,
    responses=declared("unknown_servo", "unknown_snapshot", "invalid_value"),
)
async def drop_snapshot(host: TheHost, uid: UidPath, snapshot_id: SnapshotId, lease: LeaseHeader = None) -> None:
    """Forget a snapshot; the audit keeps that there was one."""
    host.history.drop(_of(host, uid, snapshot_id), by=host.leases.who(lease, host.base.now()))


@router.post(
    "/servos/{uid}/snapshots/{snapshot_id}/restore", operation_id="restore_snapshot", responses=RESTORE_PROBLEMS
)
async def restore_snapshot(
    host: TheHost,
    servo: TheServo,
    snapshot_id: SnapshotId,
    body: config_models.Restore | None = None,
    lease: LeaseHeader = None,
    revision: Revision = None,
) -> config_models.Restored:
    """Write what a snapshot holds, all or nothing: whole, or the rows named."""
    wanted = body or config_models.Restore()
    side = snapshot_side(host.catalog, _of(host, servo.uid, snapshot_id), wanted.source)
    return await _restore(host, servo, side, wanted, lease, revision)


@router.post("/servos/{uid}/copy", operation_id="copy_configuration", responses=RESTORE_PROBLEMS)
async def copy_configuration(
    host: TheHost,
    servo: TheServo,
    body: config_models.Copy,
    lease: LeaseHeader = None,
    revision: Revision = None,
) -> config_models.Restored:
    """Write what another servo, a snapshot of it, a profile or the defaults hold, all or nothing."""
    return await _restore(host, servo, host.sides.get(body.from_), body, lease, revision)


@router.get(
    "/compare",
    operation_id="compare",
    responses=declared("invalid_value", "unknown_servo", "unknown_snapshot", "unknown_profile", "no_answer"),
)
async def compare_sides(
    host: TheHost,
    left: SideName,
    right: SideName,
    identity: Annotated[bool, Query(description="compare the identity rows 0x44 to 0x46 as well")] = False,
) -> config_models.Comparison:
    """Where two sides differ, row by row. What is not known on a side (null) equals nothing."""
    found = compare(host.catalog, host.sides.get(left), host.sides.get(right), identity=identity)
    return config_models.Comparison.model_validate(found)


async def _restore(
    host: Host, servo: Servo, side: Side, wanted: config_models.RowsToWrite, lease: str | None, revision: str | None
) -> config_models.Restored:
    named = {key: side.values.get(key) for key in wanted.keys or ()}
    saves = await may_begin(
        host, servo, save=wanted.save and not wanted.dry_run, lease=lease, confirm=wanted.confirm, values=named
    )
    outcome, left_out = await host.restoring.restore(
        servo, side, lease, keys=wanted.keys, identity=wanted.identity, dry_run=wanted.dry_run,
        revision=revision_of(revision), confirm=wanted.confirm,
    )  # fmt: skip
    answer = patched(host, servo, outcome, lease, saves=saves)
    return config_models.Restored(
        **dict(answer), left_out=[config_models.LeftOut.model_validate(one) for one in left_out]
    )


def _check_known(host: Host, uid: str) -> None:
    """Raises Unknown (unknown_servo) for a servo never met: one that is switched off has a history, too."""
    if not host.fleet.knows(uid) and host.store.servos.get(Uid(uid)) is None:
        raise Unknown("unknown_servo", f"There never was a servo {uid}. GET /api/v1/servos lists them.", uid=uid)


def _of(host: Host, uid: str, snapshot_id: int) -> Snapshot:
    _check_known(host, uid)
    found = host.sides.snapshot(snapshot_id)
    if found.uid != uid:
        raise Unknown(
            "unknown_snapshot", f"Snapshot {snapshot_id} is of another servo: {found.uid}.", snapshot=snapshot_id
        )
    return found


def _shown(host: Host, one: Snapshot) -> config_models.Snapshot:
    return config_models.Snapshot(
        id=one.id, uid=one.uid, at=one.at, reason=one.reason, by=one.by, automatic=one.automatic, model=one.model,
        firmware=None if one.firmware is None else to_text(one.firmware),
        values=_known(snapshot_side(host.catalog, one, "ram")), rom=_known(snapshot_side(host.catalog, one, "rom")),
    )  # fmt: skip


def _known(side: Side) -> dict[str, Value]:
    return {key: value for key, value in side.values.items() if value is not None}

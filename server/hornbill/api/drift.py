"""Owns the routes of drift: what ROM holds otherwise than we last knew, putting it back, and accepting it."""

from fastapi import APIRouter

from hornbill.api import PREFIX, config_models, models
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.parameters import PATCH_PROBLEMS, may_begin, patched
from hornbill.api.problems import declared
from hornbill.errors import Busy

router = APIRouter(prefix=PREFIX, tags=["history"])


@router.get("/servos/{uid}/drift", operation_id="get_drift", responses=declared("unknown_servo"))
async def get_drift(host: TheHost, servo: TheServo) -> config_models.Drift:
    """Rows that somebody else changed in ROM since the servo was last known. Empty when nothing differs."""
    rows = [config_models.DriftRow.model_validate(one) for one in host.drift.rows(servo)]
    return config_models.Drift(uid=servo.uid, rows=rows)


@router.post("/servos/{uid}/drift/restore", operation_id="restore_drift", responses=PATCH_PROBLEMS)
async def restore_drift(
    host: TheHost, servo: TheServo, body: config_models.DriftRestore | None = None, lease: LeaseHeader = None
) -> models.ParametersPatched:
    """Write back what ROM held, all or nothing, identity rows too. The flag goes when ROM is proved to hold it."""
    wanted = body or config_models.DriftRestore()
    values = {one.key: one.was for one in host.drift.rows(servo)}
    saves = bool(values) and await may_begin(
        host, servo, save=wanted.save, lease=lease, confirm=wanted.confirm, values=values
    )
    outcome = await host.changes.apply(servo, values, lease, confirm=wanted.confirm, reason="before drift is undone")
    return patched(host, servo, outcome, lease, saves=saves)


@router.delete("/servos/{uid}/drift", operation_id="accept_drift", status_code=204,
               responses=declared("unknown_servo", "busy", "lease_held"))  # fmt: skip
async def accept_drift(host: TheHost, servo: TheServo, lease: LeaseHeader = None) -> None:
    """Take what was found for what is wanted."""
    now = host.base.now()
    host.leases.allow_write(lease, now)
    if servo.busy is not None:
        raise Busy(f"{servo.title} is {servo.state.value}. Accept its drift when that has ended.")
    host.drift.accept(servo, host.leases.who(lease, now))

"""Routes of drift: unexpected changes in ROM, restoring and accepting them."""

from pydantic import Field

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routes.configuration.parameters import PATCH_PROBLEMS, ParametersPatched, patched
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import DriftRow, Reason
from hornbill.domain.fields import Model, SafetyConfirm, SaveAfter, UidField
from hornbill.errors import Busy
from hornbill.servo.configuration.writing import WriteOptions

routes = Routes("history")


class Drift(Model):
    """Rows whose ROM value changed unexpectedly. Empty if there are none."""

    uid: UidField
    rows: list[DriftRow] = Field(description="Rows that changed.")


class DriftRestore(Model):
    """Options of restoring drift."""

    save: SaveAfter = False
    confirm: SafetyConfirm


BEFORE_DRIFT_IS_UNDONE = Reason("before drift is undone", "drift_undone")


@routes.get("/servos/{uid}/drift", Role.VIEW, "unknown_servo")
async def get_drift(host: TheHost, servo: TheServo) -> Drift:
    """Get the rows that another tool changed in ROM since the servo was last seen."""
    rows = host.drift.rows(servo)
    return Drift(uid=servo.uid, rows=rows)


@routes.post("/servos/{uid}/drift/restore", Role.CONFIGURE, *PATCH_PROBLEMS)
async def restore_drift(
    host: TheHost, servo: TheServo, body: DriftRestore | None = None, lease: LeaseHeader = None
) -> ParametersPatched:
    """Write back the previous ROM values, all or nothing, including identity rows. The drift clears once ROM is
    verified to contain them.
    """
    wanted = body or DriftRestore(confirm=[])
    values = {one.key: one.was for one in host.drift.rows(servo)}
    if not values:
        wanted = DriftRestore(confirm=[])  # nothing to restore, so nothing is saved
    host.connected()
    options = WriteOptions(lease, save=wanted.save, confirm=wanted.confirm, reason=BEFORE_DRIFT_IS_UNDONE)
    return patched(servo, await host.changes.edit(servo, values, options))


@routes.delete("/servos/{uid}/drift", Role.CONFIGURE, "unknown_servo", "busy", "lease_held", status_code=204)
async def accept_drift(host: TheHost, servo: TheServo, lease: LeaseHeader = None) -> None:
    """Accept the changed values as intended."""
    now = host.base.now()
    host.leases.allow_write(lease, now, servo.uid)
    if servo.busy is not None:
        raise Busy(
            f"{servo.title} is {servo.state.value.replace('_', ' ')}. Wait until it is ready, then accept its drift.",
            cause="not_ready",
            servo=servo.title,
            state=servo.state.value,
        )
    host.drift.accept(servo, host.leases.who(lease, now))

"""Owns the routes of drift: what ROM holds otherwise than we last knew, putting it back, and accepting it."""

from hornbill.api import config_models, models
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routes.configuration.parameters import PATCH_PROBLEMS, patched
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import Reason
from hornbill.errors import Busy
from hornbill.servo.configuration.changes import WriteOptions

routes = Routes("history")


BEFORE_DRIFT_IS_UNDONE = Reason("before drift is undone", "drift_undone")


@routes.get("/servos/{uid}/drift", Role.VIEW, "unknown_servo")
async def get_drift(host: TheHost, servo: TheServo) -> config_models.Drift:
    """Rows that somebody else changed in ROM since the servo was last known. Empty when nothing differs."""
    rows = host.drift.rows(servo)
    return config_models.Drift(uid=servo.uid, rows=rows)


@routes.post("/servos/{uid}/drift/restore", Role.CONFIGURE, *PATCH_PROBLEMS)
async def restore_drift(
    host: TheHost, servo: TheServo, body: config_models.DriftRestore | None = None, lease: LeaseHeader = None
) -> models.ParametersPatched:
    """Write back what ROM held, all or nothing, identity rows too. The flag goes when ROM is proved to hold it."""
    wanted = body or config_models.DriftRestore(confirm=[])
    values = {one.key: one.was for one in host.drift.rows(servo)}
    if not values:
        wanted = config_models.DriftRestore(confirm=[])  # nothing to put back, so nothing is saved
    host.connected()
    options = WriteOptions(lease, save=wanted.save, confirm=wanted.confirm, reason=BEFORE_DRIFT_IS_UNDONE)
    return patched(servo, await host.changes.edit(servo, values, options))


@routes.delete("/servos/{uid}/drift", Role.CONFIGURE, "unknown_servo", "busy", "lease_held", status_code=204)
async def accept_drift(host: TheHost, servo: TheServo, lease: LeaseHeader = None) -> None:
    """Take what was found for what is wanted."""
    now = host.base.now()
    host.leases.allow_write(lease, now)
    if servo.busy is not None:
        raise Busy(f"{servo.title} is {servo.state.value}. Accept its drift when that has ended.")
    host.drift.accept(servo, host.leases.who(lease, now))

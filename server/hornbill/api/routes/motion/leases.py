"""Routes of leases, which grant motion control: take, renew, release, request and refuse."""

from typing import Annotated

from pydantic import Field

from hornbill.api import present
from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, LeaseId, RequestId, TheHost
from hornbill.api.paging import Every
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.domain.motion import Lease, LeaseView, TakeOverState
from hornbill.servo.motion.motion_control import PASS_S
from hornbill.servo.runtime.actor import signed
from hornbill.units import Uid

routes = Routes("motion")


Covered = Annotated[
    list[ServoRef] | None,
    Field(
        min_length=1, max_length=250, description="Servos to control. Null: all servos, also those that appear later."
    ),
]


class LeaseRequest(Model):
    """Lease to take."""

    holder: str = Field(
        min_length=1,
        max_length=64,
        description="Name of the client, shown to other users. With access control, the token's name is used instead.",
    )
    uids: Covered = None
    ttl_s: float = Field(default=3.0, ge=0.2, le=60, description="Time to live from each renewal, s.")
    force: bool = Field(default=False, description="Take the lease from its current holder. Requires a reason.")
    reason: str = Field(default="", max_length=200, description="Reason, shown to users and written to the audit.")


class LeaseRenewal(Model):
    """Servos to add to a lease."""

    uids: list[ServoRef] = Field(
        default_factory=list[ServoRef], max_length=250, description="Servos to add to the lease, if they are free."
    )


class TakeOver(Model):
    """Request to the current holder for motion control."""

    holder: str = Field(
        min_length=1, max_length=64, description="Client that requests motion control, shown to the holder."
    )
    uids: Covered = None
    ttl_s: float = Field(default=2.0, ge=0.5, le=60, description="Time to live from each renewal, s.")
    reason: str = Field(default="", max_length=200, description="Reason, shown to users and written to the audit.")
    timeout_s: float = Field(
        default=10.0, ge=1, le=120, description="Time after which the lease passes unless refused, s."
    )


@routes.post("/leases", Role.OPERATE, "lease_held", "unknown_servo", "invalid_value", "busy", status_code=201)
async def take_lease(host: TheHost, body: LeaseRequest) -> Lease:
    """Take a lease: motion control of `uids`, or of all servos. A servo is covered by at most one lease, so several
    stations can share a bus. `lease_held` names the holder, and `uids` if their lease covers only some servos. Stop
    needs no lease and stops all servos.

    Renew it well within `ttl_s`: when it expires, torque goes off on the servos you command. `force` takes it from its
    current holder: their commands end and torque goes off first. `reason` is recorded in the audit.
    """
    if body.force:
        lease = await host.motion_control.force(signed(body.holder), body.ttl_s, body.reason, _covered(body.uids))
    else:
        lease = host.motion_control.take(signed(body.holder), body.ttl_s, _covered(body.uids))
    return present.lease(host, lease)


@routes.get("/leases", Role.VIEW)
async def list_leases(host: TheHost, page: Every) -> list[LeaseView]:
    """List the valid leases, oldest first. Empty if no client has motion control."""
    valid = [present.lease_view(host, lease) for lease in host.leases.valid(host.base.now())]
    return page.of(valid, lambda one: one.shown_id)


@routes.put("/leases/{lease_id}", Role.OPERATE, "unknown_lease", "lease_held", "unknown_servo", "invalid_value", "busy")
async def renew_lease(host: TheHost, lease_id: LeaseId, body: LeaseRenewal | None = None) -> Lease:
    """Renew a lease for `ttl_s` from now (heartbeat). The response contains any pending request for motion control.

    With a body, `uids` are added to the lease; what is commanded under it continues.
    """
    lease = host.motion_control.extend(lease_id, [] if body is None else list(map(Uid, body.uids)))
    return present.lease(host, lease)


@routes.delete("/leases/{lease_id}", Role.OPERATE, "unknown_lease")
async def release_lease(host: TheHost, lease_id: LeaseId) -> LeaseView:
    """Release a lease. Torque goes off on the servos commanded under it. A pending request is then granted."""
    lease = host.motion_control.release(lease_id, "released")
    shown = present.lease_view(host, lease)
    await host.torque_off.acknowledged(PASS_S)
    await host.motion_control.settle()
    return shown


@routes.post("/leases/requests", Role.OPERATE, "unknown_servo", "busy", "invalid_value", status_code=202)
async def request_lease(host: TheHost, body: TakeOver) -> TakeOverState:
    """Request motion control from its current holder. All clients see the request and its countdown.

    It is granted when the holder releases the lease or has not refused within `timeout_s`, after torque is off on the
    servos they commanded. Poll the request every few seconds, otherwise it is withdrawn. Store the `id`: only with it
    you receive the lease.
    """
    request = await host.motion_control.request(
        signed(body.holder), body.ttl_s, body.reason, body.timeout_s, _covered(body.uids)
    )
    return present.take_over(host, request)


@routes.get("/leases/requests/{request_id}", Role.VIEW, "unknown_lease")
async def get_lease_request(host: TheHost, request_id: RequestId) -> TakeOverState:
    """Get the state of a request, for the client that made it. Once granted, renew the lease within 5 s."""
    return present.take_over(host, host.motion_control.get_request(request_id))


@routes.delete("/leases/requests/{request_id}", Role.OPERATE, "unknown_lease")
async def withdraw_lease_request(host: TheHost, request_id: RequestId) -> TakeOverState:
    """Withdraw a request. A lease that is already granted stays valid."""
    return present.take_over(host, host.motion_control.withdraw(request_id))


@routes.post(
    "/leases/requests/{request_id}/refuse",
    Role.OPERATE,
    "unknown_lease",
    "lease_required",
    "lease_held",
    status_code=204,
)
async def refuse_lease_request(host: TheHost, request_id: RequestId, lease: LeaseHeader = None) -> None:
    """Refuse a request. Only the holder of the lease can. Use the request's ID as shown with the lease."""
    host.motion_control.refuse(request_id, lease)


def _covered(uids: list[str] | None) -> frozenset[Uid] | None:
    return None if uids is None else frozenset(map(Uid, uids))

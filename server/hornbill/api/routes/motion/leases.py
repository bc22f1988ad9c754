"""Routes of motion control: take it, renew it, give it back, ask for it, refuse that."""

from pydantic import Field

from hornbill.api import present
from hornbill.api.dependencies import LeaseHeader, LeaseId, RequestId, TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.domain.motion import Lease, LeaseView, TakeOverState
from hornbill.servo.motion.motion_control import PASS_S
from hornbill.servo.runtime.actor import signed

routes = Routes("motion")


class LeaseRequest(Model):
    """Ask to be the one writer."""

    holder: str = Field(
        min_length=1,
        max_length=64,
        description="Name of the client, shown to other users. With access control, the token's name replaces it.",
    )
    ttl_s: float = Field(default=3.0, ge=0.2, le=60, description="Time to live after each renewal, s.")
    force: bool = Field(default=False, description="Take the lease from its current holder. Requires a reason.")
    reason: str = Field(default="", max_length=200, description="Reason, shown to users and written to the audit.")


class TakeOver(Model):
    """Asking the holder for motion control."""

    holder: str = Field(
        min_length=1, max_length=64, description="Client that requests motion control, shown to the holder."
    )
    ttl_s: float = Field(default=2.0, ge=0.5, le=60, description="Time to live after each renewal, s.")
    reason: str = Field(default="", max_length=200, description="Reason, shown to users and written to the audit.")
    timeout_s: float = Field(
        default=10.0, ge=1, le=120, description="Time after which the lease passes unless refused, s."
    )


@routes.post("/leases", Role.OPERATE, "lease_held", "invalid_value", "busy", status_code=201)
async def take_lease(host: TheHost, body: LeaseRequest) -> Lease:
    """Become the one writer. Renew well before `ttl_s` is over: when it lapses, torque goes off on what you command.

    `force` takes it from whoever has it: their commands end and torque goes off first, and `reason` is kept.
    """
    if body.force:
        lease = await host.motion_control.force(signed(body.holder), body.ttl_s, body.reason)
    else:
        lease = host.motion_control.take(signed(body.holder), body.ttl_s)
    return present.lease(host, lease)


@routes.get("/leases", Role.VIEW)
async def list_leases(host: TheHost) -> list[LeaseView]:
    """Who has motion control now: nobody or one."""
    lease = host.leases.current(host.base.now())
    return [] if lease is None else [present.lease_view(host, lease)]


@routes.put("/leases/{lease_id}", Role.OPERATE, "unknown_lease")
async def renew_lease(host: TheHost, lease_id: LeaseId) -> Lease:
    """A sign of life: another `ttl_s` from now. The job_response also says who asks for motion control."""
    lease = host.leases.renew(lease_id, host.base.now())
    host.lease_changed()
    return present.lease(host, lease)


@routes.delete("/leases/{lease_id}", Role.OPERATE, "unknown_lease")
async def release_lease(host: TheHost, lease_id: LeaseId) -> LeaseView:
    """Give motion control back. Torque goes off on what was commanded under it; whoever asked for it gets it then."""
    lease = host.motion_control.release(lease_id, "released")
    shown = present.lease_view(host, lease)
    await host.torque_off.acknowledged(PASS_S)
    await host.motion_control.settle()
    return shown


@routes.post("/leases/requests", Role.OPERATE, "busy", "invalid_value", status_code=202)
async def request_lease(host: TheHost, body: TakeOver) -> TakeOverState:
    """Ask the holder for motion control. Everybody sees who asks, and a countdown.

    When the holder gives it back, or has not refused in `timeout_s`, it is yours, after torque is off on what they
    commanded. Look at least every few seconds, or you are believed gone. Keep the `id`: it is your way to the lease.
    """
    asked = await host.motion_control.request(signed(body.holder), body.ttl_s, body.reason, body.timeout_s)
    return present.take_over(host, asked)


@routes.get("/leases/requests/{request_id}", Role.VIEW, "unknown_lease")
async def get_lease_request(host: TheHost, request_id: RequestId) -> TakeOverState:
    """How it went, for whoever asked. Once granted, renew the lease within 5 s."""
    return present.take_over(host, host.motion_control.get_request(request_id))


@routes.delete("/leases/requests/{request_id}", Role.OPERATE, "unknown_lease")
async def withdraw_lease_request(host: TheHost, request_id: RequestId) -> TakeOverState:
    """Ask no more. A lease that was granted already stays granted."""
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
    """Keep motion control: the holder alone may. The id is the one that is shown with the lease."""
    host.motion_control.refuse(request_id, lease)

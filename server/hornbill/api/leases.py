"""Owns the routes of motion control: take it, renew it, give it back, ask for it, refuse that."""

from fastapi import APIRouter

from hornbill.api import PREFIX, models, motion_models, present
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.problems import declared
from hornbill.servo.acting import signed
from hornbill.servo.takeover import PASS_S

router = APIRouter(prefix=PREFIX, tags=["motion"])


@router.post(
    "/leases", operation_id="take_lease", status_code=201, responses=declared("lease_held", "invalid_value", "busy")
)
async def take_lease(host: TheHost, body: models.LeaseRequest) -> models.Lease:
    """Become the one writer. Renew well before `ttl_s` is over: when it lapses, torque goes off on what you command.

    `force` takes it from whoever has it: their commands end and torque goes off first, and `reason` is kept.
    """
    if body.force:
        lease = await host.takeovers.force(signed(body.holder), body.ttl_s, body.reason)
    else:
        lease = host.takeovers.take(signed(body.holder), body.ttl_s)
    return present.lease(host, lease)


@router.get("/leases", operation_id="list_leases")
async def list_leases(host: TheHost) -> list[models.LeaseView]:
    """Who has motion control now: nobody or one."""
    lease = host.leases.current(host.base.now())
    return [] if lease is None else [present.lease_view(host, lease)]


@router.put("/leases/{lease_id}", operation_id="renew_lease", responses=declared("unknown_lease"))
async def renew_lease(host: TheHost, lease_id: str) -> models.Lease:
    """A sign of life: another `ttl_s` from now. The answer also says who asks for motion control."""
    lease = host.leases.renew(lease_id, host.base.now())
    host.lease_changed()
    return present.lease(host, lease)


@router.delete("/leases/{lease_id}", operation_id="release_lease", responses=declared("unknown_lease"))
async def release_lease(host: TheHost, lease_id: str) -> models.LeaseView:
    """Give motion control back. Torque goes off on what was commanded under it; whoever asked for it gets it then."""
    lease = host.leases.release(lease_id, host.base.now())
    host.motion.lease_ended(lease, f"{lease.holder} gave motion control back.")
    shown = present.lease_view(host, lease)
    await host.motion.debts.paid(PASS_S)
    await host.takeovers.settle()
    return shown


@router.post(
    "/leases/requests", operation_id="ask_for_lease", status_code=202, responses=declared("busy", "invalid_value")
)
async def ask_for_lease(host: TheHost, body: motion_models.TakeOver) -> motion_models.TakeOverState:
    """Ask the holder for motion control. Everybody sees who asks, and a countdown.

    When the holder gives it back, or has not refused in `patience_s`, it is yours, after torque is off on what they
    commanded. Look at least every few seconds, or you are believed gone. Keep the `id`: it is your way to the lease.
    """
    asked = await host.takeovers.ask(signed(body.holder), body.ttl_s, body.reason, body.patience_s)
    return present.take_over(host, asked)


@router.get("/leases/requests/{request_id}", operation_id="get_lease_request", responses=declared("unknown_lease"))
async def get_lease_request(host: TheHost, request_id: str) -> motion_models.TakeOverState:
    """How it went, for whoever asked. Once granted, renew the lease within 5 s."""
    return present.take_over(host, host.takeovers.look(request_id))


@router.delete(
    "/leases/requests/{request_id}", operation_id="withdraw_lease_request", responses=declared("unknown_lease")
)
async def withdraw_lease_request(host: TheHost, request_id: str) -> motion_models.TakeOverState:
    """Ask no more. A lease that was granted already stays granted."""
    return present.take_over(host, host.takeovers.withdraw(request_id))


@router.post(
    "/leases/requests/{request_id}/refuse", operation_id="refuse_lease_request", status_code=204,
    responses=declared("unknown_lease", "lease_required", "lease_held"),
)  # fmt: skip
async def refuse_lease_request(host: TheHost, request_id: str, lease: LeaseHeader = None) -> None:
    """Keep motion control: the holder alone may. The id is the one that is shown with the lease."""
    host.takeovers.refuse(request_id, lease)

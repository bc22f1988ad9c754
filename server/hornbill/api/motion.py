"""Owns the routes that move servos or keep them from moving: command, torque, leases, stop."""

from typing import Annotated

from fastapi import APIRouter, Query

from hornbill.api import models, present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.problems import declared
from hornbill.errors import InvalidValue
from hornbill.servo.reading import reading
from hornbill.servo.settling import wait_settled

router = APIRouter(tags=["motion"])

MOTION_PROBLEMS = declared(
    "unknown_servo", "invalid_value", "out_of_range", "mode_off", "torque_off", "not_in_this_model", "busy", "stopped",
    "lease_required", "lease_held", "refused_by_servo", "no_answer", "bus_disconnected",
)  # fmt: skip
By = Annotated[str, Query(max_length=64, description="who does it, for the log and for everybody to see")]
STOP_WITHIN_S = 0.25
"""POST /stop answers when every servo has confirmed, or after this long; it goes on repeating all the same."""


@router.post("/servos/{uid}/command", operation_id="command_servo", responses=MOTION_PROBLEMS)
async def command_servo(
    host: TheHost, servo: TheServo, body: models.Command, lease: LeaseHeader = None
) -> models.Commanded:
    """Command an angle (degrees), a speed (rpm) or a torque (%), and keep it alive while the lease lives."""
    if body.wait == "settled" and body.type != "angle":
        raise InvalidValue(f'wait "settled" is about angles; a {body.type} command has no end. Use wait "sent".')
    host.connected()
    sent_at = host.base.utc_now()
    target = await host.motion.command(servo, lease, body.type, body.value, clamp=body.clamp)
    settled = None
    if body.wait == "settled":
        settled = await wait_settled(
            host.asker, servo, host.base, target.raw,
            band_deg=body.band_deg, dwell_s=body.dwell_s, timeout_s=body.timeout_s,
            still_allowed=lambda: host.motion.may_move(servo, lease),
        )  # fmt: skip
    return models.Commanded(
        sent_at=sent_at,
        settled=settled.settled if settled else None,
        settle_time_s=settled.time_s if settled else None,
        angle_deg=settled.angle_deg if settled else servo.angle_deg,
        clamped=target.clamped,
        value=target.raw / target.parameter.per_unit,
    )


@router.post("/servos/{uid}/torque", operation_id="set_torque", responses=MOTION_PROBLEMS)
async def set_torque(
    host: TheHost, servo: TheServo, body: models.TorqueMode, lease: LeaseHeader = None
) -> models.Reading:
    """Energise the motor where it stands (needs a lease), or take its output away (never does)."""
    host.connected()
    if body.mode == "on":
        await host.motion.torque_on(servo, lease)
    else:
        await host.motion.torque_away(servo, body.mode)
    return present.reading(reading(servo, "torque_mode", host.base))


@router.post("/leases", operation_id="take_lease", status_code=201, responses=declared("lease_held", "invalid_value"))
async def take_lease(host: TheHost, body: models.LeaseRequest) -> models.Lease:
    """Become the one writer. Renew well before `ttl_s` is over: when it lapses, torque goes off on what you command."""
    lease = host.leases.grant(body.holder, body.ttl_s, host.base.now())
    host.lease_changed()
    return present.lease(host, lease)


@router.get("/leases", operation_id="list_leases")
async def list_leases(host: TheHost) -> list[models.LeaseView]:
    """Who has motion control now: nobody or one."""
    lease = host.leases.current(host.base.now())
    return [] if lease is None else [present.lease_view(host, lease)]


@router.put("/leases/{lease_id}", operation_id="renew_lease", responses=declared("unknown_lease"))
async def renew_lease(host: TheHost, lease_id: str) -> models.Lease:
    """A sign of life: another `ttl_s` from now."""
    lease = host.leases.renew(lease_id, host.base.now())
    host.lease_changed()
    return present.lease(host, lease)


@router.delete("/leases/{lease_id}", operation_id="release_lease", responses=declared("unknown_lease"))
async def release_lease(host: TheHost, lease_id: str) -> models.LeaseView:
    """Give motion control back. Torque goes off on what was commanded under it."""
    lease = host.leases.release(lease_id, host.base.now())
    host.motion.lease_ended(lease, f"{lease.holder} gave motion control back.")
    await host.motion.debts.paid(STOP_WITHIN_S)
    return present.lease_view(host, lease)


@router.post("/stop", operation_id="stop", responses=declared("invalid_value"))
async def stop(host: TheHost, body: models.StopRequest | None = None, by: By = "REST") -> models.Stop:
    """Stop every servo now: needs no lease, waits for nothing, latches. Pressing again sends again."""
    wanted = body or models.StopRequest()
    host.stop.now(wanted.mode, by, wanted.reason)
    await host.stop.confirmed(STOP_WITHIN_S)
    return present.stop(host)


@router.get("/stop", operation_id="get_stop")
async def get_stop(host: TheHost) -> models.Stop:
    """The stop latch, and which servos have confirmed."""
    return present.stop(host)


@router.delete("/stop", operation_id="clear_stop")
async def clear_stop(host: TheHost, by: By = "REST") -> models.Stop:
    """Unlatch. Moves nothing and turns nothing on: torque stays off until it is turned on."""
    host.stop.clear(by)
    return present.stop(host)

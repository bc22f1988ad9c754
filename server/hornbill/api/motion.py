"""Owns the routes that move servos: command, burst and torque, and what there is to say before a command."""

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Query

from hornbill.api import PREFIX, models, motion_models, present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.problems import declared, together
from hornbill.errors import InvalidValue
from hornbill.servo import permission
from hornbill.servo.bursts import Wish
from hornbill.servo.jogging import Profile
from hornbill.servo.reading import reading
from hornbill.servo.settling import wait_settled

router = APIRouter(prefix=PREFIX, tags=["motion"])

MOTION_PROBLEMS = declared(
    "unknown_servo", "invalid_value", "out_of_range", "mode_off", "torque_off", "not_in_this_model", "busy", "stopped",
    "lease_required", "lease_held", "refused_by_servo", "no_answer", "bus_disconnected", "configuration_lost",
    "needs_confirmation",
)  # fmt: skip


@router.post("/servos/{uid}/command", operation_id="command_servo", responses=MOTION_PROBLEMS)
async def command_servo(
    host: TheHost, servo: TheServo, body: models.Command, lease: LeaseHeader = None
) -> models.Commanded:
    """Command an angle (degrees), a speed (rpm) or a torque (%), and keep it alive while the lease lives."""
    if body.wait == "settled" and body.type != "angle":
        raise InvalidValue(f'wait "settled" is about angles; a {body.type} command has no end. Use wait "sent".')
    if body.profile is not None and body.type != "angle":
        raise InvalidValue(f"A profile is for angles; a {body.type} command has no way to go. Leave it out.")
    host.connected()
    sent_at = host.base.utc_now()
    if body.hold is not None:
        target = await host.holds.run(
            servo, lease, body.type, body.value, body.hold.for_s, renew=body.hold.renew, confirm=body.confirm
        )
    elif body.profile is None:
        target = await host.motion.command(servo, lease, body.type, body.value, clamp=body.clamp, confirm=body.confirm)
    else:
        profile = Profile(body.profile.speed_deg_s, body.profile.accel_deg_s2)
        target, moving = await host.jogs.move(servo, lease, body.value, profile, clamp=body.clamp, confirm=body.confirm)
        if body.wait == "settled":
            await asyncio.wait([moving], timeout=body.timeout_s)
    settled = None
    if body.wait == "settled":
        settled = await wait_settled(
            host.asker, servo, host.base, target.raw,
            band_deg=body.band_deg, dwell_s=body.dwell_s, timeout_s=body.timeout_s,
            still_allowed=lambda: host.motion.still_holds(servo, lease, target),
        )  # fmt: skip
    return models.Commanded(
        sent_at=sent_at,
        settled=settled.settled if settled else None,
        settle_time_s=settled.time_s if settled else None,
        angle_deg=settled.angle_deg if settled else servo.angle_deg,
        clamped=target.clamped,
        value=target.raw / target.parameter.per_unit,
        samples=settled.samples if settled else None,
        max_deviation_deg=settled.max_deviation_deg if settled else None,
        warnings=list(target.warnings),
    )


@router.get(
    "/servos/{uid}/cautions", operation_id="get_cautions",
    responses=declared(
        "unknown_servo", "invalid_value", "out_of_range", "not_in_this_model", "no_answer", "refused_by_servo",
        "bus_disconnected",
    ),
)  # fmt: skip
async def get_cautions(
    host: TheHost,
    servo: TheServo,
    kind: Annotated[Literal["angle", "speed", "torque"], Query(alias="type")],
    value: Annotated[float, Query(description="degrees, rpm or %", allow_inf_nan=False)],
) -> list[models.Caution]:
    """What there would be to say before a command, and which words it would need. Reads, and moves nothing."""
    host.connected()
    permission.row_for(servo, kind)
    await host.motion.freshen(servo, kind)
    target = permission.target(servo, kind, value, clamp=False)
    return [models.Caution.model_validate(one) for one in host.motion.cautions(servo, kind, target.raw)]


@router.post(
    "/commands", operation_id="command_servos",
    responses=together(MOTION_PROBLEMS, declared("conflict", "position_unit_unconfirmed")),
)  # fmt: skip
async def command_servos(
    host: TheHost, body: motion_models.Burst, lease: LeaseHeader = None
) -> motion_models.BurstSent:
    """Command many servos at one instant, up to 15 in a message: all of them, or none and why.

    Nobody answers such a message, and it is never repeated; a servo that missed it is told by its keep-alive.
    """
    host.connected()
    wishes = [Wish(host.fleet.get(one.uid), one.type, one.value) for one in body.commands]
    prepared = await host.bursts.prepare(lease, wishes, clamp=body.clamp, confirm=body.confirm)
    sent_at = host.base.utc_now()
    sent = host.bursts.send(lease, prepared)
    return motion_models.BurstSent(
        sent_at=sent_at,
        messages=sent.messages,
        start_skew_s=round(sent.skew_s, 6),
        commands=[
            motion_models.BurstPart(uid=part.servo.uid, value=part.value, clamped=part.target.clamped)
            for part in prepared.parts
        ],
        warnings=prepared.warnings,
    )


@router.post("/servos/{uid}/torque", operation_id="set_torque", responses=MOTION_PROBLEMS)
async def set_torque(
    host: TheHost, servo: TheServo, body: models.TorqueMode, lease: LeaseHeader = None
) -> models.Reading:
    """Energise the motor where it stands (needs a lease), or take its output away (never does)."""
    host.connected()
    await host.changes.torque(servo, body.mode, lease)
    return present.reading(reading(servo, "torque_mode", host.base))

"""Routes that move servos: command, burst and torque; and cautions before a command."""

import asyncio
from typing import Annotated, Literal

from fastapi import Query
from pydantic import Field

from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model, MotionCode, MotionConfirms, UidField, Utc
from hornbill.domain.motion import Caution, MotionHold, MotionProfile
from hornbill.domain.servo import Reading
from hornbill.errors import InvalidValue
from hornbill.schema.effect import CommandKind
from hornbill.servo.device import permission
from hornbill.servo.device.output import MODES, ON
from hornbill.servo.device.reading import reading
from hornbill.servo.motion.bursts import Setpoint
from hornbill.servo.motion.settle import wait_settled
from hornbill.servo.motion.trapezoid import TrapezoidProfile

routes = Routes("motion")


class Command(Model):
    """Motion command for one servo."""

    type: CommandKind = Field(description="Type of the value: angle (°), speed (rpm) or torque (%).")
    value: float = Field(
        description="Angle (°), speed (rpm) or torque (%), rounded to the servo's step.", allow_inf_nan=False
    )
    wait: Literal["sent", "settled"] = Field(
        default="sent", description="Respond when the command is sent, or when the horn has settled."
    )
    timeout_s: float = Field(default=5.0, gt=0, le=120, description="Timeout for settling, s.")
    band_deg: float = Field(default=0.5, gt=0, le=30, description="Settling band around the target, °.")
    dwell_s: float = Field(
        default=0.2, ge=0, le=10, description="Time within the band before the move counts as settled, s."
    )
    clamp: bool = Field(default=False, description="Send the nearest valid value instead of refusing.")
    confirm: list[MotionCode] = Field(
        default_factory=list[MotionCode], description="Confirmation codes of earlier `needs_confirmation` problems."
    )
    profile: MotionProfile | None = Field(
        default=None, description="Speed and acceleration limits of the move, for angles only. Null: none."
    )
    hold: MotionHold | None = Field(
        default=None, description="Time limit for use with a held button, for speed and torque only. Null: none."
    )


class Commanded(Model):
    """Result of a command: when it was sent and, with `wait` settled, whether and when the horn settled."""

    sent_at: Utc
    settled: bool | None = Field(description="The horn settled at the target. Null if not waited for.")
    settle_time_s: float | None = Field(
        description="Time from sending to settling, s. Null if not waited for or never settled."
    )
    angle_deg: float | None = Field(description="Horn angle, °. Positive is clockwise.")
    clamped: bool = Field(description="A limit of the servo was sent instead of the requested value.")
    value: float = Field(description="Sent value, in steps of 0.1°, 1 rpm or 1 %.")
    samples: int | None = Field(
        default=None, description="Number of consecutive samples within the band at the end. Null if not waited for."
    )
    max_deviation_deg: float | None = Field(
        default=None, description="Greatest deviation of these samples from the target, °. Null if none."
    )
    in_band_s: float | None = Field(
        default=None, description="Time within the band at the end, s. Null if not waited for."
    )
    unmet: Literal["band", "dwell", "samples"] | None = Field(
        default=None,
        description=(
            "Condition not fulfilled when `settled` is false. band: the angle is outside the band; dwell: within it, "
            "but not for `dwell_s`; samples: the servo did not respond to angle reads. Null otherwise."
        ),
    )
    warnings: list[str] = Field(default_factory=list[str], description="Warnings, one sentence each.")


class TorqueMode(Model):
    """Torque mode to set (section 4.13: on 0, off 1, brake 2)."""

    mode: Literal["on", "off", "brake"] = Field(description="Torque mode (0x20).")


class BurstCommand(Model):
    """Command of one servo in a burst."""

    uid: ServoRef
    type: CommandKind = Field(description="Type of the value: angle (°), speed (rpm) or torque (%).")
    value: float = Field(allow_inf_nan=False, description="Angle (°), speed (rpm) or torque (%).")


class Burst(Model):
    """Commands sent together, in one ArrayCommand per 15 servos."""

    commands: list[BurstCommand] = Field(min_length=1, max_length=60, description="Commands, one per servo.")
    clamp: bool = Field(default=False, description="Send the nearest valid values instead of refusing.")
    confirm: MotionConfirms


class BurstPart(Model):
    """Command sent to one servo."""

    uid: UidField
    value: float = Field(description="Sent value as a 16-bit float: angle (°), speed (rpm) or torque (%).")
    clamped: bool = Field(description="A limit of the servo was sent instead of the requested value.")


class BurstSent(Model):
    """Result of a burst."""

    sent_at: Utc
    messages: int = Field(description="Number of ArrayCommand messages sent.")
    start_skew_s: float = Field(description="Time between its first and last message, s.")
    commands: list[BurstPart] = Field(description="Command sent to each servo.")
    warnings: list[str] = Field(description="Warnings, one sentence each.")


MOTION_PROBLEMS = (
    "unknown_servo", "invalid_value", "out_of_range", "mode_off", "torque_off", "not_in_this_model", "busy",
    "stopped", "lease_required", "lease_held", "commanded_elsewhere", "refused_by_servo", "no_response",
    "bus_disconnected", "configuration_lost", "needs_confirmation",
)  # fmt: skip


@routes.post("/servos/{uid}/command", Role.OPERATE, *MOTION_PROBLEMS)
async def command_servo(host: TheHost, servo: TheServo, body: Command, lease: LeaseHeader = None) -> Commanded:
    """Command an angle (°), speed (rpm) or torque (%). It is kept alive until the lease ends."""
    if body.wait == "settled" and body.type != "angle":
        raise InvalidValue(
            f'wait "settled" applies to angle commands only, not to {body.type} commands. Use wait "sent".',
            cause="settle_angle_only",
        )
    if body.profile is not None and body.type != "angle":
        raise InvalidValue(
            f"A profile applies to angle commands only, not to {body.type} commands. Remove it.",
            cause="profile_angle_only",
        )
    host.connected()
    sent_at = host.base.utc_now()
    if body.hold is not None:
        target = await host.holds.run(
            servo, lease, body.type, body.value, body.hold.for_s, renew=body.hold.renew, confirm=body.confirm
        )
    elif body.profile is None:
        target = await host.motion.command(servo, lease, body.type, body.value, clamp=body.clamp, confirm=body.confirm)
    else:
        profile = TrapezoidProfile(body.profile.speed_deg_s, body.profile.accel_deg_s2)
        target, moving = await host.jogs.move(servo, lease, body.value, profile, clamp=body.clamp, confirm=body.confirm)
        if body.wait == "settled":
            await asyncio.wait([moving], timeout=body.timeout_s)
    settled = None
    if body.wait == "settled":
        settled = await wait_settled(
            host.requests, servo, host.base, target.raw,
            band_deg=body.band_deg, dwell_s=body.dwell_s, timeout_s=body.timeout_s,
            still_allowed=lambda: host.motion.check_command(servo, lease, target),
        )  # fmt: skip
    return Commanded(
        sent_at=sent_at,
        settled=settled.settled if settled else None,
        settle_time_s=settled.time_s if settled else None,
        angle_deg=settled.angle_deg if settled else servo.angle_deg,
        clamped=target.clamped,
        value=target.raw / target.parameter.per_unit,
        samples=settled.samples if settled else None,
        max_deviation_deg=settled.max_deviation_deg if settled else None,
        in_band_s=settled.in_band_s if settled else None,
        unmet=settled.unmet if settled else None,
        warnings=list(target.warnings),
    )


@routes.get(
    "/servos/{uid}/cautions",
    Role.VIEW,
    "unknown_servo",
    "invalid_value",
    "out_of_range",
    "not_in_this_model",
    "no_response",
    "refused_by_servo",
    "bus_disconnected",
)
async def get_cautions(
    host: TheHost,
    servo: TheServo,
    kind: Annotated[CommandKind, Query(alias="type", description="Angle (°), speed (rpm) or torque (%).")],
    value: Annotated[float, Query(description="Value of the command, in °, rpm or %.", allow_inf_nan=False)],
) -> list[Caution]:
    """Get cautions for a command, and the confirmation codes it would require. Moves nothing."""
    host.connected()
    permission.check_kind(servo, kind)
    await host.motion.freshen(servo, kind)
    target = permission.target(servo, kind, value, clamp=False)
    return host.motion.cautions(servo, kind, target.raw)


@routes.post("/commands", Role.OPERATE, *MOTION_PROBLEMS, "conflict", "position_unit_unconfirmed")
async def command_servos(host: TheHost, body: Burst, lease: LeaseHeader = None) -> BurstSent:
    """Command several servos simultaneously, up to 15 per message, all or none.

    Servos do not acknowledge these messages, and they are not repeated. A servo that missed its message receives the
    command with the next keep-alive.
    """
    host.connected()
    setpoints = [Setpoint(host.fleet.get(one.uid), one.type, one.value) for one in body.commands]
    prepared = await host.bursts.prepare(lease, setpoints, clamp=body.clamp, confirm=body.confirm)
    sent_at = host.base.utc_now()
    sent = host.bursts.send(lease, prepared)
    return BurstSent(
        sent_at=sent_at,
        messages=sent.messages,
        start_skew_s=round(sent.skew_s, 6),
        commands=[
            BurstPart(uid=part.servo.uid, value=part.value, clamped=part.target.clamped) for part in prepared.parts
        ],
        warnings=prepared.warnings,
    )


@routes.post("/servos/{uid}/torque", Role.OPERATE, *MOTION_PROBLEMS)
async def set_torque(host: TheHost, servo: TheServo, body: TorqueMode, lease: LeaseHeader = None) -> Reading:
    """Set the torque mode. On requires a lease and holds the horn at its current angle; off and brake need no lease."""
    host.connected()
    await host.changes.torque(servo, ON if body.mode == "on" else MODES[body.mode], lease)
    return reading(servo, "torque_mode", host.base)

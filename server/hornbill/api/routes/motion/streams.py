"""Routes of streams: setpoints for several servos at a constant rate."""

from typing import Annotated

from pydantic import Field

from hornbill.api.addressing import Distinct, ServoRef
from hornbill.api.dependencies import LeaseHeader, StreamId, TheHost
from hornbill.api.paging import Every
from hornbill.api.routes.motion.motion import MOTION_PROBLEMS
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model, Param, Params
from hornbill.domain.motion import MotionProfile
from hornbill.domain.note import NoteCode
from hornbill.schema.effect import CommandKind
from hornbill.servo.motion.streams import SetpointStream
from hornbill.servo.motion.trapezoid import TrapezoidProfile

routes = Routes("motion")


class NewStream(Model):
    """Stream to start."""

    uids: list[ServoRef] = Field(min_length=1, max_length=60, description="Servos that are commanded together.")
    type: CommandKind = Field(default="angle", description="Type of the values: angle (°), speed (rpm) or torque (%).")
    rate_hz: float = Field(default=50.0, gt=0, le=200, description="Bursts per second.")


class StreamValues(Model):
    """New setpoints. Servos that are not listed keep theirs."""

    values: Annotated[dict[ServoRef, Annotated[float, Field(allow_inf_nan=False)]], Distinct] = Field(
        min_length=1, max_length=60, description="Setpoints by servo: angle (°), speed (rpm) or torque (%)."
    )
    profile: MotionProfile | None = Field(
        default=None,
        description="Speed and acceleration limits of the move. All servos arrive at the same time. Null: none.",
    )


class Stream(Model):
    """A stream and its timing."""

    id: str = Field(description="ID, as used in paths.")
    holder: str = Field(description="Client with motion control.")
    uids: list[str] = Field(description="Servos that are commanded together, unique IDs.")
    type: CommandKind = Field(description="Type of the values: angle (°), speed (rpm) or torque (%).")
    rate_hz: float = Field(description="Bursts per second.")
    bus_share: float = Field(description="Share of the bus, 0 to 1.")
    sent: int = Field(description="Number of bursts sent.")
    misses: int = Field(description="Number of slots without a burst in time.")
    worst_late_ms: float = Field(description="Greatest delay of a burst, ms.")
    worst_skew_ms: float = Field(description="Longest time between the first and last message of a burst, ms.")
    moving: bool = Field(description="A servo is still following its profile.")
    ended: str | None = Field(default=None, description="Reason why it ended. Null while it runs.")
    ended_code: NoteCode | None = Field(default=None, description="Code of `ended`. Null while it runs.")
    ended_params: Params = Field(default_factory=dict[str, Param])


STREAM_PROBLEMS = (*MOTION_PROBLEMS, "conflict", "position_unit_unconfirmed", "bus_budget")


@routes.post("/streams", Role.OPERATE, *STREAM_PROBLEMS, status_code=201)
async def start_stream(host: TheHost, body: NewStream, lease: LeaseHeader = None) -> Stream:
    """Start a stream of setpoints at `rate_hz`, one ArrayCommand per 15 servos. It first holds the current angles."""
    host.connected()
    servos = [host.fleet.get(uid) for uid in body.uids]
    return shown(await host.streams.begin(lease, servos, body.type, body.rate_hz))


@routes.get("/streams", Role.VIEW)
async def list_streams(host: TheHost, page: Every) -> list[Stream]:
    """List running and recently ended streams, oldest first."""
    return page.of([shown(one) for one in host.streams.all()], lambda one: one.id)


@routes.get("/streams/{stream_id}", Role.VIEW, "unknown_stream")
async def get_stream(host: TheHost, stream_id: StreamId) -> Stream:
    """Get a stream and its timing."""
    return shown(host.streams.get(stream_id))


@routes.put("/streams/{stream_id}", Role.OPERATE, *STREAM_PROBLEMS, "unknown_stream", "needs_confirmation")
async def set_stream_values(
    host: TheHost, stream_id: StreamId, body: StreamValues, lease: LeaseHeader = None
) -> Stream:
    """Set new setpoints, all or nothing, sent with the next burst. Same as a `stream` WebSocket message."""
    profile = None if body.profile is None else TrapezoidProfile(body.profile.speed_deg_s, body.profile.accel_deg_s2)
    return shown(host.streams.put(stream_id, lease, body.values, profile))


@routes.delete("/streams/{stream_id}", Role.OPERATE, "unknown_stream")
async def end_stream(host: TheHost, stream_id: StreamId) -> Stream:
    """End a stream. Servos keep their last setpoint until the lease ends. To turn torque off, use `POST /stop`."""
    return shown(await host.streams.end(stream_id))


def shown(one: SetpointStream) -> Stream:
    """Stream as a response."""
    ended = one.ended
    return Stream(
        id=one.id,
        holder=one.holder,
        uids=list(one.uids),
        type=one.kind,  # pyright: ignore[reportArgumentType]
        rate_hz=one.rate_hz,
        bus_share=round(one.share, 4),
        sent=one.sent,
        misses=one.misses,
        worst_late_ms=round(one.worst_late_s * 1000, 2),
        worst_skew_ms=round(one.worst_skew_s * 1000, 2),
        moving=bool(one.legs) and one.ended is None,
        ended=ended and ended.text,
        ended_code=ended and ended.code,
        ended_params=ended.params if ended else {},
    )

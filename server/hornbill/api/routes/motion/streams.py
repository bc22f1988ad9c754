"""Routes of streams: setpoints for many servos at a steady rate."""

from typing import Annotated

from pydantic import Field

from hornbill.api.dependencies import LeaseHeader, StreamId, TheHost
from hornbill.api.routes.motion.motion import MOTION_PROBLEMS
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model, UidField
from hornbill.domain.motion import MotionProfile
from hornbill.schema.effect import CommandKind
from hornbill.servo.motion.streams import SetpointStream
from hornbill.servo.motion.trapezoid import TrapezoidProfile

routes = Routes("motion")


class NewStream(Model):
    """A stream of angles (degrees), speeds (rpm) or torques (%) to servos that are commanded together."""

    uids: list[UidField] = Field(
        min_length=1, max_length=60, description="Servos that are commanded together, unique IDs."
    )
    type: CommandKind = Field(default="angle", description="Type of the values: angle (°), speed (rpm) or torque (%).")
    rate_hz: float = Field(default=50.0, gt=0, le=200, description="Bursts per second.")


class StreamValues(Model):
    """The newest values by uid; servos that are not named keep theirs."""

    values: dict[str, Annotated[float, Field(allow_inf_nan=False)]] = Field(
        min_length=1, max_length=60, description="Setpoints by unique ID: angle (°), speed (rpm) or torque (%)."
    )
    profile: MotionProfile | None = Field(
        default=None,
        description="Speed and acceleration of the move. All servos arrive together. Null: without limits.",
    )


class Stream(Model):
    """A stream and how well it keeps time."""

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
    ended_summary: str | None = Field(
        default=None, description="`ended` without requests for programs. Null while it runs."
    )


STREAM_PROBLEMS = (*MOTION_PROBLEMS, "conflict", "position_unit_unconfirmed", "bus_budget")


@routes.post("/streams", Role.OPERATE, *STREAM_PROBLEMS, status_code=201)
async def begin_stream(host: TheHost, body: NewStream, lease: LeaseHeader = None) -> Stream:
    """Hold the servos where they are, and go on at `rate_hz` from there: one ArrayCommand for up to 15 servos."""
    host.connected()
    servos = [host.fleet.get(uid) for uid in body.uids]
    return shown(await host.streams.begin(lease, servos, body.type, body.rate_hz))


@routes.get("/streams", Role.VIEW)
async def list_streams(host: TheHost) -> list[Stream]:
    """Streams that run and the last that ended, oldest first."""
    return [shown(one) for one in host.streams.all()]


@routes.get("/streams/{stream_id}", Role.VIEW, "unknown_stream")
async def get_stream(host: TheHost, stream_id: StreamId) -> Stream:
    """One stream, and how well it keeps time."""
    return shown(host.streams.get(stream_id))


@routes.put("/streams/{stream_id}", Role.OPERATE, *STREAM_PROBLEMS, "unknown_stream", "needs_confirmation")
async def put_stream_values(
    host: TheHost, stream_id: StreamId, body: StreamValues, lease: LeaseHeader = None
) -> Stream:
    """New values by uid, all or nothing; they leave with the next burst. So does a `stream` message of the socket."""
    profile = None if body.profile is None else TrapezoidProfile(body.profile.speed_deg_s, body.profile.accel_deg_s2)
    return shown(host.streams.put(stream_id, lease, body.values, profile))


@routes.delete("/streams/{stream_id}", Role.OPERATE, "unknown_stream")
async def end_stream(host: TheHost, stream_id: StreamId) -> Stream:
    """End it. The servos stay under their last value while the lease lives; POST /stop is what takes torque."""
    return shown(await host.streams.end(stream_id, "Ended by request."))


def shown(one: SetpointStream) -> Stream:
    """A stream as JSON has it."""
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
        ended=one.ended,
        ended_summary=one.ended_summary,
    )

"""Owns the routes of streams: setpoints for many servos at a steady rate."""

from hornbill.api import motion_models as models
from hornbill.api.dependencies import LeaseHeader, StreamId, TheHost
from hornbill.api.routes.motion.motion import MOTION_PROBLEMS
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.servo.motion.streams import SetpointStream
from hornbill.servo.motion.trapezoid import TrapezoidProfile

routes = Routes("motion")

STREAM_PROBLEMS = (*MOTION_PROBLEMS, "conflict", "position_unit_unconfirmed", "bus_budget")


@routes.post("/streams", Role.OPERATE, *STREAM_PROBLEMS, status_code=201)
async def begin_stream(host: TheHost, body: models.NewStream, lease: LeaseHeader = None) -> models.Stream:
    """Hold the servos where they are, and go on at `rate_hz` from there: one ArrayCommand for up to 15 servos."""
    host.connected()
    servos = [host.fleet.get(uid) for uid in body.uids]
    return shown(await host.streams.begin(lease, servos, body.type, body.rate_hz))


@routes.get("/streams", Role.VIEW)
async def list_streams(host: TheHost) -> list[models.Stream]:
    """Streams that run and the last that ended, oldest first."""
    return [shown(one) for one in host.streams.all()]


@routes.get("/streams/{stream_id}", Role.VIEW, "unknown_stream")
async def get_stream(host: TheHost, stream_id: StreamId) -> models.Stream:
    """One stream, and how well it keeps time."""
    return shown(host.streams.get(stream_id))


@routes.put("/streams/{stream_id}", Role.OPERATE, *STREAM_PROBLEMS, "unknown_stream", "needs_confirmation")
async def put_stream_values(
    host: TheHost, stream_id: StreamId, body: models.StreamValues, lease: LeaseHeader = None
) -> models.Stream:
    """New values by uid, all or nothing; they leave with the next burst. So does a `stream` message of the socket."""
    profile = None if body.profile is None else TrapezoidProfile(body.profile.speed_deg_s, body.profile.accel_deg_s2)
    return shown(host.streams.put(stream_id, lease, body.values, profile))


@routes.delete("/streams/{stream_id}", Role.OPERATE, "unknown_stream")
async def end_stream(host: TheHost, stream_id: StreamId) -> models.Stream:
    """End it. The servos stay under their last value while the lease lives; POST /stop is what takes torque."""
    return shown(await host.streams.end(stream_id, "Ended by request."))


def shown(one: SetpointStream) -> models.Stream:
    """A stream as JSON has it."""
    return models.Stream(
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

"""Owns the routes of streams: setpoints for many servos at a steady rate."""

from fastapi import APIRouter

from hornbill.api import PREFIX
from hornbill.api import motion_models as models
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.motion import MOTION_PROBLEMS
from hornbill.api.problems import declared, together
from hornbill.servo.jogging import Profile
from hornbill.servo.streams import Stream

router = APIRouter(prefix=PREFIX, tags=["motion"])

STREAM_PROBLEMS = together(MOTION_PROBLEMS, declared("conflict", "position_unit_unconfirmed", "bus_budget"))


@router.post("/streams", operation_id="begin_stream", status_code=201, responses=STREAM_PROBLEMS)
async def begin_stream(host: TheHost, body: models.NewStream, lease: LeaseHeader = None) -> models.Stream:
    """Hold the servos where they are, and go on at `rate_hz` from there: one ArrayCommand for up to 15 servos."""
    host.connected()
    servos = [host.fleet.get(uid) for uid in body.uids]
    return shown(await host.streams.begin(lease, servos, body.type, body.rate_hz))


@router.get("/streams", operation_id="list_streams")
async def list_streams(host: TheHost) -> list[models.Stream]:
    """Streams that run and the last that ended, oldest first."""
    return [shown(one) for one in host.streams.all()]


@router.get("/streams/{stream_id}", operation_id="get_stream", responses=declared("unknown_stream"))
async def get_stream(host: TheHost, stream_id: str) -> models.Stream:
    """One stream, and how well it keeps time."""
    return shown(host.streams.get(stream_id))


@router.put(
    "/streams/{stream_id}",
    operation_id="put_stream_values",
    responses=together(STREAM_PROBLEMS, declared("unknown_stream", "needs_confirmation")),
)
async def put_stream_values(
    host: TheHost, stream_id: str, body: models.StreamValues, lease: LeaseHeader = None
) -> models.Stream:
    """New values by uid, all or nothing; they leave with the next burst. So does a `stream` message of the socket."""
    profile = None if body.profile is None else Profile(body.profile.speed_deg_s, body.profile.accel_deg_s2)
    return shown(host.streams.put(stream_id, lease, body.values, profile))


@router.delete("/streams/{stream_id}", operation_id="end_stream", responses=declared("unknown_stream"))
async def end_stream(host: TheHost, stream_id: str) -> models.Stream:
    """End it. The servos stay under their last value while the lease lives; POST /stop is what takes torque."""
    return shown(await host.streams.end(stream_id, "Ended by request."))


def shown(one: Stream) -> models.Stream:
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
    )

"""Routes of telemetry: subscriptions, and samples as a file."""

import re
from typing import Annotated, Final, Literal

from fastapi import Query
from pydantic import Field
from starlette.responses import StreamingResponse
from typing_extensions import TypeAliasType

from hornbill.api import telemetry_files
from hornbill.api.dependencies import TheHost, TheServo
from hornbill.api.downloads import CSV, attachment
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.by_key import ByKey, ParameterKey
from hornbill.domain.fields import Model
from hornbill.domain.servo import TelemetryGrant
from hornbill.errors import InvalidValue
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.monitoring.sample_ring import SampleColumns

routes = Routes("telemetry")


class TelemetryRequest(Model):
    """Telemetry subscription: rows to poll, and their rate."""

    channels: list[ParameterKey] = Field(description="Keys of readable parameters. Empty to end the subscription.")
    rate_hz: float = Field(gt=0, le=200, description="Samples per second.")
    ttl_s: float | None = Field(
        default=None, gt=0, le=86_400, description="Time until the subscription expires, s. Null: until replaced."
    )
    owner: str = Field(
        default="rest",
        min_length=1,
        max_length=64,
        description="Owner of the subscription. Each owner has one per servo.",
    )


class TelemetryMark(Model):
    """Mark in the samples of a channel."""

    t: float = Field(description="Time on the server's clock, s.")
    kind: Literal["wrap", "inactive", "gap", "restart"] = Field(
        description="wrap: the angle wrapped at ±180°; inactive: no value (dummy value); gap: samples are missing; "
        "restart: the servo restarted."
    )


class TelemetryChannel(Model):
    """Rates of one channel."""

    granted_hz: float | None = Field(description="Granted rate of the subscriptions, Hz. Null without a subscription.")
    background_hz: float | None = Field(description="Rate of background polling, Hz. Null if not polled.")
    measured_hz: float = Field(description="Samples per second over the last 5 s, including broadcasts.")
    age_s: float | None = Field(description="Age of the last sample, s. Null if there is none.")
    marks: list[TelemetryMark] = Field(description="Newest 1000 marks.")


TelemetryChannelByKey = TypeAliasType("TelemetryChannelByKey", Annotated[dict[str, TelemetryChannel], ByKey()])


class Telemetry(Model):
    """Telemetry of a servo."""

    subscriptions: list[TelemetryGrant] = Field(description="Subscriptions and their granted rates.")
    channels: TelemetryChannelByKey = Field(description="Channels by parameter key.")
    budget: float = Field(description="Share of the bus available to polling, 0 to 1.")


SUBSCRIPTION_PROBLEMS = ("unknown_servo", "unknown_parameter", "not_in_this_model", "invalid_value")
FILE_PROBLEMS = ("unknown_servo", "unknown_parameter", "invalid_value")

PARQUET: Final = "application/vnd.apache.parquet"

Seconds = Annotated[float, Query(gt=0, le=7200, description="Time span up to now, s.")]
Channels = Annotated[
    str | None, Query(max_length=2000, description="Keys, separated by commas. Default: all channels.")
]


@routes.put("/servos/{uid}/telemetry", Role.OPERATE, *SUBSCRIPTION_PROBLEMS)
async def set_telemetry(host: TheHost, servo: TheServo, body: TelemetryRequest) -> TelemetryGrant:
    """Set the telemetry subscription of one owner. The response contains the rate that the bus budget allows.

    Each `owner` has one subscription per servo; every row is polled at the highest requested rate. With `ttl_s` the
    subscription expires unless renewed. Servos of unknown models cannot be polled: the granted rate is 0, and `note`
    gives the reason.
    """
    return host.polling.subscribe(servo, body.channels, body.rate_hz, owner=body.owner, ttl_s=body.ttl_s)


@routes.get("/servos/{uid}/telemetry", Role.VIEW, "unknown_servo")
async def get_telemetry(host: TheHost, servo: TheServo) -> Telemetry:
    """Get the subscriptions of a servo, and the granted and measured rates of its channels."""
    granted, background = host.polling.rates(servo), host.polling.background(servo)
    since = host.base.now() - host.telemetry.retention_s
    shown: dict[str, TelemetryChannel] = {}
    for key in dict.fromkeys((*granted, *background, *host.telemetry.channels(servo.uid))):
        hz, age_s = host.telemetry.measured(servo.uid, key)
        shown[key] = TelemetryChannel(
            granted_hz=_rounded(granted.get(key)),
            background_hz=_rounded(background.get(key)),
            measured_hz=round(hz, 2),
            age_s=None if age_s is None else round(age_s, 3),
            marks=[TelemetryMark(t=t, kind=kind) for t, kind in host.telemetry.marks(servo.uid, key, since)],
        )
    subscriptions = host.polling.grants(servo)
    return Telemetry(subscriptions=subscriptions, channels=shown, budget=host.polling.budget)


@routes.get(
    "/servos/{uid}/telemetry.csv",
    Role.VIEW,
    *FILE_PROBLEMS,
    operation_id="export_telemetry_csv",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/csv": {}}}},
)
async def export_csv(
    host: TheHost, servo: TheServo, seconds: Seconds = 600.0, channels: Channels = None
) -> StreamingResponse:
    """Download recent samples as CSV: one line per sample time, one column per channel. A cell is empty if the channel
    has no sample at that time, did not respond or was inactive. Nothing is interpolated.
    """
    content = telemetry_files.csv(_window(host, servo, seconds, channels), host.base)
    return StreamingResponse(content, media_type=CSV, headers=_named(servo, "csv"))


@routes.get(
    "/servos/{uid}/telemetry.parquet",
    Role.VIEW,
    *FILE_PROBLEMS,
    "not_available",
    operation_id="export_telemetry_parquet",
    response_class=StreamingResponse,
    responses={200: {"content": {PARQUET: {}}}},
)
async def export_parquet(
    host: TheHost, servo: TheServo, seconds: Seconds = 600.0, channels: Channels = None
) -> StreamingResponse:
    """Download recent samples as Parquet: rows of `channel`, `t` and `value` (null for gap or inactive), sorted by
    channel. The metadata contains `utc_offset`.
    """
    telemetry_files.need_parquet()
    content = telemetry_files.parquet(_window(host, servo, seconds, channels), host.base.utc_offset)
    return StreamingResponse(content, media_type=PARQUET, headers=_named(servo, "parquet"))


def _window(host: Host, servo: Servo, seconds: float, channels: str | None) -> dict[str, SampleColumns]:
    """Samples up to now; those received during the download are not included."""
    since = host.base.now() - seconds
    known = list(host.telemetry.channels(servo.uid))
    keys = known if channels is None else [key.strip() for key in channels.split(",") if key.strip()]
    for key in keys:
        row = servo.catalog.parameter(key)
        if row.kind != "number" and key not in known:
            raise InvalidValue(
                f"{key} is not numeric, so it cannot be a channel.", key=key, cause="channel_not_numeric"
            )
    return {key: host.telemetry.columns(servo.uid, key, since) for key in dict.fromkeys(keys)}


def _named(servo: Servo, ending: str) -> dict[str, str]:
    name = re.sub(r"[^A-Za-z0-9_.-]+", "-", servo.title).strip("-") or servo.uid[:8]
    return attachment(f"telemetry-{name}.{ending}")


def _rounded(hz: float | None) -> float | None:
    return None if hz is None else round(hz, 2)

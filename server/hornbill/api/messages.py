"""Owns the WebSocket's messages in both directions, as discriminated unions."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from hornbill.api.bus_models import Bus, DecodedTransfer, RawFrame
from hornbill.api.models import Job, LeaseView, MotionConfirm, MotionHold, MotionProfile, Reading, Servo, Short, Stop

Topic = Literal["servos", "telemetry", "events", "jobs", "bus", "frames"]


class Message(BaseModel):
    """Base of every message."""

    model_config = ConfigDict(extra="forbid")


class FrameFilter(Message):
    """Which frames and transfers topic `frames` carries; what is not told is not filtered.

    `view` raw: frames as they were; decoded: whole transfers, and frames nothing could be made of.
    """

    view: Literal["raw", "decoded"] = "decoded"
    node_id: int | None = Field(default=None, ge=0, le=127, description="source or destination; 0 is anonymous")
    type: str | None = Field(default=None, max_length=80, description="part of the DSDL name, upper or lower case")
    kind: Literal["message", "request", "response"] | None = None
    text: str | None = Field(
        default=None, max_length=100, description="part of the summary, the identifier or the data"
    )
    problems_only: bool = False


class Subscribe(Message):
    """Start receiving topics, of all servos or of some. `frames` replaces the filter of topic `frames`."""

    type: Literal["subscribe"]
    topics: list[Topic]
    uids: list[str] | None = None
    frames: FrameFilter | None = None


class Unsubscribe(Message):
    """Stop receiving topics."""

    type: Literal["unsubscribe"]
    topics: list[Topic]


class Heartbeat(Message):
    """Renews a lease. A lease once renewed over a socket ends when that socket closes."""

    type: Literal["heartbeat"]
    lease: str


class SocketCommand(Message):
    """One motion command of a `command` message."""

    uid: str
    type: Literal["angle", "speed", "torque"]
    value: float = Field(allow_inf_nan=False)
    confirm: list[MotionConfirm] = Field(default_factory=list[MotionConfirm])
    profile: MotionProfile | None = None
    hold: MotionHold | None = None

    @property
    def brakes(self) -> bool:
        """Whether it is a way to stop: 0 rpm and 0 % brake (4.2, 4.3)."""
        return self.type != "angle" and self.value == 0


class CommandMessage(Message):
    """Motion commands; the newest command of a servo wins when they come faster than the bus."""

    type: Literal["command"]
    lease: str
    commands: list[SocketCommand] = Field(min_length=1, max_length=60)


class StopMessage(Message):
    """Stop everything now; needs no lease."""

    type: Literal["stop"]
    mode: Literal["off", "brake"] = "off"
    by: Short = "page"
    reason: Short = ""


class StreamMessage(Message):
    """New values of a stream by uid, all or nothing; they leave with the next burst."""

    type: Literal["stream"]
    lease: str
    id: str
    values: dict[str, Annotated[float, Field(allow_inf_nan=False)]] = Field(min_length=1, max_length=60)
    profile: MotionProfile | None = None


ClientMessage = Annotated[
    Subscribe | Unsubscribe | Heartbeat | CommandMessage | StreamMessage | StopMessage, Field(discriminator="type")
]


class ServerMessageBase(Message):
    """Every server message carries its place in the stream of this socket."""

    seq: int


class Hello(ServerMessageBase):
    """First message: who serves, which tables, and how `t` of telemetry relates to UTC."""

    type: Literal["hello"]
    version: str
    schema_revision: str
    utc_offset: float = Field(description="add to a telemetry time for seconds since 1970 UTC")
    now: float = Field(description="the clock of telemetry times when this was sent")
    demo: bool


class ServosMessage(ServerMessageBase):
    """Changed servos, whole."""

    type: Literal["servos"]
    servos: list[Servo]


class Column(Message):
    """Samples of one channel: times on the server's monotonic clock, values (null is a gap)."""

    t: list[float]
    v: list[float | None]


class TelemetryMessage(ServerMessageBase):
    """New samples of one servo."""

    type: Literal["telemetry"]
    uid: str
    channels: dict[str, Column]
    dropped: int = 0


class ParameterMessage(ServerMessageBase):
    """A reading changed."""

    type: Literal["parameter"]
    uid: str
    reading: Reading


class EventMessage(ServerMessageBase):
    """Something happened, in one plain sentence."""

    type: Literal["event"]
    at: float
    level: Literal["info", "notice", "warning", "failure"]
    uid: str | None
    code: str
    text: str


class JobMessage(ServerMessageBase):
    """A job moved on."""

    type: Literal["job"]
    job: Job


class BusMessage(ServerMessageBase):
    """The bus, about once a second."""

    type: Literal["bus"]
    bus: Bus


class FramesMessage(ServerMessageBase):
    """What was on the bus since the last one. Counts are since the subscription.

    `received` frames, or transfers in the decoded view, of which `shown` passed the filter and were sent, and
    `dropped` passed it but were too many for this socket.
    """

    type: Literal["frames"]
    received: int
    shown: int
    dropped: int
    frames: list[RawFrame]
    transfers: list[DecodedTransfer]


class LeaseMessage(ServerMessageBase):
    """Who holds motion control now; null when nobody does."""

    type: Literal["lease"]
    lease: LeaseView | None


class StopStateMessage(ServerMessageBase):
    """The stop latch changed, or another servo confirmed."""

    type: Literal["stop"]
    stop: Stop


class DroppedMessage(ServerMessageBase):
    """Of an event stream only: so many messages, of all topics and servos, are gone for good; null where not known.

    `telemetry`: samples are; else what follows is how everything stands now.
    """

    type: Literal["dropped"]
    count: int | None
    telemetry: bool


class ErrorMessage(ServerMessageBase):
    """A client message could not be done; the same code and sentence REST would give."""

    type: Literal["error"]
    code: str
    detail: str
    uid: str | None = None


ServerMessage = Annotated[
    Hello
    | ServosMessage
    | TelemetryMessage
    | ParameterMessage
    | EventMessage
    | JobMessage
    | BusMessage
    | FramesMessage
    | LeaseMessage
    | StopStateMessage
    | ErrorMessage,
    Field(discriminator="type"),
]

"""WebSocket messages in both directions, as discriminated unions."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field
from typing_extensions import TypeAliasType

from hornbill.api.addressing import Distinct, ServoName, ServoRef
from hornbill.domain.bus import Bus, DecodedTransfer, RawFrame, TransferKind
from hornbill.domain.by_key import ByKey
from hornbill.domain.event import EventCode
from hornbill.domain.fields import STRICT, MotionConfirms, Param, Params, Short, UidText, Utc
from hornbill.domain.job import Job
from hornbill.domain.motion import LeaseView, MotionHold, MotionProfile, Stop, StopMode
from hornbill.domain.servo import Reading, Servo
from hornbill.schema.effect import CommandKind

Topic = TypeAliasType("Topic", Literal["servos", "telemetry", "events", "jobs", "bus", "frames"])


class Message(BaseModel):
    """Base of every message."""

    model_config = STRICT


class FrameFilter(Message):
    """Filter of topic `frames`. Frames and transfers must match all given fields."""

    view: Literal["raw", "decoded"] = Field(
        default="decoded", description="Raw frames, or decoded transfers and the frames that match no transfer."
    )
    node_id: int | None = Field(
        default=None, ge=0, le=127, description="Source or destination node ID. 0 for anonymous. Null for all."
    )
    type: str | None = Field(
        default=None, max_length=80, description="Part of the DSDL name, case-insensitive. Null for all."
    )
    kind: TransferKind | None = Field(default=None, description="Kind of transfer. Null for all.")
    text: str | None = Field(
        default=None, max_length=100, description="Part of the summary, identifier or data. Null for all."
    )
    problems_only: bool = Field(default=False, description="Only frames that match no transfer.")


class Subscribe(Message):
    """Subscribe to topics, for all servos or some. `frames` replaces the filter of topic `frames`."""

    type: Literal["subscribe"]
    topics: list[Topic] = Field(description="Topics to subscribe to.")
    uids: list[ServoName] | None = Field(
        default=None,
        description="Servos to limit all topics to (unique ID, serial number or label). Null removes the limit; omit "
        "to keep it.",
    )
    frames: FrameFilter | None = Field(default=None, description="Filter of topic `frames`.")


class Unsubscribe(Message):
    """Unsubscribe from topics."""

    type: Literal["unsubscribe"]
    topics: list[Topic] = Field(description="Topics to unsubscribe from.")


class Heartbeat(Message):
    """Renew a lease. A lease that was renewed over a socket ends when that socket closes."""

    type: Literal["heartbeat"]
    lease: str = Field(description="ID of the lease.")


class SocketCommand(Message):
    """One motion command of a `command` message."""

    uid: ServoRef
    type: CommandKind = Field(description="Type of the value: angle (°), speed (rpm) or torque (%).")
    value: float = Field(allow_inf_nan=False, description="Angle (°), speed (rpm) or torque (%).")
    confirm: MotionConfirms
    profile: MotionProfile | None = Field(
        default=None, description="Speed and acceleration limits of the move. Null: none."
    )
    hold: MotionHold | None = Field(
        default=None, description="Time limit of a speed or torque command. Null: the servo's own timeout applies."
    )

    @property
    def brakes(self) -> bool:
        """Whether the command brakes: 0 rpm and 0 % do (4.2, 4.3)."""
        return self.type != "angle" and self.value == 0

    @property
    def renews(self) -> bool:
        """Whether the command only extends a running hold."""
        return self.hold is not None and self.hold.renew


class CommandMessage(Message):
    """Motion commands. If they arrive faster than the bus can carry them, the newest of each servo is sent."""

    type: Literal["command"]
    lease: str = Field(description="ID of the lease.")
    commands: list[SocketCommand] = Field(min_length=1, max_length=60, description="Commands, one per servo.")


class StopMessage(Message):
    """Stop all servos immediately. Needs no lease."""

    type: Literal["stop"]
    mode: StopMode = Field(default="off", description="Torque off or brake.")
    by: Short = Field(default="page", description="Client that stops, shown to other users.")
    reason: Short = Field(
        default="", description="Reason, shown to users and written to the audit. At most 200 characters are stored."
    )


class StreamMessage(Message):
    """New setpoints of a stream, all or nothing; sent with the next burst."""

    type: Literal["stream"]
    lease: str = Field(description="ID of the lease.")
    id: str = Field(description="ID of the stream.")
    values: Annotated[dict[ServoRef, Annotated[float, Field(allow_inf_nan=False)]], Distinct] = Field(
        min_length=1, max_length=60, description="Setpoints by servo: angle (°), speed (rpm) or torque (%)."
    )
    profile: MotionProfile | None = Field(
        default=None, description="Speed and acceleration limits of the move. Null: none."
    )


ClientMessage = Annotated[
    Subscribe | Unsubscribe | Heartbeat | CommandMessage | StreamMessage | StopMessage, Field(discriminator="type")
]


class ServerMessageBase(Message):
    """Base of server messages."""

    seq: int = Field(description="Sequence number on this connection. A gap means lost messages.")


class Hello(ServerMessageBase):
    """First message: version, tables, and the relation of telemetry time to UTC."""

    type: Literal["hello"]
    version: str = Field(description="Version of hornbill.")
    schema_revision: str = Field(description="Revision of the parameter tables.")
    utc_offset: float = Field(description="Offset from telemetry time to seconds since 1970 UTC, s.")
    now: float = Field(description="Telemetry time when this message was sent, s.")
    demo: bool = Field(description="Simulated servos on an embedded bus.")
    stale_after_s: dict[str, float] = Field(
        description="Age at which a value is stale, s: `angle` of a servo, and rows by group (command, status, "
        "faults). Rows of other groups do not become stale while the servo is online."
    )


class ServosMessage(ServerMessageBase):
    """Changed servos, each complete."""

    type: Literal["servos"]
    servos: list[Servo] = Field(description="Changed servos.")


class Column(Message):
    """Samples of one channel."""

    t: list[float] = Field(description="Times on the server's clock, s.")
    v: list[float | None] = Field(description="Values. Null is a gap.")


ColumnByKey = TypeAliasType("ColumnByKey", Annotated[dict[str, Column], ByKey()])


class TelemetryMessage(ServerMessageBase):
    """New samples of one servo."""

    type: Literal["telemetry"]
    uid: UidText
    channels: ColumnByKey = Field(description="Samples by parameter key.")
    dropped: int = Field(default=0, description="Samples lost because the client was too slow.")


class ParameterMessage(ServerMessageBase):
    """A reading changed."""

    type: Literal["parameter"]
    uid: UidText
    reading: Reading


class EventMessage(ServerMessageBase):
    """An entry of the event log."""

    type: Literal["event"]
    at: Utc
    level: Literal["info", "notice", "warning", "failure"] = Field(description="Severity.")
    uid: str | None = Field(description="Unique ID of the servo, 32 hex digits. Null if it concerns none.")
    code: EventCode = Field(description="Code for programs. Stable.")
    text: str = Field(description="One sentence for users.")
    params: dict[str, Any] = Field(
        default_factory=dict[str, Any], description="Values in the text, by name. Empty for events without values."
    )


class JobMessage(ServerMessageBase):
    """Progress of a job."""

    type: Literal["job"]
    job: Job


class BusMessage(ServerMessageBase):
    """State of the bus, about once per second."""

    type: Literal["bus"]
    bus: Bus


class FramesMessage(ServerMessageBase):
    """Bus traffic since the previous message. Counts start with the subscription."""

    type: Literal["frames"]
    received: int = Field(description="Frames or transfers received since the subscription.")
    shown: int = Field(description="Frames or transfers sent to this socket since the subscription.")
    dropped: int = Field(description="Frames or transfers that matched but exceeded this socket's rate.")
    frames: list[RawFrame] = Field(description="Frames of the raw view, and frames that match no transfer.")
    transfers: list[DecodedTransfer] = Field(description="Decoded transfers. Empty in the raw view.")


class LeaseMessage(ServerMessageBase):
    """Motion control changed. A servo is covered by at most one lease."""

    type: Literal["lease"]
    lease: LeaseView | None = Field(description="The oldest of `leases`. Null if no client has motion control.")
    leases: list[LeaseView] = Field(description="All leases, oldest first. Empty if no client has motion control.")


class StopStateMessage(ServerMessageBase):
    """Change of the stop latch, or confirmation by another servo."""

    type: Literal["stop"]
    stop: Stop


class DroppedMessage(ServerMessageBase):
    """Lost messages, of all topics and servos. Event streams only."""

    type: Literal["dropped"]
    count: int | None = Field(description="Number of lost messages. Null if unknown.")
    telemetry: bool = Field(description="Samples were lost. If false, the current state follows.")


class ErrorMessage(ServerMessageBase):
    """Failure of a client message, with the code and text of the REST API."""

    type: Literal["error"]
    code: str = Field(description="Code for programs. Stable.")
    detail: str = Field(description="What happened and what to do, with the request that resolves it, if there is one.")
    summary: str = Field(description="`detail` without the request.")
    params: Params = Field(default_factory=dict[str, Param])
    uid: str | None = Field(
        default=None, description="Unique ID of the servo, 32 hex digits. Null if it concerns none."
    )


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

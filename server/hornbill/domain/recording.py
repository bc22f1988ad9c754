"""Contents of a recording: time, triggers, servos, bus, telemetry and writes."""

from typing import Annotated, Final, Literal, NamedTuple, TypeAlias

from pydantic import BaseModel, ConfigDict, Field
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Param, Params, UidText, Utc

MarkReason = TypeAliasType("MarkReason", Literal["failure", "stop", "lost", "bus_lost", "manual"])
Word: TypeAlias = Annotated[str, Field(max_length=120)]
Sentence: TypeAlias = Annotated[str, Field(max_length=2000)]
Uid32: TypeAlias = Annotated[str, Field(pattern="^[0-9a-f]{32}$")]
Int64: TypeAlias = Annotated[int, Field(ge=-(2**63), lt=2**63)]

MARKS_MOST: Final = 1000
"""Triggers of one recording."""


class _Form(BaseModel):
    """Ignores fields of a newer hornbill. Refuses NaN and infinity."""

    model_config = ConfigDict(
        frozen=True,
        extra="ignore",
        allow_inf_nan=False,
        json_schema_serialization_defaults_required=True,
        defer_build=True,
    )


class Mark(_Form):
    """A trigger of the recording. `at`: seconds since 1970 UTC."""

    at: Utc
    reason: MarkReason = Field(description="Type of trigger.")
    text: Sentence = Field(description="One sentence for users.")
    uid: Uid32 | None = Field(
        default=None, description="Unique ID of the servo, 32 hex digits. Null if it concerns none."
    )
    params: Params = Field(default_factory=dict[str, Param])


class RecordedBus(_Form):
    """The connected bus: address, bit rate, own node ID."""

    address: Annotated[str, Field(max_length=1000)] = Field(description="INTERFACE:CHANNEL, as `PUT /bus` takes it.")
    bitrate: Annotated[int, Field(gt=0, le=10_000_000)] = Field(description="Bit rate, bit/s.")
    node_id: Annotated[int, Field(ge=1, le=127)] = Field(description="Node ID, 1 to 127.")


class RecordedReading(_Form):
    """One register as last read before the first trigger. `at`: seconds since 1970 UTC."""

    raw: Int64 = Field(description="Integer on the wire.")
    value: bool | int | float | Word | None = Field(description="Engineering value or choice key.")
    unit: Word = Field(description="Unit of the value. Empty if none.")
    at: float | None = Field(description="Time of the read, seconds since 1970 UTC. Null if unknown.")


class RecordedCommander(_Form):
    """Another node that commanded a servo at the first trigger."""

    node_id: Annotated[int, Field(ge=1, le=127)] = Field(description="Node ID of the sender, 1 to 127.")
    command_deg: float | None = Field(description="Last commanded angle, °. Null for speed, torque and unknown types.")
    rate_hz: float | None = Field(description="Rate of its commands, Hz. Null after a single command.")


class RecordedServo(_Form):
    """One servo as known at the first trigger."""

    uid: Uid32 = Field(description="Unique ID of the servo, 32 hex digits.")
    node_id: Annotated[int, Field(ge=1, le=127)] | None = Field(description="Node ID, 1 to 127. Null if none.")
    name: Word = Field(description="Node name from GetNodeInfo.")
    label: Word = Field(description="Nickname. Empty if none.")
    title: Word = Field(description="Display name.")
    model_number: Int64 | None = Field(description="Model number as read from the servo.")
    hardware_version: Int64 | None = Field(description="Hardware version from GetNodeInfo. Null if unknown.")
    firmware: Int64 | None = Field(description="Firmware version as read from 0x52, raw. Null if unknown.")
    serial_number: Int64 | None = Field(description="Product number as read from the servo. Null if unknown.")
    production_date: Word | None = Field(description="Production date as the servo reports it. Null if unknown.")
    state: Word = Field(description="Operating state.")
    commanded_by: Annotated[list[RecordedCommander], Field(max_length=127)] = Field(
        default=[], description="Other nodes that commanded it at the first trigger."
    )
    readings: Annotated[dict[Word, RecordedReading], Field(max_length=200)] = Field(
        description="Last known values in RAM, by key."
    )
    rom: Annotated[dict[Word, Int64], Field(max_length=200)] = Field(
        default={}, description="Last known values in ROM, by key."
    )


class About(_Form):
    """Description of a recording. Times: seconds since 1970 UTC. `utc_offset`: conversion from the writer's clock."""

    format: Literal[1] = Field(description="Format version of the recording.")
    version: Word = Field(description="Version of hornbill.")
    reason: MarkReason = Field(description="Type of trigger.")
    text: Sentence = Field(description="One sentence for users.")
    marks: Annotated[list[Mark], Field(min_length=1, max_length=MARKS_MOST)] = Field(
        description="Triggers of the recording."
    )
    started_at: Utc
    ended_at: Utc
    utc_offset: float = Field(description="Offset from the writer's clock to seconds since 1970 UTC, s.")
    bus: RecordedBus | None = Field(description="Bus that was connected. Null if none was.")
    servos: Annotated[list[RecordedServo], Field(max_length=500)] = Field(description="One entry per servo.")
    schema_revision: Word = Field(description="Revision of the parameter tables.")
    frames: Annotated[int, Field(ge=0)] = Field(description="Number of CAN frames.")
    incomplete: Annotated[list[Word], Field(max_length=10)] = Field(
        default=[], description="Members that were truncated at their size limit."
    )


class Columns(BaseModel):
    """Samples of one channel. `t`: seconds since 1970 UTC. `v`: in its unit, null for a gap."""

    uid: UidText
    channel: str = Field(description="Parameter key.")
    t: list[float] = Field(description="Times, seconds since 1970 UTC.")
    v: list[float | None] = Field(description="Values. Null is a gap.")


class RecordedWrite(NamedTuple):
    """A write: a parameter, an opcode, a restart, or an entry of an ArrayCommand.

    `time`: seconds since 1970 UTC. `node_id`: None for all nodes. `uid`: "" if unknown. `name` and `raw`: as sent.
    `key` and `value`: according to the tables.
    """

    time: float
    node_id: int | None
    uid: str
    kind: Literal["parameter", "opcode", "restart", "array_command"]
    key: str = ""
    name: str | int = ""
    raw: object = ""
    value: object = ""

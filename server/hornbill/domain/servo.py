"""One servo: state, parameters and faults as last read, and telemetry rates."""

import dataclasses
from typing import Annotated, ClassVar, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.bus import HealthCode
from hornbill.domain.fields import STRICT, Model, Param, Params, UidField
from hornbill.domain.note import NoteCode
from hornbill.schema.effect import Why
from hornbill.schema.fault import FaultLevel
from hornbill.schema.scale import Value


@dataclasses.dataclass(frozen=True, slots=True)
class Reading:
    """One parameter as last read from RAM, with its ROM value and this model's limits.

    Not validated, for speed: sockets send many.
    """

    __pydantic_config__: ClassVar[ConfigDict] = {
        **STRICT,
        "json_schema_extra": {
            "description": "One parameter as last read from RAM, with its ROM value and this model's limits."
        },
    }

    key: Annotated[str, Field(description="Parameter key.")]
    address: Annotated[int, Field(description="Register address.")]
    value: Annotated[
        Value, Field(description="Engineering value or choice key. Null for the dummy value and if never read.")
    ]
    raw: Annotated[int | None, Field(description="Integer on the wire. Null if never read.")]
    unit: Annotated[str, Field(description="Unit of the value. Empty if none.")]
    at: Annotated[float | None, Field(description="Time of the read, seconds since 1970 UTC. Null if never read.")]
    age_s: Annotated[float | None, Field(description="Time since it was read, s. Null if never read.")]
    rom: Annotated[Value, Field(description="Value known to be in ROM. Null if unknown.")]
    configured: Annotated[
        Value,
        Field(
            description="Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, "
            "the value written as configuration, otherwise `rom`."
        ),
    ]
    default: Annotated[Value, Field(description="Default of this model. Null if none or unknown.")]
    minimum: Annotated[float | None, Field(description="Minimum of this model. Null if none or unknown.")]
    maximum: Annotated[float | None, Field(description="Maximum of this model. Null if none or unknown.")]
    in_effect: Annotated[bool | None, Field(description="false: the row has no effect now. Null if unknown.")]
    why_not: Annotated[str | None, Field(description="Reason why it has no effect now. Null if it has.")]
    why: Annotated[Why | None, Field(description="`why_not` by code. Null while it has an effect.")]
    stale: Annotated[
        bool, Field(description="The reading is too old or the servo is offline, so the servo may have another value.")
    ]
    differs_from_default: Annotated[
        bool | None,
        Field(description="`configured` differs from the default. Null if either is unknown or there is none."),
    ] = None
    unsaved: Annotated[
        bool | None, Field(description="`configured` differs from ROM. Null if either is unknown or ROM lacks the row.")
    ] = None


@dataclass(frozen=True, slots=True, config=STRICT)
class Fault:
    """One fault bit of one servo, present or past (section 4.12)."""

    level: FaultLevel = Field(description="Severity.")
    group: str = Field(description="Group within its table.")
    bit: int = Field(description="Bit number in its register, from 0.")
    key: str = Field(description="Key of the bit.")
    label: str = Field(description="Display name.")
    advice: str = Field(description="What to do about it.")
    active: bool = Field(description="Set in the last reading, which is fresh.")
    stale: bool = Field(description="Set in the last reading, which is too old to know the present state.")
    latched: bool = Field(description="Active, and stays set until the servo restarts, regardless of its cause.")
    past_event: bool = Field(description="Describes something before the servo's last start.")
    first_seen: float = Field(description="First time it was read as set, seconds since 1970 UTC.")
    last_seen: float = Field(description="Last time it was read as set, seconds since 1970 UTC, to within one poll.")
    count: int = Field(description="Number of times it was set.")
    acknowledged_at: float | None = Field(
        default=None, description="Time of acknowledgement, seconds since 1970 UTC. Null if not acknowledged."
    )
    acknowledged_by: str | None = Field(
        default=None, description="Client that acknowledged it. Null if not acknowledged."
    )


@dataclass(frozen=True, slots=True, kw_only=True, config=STRICT)
class TelemetryGrant:
    """Rate of one subscription within the bus budget."""

    owner: str = Field(default="rest", description="Owner of the subscription.")
    channels: list[str] = Field(description="Parameter keys.")
    requested_hz: float = Field(description="Requested rate, Hz.")
    granted_hz: float = Field(description="Rate within the bus budget, Hz.")
    bus_share: float = Field(description="Share of the bus, 0 to 1.")
    expires_in_s: float | None = Field(default=None, description="Time until it expires, s. Null if it does not.")
    note: str | None = Field(default=None, description="Reason why nothing is polled now. Null if polled.")
    note_code: NoteCode | None = Field(default=None, description="Code of the note. Null if polled.")
    note_params: Params = Field(default_factory=dict[str, Param])


PositionUnit = TypeAliasType("PositionUnit", Literal["hundred_degrees", "radian", "degree", "tenth_degree"])
"""Unit of positions in Status and ArrayCommand (tables 2-21 and 2-22)."""


class PositionUnitState(Model):
    """Unit of a servo's positions in broadcasts, and how it is known."""

    unit: PositionUnit = Field(description="Unit of positions in broadcasts.")
    state: Literal["assumed", "confirmed", "forced", "conflict"] = Field(
        description=(
            "assumed: Futaba's unit, not checked yet; confirmed: Status and 0x08 agree on it; conflict: they agree on "
            "another unit, on none or on several, and ArrayCommand angles are refused; forced: set by a client."
        )
    )
    evidence: str = Field(description="Evidence, one sentence for users.")
    evidence_code: NoteCode = Field(description="Code of `evidence`.")
    evidence_params: Params = Field(default_factory=dict[str, Param])


class FaultWords(Model):
    """The fault registers 0x19, 0x1A and 0x1B as last read (section 4.12)."""

    notification: int | None = Field(description="Notification register, raw. Null if never read.")
    warning: int | None = Field(description="Warning register, raw. Null if never read.")
    failure: int | None = Field(description="Failure register, raw. Null if never read.")


class Output(Model):
    """Output of a servo's motor, and its reason. Session state: switching it does not edit parameter 0x20."""

    state: Literal["on", "off", "brake", "unknown"] = Field(
        description="Output of the motor. unknown: offline, or not read since the start."
    )
    reason: Literal["configured", "stop", "lease", "command", "timeout", "protection"] = Field(
        description=(
            "configured: since the start of the servo, or 0x20 was written as configuration; stop: Stop; lease: a "
            "lease ended or expired; command: a client or another tool switched it; timeout: the servo's own timeout "
            "(0x26, 0x27); protection: temperature or voltage limit, or motor failure."
        )
    )
    by: str | None = Field(description="Client that switched it. Null if none or unknown.")
    since: float | None = Field(description="Time of the switch, seconds since 1970 UTC. Null if unknown.")


class Activity(Model):
    """Present activity of a servo's motor and horn, derived from Status and polled rows.

    At rest: the angle command has not changed for 0.6 s.
    """

    state: Literal[
        "holding",
        "moving",
        "turning",
        "hunting",
        "saturated",
        "soft_start",
        "released",
        "held_after_timeout",
        "off",
        "brake",
        "unknown",
    ] = Field(
        description=(
            "holding: output on, angle steady within 0.3° for 0.6 s; moving: output on, angle changing; turning: speed "
            "or torque command other than 0; hunting: at rest, and the angle has oscillated by 0.5° or more for at "
            "least 1 s; saturated: at rest, angle steady, and torque at 90 % or more of the available torque; "
            "soft_start: moving to 0° after a start; released: switched off by the servo's own timeout (0x26 off, "
            "0x27); held_after_timeout: holds its last command after the timeout (0x26 hold); off: output off for "
            "another reason, see `output`; brake: output off, weak brake; unknown: offline, being identified, saved or "
            "restarted, output unknown, or no angle for 1 s."
        )
    )
    since: float = Field(description="Start of this state, seconds since 1970 UTC.")
    peak_to_peak_deg: float | None = Field(
        description="Peak-to-peak angle, °: of the oscillation while hunting, otherwise of the last 0.6 "
        "s. Null if unknown."
    )
    oscillation_hz: float | None = Field(
        description="Frequency of the oscillation while hunting, Hz. Null until measured."
    )
    torque_pct: float | None = Field(description="Torque as last read from 0x0A, %. Null if never read.")
    torque_limit_pct: float = Field(
        description="Available torque at rest in that direction, %: the lowest of the torque limit (with 0x25 on), the "
        "overcurrent limit relative to its default, and the supply voltage relative to nominal."
    )


class Commander(Model):
    """Another node that commands a servo by ArrayCommand: a command within the last second."""

    node_id: int = Field(description="Node ID of the sender, 1 to 127.")
    name: str | None = Field(description="Its name from GetNodeInfo. Null if unknown.")
    type: Literal["unitless", "position", "force", "speed", "pwm", "unknown"] = Field(
        description="Command type of ArrayCommand (table 2-21)."
    )
    value: float | None = Field(description="Last command value, in the unit of its type. Null if not finite.")
    command_deg: float | None = Field(description="Last commanded angle, °. Null for speed, torque and unknown types.")
    error_deg: float | None = Field(
        description="Tracking error: `command_deg` minus the last angle, °. Null if either is unknown."
    )
    rate_hz: float | None = Field(description="Rate over the last 100 commands, Hz. Null after a single command.")
    since: float = Field(description="Start of its commands, seconds since 1970 UTC.")
    age_s: float = Field(description="Time since its last command, s.")


class LostValue(Model):
    """A RAM value that was lost in a restart without a save."""

    key: str = Field(description="Parameter key.")
    value: Value = Field(description="Engineering value or choice key, as PATCH takes it.")
    at: float = Field(description="Time the loss was found, seconds since 1970 UTC.")


class TreatedAs(Model):
    """Known model and firmware assumed for a servo that the tables do not contain."""

    model: str | None = Field(description="Model to assume. Null if the model is known.")
    firmware: str | None = Field(description="Firmware to assume. Null if the firmware is known.")


class Servo(Model):
    """One servo, identified by its unique ID."""

    uid: UidField
    node_id: int | None = Field(description="Current node ID, 1 to 127. Null while it has none.")
    servo_id: int | None = Field(description="Servo ID (0x45). ArrayCommand cannot address 0. Null if unknown.")
    label: str = Field(description="Nickname, stored by the server.")
    name: str = Field(description="Node name from GetNodeInfo.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    model_number: int | None = Field(description="Model number (0x50), which determines the series. Null if unknown.")
    series: str | None = Field(description="BLA15, BLA21 or BLA34. Null if unknown.")
    pwm: bool | None = Field(description="The servo has a PWM input. Null if unknown.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    hardware_version: int | None = Field(description="Hardware version from GetNodeInfo. Null if unknown.")
    serial: str | None = Field(description="Serial number: model number, dash, product number. Null if unknown.")
    production_date: str | None = Field(
        description="Production date, YYYY-MM-DDTHH:MM, time zone unknown. Null if unknown."
    )
    known_model: bool = Field(description="The tables contain its series. Servos of other series are read-only.")
    treated_as: TreatedAs
    firmware_note: str | None = Field(description="Note for users of this firmware, in English. Null if none.")
    online: bool = Field(description="Received recently.")
    state: Literal["identifying", "ready", "soft_start", "saving", "restarting", "updating", "protected", "offline"] = (
        Field(description="Operating state.")
    )
    health: HealthCode | None = Field(description="Health from NodeStatus. Null if unknown.")
    mode: str | None = Field(description="Mode from NodeStatus. Null if unknown.")
    uptime_s: int | None = Field(description="Time since its start, s. Null if unknown.")
    angle_deg: float | None = Field(description="Horn angle, °. Positive is clockwise. Null if unknown.")
    command_deg: float | None = Field(description="Last known angle command, °. Null while inactive.")
    age_s: float | None = Field(description="Age of `angle_deg`, s. Null if never received.")
    position_unit: PositionUnitState
    output: Output
    activity: Activity
    commanded_by: list[Commander] = Field(
        default_factory=list[Commander], description="Other nodes that command it now. hornbill then does not."
    )
    unsaved: list[str] = Field(
        description="Keys of rows configured differently from ROM. Switching the output does not count."
    )
    drift: list[str] = Field(
        default_factory=list[str],
        description="Keys of rows that another tool changed in ROM. Details: `GET …/drift`.",
    )
    lost: list[LostValue] = Field(
        default_factory=list[LostValue],
        description="RAM values lost in a restart. A value is removed once it is in RAM again; all are removed by a "
        "successful save or `DELETE …/lost`.",
    )
    owed: list[str] = Field(
        default_factory=list[str],
        description="Keys of rows with a temporary value in RAM that could not be restored yet. hornbill restores them "
        "as soon as the servo responds, and refuses its motion, changes and saves until then.",
    )
    faults: FaultWords
    unacknowledged: int = Field(
        default=0, description="Number of warnings and failures not acknowledged since they last occurred."
    )
    bus: str | None = Field(description="Address of the bus. Null while offline.")

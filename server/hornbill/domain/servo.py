"""One servo's parameters, faults and measurements as last read."""

import dataclasses
from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from hornbill.domain.fields import STRICT
from hornbill.schema.effect import Why
from hornbill.schema.fault import Level
from hornbill.schema.scale import Value


@dataclasses.dataclass(frozen=True, slots=True)
class Reading:
    """One parameter as last read from RAM, with its ROM value and this model's limits.

    Not validated, because sockets send many.
    """

    __pydantic_config__ = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "description": "One parameter as last read from RAM, with its ROM value and this model's limits."
        },
    )

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
    stale: Annotated[bool, Field(description="Too old, or the servo is offline: the servo may hold another value.")]
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

    level: Level = Field(description="Severity.")
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


@dataclass(frozen=True, slots=True, config=STRICT)
class StepMetrics:
    """Metrics of one step; all times ± `sample_s`. Null if the step never got that far.

    `hunting_hz` is also measured at the end of a step that never settles because the horn oscillates. It is null with
    fewer than 100 samples per second.
    """

    sample_s: float = Field(description="Longest time between two samples, which is the resolution of all times, s.")
    delay_s: float | None = Field(description="Time until the horn starts to move, s.")
    rise_s: float | None = Field(description="Time from 10 % to 90 % of the step, s.")
    crossing_s: float | None = Field(description="Time until the target is first reached, s.")
    peak_deg: float | None = Field(description="Farthest angle, °.")
    overshoot_pct: float | None = Field(description="Overshoot, % of the step.")
    settling_s: float | None = Field(description="Settling time: until the angle stays within the band, s.")
    steady_state_error_deg: float | None = Field(description="Deviation from the target after settling, °.")
    peak_speed_rpm: float | None = Field(description="Greatest speed, rpm.")
    hunting: Literal["none", "slight", "hunting"] = Field(description="Oscillation after settling.")
    hunting_rms_deg: float | None = Field(description="Oscillation amplitude, RMS, °.")
    hunting_hz: float | None = Field(description="Oscillation frequency after settling, Hz.")

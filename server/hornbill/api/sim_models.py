"""Owns the JSON shapes of the simulator: what a bench could do to a real servo."""

from typing import Annotated, Any, Literal

from pydantic import Field

from hornbill.api.models import Model, UidField

PositionUnit = Literal["hundred_degrees", "radian", "degree", "tenth_degree"]
Percent = Annotated[float, Field(ge=0, le=100)]


class SimServo(Model):
    """One simulated servo and everything the bench does to it."""

    uid: UidField
    model: str
    firmware: str
    serial: int
    story: str = Field(description="why it is on the bench, in one sentence; empty for a plain servo")
    power: Literal["off", "on"]
    stage: Literal["off", "starting", "running", "saving"]
    starts: int = Field(description="how often it came up")
    node_id: int | None = Field(description="null while it has none")
    servo_id: int
    angle_deg: float = Field(description="where the horn stands, clockwise from its notch, every turn counted")
    speed_rpm: float
    output: Literal["on", "off", "brake"] = Field(description="what the motor gets, after time-out and protection")
    soft_starting: bool
    temperature_c: float = Field(description="surroundings")
    voltage_v: float = Field(description="supply without load")
    load_pct: float = Field(description="torque on the horn in % of stall torque, + pushes clockwise")
    load_inertia: float = Field(description="inertia on the horn as a multiple of the servo's own")
    pwm_us: float | None = Field(description="pulse width at the PWM input; null without a signal")
    sensor_error: float = Field(description="-1..1 of the ±5 °C and ±0.5 V of the sensors")
    faults: list[str] = Field(description="keys of the bits that are set")
    mute: bool
    drop_responses_pct: float
    answer_delay_s: float
    restart_delay_s: float
    software_update: bool
    refuse_keys: list[str]
    position_unit: PositionUnit
    behaviour: dict[str, bool | str] = Field(description="the choices where the document is silent")


class NewSimServo(Model):
    """A servo to put on the bench; what is not told is a new servo's."""

    model: str = Field(examples=["BLA21-06U-A0"])
    firmware: str = Field(default="1.300", examples=["1.300"])
    node_id: Annotated[int, Field(ge=0, le=127)] = Field(default=0, description="0: it asks for one")
    servo_id: Annotated[int, Field(ge=0, le=254)] = Field(default=0, description="0: as delivered")
    angle_deg: Annotated[float, Field(ge=-180, lt=180)] = 0.0
    uid: UidField | None = None
    rom: dict[str, int] = Field(default_factory=dict[str, int], description="what else was saved, by key, raw")


class SimChange(Model):
    """What the bench shall do to a servo; what is not told stays. All or nothing."""

    temperature_c: Annotated[float, Field(ge=-60, le=150)] | None = None
    voltage_v: Annotated[float, Field(ge=0, le=60)] | None = None
    load_pct: Annotated[float, Field(ge=-200, le=200)] | None = None
    load_inertia: Annotated[float, Field(ge=0, le=100)] | None = None
    external_angle_deg: Annotated[float, Field(ge=-36_000_000, le=36_000_000)] | None = Field(
        default=None, description="turn the horn by hand until 0x08 reads this; it needs a motor without output"
    )
    pwm_us: Annotated[float, Field(ge=0, le=65_535)] | None = Field(default=None, description="null takes it away")
    sensor_error: Annotated[float, Field(ge=-1, le=1)] | None = None
    faults: dict[str, bool] | None = Field(
        default=None, description="bits to set or to take back, by key; those that tell of a restart bring one"
    )
    mute: bool | None = None
    drop_responses_pct: Percent | None = None
    answer_delay_s: Annotated[float, Field(ge=0, le=10)] | None = None
    restart_delay_s: Annotated[float, Field(ge=0, le=60)] | None = None
    software_update: bool | None = None
    refuse_keys: list[str] | None = Field(default=None, description="parameters GetSet says no to from now on")
    position_unit: PositionUnit | None = None
    behaviour: dict[str, Any] | None = Field(default=None, description="switches to set, by name")
    power: Literal["off", "on"] | None = None

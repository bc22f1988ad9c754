"""Owns the JSON shapes of the simulator: what a bench could do to a real servo."""

from typing import Annotated, Any, Literal

from pydantic import Field

from hornbill.domain.fields import Model, UidField

PositionUnit = Literal["hundred_degrees", "radian", "degree", "tenth_degree"]
Percent = Annotated[float, Field(ge=0, le=100)]


class SimServo(Model):
    """One simulated servo and everything the bench does to it."""

    uid: UidField
    model: str = Field(description="Model, such as `BLA21-06U-A0`.")
    firmware: str = Field(description="Firmware version, such as `1.300`.")
    serial: int = Field(description="Product number.")
    story: str = Field(description="Purpose in the simulation, one sentence. Empty for a plain servo.")
    power: Literal["off", "on"] = Field(description="Supply.")
    stage: Literal["off", "starting", "running", "saving"] = Field(description="Operating state.")
    starts: int = Field(description="Number of starts.")
    node_id: int | None = Field(description="Node ID. Null while it has none.")
    servo_id: int = Field(description="Servo ID (0x45).")
    angle_deg: float = Field(description="Horn angle from its notch with all turns counted, °. Positive is clockwise.")
    speed_rpm: float = Field(description="Speed of the horn, rpm. Positive is clockwise.")
    output: Literal["on", "off", "brake"] = Field(description="Motor output after timeout and protection.")
    soft_starting: bool = Field(description="Soft start: moves slowly to its first target.")
    temperature_c: float = Field(description="Ambient temperature, °C.")
    voltage_v: float = Field(description="Supply voltage without load, V.")
    load_pct: float = Field(description="Torque on the horn, % of stall torque. Positive pushes clockwise.")
    load_inertia: float = Field(description="Inertia on the horn, as a multiple of the servo's own inertia.")
    pwm_us: float | None = Field(description="Pulse width at the PWM input, µs. Null without a signal.")
    sensor_error: float = Field(description="-1..1 of the ±5 °C and ±0.5 V of the sensors")
    faults: list[str] = Field(description="Keys of the fault bits that are set.")
    mute: bool = Field(description="No responses and no broadcasts.")
    drop_responses_pct: float = Field(description="Share of responses that are lost, %.")
    answer_delay_s: float = Field(description="Delay of every response, s.")
    restart_delay_s: float = Field(description="Time a restart takes, s.")
    software_update: bool = Field(description="Reports a software update in progress.")
    refuse_keys: list[str] = Field(description="Keys of rows the servo refuses to write.")
    position_unit: PositionUnit = Field(description="Unit of position 1.0 in its broadcasts.")
    behaviour: dict[str, bool | str] = Field(description="Choices where the specification is silent, by name.")


class NewSimServo(Model):
    """A servo to put on the bench; what is not told is a new servo's."""

    model: str = Field(examples=["BLA21-06U-A0"], description="Model, such as `BLA21-06U-A0`.")
    firmware: str = Field(default="1.300", examples=["1.300"], description="Firmware version, such as `1.300`.")
    node_id: Annotated[int, Field(ge=0, le=127)] = Field(default=0, description="0: it asks for one")
    servo_id: Annotated[int, Field(ge=0, le=254)] = Field(default=0, description="0: as delivered")
    angle_deg: Annotated[float, Field(ge=-180, lt=180)] = Field(default=0.0, description="Initial horn angle, °.")
    uid: UidField | None = Field(default=None, description="Unique ID. Null for a generated one.")
    rom: dict[str, int] = Field(default_factory=dict[str, int], description="Other values in ROM, by key, raw.")
    reads: dict[str, int] = Field(
        default_factory=dict[str, int],
        description="Values that model_number, firmware_version or hardware_version read instead, to "
        "simulate an unknown servo.",
    )
    any_firmware: bool = Field(default=False, description="Allow a firmware that this model never had, for tests.")


class SimChange(Model):
    """What the bench shall do to a servo; what is not told stays. All or nothing."""

    temperature_c: Annotated[float, Field(ge=-60, le=150)] | None = Field(
        default=None, description="Ambient temperature, °C."
    )
    voltage_v: Annotated[float, Field(ge=0, le=60)] | None = Field(default=None, description="Supply voltage, V.")
    load_pct: Annotated[float, Field(ge=-200, le=200)] | None = Field(
        default=None, description="Constant torque on the horn, % of stall torque. Positive pushes clockwise."
    )
    load_inertia: Annotated[float, Field(ge=0, le=100)] | None = Field(
        default=None, description="Inertia on the horn, as a multiple of the servo's own inertia at the horn."
    )
    external_angle_deg: Annotated[float, Field(ge=-36_000_000, le=36_000_000)] | None = Field(
        default=None,
        description="Turn the horn manually until 0x08 reads this angle, °. Requires a motor without output.",
    )
    pwm_us: Annotated[float, Field(ge=0, le=65_535)] | None = Field(
        default=None, description="Pulse width at the PWM input, µs. Null removes the signal."
    )
    sensor_error: Annotated[float, Field(ge=-1, le=1)] | None = Field(
        default=None, description="Error of the temperature and supply sensors, -1 to 1 of ±5 °C and ±0.5 V."
    )
    faults: dict[str, bool] | None = Field(
        default=None, description="Fault bits to set or clear, by key. Bits that report a restart cause one."
    )
    mute: bool | None = Field(default=None, description="No responses and no broadcasts.")
    drop_responses_pct: Percent | None = Field(default=None, description="Share of responses that are lost, %.")
    answer_delay_s: Annotated[float, Field(ge=0, le=10)] | None = Field(
        default=None, description="Delay of every response, s."
    )
    restart_delay_s: Annotated[float, Field(ge=0, le=60)] | None = Field(
        default=None, description="Time a restart takes, s."
    )
    software_update: bool | None = Field(default=None, description="Reports a software update in progress.")
    refuse_keys: list[str] | None = Field(
        default=None, description="Keys of parameters whose writes the servo refuses."
    )
    position_unit: PositionUnit | None = Field(default=None, description="Unit of position 1.0 in its broadcasts.")
    behaviour: dict[str, Any] | None = Field(default=None, description="Choices to make, by name.")
    power: Literal["off", "on"] | None = Field(default=None, description="Supply.")

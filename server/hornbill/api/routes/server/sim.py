"""Routes of the simulator."""

from dataclasses import asdict, replace
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from fastapi import Depends, Path, Request
from pydantic import Field
from typing_extensions import TypeAliasType

from hornbill.api import PREFIX
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model, UidField
from hornbill.domain.servo import PositionUnit
from hornbill.errors import Busy, InvalidValue, Unknown
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import to_text
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.units import Uid

Percent = Annotated[float, Field(ge=0, le=100)]


SimPower = TypeAliasType("SimPower", Literal["off", "on"])


class SimServo(Model):
    """A simulated servo and its conditions."""

    uid: UidField
    model: str = Field(description="Model, such as `BLA21-06U-A0`.")
    firmware: str = Field(description="Firmware version, such as `1.300`.")
    serial: int = Field(description="Product number.")
    story: str = Field(description="Purpose in the simulation, one sentence. Empty for a plain servo.")
    power: SimPower = Field(description="Supply.")
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
    sensor_error: float = Field(description="Error of the temperature and supply sensors, -1 to 1 of ±5 °C and ±0.5 V.")
    faults: list[str] = Field(description="Keys of the fault bits that are set.")
    mute: bool = Field(description="No responses and no broadcasts.")
    drop_responses_pct: float = Field(description="Share of responses that are lost, %.")
    response_delay_s: float = Field(description="Delay of every response, s.")
    restart_delay_s: float = Field(description="Time a restart takes, s.")
    software_update: bool = Field(description="Reports a software update in progress.")
    refuse_keys: list[str] = Field(description="Keys of rows the servo refuses to write.")
    position_unit: PositionUnit = Field(description="Unit of position 1.0 in its broadcasts.")
    behaviour: dict[str, bool | str] = Field(description="Choices where the specification is silent, by name.")


class NewSimServo(Model):
    """A simulated servo to add. Omitted fields are those of a new servo."""

    model: str = Field(examples=["BLA21-06U-A0"], description="Model, such as `BLA21-06U-A0`.")
    firmware: str = Field(default="1.300", examples=["1.300"], description="Firmware version, such as `1.300`.")
    node_id: Annotated[int, Field(ge=0, le=127)] = Field(default=0, description="Fixed node ID. 0: it requests one.")
    servo_id: Annotated[int, Field(ge=0, le=254)] = Field(default=0, description="Servo ID. 0: factory setting.")
    angle_deg: Annotated[float, Field(ge=-180, lt=180)] = Field(default=0.0, description="Initial horn angle, °.")
    uid: UidField | None = Field(default=None, description="Unique ID. Null for a generated one.")
    rom: dict[str, int] = Field(default_factory=dict[str, int], description="Other values in ROM, by key, raw.")
    reads: dict[str, int] = Field(
        default_factory=dict[str, int],
        description="Values reported for model_number, firmware_version or hardware_version, to simulate an unknown "
        "servo.",
    )
    any_firmware: bool = Field(
        default=False, description="Allow a firmware version that does not exist for this model."
    )


class SimChange(Model):
    """Changes to a simulated servo, all or nothing. Omitted fields stay unchanged."""

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
        description="Turn the horn manually until 0x08 reads this angle, °. Requires torque off.",
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
    response_delay_s: Annotated[float, Field(ge=0, le=10)] | None = Field(
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
    power: SimPower | None = Field(default=None, description="Supply.")


_OUTPUT: tuple[Literal["on", "off", "brake"], ...] = ("on", "off", "brake")
_CONDITIONS = (
    "temperature_c", "voltage_v", "load_pct", "load_inertia", "sensor_error", "mute", "drop_responses_pct",
    "response_delay_s", "restart_delay_s", "software_update",
)  # fmt: skip


async def _bench(request: Request) -> Bench:
    bench = getattr(request.app.state, "bench", None)
    if not isinstance(bench, Bench):
        raise Unknown(
            "no_simulator",
            "This server has no simulator. Start 'hornbill demo', or 'hornbill serve' with --sim-api.",
            cause="no_simulator",
        )
    return bench


TheBench = Annotated[Bench, Depends(_bench)]
ServoUid = Annotated[str, Path(description="Unique ID, 32 lower-case hex digits.")]


def routes(catalog: Catalog) -> Routes:
    """Routes under /sim. They respond with no_simulator (404) if the server has no simulator."""
    made = Routes("simulator", f"{PREFIX}/sim")

    @made.get("/servos", Role.VIEW, "no_simulator")
    async def list_sim_servos(bench: TheBench) -> list[SimServo]:
        """List the simulated servos."""
        return [_shown(bench, uid) for uid in bench.servos]

    @made.post("/servos", Role.ADMIN, "no_simulator", "invalid_value", status_code=201)
    async def add_sim_servo(bench: TheBench, body: NewSimServo) -> SimServo:
        """Add a simulated servo and switch it on."""
        recipe = Recipe(
            body.model, body.firmware, servo_id=body.servo_id, node_id=body.node_id, rom=body.rom,
            angle_deg=body.angle_deg, uid=None if body.uid is None else bytes.fromhex(body.uid),
            any_firmware=body.any_firmware, reads=body.reads,
        )  # fmt: skip
        try:
            made = bench.add(recipe)
        except ValueError as error:
            raise InvalidValue(f"{error}", cause="sim_servo_invalid") from error
        return _shown(bench, Uid(made.uid.hex()))

    @made.get("/servos/{uid}", Role.VIEW, "no_simulator", "unknown_servo")
    async def get_sim_servo(bench: TheBench, uid: ServoUid) -> SimServo:
        """Get a simulated servo."""
        return _shown(bench, Uid(uid))

    @made.delete("/servos/{uid}", Role.ADMIN, "no_simulator", "unknown_servo", status_code=204)
    async def remove_sim_servo(bench: TheBench, uid: ServoUid) -> None:
        """Remove a simulated servo from the bus, as if it were unplugged."""
        await bench.remove(Uid(uid))

    @made.patch("/servos/{uid}", Role.ADMIN, "no_simulator", "unknown_servo", "invalid_value", "busy")
    async def change_sim_servo(bench: TheBench, uid: ServoUid, body: SimChange) -> SimServo:
        """Change the conditions of a simulated servo, all or nothing."""
        _apply(catalog, bench, Uid(uid), body)
        return _shown(bench, Uid(uid))

    return made


def _apply(catalog: Catalog, bench: Bench, uid: Uid, change: SimChange) -> None:
    """Check everything, then apply it: the supply last, so that the servo starts under the new conditions."""
    servo = bench.servo(uid)
    behaviour = _behaviour(servo.behaviour, change)
    if change.faults is not None:
        known = servo.faults.keys
        _check_known(change.faults, known, "fault bits of this model")
    if change.refuse_keys is not None:
        _check_known(change.refuse_keys, catalog.by_key, "parameters")
    if change.external_angle_deg is not None and not bench.turn_manually(uid, change.external_angle_deg):
        raise Busy(
            "The horn cannot be turned manually while torque is on. Set torque_mode or power to off first.",
            cause="sim_output_on",
        )
    conditions = servo.conditions
    for name in _CONDITIONS:
        value = getattr(change, name)
        if value is not None:
            setattr(conditions, name, value)
    if "pwm_us" in change.model_fields_set:
        conditions.pwm_us = change.pwm_us
    if change.refuse_keys is not None:
        conditions.refuse_keys.clear()
        conditions.refuse_keys.update(change.refuse_keys)
    for key, on in (change.faults or {}).items():
        servo.faults.inject(key, on)
    servo.behaviour = behaviour
    if change.power is not None:
        bench.power(uid, change.power == "on")


def _behaviour(before: Behaviour, change: SimChange) -> Behaviour:
    """Behaviour after the change. Raises InvalidValue for an unknown name or setting."""
    wanted: dict[str, Any] = dict(change.behaviour or {})
    if change.position_unit is not None:
        wanted["position_unit"] = change.position_unit
    hints = get_type_hints(Behaviour)
    _check_known(wanted, hints, "behaviour names")
    for name, value in wanted.items():
        kind = hints[name]
        settings = get_args(kind) if get_origin(kind) is Literal else (True, False)
        if value not in settings or isinstance(value, bool) is not (settings[0] is True):
            raise InvalidValue(
                f"Invalid value {value!r} of {name}. Valid values: {', '.join(map(str, settings))}.",
                cause="setting_unknown",
                name=name,
                requested=str(value),
                known=[str(one) for one in settings],
            )
    return replace(before, **wanted)


def _check_known(given: Any, known: Any, what: str) -> None:
    unknown = [key for key in given if key not in known]
    if unknown:
        raise InvalidValue(
            f"Unknown {what}: {', '.join(map(repr, unknown))}. Valid: {', '.join(sorted(known))}.",
            cause="names_unknown",
            names=unknown,
            known=sorted(known),
        )


def _shown(bench: Bench, uid: Uid) -> SimServo:
    servo: SimulatedServo = bench.servo(uid)
    conditions = servo.conditions
    return SimServo(
        uid=uid,
        model=servo.model.name,
        firmware=to_text(servo.firmware),
        serial=servo.serial,
        story=bench.story(uid),
        power="on" if servo.powered else "off",
        stage=servo.stage.value,  # pyright: ignore[reportArgumentType] - a Stage is one of these words
        starts=servo.starts,
        node_id=servo.node_id or None,
        servo_id=servo.servo_id,
        angle_deg=round(servo.angle_deg, 2),
        speed_rpm=round(servo.speed_rpm, 2),
        output=_OUTPUT[servo.output],
        soft_starting=servo.soft_starting,
        pwm_us=conditions.pwm_us,
        faults=sorted(servo.faults.active),
        refuse_keys=sorted(conditions.refuse_keys),
        position_unit=servo.position_unit,
        behaviour=asdict(servo.behaviour),
        **{name: getattr(conditions, name) for name in _CONDITIONS},
    )

"""Routes of the simulator."""

import asyncio
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

from fastapi import Depends, Request
from pydantic import ConfigDict, Field, create_model
from typing_extensions import TypeAliasType

from hornbill.api import PREFIX
from hornbill.api.dependencies import TheHost, UidPath
from hornbill.api.paging import Every, Page, pages
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.autopilot import Program
from hornbill.domain.fields import Model, UidField, Utc
from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants
from hornbill.domain.servo import PositionUnit
from hornbill.errors import Busy, Conflict, InvalidValue, Unknown
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import to_text
from hornbill.schema.scale import Value, to_value
from hornbill.servo.host import Host
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.autopilot import SimulatedAutopilot
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.chaos import INTERVAL_S, KINDS, RECORDED, ChaosKind
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.units import Raw, Uid, serial_text
from hornbill.virtual_time import MAX_SPEED, VirtualLoop

Percent = Annotated[float, Field(ge=0, le=100)]


SimPower = TypeAliasType("SimPower", Literal["off", "on"])


class SimServo(Model):
    """A simulated servo and its conditions."""

    uid: UidField
    model: str = Field(description="Model, such as `BLA21-06U-A0`.")
    firmware: str = Field(description="Firmware version, such as `1.300`.")
    serial: str = Field(description="Serial number: model number, dash, product number, such as `61-466861`.")
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
    refuse_keys: list[str] = Field(description="Keys of parameters that the servo refuses to read and write.")
    position_unit: PositionUnit = Field(description="Unit of position 1.0 in its broadcasts.")
    behaviour: Behaviour = Field(description="Choices where the specification is silent, by name.")


SimValue = TypeAliasType("SimValue", bool | int | float | str | None)


class SimTruth(Model):
    """What a sensor of the servo cannot show: true constants and state of the simulated plant."""

    uid: UidField
    plant: PlantConstants = Field(description="Constants as delivered, without wear.")
    friction_factor: float = Field(description="Friction relative to that of `plant`: it grows with motion.")
    moved_s: float = Field(description="Time in motion since it was added, s.")
    horn_deg: float = Field(description="Horn angle from its notch with all turns counted, °. Positive is clockwise.")
    motor_deg: float = Field(description="Motor angle at the horn, °. It differs by up to half the backlash.")
    speed_rpm: float = Field(description="Speed of the motor at the horn, rpm. Positive is clockwise.")
    torque_pct: float = Field(description="Torque of the motor, % of stall torque. Positive is clockwise.")
    temperature_c: float = Field(description="Temperature of the board, without error of the sensor, °C.")
    supply_v: float = Field(description="Supply at the motor, without error of the sensor, V.")
    angle_deg: float = Field(
        description="Angle as the servo reports it, with origin, reverse and turns, without noise, °."
    )
    output: Literal["on", "off", "brake"] = Field(description="Motor output after timeout and protection.")
    faults: list[str] = Field(description="Keys of the fault bits that are set.")
    ram: dict[str, SimValue] = Field(
        description="Values in use of writable parameters, by key, in the units of the API. Null: inactive."
    )
    rom: dict[str, SimValue] = Field(description="Values in ROM, by key, in the units of the API.")
    rom_sound: bool = Field(description="Whether ROM can be read. If not, the next start uses default values.")


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
    plant: PlantConstants = Field(default=DEFAULT_PLANT, description="Load, friction and other constants of the horn.")


class _Strict(Model):
    model_config = ConfigDict(strict=True)


if TYPE_CHECKING:

    class SimBehaviour(Model):
        """Choices to make where the specification is silent."""

else:  # every field of Behaviour, with its description, all optional
    SimBehaviour = create_model(
        "SimBehaviour",
        __base__=_Strict,
        __doc__="Choices to make where the specification is silent. Omitted ones stay unchanged.",
        **{
            name: (kind | None, Field(default=None, description=about.description))
            for (name, kind), about in zip(
                get_type_hints(Behaviour).items(), Behaviour.__pydantic_fields__.values(), strict=True
            )
        },
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
    plant: PlantConstants | None = Field(
        default=None,
        description="All constants of the horn; omitted ones get their defaults. `load_pct` and `load_inertia` above "
        "are applied to it.",
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
        default=None, description="Keys of parameters that the servo refuses to read and write."
    )
    position_unit: PositionUnit | None = Field(default=None, description="Unit of position 1.0 in its broadcasts.")
    behaviour: SimBehaviour | None = Field(default=None, description="Choices to make, by name.")
    power: SimPower | None = Field(default=None, description="Supply.")


class SimChaos(Model):
    """Faults injected at random, the same for the same seed and the same servos."""

    running: bool = Field(description="Faults are being injected.")
    seed: int | None = Field(description="Seed. Null if none are injected.")
    kinds: list[ChaosKind] = Field(description="Kinds of faults.")
    interval_s: float | None = Field(description="Mean time between two injections, s. Null if none are injected.")
    active: int = Field(description="Number of injections in effect.")
    injected: int = Field(description=f"Number of injections since the last start, of which {RECORDED} are listed.")


class NewSimChaos(Model):
    """Faults to inject into the present servos."""

    seed: int = Field(description="Seed. Equal seeds inject equal faults at equal times into equal servos.")
    kinds: list[ChaosKind] = Field(
        default=list(KINDS), min_length=1, description="Kinds of faults. Default: all. Those of the bus need an "
        "embedded one.",
    )  # fmt: skip
    interval_s: float = Field(default=INTERVAL_S, ge=0.1, le=3600, description="Mean time between injections, s.")


class SimInjection(Model):
    """A fault that was injected."""

    number: int = Field(description="Number in the sequence of the seed.")
    kind: ChaosKind = Field(description="Kind of fault.")
    uid: UidField | None = Field(description="Servo. Null for the bus.")
    values: dict[str, str | float] = Field(description="What was set, such as `load_pct`.")
    at: Utc = Field(description="Start, seconds since 1970 UTC.")
    until: Utc = Field(description="End, seconds since 1970 UTC; planned while it is active.")
    active: bool = Field(description="It is in effect.")


SimSpeed = TypeAliasType("SimSpeed", Literal["max"] | Annotated[float, Field(gt=0, le=MAX_SPEED)])


class SimClock(Model):
    """Clock of the server: real time, or virtual time started with `--speed`."""

    virtual: bool = Field(description="Virtual time. Otherwise the speed is 1 and cannot be changed.")
    speed: SimSpeed = Field(description="Highest speed relative to real time; max for as fast as possible.")
    actual_speed: float = Field(description="Speed reached over the last second or more.")
    now: Utc = Field(description="Present time of the server, seconds since 1970 UTC.")
    elapsed_s: float = Field(description="Time since the start of the server, s, in its own time.")


class NewSimClock(Model):
    """A change of the speed."""

    speed: SimSpeed = Field(description="Speed relative to real time; max for as fast as possible.")


class SimOutput(Model):
    """One output of the simulated autopilot."""

    output: int = Field(description="Output number, from 1.")
    servo_id: int = Field(description="Actuator ID in ArrayCommand: the servo ID it commands.")
    low_deg: float = Field(description="Angle at demand -1, °.")
    high_deg: float = Field(description="Angle at demand 1, °.")
    neutral_deg: float = Field(description="Angle at demand 0, °.")
    reversed: bool = Field(description="A positive demand turns towards `low_deg`.")
    demand: float = Field(description="Present demand, -1 to 1.")
    sent: bool = Field(description="ArrayCommand has an entry for it.")


class SimAutopilot(Model):
    """The simulated autopilot."""

    program: Program = Field(description="Autopilot program whose IDs and scaling it uses.")
    node_id: int = Field(
        description="Its node ID: 10 for ArduPilot, 1 for PX4, or the next one that no simulated servo has."
    )
    rate_hz: float = Field(description="Rate of ArrayCommand, Hz.")
    armed: bool = Field(description="Armed: it moves its outputs.")
    safety_on: bool = Field(description="Safety switch on: ArduPilot then sends no ArrayCommand.")
    sweep: bool = Field(description="While armed it moves all outputs slowly between their ends.")
    allocated: int = Field(description="Number of node IDs it has allocated.")
    sent_commands: int = Field(description="Number of ArrayCommand messages sent.")
    outputs: list[SimOutput] = Field(description="Outputs.")


class NewSimAutopilot(Model):
    """A simulated autopilot to add to the bus."""

    program: Program = Field(description="Autopilot program.")
    output_count: int = Field(default=4, ge=1, le=15, description="Number of outputs.")
    rate_hz: float = Field(default=50.0, gt=0, le=400, description="Rate of ArrayCommand, Hz.")


class SimOutputChange(Model):
    """Changes to one output. Omitted fields stay unchanged."""

    output: int = Field(ge=1, le=15, description="Output number, from 1.")
    low_deg: Annotated[float, Field(ge=-180, le=180)] | None = Field(default=None, description="Angle at -1, °.")
    high_deg: Annotated[float, Field(ge=-180, le=180)] | None = Field(default=None, description="Angle at 1, °.")
    neutral_deg: Annotated[float, Field(ge=-180, le=180)] | None = Field(default=None, description="Angle at 0, °.")
    reversed: bool | None = Field(default=None, description="A positive demand turns towards `low_deg`.")
    demand: Annotated[float, Field(ge=-1, le=1)] | None = Field(default=None, description="Demand, -1 to 1.")
    sent: bool | None = Field(default=None, description="ArrayCommand has an entry for it.")


class SimAutopilotChange(Model):
    """Changes to the simulated autopilot. Omitted fields stay unchanged."""

    armed: bool | None = Field(default=None, description="Arm or disarm.")
    safety_on: bool | None = Field(default=None, description="Safety switch.")
    sweep: bool | None = Field(default=None, description="Move all outputs slowly while armed.")
    rate_hz: Annotated[float, Field(gt=0, le=400)] | None = Field(default=None, description="Rate, Hz.")
    restart: bool = Field(default=False, description="Restart it: two seconds of silence, disarmed.")
    outputs: list[SimOutputChange] = Field(default_factory=list[SimOutputChange], description="Changes to outputs.")


_OUTPUT: tuple[Literal["on", "off", "brake"], ...] = ("on", "off", "brake")
_CONDITIONS = (
    "temperature_c", "voltage_v", "load_pct", "load_inertia", "sensor_error", "mute", "drop_responses_pct",
    "response_delay_s", "restart_delay_s", "software_update",
)  # fmt: skip


async def _bench(_host: TheHost, request: Request) -> Bench:
    bench = getattr(request.app.state, "bench", None)
    if not isinstance(bench, Bench):
        raise Unknown(
            "no_simulator",
            "This server has no simulator. Start 'hornbill demo', or 'hornbill serve' with --sim-api.",
            cause="no_simulator",
        )
    return bench


TheBench = Annotated[Bench, Depends(_bench)]


def routes(catalog: Catalog) -> Routes:
    """Routes under /sim. They respond with no_simulator (404) if the server has no simulator."""
    made = Routes("simulator", f"{PREFIX}/sim")

    @made.get("/servos", Role.VIEW, "no_simulator")
    async def list_sim_servos(bench: TheBench, page: Every) -> list[SimServo]:
        """List the simulated servos."""
        return page.of([_shown(bench, uid) for uid in bench.servos], lambda one: one.uid)

    @made.post("/servos", Role.ADMIN, "no_simulator", "invalid_value", status_code=201)
    async def add_sim_servo(bench: TheBench, body: NewSimServo) -> SimServo:
        """Add a simulated servo and switch it on."""
        recipe = Recipe(
            body.model, body.firmware, servo_id=body.servo_id, node_id=body.node_id, rom=body.rom,
            angle_deg=body.angle_deg, uid=None if body.uid is None else bytes.fromhex(body.uid),
            any_firmware=body.any_firmware, reads=body.reads, plant=body.plant,
        )  # fmt: skip
        try:
            made = bench.add(recipe)
        except ValueError as error:
            raise InvalidValue(f"{error}", cause="sim_servo_invalid") from error
        return _shown(bench, Uid(made.uid.hex()))

    @made.get("/servos/{uid}", Role.VIEW, "no_simulator", "unknown_servo")
    async def get_sim_servo(bench: TheBench, uid: UidPath) -> SimServo:
        """Get a simulated servo."""
        return _shown(bench, Uid(uid))

    @made.delete("/servos/{uid}", Role.ADMIN, "no_simulator", "unknown_servo", status_code=204)
    async def remove_sim_servo(bench: TheBench, uid: UidPath) -> None:
        """Remove a simulated servo from the bus, as if it were unplugged."""
        await bench.remove(Uid(uid))

    @made.patch("/servos/{uid}", Role.ADMIN, "no_simulator", "unknown_servo", "invalid_value", "busy")
    async def change_sim_servo(bench: TheBench, uid: UidPath, body: SimChange) -> SimServo:
        """Change the conditions of a simulated servo, all or nothing."""
        _apply(catalog, bench, Uid(uid), body)
        return _shown(bench, Uid(uid))

    @made.get("/servos/{uid}/truth", Role.VIEW, "no_simulator", "unknown_servo")
    async def get_sim_truth(bench: TheBench, uid: UidPath) -> SimTruth:
        """Get the true constants and state of a simulated horn, to compare measurements with."""
        return _truth(bench, Uid(uid))

    @made.get("/clock", Role.VIEW, "no_simulator")
    async def get_sim_clock(bench: TheBench, host: TheHost) -> SimClock:
        """Get the clock of the server and its speed."""
        return _clock(host)

    @made.put("/clock", Role.ADMIN, "no_simulator", "conflict")
    async def set_sim_clock(bench: TheBench, host: TheHost, body: NewSimClock) -> SimClock:
        """Change the speed of a server in virtual time. Leases and timeouts run with it."""
        loop = asyncio.get_running_loop()
        if not isinstance(loop, VirtualLoop):
            raise Conflict(
                "This server runs in real time. Start it with 'hornbill demo --speed 1' to change its speed.",
                cause="real_time",
            )
        loop.speed = math.inf if body.speed == "max" else body.speed
        return _clock(host)

    @made.get("/chaos", Role.VIEW, "no_simulator")
    async def get_sim_chaos(bench: TheBench) -> SimChaos:
        """Get the state of the faults that are injected at random."""
        return _chaos(bench)

    @made.put("/chaos", Role.ADMIN, "no_simulator", "invalid_value")
    async def start_sim_chaos(bench: TheBench, body: NewSimChaos) -> SimChaos:
        """Inject faults at random into the present servos, in place of those of an earlier seed."""
        try:
            bench.chaos.start(body.seed, body.kinds, body.interval_s)
        except ValueError as error:
            raise InvalidValue(f"{error} Add a servo, or enter other kinds.", cause="nothing_to_inject") from error
        return _chaos(bench)

    @made.delete("/chaos", Role.ADMIN, "no_simulator")
    async def stop_sim_chaos(bench: TheBench) -> SimChaos:
        """End all injected faults and inject no more. Idempotent."""
        bench.chaos.stop()
        return _chaos(bench)

    @made.get("/chaos/injections", Role.VIEW, "no_simulator", "invalid_value")
    async def list_sim_injections(
        bench: TheBench, host: TheHost, page: Annotated[Page, pages(100, RECORDED)]
    ) -> list[SimInjection]:
        """List injected faults, newest first, including those of a seed that was stopped."""
        found = page.of(reversed(bench.chaos.injections), lambda one: one.number)
        return [
            SimInjection(
                number=one.number, kind=one.kind, uid=one.uid, values=dict(one.values), at=host.base.utc(one.at),
                until=host.base.utc(one.until), active=one.active,
            )
            for one in found
        ]  # fmt: skip

    @made.get("/autopilot", Role.VIEW, "no_simulator", "no_autopilot")
    async def get_sim_autopilot(bench: TheBench) -> SimAutopilot:
        """Get the simulated autopilot."""
        return _autopilot(bench)

    @made.put("/autopilot", Role.ADMIN, "no_simulator")
    async def add_sim_autopilot(bench: TheBench, body: NewSimAutopilot) -> SimAutopilot:
        """Add a simulated autopilot to the bus, in place of the present one. It is disarmed."""
        await bench.set_autopilot(body.program, outputs=body.output_count, rate_hz=body.rate_hz)
        return _autopilot(bench)

    @made.patch("/autopilot", Role.ADMIN, "no_simulator", "no_autopilot", "invalid_value")
    async def change_sim_autopilot(bench: TheBench, body: SimAutopilotChange) -> SimAutopilot:
        """Arm or disarm it, press its safety switch, restart it, or set its outputs. All or nothing."""
        one = _present_autopilot(bench)
        for change in body.outputs:
            if change.output > len(one.outputs):
                raise InvalidValue(
                    f"The autopilot has outputs 1 to {len(one.outputs)}, not {change.output}.",
                    cause="autopilot_output_range", output=change.output, maximum=len(one.outputs),
                )  # fmt: skip
        for change in body.outputs:
            for name, value in change.model_dump(exclude={"output"}, exclude_none=True).items():
                setattr(one.outputs[change.output - 1], name, value)
        for name, value in body.model_dump(exclude={"outputs", "restart"}, exclude_none=True).items():
            setattr(one, name, value)
        if body.restart:
            one.restart()
        return _autopilot(bench)

    @made.delete("/autopilot", Role.ADMIN, "no_simulator", status_code=204)
    async def remove_sim_autopilot(bench: TheBench) -> None:
        """Remove the simulated autopilot from the bus. Idempotent."""
        await bench.set_autopilot(None)

    return made


def _clock(host: Host) -> SimClock:
    loop = asyncio.get_running_loop()
    virtual = isinstance(loop, VirtualLoop)
    speed = loop.speed if virtual else 1.0
    return SimClock(
        virtual=virtual, speed="max" if math.isinf(speed) else speed,
        actual_speed=round(loop.actual_speed, 2) if virtual else 1.0, now=host.base.utc_now(),
        elapsed_s=round(host.base.now() - host.started_at, 3),
    )  # fmt: skip


def _chaos(bench: Bench) -> SimChaos:
    chaos = bench.chaos
    return SimChaos(
        running=chaos.running, seed=chaos.seed, kinds=list(chaos.kinds), interval_s=chaos.interval_s,
        active=sum(one.active for one in chaos.injections), injected=chaos.injected,
    )  # fmt: skip


def _present_autopilot(bench: Bench) -> SimulatedAutopilot:
    if bench.autopilot is None:
        raise Unknown(
            "no_autopilot", "There is no simulated autopilot. Add one with PUT /sim/autopilot.", cause="no_autopilot"
        )
    return bench.autopilot


def _autopilot(bench: Bench) -> SimAutopilot:
    one = _present_autopilot(bench)
    names = ("low_deg", "high_deg", "neutral_deg", "reversed", "demand", "sent")
    return SimAutopilot(
        program=one.program, node_id=one.node_id, rate_hz=one.rate_hz, armed=one.armed, safety_on=one.safety_on,
        sweep=one.sweep, allocated=len(one.allocated), sent_commands=one.sent_commands,
        outputs=[
            SimOutput(
                output=index + 1, servo_id=one.actuator_id(index), **{name: getattr(output, name) for name in names}
            )
            for index, output in enumerate(one.outputs)
        ],
    )  # fmt: skip


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
    if change.plant is not None:
        conditions.plant = change.plant
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
    """Behaviour after the change."""
    wanted = {} if change.behaviour is None else change.behaviour.model_dump(exclude_none=True)
    if change.position_unit is not None:
        wanted["position_unit"] = change.position_unit
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


def _truth(bench: Bench, uid: Uid) -> SimTruth:
    servo = bench.servo(uid)
    motion = servo.motion
    return SimTruth(
        uid=uid, plant=servo.conditions.plant, friction_factor=motion.friction, moved_s=motion.moved_s,
        horn_deg=motion.angle, motor_deg=motion.motor, speed_rpm=servo.speed_rpm, torque_pct=100.0 * motion.torque,
        temperature_c=servo.board_c, supply_v=servo.supply_v, angle_deg=servo.reported_angle_deg,
        output=_OUTPUT[servo.output], faults=sorted(servo.faults.active),
        ram=_values(servo, servo.in_use()), rom=_values(servo, servo.stored()), rom_sound=servo.memory.rom_sound,
    )  # fmt: skip


def _values(servo: SimulatedServo, raws: Mapping[str, Raw]) -> dict[str, Value]:
    rows = servo.model.parameters
    return {key: to_value(rows[key], raw, raws) for key, raw in raws.items()}


def _shown(bench: Bench, uid: Uid) -> SimServo:
    servo: SimulatedServo = bench.servo(uid)
    conditions = servo.conditions
    return SimServo(
        uid=uid,
        model=servo.model.name,
        firmware=to_text(servo.firmware),
        serial=serial_text(servo.model.model_number, servo.serial),
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
        behaviour=servo.behaviour,
        **{name: getattr(conditions, name) for name in _CONDITIONS},
    )

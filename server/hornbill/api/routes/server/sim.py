"""Owns the routes of the simulator: what a bench could do to a real servo, done to a simulated one."""

from dataclasses import asdict, replace
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from fastapi import Depends, Path, Request

from hornbill.api import PREFIX, sim_models
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.errors import Busy, InvalidValue, Unknown
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import to_text
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.units import Uid

_OUTPUT: tuple[Literal["on", "off", "brake"], ...] = ("on", "off", "brake")
_CONDITIONS = (
    "temperature_c", "voltage_v", "load_pct", "load_inertia", "sensor_error", "mute", "drop_responses_pct",
    "answer_delay_s", "restart_delay_s", "software_update",
)  # fmt: skip


async def _bench(request: Request) -> Bench:
    bench = getattr(request.app.state, "bench", None)
    if not isinstance(bench, Bench):
        raise Unknown(
            "no_simulator", "This server has no simulated servos. Start `hornbill demo`, or serve with --sim-api."
        )
    return bench


TheBench = Annotated[Bench, Depends(_bench)]
ServoUid = Annotated[str, Path(description="Unique ID, 32 lower-case hex digits.")]


def routes(catalog: Catalog) -> Routes:
    """The routes under /sim. They answer no_simulator (404) where no bench is set up."""
    made = Routes("simulator", f"{PREFIX}/sim")

    @made.get("/servos", Role.VIEW, "no_simulator")
    async def list_sim_servos(bench: TheBench) -> list[sim_models.SimServo]:
        """Every servo on the bench."""
        return [_shown(bench, uid) for uid in bench.servos]

    @made.post("/servos", Role.ADMIN, "no_simulator", "invalid_value", status_code=201)
    async def add_sim_servo(bench: TheBench, body: sim_models.NewSimServo) -> sim_models.SimServo:
        """Put one more servo on the bench and switch it on."""
        recipe = Recipe(
            body.model, body.firmware, servo_id=body.servo_id, node_id=body.node_id, rom=body.rom,
            angle_deg=body.angle_deg, uid=None if body.uid is None else bytes.fromhex(body.uid),
            any_firmware=body.any_firmware, reads=body.reads,
        )  # fmt: skip
        try:
            made = bench.add(recipe)
        except ValueError as error:
            raise InvalidValue(f"{error}") from error
        return _shown(bench, Uid(made.uid.hex()))

    @made.get("/servos/{uid}", Role.VIEW, "no_simulator", "unknown_servo")
    async def get_sim_servo(bench: TheBench, uid: ServoUid) -> sim_models.SimServo:
        """One servo on the bench."""
        return _shown(bench, Uid(uid))

    @made.delete("/servos/{uid}", Role.ADMIN, "no_simulator", "unknown_servo", status_code=204)
    async def remove_sim_servo(bench: TheBench, uid: ServoUid) -> None:
        """Take a servo off the bus, as if its cable were pulled."""
        await bench.remove(Uid(uid))

    @made.patch("/servos/{uid}", Role.ADMIN, "no_simulator", "unknown_servo", "invalid_value", "busy")
    async def change_sim_servo(bench: TheBench, uid: ServoUid, body: sim_models.SimChange) -> sim_models.SimServo:
        """Do to a servo what a bench could do to a real one. All or nothing."""
        _apply(catalog, bench, Uid(uid), body)
        return _shown(bench, Uid(uid))

    return made


def _apply(catalog: Catalog, bench: Bench, uid: Uid, change: sim_models.SimChange) -> None:
    """Check all of it, then do it: the supply last, so that what was set holds from the first instant."""
    servo = bench.servo(uid)
    told = change.model_fields_set
    behaviour = _behaviour(servo.behaviour, change)
    if change.faults is not None:
        known = servo.faults.keys
        _demand(change.faults, known, "fault bits of this model")
    if change.refuse_keys is not None:
        _demand(change.refuse_keys, catalog.by_key, "parameters")
    if change.external_angle_deg is not None and not bench.turn_by_hand(uid, change.external_angle_deg):
        raise Busy(
            "The motor has its output on and holds against the hand. Set torque_mode to off first, or take its power."
        )
    conditions = servo.conditions
    for name in _CONDITIONS:
        value = getattr(change, name)
        if value is not None:
            setattr(conditions, name, value)
    if "pwm_us" in told:
        conditions.pwm_us = change.pwm_us
    if change.refuse_keys is not None:
        conditions.refuse_keys.clear()
        conditions.refuse_keys.update(change.refuse_keys)
    for key, on in (change.faults or {}).items():
        servo.faults.inject(key, on)
    servo.behaviour = behaviour
    if change.power is not None:
        bench.power(uid, change.power == "on")


def _behaviour(before: Behaviour, change: sim_models.SimChange) -> Behaviour:
    """The switches after the change. Raises InvalidValue for a name or a setting there is not."""
    wanted: dict[str, Any] = dict(change.behaviour or {})
    if change.position_unit is not None:
        wanted["position_unit"] = change.position_unit
    hints = get_type_hints(Behaviour)
    _demand(wanted, hints, "switches")
    for name, value in wanted.items():
        kind = hints[name]
        settings = get_args(kind) if get_origin(kind) is Literal else (True, False)
        if value not in settings or isinstance(value, bool) is not (settings[0] is True):
            raise InvalidValue(f"{name} cannot be {value!r}. Give one of {', '.join(map(str, settings))}.")
    return replace(before, **wanted)


def _demand(given: Any, known: Any, what: str) -> None:
    unknown = [key for key in given if key not in known]
    if unknown:
        raise InvalidValue(f"There are no {what} {', '.join(map(repr, unknown))}. Known: {', '.join(sorted(known))}.")


def _shown(bench: Bench, uid: Uid) -> sim_models.SimServo:
    servo: SimulatedServo = bench.servo(uid)
    conditions = servo.conditions
    return sim_models.SimServo(
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

"""Owns the parameter routes, made from the tables: a GET (and PUT) a row, the whole set, and PATCH."""

from collections.abc import Callable, Collection
from typing import Annotated, Any, TypeAlias

from fastapi import APIRouter, Header, Query
from pydantic import WithJsonSchema, create_model

from hornbill.api import models, present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.problems import declared, problem, together
from hornbill.errors import HornbillError
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration.changes import Outcome
from hornbill.servo.host import Host
from hornbill.servo.identification import read_rows
from hornbill.servo.reading import reading, readings
from hornbill.servo.servo import Servo

JsonSchema: TypeAlias = dict[str, Any]

READ_PROBLEMS = declared("unknown_servo", "not_in_this_model", "refused_by_servo", "no_answer", "bus_disconnected")
WRITE_PROBLEMS = declared(
    "unknown_servo", "not_in_this_model", "out_of_range", "invalid_value", "busy", "torque_on", "lease_held",
    "refused_by_servo", "no_answer", "bus_disconnected", "forbidden_parameter", "unknown_parameter", "read_only",
    "conflict", "needs_confirmation", "configuration_lost", "not_as_wanted", "store_failed",
)  # fmt: skip
COMMAND_PROBLEMS = declared("lease_required", "stopped", "mode_off", "torque_off")
PATCH_PROBLEMS = together(WRITE_PROBLEMS, declared("stale_revision", "lease_required", "stopped"))


def router(catalog: Catalog) -> APIRouter:
    """Every parameter route. Rows come first, so that a known key is never taken for an unknown one."""
    made = APIRouter(tags=["parameters"])
    _whole_set(made, catalog)
    for row in catalog.readable.values():
        _row_routes(made, catalog, row)
    _any_other_key(made)
    return made


def value_schema(catalog: Catalog, row: Parameter) -> JsonSchema:
    """JSON Schema of a row's value, with the widest range over all models: the servo's own is checked on writing."""
    shown: JsonSchema = {"title": row.label, "description": _description(row)}
    if row.kind == "choice":
        return {**shown, "type": "string", "enum": [choice.key for choice in row.choices]}
    if row.kind == "switch":
        return {**shown, "type": "boolean"}
    low, high = catalog.widest(row.key)
    if low is not None and high is not None:
        shown |= {"minimum": low / row.per_unit, "maximum": high / row.per_unit}
    if row.per_unit == 1:
        return {**shown, "type": "integer", "x-unit": row.unit}
    return {**shown, "type": "number", "multipleOf": 1 / row.per_unit, "x-unit": row.unit}


def _description(row: Parameter) -> str:
    unit = f" Unit: {row.unit}." if row.unit else ""
    since = "" if row.since == "1.010" else f" Since firmware {row.since}."
    pwm = " Only in models with PWM input." if row.pwm_only else ""
    return f"{row.description}{unit} Register {row.name}, section {row.section}.{since}{pwm}"


def _whole_set(made: APIRouter, catalog: Catalog) -> None:
    rows = [row for row in catalog.readable.values() if row.writable and row.group != "command"]
    values_schema: JsonSchema = {
        "type": "object",
        "minProperties": 1,
        "additionalProperties": False,
        "properties": {row.key: value_schema(catalog, row) for row in rows},
    }
    values_type = Annotated[dict[str, Any], WithJsonSchema(values_schema)]
    body_type = create_model("ParametersPatch", __base__=models.ParametersPatch, values=(values_type, ...))

    @made.get(
        "/servos/{uid}/parameters", operation_id="list_parameters",
        responses=together(READ_PROBLEMS, declared("invalid_value")),
    )  # fmt: skip
    async def list_parameters(
        host: TheHost,
        servo: TheServo,
        refresh: Annotated[bool, Query(description="read every row from the bus first")] = False,
    ) -> models.Parameters:
        """Every row this model and firmware has, as last read; `refresh` reads the bus first."""
        if refresh:
            host.connected()
            await read_rows(host.asker, servo)
        return _all(host, servo)

    @made.patch("/servos/{uid}/parameters", operation_id="change_parameters", responses=PATCH_PROBLEMS)
    async def change_parameters(
        host: TheHost,
        servo: TheServo,
        body: body_type,  # pyright: ignore[reportInvalidTypeForm, reportUnknownParameterType]
        lease: LeaseHeader = None,
        revision: Annotated[str | None, Header(alias="If-Match")] = None,
    ) -> models.ParametersPatched:
        """Several rows, all or nothing: validated, written, read back; on any failure undone."""
        assert isinstance(body, models.ParametersPatch)
        if body.save and not body.dry_run and revision is None:
            joined = host.saving.joined(servo, body.values)
            if joined is not None:
                return models.ParametersPatched(
                    outcome="applied", revision=servo.revision, job=joined.id,
                    changes=[
                        models.Change(key=key, before=value, requested=value, after=value, verdict="unchanged")
                        for key, value in body.values.items()
                    ],
                )  # fmt: skip
        saves = may_begin(host, servo, save=body.save and not body.dry_run, lease=lease)
        outcome = await host.changes.apply(
            servo, body.values, lease, dry_run=body.dry_run, revision=revision_of(revision), confirm=body.confirm,
        )  # fmt: skip
        return patched(host, servo, outcome, lease, saves=saves)


def may_begin(host: Host, servo: Servo, *, save: bool, lease: str | None) -> bool:
    """Whether a save follows; raises what speaks against it now, before anything is written."""
    host.connected()
    if save:
        host.saving.check(servo, lease)
    return save


def patched(host: Host, servo: Servo, outcome: Outcome, lease: str | None, *, saves: bool) -> models.ParametersPatched:
    """The answer to whoever had values written, once the save they asked for is under way."""
    job, failure = None, outcome.failure
    if saves and outcome.outcome == "applied":
        try:
            job = host.saving.save(servo, lease, written=outcome.changes)
        except HornbillError as error:  # what was written stays written, and that is what must be said
            failure = error
    return models.ParametersPatched(
        outcome=outcome.outcome,  # pyright: ignore[reportArgumentType]
        changes=[models.Change.model_validate(change) for change in outcome.changes],
        revision=servo.revision,
        job=None if job is None else job.id,
        failure=None if failure is None else failure.detail,
        problem=None if failure is None else problem(failure),
    )


def _row_routes(made: APIRouter, catalog: Catalog, row: Parameter) -> None:
    path = f"/servos/{{uid}}/parameters/{row.key}"

    async def get(host: TheHost, servo: TheServo) -> models.Reading:
        host.connected()
        await host.asker.read(servo, host.changes.row(servo, row.key))
        return present.reading(reading(servo, row.key, host.base))

    made.add_api_route(
        path, get, methods=["GET"], operation_id=f"get_{row.key}", summary=row.label, description=_description(row),
        responses=READ_PROBLEMS,
    )  # fmt: skip
    if not row.writable:
        return
    name = "".join(part.capitalize() for part in row.key.split("_")) + "Value"
    value_type = Annotated[Any, WithJsonSchema(value_schema(catalog, row))]
    body_type = create_model(name, __base__=models.RowValue, value=(value_type, ...))

    async def put(
        host: TheHost,
        servo: TheServo,
        body: body_type,  # pyright: ignore[reportInvalidTypeForm, reportUnknownParameterType]
        lease: LeaseHeader = None,
    ) -> models.Reading:
        assert isinstance(body, models.RowValue)
        await _write(host, servo, row.key, body.value, lease, body.confirm)
        return present.reading(reading(servo, row.key, host.base))

    handler: Callable[..., Any] = put  # pyright: ignore[reportUnknownVariableType] - its body type is made here
    made.add_api_route(
        path, handler, methods=["PUT"], operation_id=f"set_{row.key}", summary=f"Set {row.label.lower()}",
        description=_description(row), responses=together(WRITE_PROBLEMS, COMMAND_PROBLEMS),
    )  # fmt: skip


def _any_other_key(made: APIRouter) -> None:
    """Keys that are no row, rows that cannot be written: the same problems as everywhere, not a bare 404 or 405."""
    path = "/servos/{uid}/parameters/{key}"

    @made.get(path, include_in_schema=False)
    async def get(host: TheHost, servo: TheServo, key: str) -> models.Reading:
        host.changes.row(servo, key)
        raise AssertionError(f"{key} has a route of its own")

    @made.put(path, include_in_schema=False)
    async def put(host: TheHost, servo: TheServo, key: str, lease: LeaseHeader = None) -> models.Reading:
        await _write(host, servo, key, None, lease)
        raise AssertionError(f"{key} has a route of its own")


async def _write(
    host: Host, servo: Servo, key: str, value: object, lease: str | None, confirm: Collection[str] = ()
) -> None:
    row = host.changes.row(servo, key)
    host.connected()
    if row.key in COMMANDS and row.writable:
        number = host.changes.number(row, value)
        await host.motion.command(servo, lease, COMMANDS[row.key], number, clamp=False, confirm=confirm)
        return
    outcome = await host.changes.apply(servo, {key: value}, lease, confirm=confirm)
    if outcome.failure is not None:
        raise outcome.failure


def revision_of(header: str | None) -> str | None:
    """The revision of an If-Match header, quoted as RFC 9110 has it or bare; None for "*", which any one matches."""
    text = "*" if header is None else header.strip()
    return None if text == "*" else text.removeprefix("W/").strip('"')


def _all(host: Host, servo: Servo) -> models.Parameters:
    shown = {key: present.reading(one) for key, one in readings(servo, host.base).items()}
    return models.Parameters(revision=servo.revision, parameters=shown)

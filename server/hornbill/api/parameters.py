"""Owns the parameter routes: the GET and the PUT of any row, the whole set, and PATCH."""

from collections.abc import Collection, Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query
from pydantic import WithJsonSchema, create_model

from hornbill.api import PREFIX, models, present, rows
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.problems import declared, problem, together
from hornbill.errors import HornbillError
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration import torque_in_rom
from hornbill.servo.configuration.changes import Outcome
from hornbill.servo.host import Host
from hornbill.servo.identification import read_rows
from hornbill.servo.reading import reading, readings
from hornbill.servo.servo import Servo

READ_PROBLEMS = declared("unknown_servo", "not_in_this_model", "refused_by_servo", "no_answer", "bus_disconnected")
WRITE_PROBLEMS = declared(
    "unknown_servo", "not_in_this_model", "out_of_range", "invalid_value", "busy", "torque_on", "lease_held",
    "refused_by_servo", "no_answer", "bus_disconnected", "forbidden_parameter", "unknown_parameter", "read_only",
    "conflict", "needs_confirmation", "configuration_lost", "not_as_wanted", "store_failed",
)  # fmt: skip
COMMAND_PROBLEMS = declared("lease_required", "stopped", "mode_off", "torque_off")
PATCH_PROBLEMS = together(WRITE_PROBLEMS, declared("stale_revision", "lease_required", "stopped"))


async def _row(host: TheHost, servo: TheServo, key: str) -> Parameter:
    return host.changes.row(servo, key)


_TheRow = Annotated[Parameter, Depends(_row)]
"""The row of `{key}`; found before the body is looked at, which a key that is none need not bring."""


def router(catalog: Catalog) -> APIRouter:
    """Every parameter route: one GET and one PUT serve all rows, and `rows` says of each what it takes."""
    made = APIRouter(prefix=PREFIX, tags=["parameters"])
    _whole_set(made, catalog)
    _any_row(made)
    return made


def _whole_set(made: APIRouter, catalog: Catalog) -> None:
    values_schema: rows.JsonSchema = {
        "type": "object",
        "minProperties": 1,
        "additionalProperties": False,
        "properties": {
            row.key: rows.value_schema(catalog, row)
            for row in catalog.readable.values()
            if row.writable and row.group != "command"
        },
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
        saves = await may_begin(
            host, servo, save=body.save and not body.dry_run, lease=lease, confirm=body.confirm, values=body.values
        )
        outcome = await host.changes.apply(
            servo, body.values, lease, dry_run=body.dry_run, revision=revision_of(revision), confirm=body.confirm,
        )  # fmt: skip
        return patched(host, servo, outcome, lease, saves=saves)


async def may_begin(
    host: Host, servo: Servo, *, save: bool, lease: str | None, confirm: Collection[str], values: Mapping[str, object]
) -> bool:
    """Whether a save follows; raises what speaks against it now, before any of `values` is written."""
    host.connected()
    if save:
        host.saving.check(servo, lease)
        await torque_in_rom.require(host.asker, servo, confirm, values)
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


def _any_row(made: APIRouter) -> None:
    """What every row answers. Keys that are no row, rows that cannot be written: problems, not a bare 404 or 405."""

    @made.get(rows.PATH, operation_id=rows.GET, responses=READ_PROBLEMS)
    async def get(host: TheHost, servo: TheServo, row: _TheRow) -> models.Reading:
        host.connected()
        await host.asker.read(servo, row)
        return present.reading(reading(servo, row.key, host.base))

    @made.put(rows.PATH, operation_id=rows.PUT, responses=together(WRITE_PROBLEMS, COMMAND_PROBLEMS))
    async def put(
        host: TheHost, servo: TheServo, row: _TheRow, body: models.RowValue, lease: LeaseHeader = None
    ) -> models.Reading:
        await _write(host, servo, row, body.value, lease, body.confirm)
        return present.reading(reading(servo, row.key, host.base))


async def _write(
    host: Host, servo: Servo, row: Parameter, value: object, lease: str | None, confirm: Collection[str]
) -> None:
    host.connected()
    if row.key in COMMANDS and row.writable:
        number = host.changes.number(row, value)
        await host.motion.command(servo, lease, COMMANDS[row.key], number, clamp=False, confirm=confirm)
        return
    outcome = await host.changes.apply(servo, {row.key: value}, lease, confirm=confirm)
    if outcome.failure is not None:
        raise outcome.failure


def revision_of(header: str | None) -> str | None:
    """The revision of an If-Match header, quoted as RFC 9110 has it or bare; None for "*", which any one matches."""
    text = "*" if header is None else header.strip()
    return None if text == "*" else text.removeprefix("W/").strip('"')


def _all(host: Host, servo: Servo) -> models.Parameters:
    shown = {key: present.reading(one) for key, one in readings(servo, host.base).items()}
    return models.Parameters(revision=servo.revision, parameters=shown)

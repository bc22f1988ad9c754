"""Parameter routes: GET and PUT of a row, and GET and PATCH of the whole set."""

from collections.abc import Collection
from typing import Annotated

from fastapi import Depends, Path, Query, Request
from pydantic import Field, ValidationError, create_model
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.addressing import UNIQUE_ID
from hornbill.api.dependencies import IfMatch, LeaseHeader, TheHost, TheServo, UidText, host_of, servo_of
from hornbill.api.problems import problem
from hornbill.api.routes.configuration import rows
from hornbill.api.routes.configuration.rows import COMMAND_PROBLEMS, READ_PROBLEMS, WRITE_PROBLEMS, RowValue
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.by_key import ParameterKey
from hornbill.domain.change import Change, ChangeOutcome, SavePreview
from hornbill.domain.fields import Confirmed, DryRun, Model, SaveAfter
from hornbill.domain.problem import Problem
from hornbill.domain.servo import Reading
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration.writing import Outcome, WriteOptions
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.reading import reading, readings
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.units import Uid


class Parameters(Model):
    """All rows of this model and firmware."""

    revision: str = Field(description="Revision of the values, for If-Match.")
    parameters: dict[str, Reading] = Field(description="Readings by key.")


class ParametersPatch(Model):
    """Values to write, all or nothing."""

    values: dict[str, bool | int | float | str] = Field(
        min_length=1, description="Values by key, in the units of the parameter manual."
    )
    dry_run: DryRun = False
    save: SaveAfter = False
    confirm: Confirmed = Field(default=[])


class ParametersPatched(SavePreview):
    """Result of a change; with `save`, the save job, or the result of its dry run."""

    outcome: ChangeOutcome = Field(description="All changes, or none: rolled_back restores the earlier values.")
    changes: list[Change] = Field(description="Changes, row by row.")
    revision: str = Field(description="Revision of the values, for If-Match.")
    job: str | None = Field(default=None, description="ID of the save job, with `save`. Null otherwise.")
    failure: str | None = Field(default=None, description="Reason for rolled_back, one sentence. Null otherwise.")
    problem: Problem | None = Field(
        default=None, description="Reason for rolled_back, with code and facts. Null otherwise."
    )


PATCH_PROBLEMS = (*WRITE_PROBLEMS, "stale_revision", "lease_required", "stopped")


def routes(catalog: Catalog) -> Routes:
    """All parameter routes. One GET and one PUT serve all rows; `rows` documents each row."""
    made = Routes("parameters")
    _whole_set(made, catalog)
    _any_row(made)
    return made


def _whole_set(made: Routes, catalog: Catalog) -> None:
    readings_type, values_type = rows.reading_set(catalog), rows.input_set(catalog)
    whole_set = create_model(
        "Parameters",
        __base__=Parameters,
        parameters=(readings_type, Field(description="Readings by key.")),
    )
    body_type = create_model("ParametersPatch", __base__=ParametersPatch, values=(values_type, ...))

    @made.get("/servos/{uid}/parameters", Role.VIEW, *READ_PROBLEMS, "invalid_value", response_model=whole_set)
    async def list_parameters(
        host: TheHost,
        servo: TheServo,
        refresh: Annotated[bool, Query(description="Read every row from the bus first.")] = False,
    ) -> Parameters:
        """List all rows of this model and firmware as last read; `refresh` reads them from the bus first."""
        if refresh:
            host.connected()
            await read_rows(host.requests, servo)
        return _all(host, servo)

    @made.patch("/servos/{uid}/parameters", Role.CONFIGURE, *PATCH_PROBLEMS)
    async def change_parameters(
        host: TheHost,
        servo: TheServo,
        body: body_type,  # pyright: ignore[reportInvalidTypeForm, reportUnknownParameterType]
        lease: LeaseHeader = None,
        revision: IfMatch = None,
    ) -> ParametersPatched:
        """Change rows, all or nothing: validate, write and read back; roll back on any failure."""
        assert isinstance(body, ParametersPatch)
        host.connected()
        options = WriteOptions(
            lease, body.dry_run, body.save, revision_of(revision), body.confirm
        )  # fmt: skip
        return patched(servo, await host.changes.edit(servo, body.values, options))


def patched(servo: Servo, outcome: Outcome) -> ParametersPatched:
    """Response to a change, with the started save or the plan of a dry run."""
    return ParametersPatched(
        **dict(outcome.plan or SavePreview()),
        outcome=outcome.outcome,  # pyright: ignore[reportArgumentType]
        changes=outcome.changes,
        revision=servo.revision,
        job=None if outcome.job is None else outcome.job.id,
        failure=None if outcome.failure is None else outcome.failure.detail,
        problem=None if outcome.failure is None else problem(outcome.failure),
    )


def _any_row(made: Routes) -> None:
    """Generic routes of any row. Unknown keys and read-only rows result in problems, not in a bare 404 or 405."""

    async def the_row(
        request: Request, uid: UidText, key: Annotated[ParameterKey, Path(description="Parameter key.")]
    ) -> Parameter:
        host: Host = request.app.state.host
        return host.changes.row(await servo_of(request, uid), key)

    # A dependency, because the key is checked before the body.
    @made.get("/servos/{uid}/parameters/{key}", Role.VIEW, *READ_PROBLEMS, "unknown_parameter", "forbidden_parameter")
    async def get_parameter(
        host: TheHost,
        servo: TheServo,
        row: Annotated[Parameter, Depends(the_row)],
    ) -> Reading:
        """Read one row by key, for programs that loop over keys. Each row has a typed route, too."""
        host.connected()
        await host.requests.read(servo, row)
        return reading(servo, row.key, host.base)

    path = "/servos/{uid}/parameters/{key}"

    @made.put(path, Role.CONFIGURE, *WRITE_PROBLEMS, *COMMAND_PROBLEMS, direct=_set_directly)
    async def set_parameter(
        host: TheHost,
        servo: TheServo,
        row: Annotated[Parameter, Depends(the_row)],
        body: RowValue,
        lease: LeaseHeader = None,
    ) -> Reading:
        """Write one row by key and read it back, for programs that loop over keys. Each row has a typed route, too."""
        await _write(host, servo, row, body.value, lease, body.confirm)
        return reading(servo, row.key, host.base)


async def _set_directly(request: Request, body: bytes) -> Response | None:
    """Response to a valid write of a readable row of a servo that is named by its unique ID."""
    uid, key, host = request.path_params["uid"], request.path_params["key"], host_of(request)
    if (
        request.headers.get("content-type") != "application/json"
        or not UNIQUE_ID.fullmatch(uid)
        or key not in host.catalog.readable
    ):
        return None
    try:
        given = RowValue.model_validate_json(body)
    except ValidationError:  # the declared way says what is wrong
        return None
    servo = host.fleet.get(Uid(uid))
    await _write(host, servo, host.changes.row(servo, key), given.value, request.headers.get("lease"), given.confirm)
    return Response(present.reading_json(host, servo, key), media_type="application/json")


async def _write(
    host: Host, servo: Servo, row: Parameter, value: object, lease: str | None, confirm: Collection[str]
) -> None:
    host.connected()
    if row.key in COMMANDS and row.writable:
        number = host.changes.number(row, value)
        await host.motion.command(servo, lease, COMMANDS[row.key], number, clamp=False, confirm=confirm)
        return
    outcome = await host.changes.apply(servo, {row.key: value}, WriteOptions(lease, confirm=confirm))
    if outcome.failure is not None:
        raise outcome.failure


def revision_of(header: str | None) -> str | None:
    """Revision in an If-Match header, quoted (RFC 9110) or bare; None for "*", which matches any revision."""
    text = "*" if header is None else header.strip()
    return None if text == "*" else text.removeprefix("W/").strip('"')


def _all(host: Host, servo: Servo) -> Parameters:
    shown = readings(servo, host.base)
    return Parameters(revision=servo.revision, parameters=shown)

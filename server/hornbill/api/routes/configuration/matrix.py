"""Routes of the matrix: parameters of several servos, read and changed together."""

from typing import Annotated, Literal

from fastapi import Query
from pydantic import Field

from hornbill.api.addressing import NAMES, Distinct, ServoName, ServoNames
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.problems import problem
from hornbill.api.routes.configuration.parameters import revision_of
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import Change, SavePreview
from hornbill.domain.fields import DryRun, Model, SafetyConfirm, SaveAfter, UidText
from hornbill.domain.problem import Problem
from hornbill.domain.servo import Reading
from hornbill.errors import HornbillError
from hornbill.servo.device.reading import readings
from hornbill.servo.host import Host
from hornbill.servo.runs.matrix import MatrixOptions, MatrixTarget
from hornbill.units import Uid

routes = Routes("parameters")


class BatchRead(Model):
    """Parameters of several servos."""

    servos: dict[str, "BatchServo"] = Field(description="Results by unique ID.")


class BatchServo(Model):
    """Parameters of one servo, or the problem if it is unknown or unreadable."""

    revision: str | None = Field(description="Revision of the values, for If-Match. Null if unknown.")
    parameters: dict[str, Reading] = Field(description="Readings by key.")
    problem: Problem | None = Field(default=None, description="Reason why there are none. Null otherwise.")


class BatchPatch(Model):
    """Values to write, all or nothing for each servo. IDs may be swapped among the servos."""

    servos: Annotated[dict[ServoName, dict[str, bool | int | float | str]], Distinct] = Field(
        min_length=1, max_length=250, description="Values by servo (unique ID, serial number or label) and key."
    )
    revisions: Annotated[dict[ServoName, str], Distinct] = Field(
        default_factory=dict[ServoName, str], description="Revisions as in If-Match, by servo."
    )
    dry_run: DryRun = False
    save: SaveAfter = False
    all_or_none: bool = Field(default=False, description="Write to no servo if the plan of any servo is rejected.")
    confirm: SafetyConfirm


class BatchOutcome(SavePreview):
    """Result for one servo."""

    uid: UidText
    outcome: Literal["applied", "rolled_back", "planned", "rejected", "not_tried"] = Field(
        description="rejected: nothing was written; not_tried: an earlier servo failed; planned: of a dry run."
    )
    changes: list[Change] = Field(description="Changes, row by row.")
    revision: str | None = Field(description="Revision of the values afterwards. Null if nothing was read.")
    job: str | None = Field(default=None, description="ID of the save job, with `save`. Null otherwise.")
    problem: Problem | None = Field(default=None, description="Reason for rejected or rolled_back. Null otherwise.")


class BatchPatched(Model):
    """Results in the order of the request."""

    servos: list[BatchOutcome] = Field(description="One entry per servo.")


Listed = Annotated[str | None, Query(description="Separated by commas. Default: all.")]


@routes.get("/parameters", Role.VIEW, "unknown_parameter", "bus_disconnected", "invalid_value")
async def read_matrix(
    host: TheHost,
    uids: Annotated[
        ServoNames | None, Query(description=f"{NAMES}, separated by commas. Default: all servos online.")
    ] = None,
    keys: Annotated[Listed, Query(description="Parameter keys, separated by commas. Default: all rows.")] = None,
    refresh: Annotated[bool, Query(description="Read the rows from the bus first.")] = False,
) -> BatchRead:
    """Get rows of several servos, as last read or, with `refresh`, from the bus. Rows that a model lacks are absent."""
    chosen = None if keys is None else set(_items(keys))
    for key in chosen or ():
        host.catalog.parameter(key)
    online = [one.uid for one in host.fleet.all() if one.online]
    listed = online if uids is None else [Uid(uid) for uid in dict.fromkeys(_items(uids))]
    problems: dict[Uid, HornbillError] = {}
    if refresh:
        host.connected()
        problems = await host.matrix.read(listed, chosen)
    return BatchRead(servos={uid: _column(host, uid, chosen, problems.get(uid)) for uid in listed})


@routes.patch("/parameters", Role.CONFIGURE, "lease_held", "bus_disconnected", "invalid_value")
async def change_matrix(host: TheHost, body: BatchPatch, lease: LeaseHeader = None) -> BatchPatched:
    """Change rows of several servos. All servos are planned first, then each is changed all or nothing.

    IDs may be swapped; servos that exchange IDs succeed or fail together. With `save` all changed servos are saved at
    the same time: each restarts, and with soft start, and torque on in ROM, its horn moves slowly to 0°.
    """
    host.connected()
    revisions = {uid: one for uid, text in body.revisions.items() if (one := revision_of(text)) is not None}
    order = MatrixOptions(
        lease, revisions, body.confirm, dry_run=body.dry_run, save=body.save, all_or_none=body.all_or_none,
    )  # fmt: skip
    entries = await host.matrix.write({Uid(uid): values for uid, values in body.servos.items()}, order)
    return BatchPatched(servos=[_outcome(one) for one in entries])


def _items(text: str) -> list[str]:
    return [item for part in text.split(",") if (item := part.strip())]


def _column(host: Host, uid: Uid, keys: set[str] | None, failed: HornbillError | None) -> BatchServo:
    try:
        servo = host.fleet.get(uid)
        if failed is not None:
            raise failed
    except HornbillError as error:
        revision = host.fleet.get(uid).revision if host.fleet.knows(uid) else None
        return BatchServo(revision=revision, parameters={}, problem=problem(error))
    shown = readings(servo, host.base)
    return BatchServo(
        revision=servo.revision,
        parameters={key: one for key, one in shown.items() if keys is None or key in keys},
    )


def _outcome(one: MatrixTarget) -> BatchOutcome:
    return BatchOutcome(
        **dict(one.plan or SavePreview()),
        uid=one.uid,
        outcome=one.outcome,  # pyright: ignore[reportArgumentType]
        changes=one.changes,
        revision=None if one.servo is None else one.servo.revision,
        job=None if one.job is None else one.job.id,
        problem=None if one.problem is None else problem(one.problem),
    )

"""Owns the routes of the matrix: parameters × servos, read and changed as one."""

from typing import Annotated

from fastapi import Query

from hornbill.api import config_models
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.problems import problem
from hornbill.api.routes.configuration.parameters import revision_of
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import SavePreview
from hornbill.errors import HornbillError
from hornbill.servo.device.reading import readings
from hornbill.servo.host import Host
from hornbill.servo.runs.matrix import MatrixOptions, MatrixTarget
from hornbill.units import Uid

routes = Routes("parameters")

Listed = Annotated[str | None, Query(description="Separated by commas. Default: all.")]


@routes.get("/parameters", Role.VIEW, "unknown_parameter", "bus_disconnected", "invalid_value")
async def read_matrix(
    host: TheHost,
    uids: Annotated[Listed, Query(description="Unique IDs, separated by commas. Default: all servos online.")] = None,
    keys: Annotated[Listed, Query(description="Parameter keys, separated by commas. Default: all rows.")] = None,
    refresh: Annotated[bool, Query(description="Read the rows from the bus first.")] = False,
) -> config_models.BatchRead:
    """Rows of many servos, as last read or read now. A row a model lacks is absent; a servo with a problem has it."""
    chosen = None if keys is None else set(_items(keys))
    for key in chosen or ():
        host.catalog.parameter(key)
    online = [one.uid for one in host.fleet.all() if one.online]
    listed = online if uids is None else [Uid(uid) for uid in dict.fromkeys(_items(uids))]
    problems: dict[Uid, HornbillError] = {}
    if refresh:
        host.connected()
        problems = await host.matrix.read(listed, chosen)
    return config_models.BatchRead(servos={uid: _column(host, uid, chosen, problems.get(uid)) for uid in listed})


@routes.patch("/parameters", Role.CONFIGURE, "lease_held", "bus_disconnected", "invalid_value")
async def change_matrix(
    host: TheHost, body: config_models.BatchPatch, lease: LeaseHeader = None
) -> config_models.BatchPatched:
    """Rows of many servos. Each servo is planned first and then changed all or nothing; ids may be swapped.

    Servos that pass ids to one another stand and fall together. With `save` each servo that was changed is saved,
    all at once: every one of them restarts, and with soft start and torque on in ROM its horn goes slowly to 0 degrees.
    """
    host.connected()
    revisions = {uid: one for uid, text in body.revisions.items() if (one := revision_of(text)) is not None}
    order = MatrixOptions(
        lease, revisions, body.confirm, dry_run=body.dry_run, save=body.save, all_or_none=body.all_or_none,
    )  # fmt: skip
    entries = await host.matrix.write({Uid(uid): values for uid, values in body.servos.items()}, order)
    return config_models.BatchPatched(servos=[_outcome(one) for one in entries])


def _items(text: str) -> list[str]:
    return [item for part in text.split(",") if (item := part.strip())]


def _column(host: Host, uid: Uid, keys: set[str] | None, failed: HornbillError | None) -> config_models.BatchServo:
    try:
        servo = host.fleet.get(uid)
        if failed is not None:
            raise failed
    except HornbillError as error:
        revision = host.fleet.get(uid).revision if host.fleet.knows(uid) else None
        return config_models.BatchServo(revision=revision, parameters={}, problem=problem(error))
    shown = readings(servo, host.base)
    return config_models.BatchServo(
        revision=servo.revision,
        parameters={key: one for key, one in shown.items() if keys is None or key in keys},
    )


def _outcome(one: MatrixTarget) -> config_models.BatchOutcome:
    return config_models.BatchOutcome(
        **dict(one.plan or SavePreview()),
        uid=one.uid,
        outcome=one.outcome,  # pyright: ignore[reportArgumentType]
        changes=one.changes,
        revision=None if one.servo is None else one.servo.revision,
        job=None if one.job is None else one.job.id,
        problem=None if one.problem is None else problem(one.problem),
    )

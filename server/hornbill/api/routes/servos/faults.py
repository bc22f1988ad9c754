"""Routes of faults, present and past, and their acknowledgement."""

from typing import Annotated

from fastapi import Path, Query
from pydantic import Field

from hornbill.api.addressing import NAMES, ServoNames
from hornbill.api.dependencies import LeaseHeader, TheHost, UidPath, known_uid
from hornbill.api.paging import Every
from hornbill.api.problems import problem
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.domain.problem import Problem
from hornbill.domain.servo import Fault
from hornbill.errors import Unknown
from hornbill.servo.host import Host
from hornbill.servo.runtime.actor import signed
from hornbill.units import Uid

routes = Routes("faults")


class FaultsRead(Model):
    """Fault bits of several servos."""

    servos: dict[str, "ServoFaults"] = Field(description="Results by unique ID.")


class ServoFaults(Model):
    """Fault bits of one servo, or the problem if it is unknown."""

    faults: list[Fault] = Field(description="Failures, then warnings, then notifications. Active before past.")
    problem: Problem | None = Field(default=None, description="Reason why there are none. Null otherwise.")


Key = Annotated[str, Path(description="Key of the bit.")]
By = Annotated[str | None, Query(max_length=64, description="User who acknowledges. Default: the holder of the lease.")]
ACKNOWLEDGE_PROBLEMS = ("unknown_servo", "invalid_value", "store_failed")


@routes.get("/faults", Role.VIEW, "invalid_value")
async def read_faults(
    host: TheHost,
    uids: Annotated[ServoNames | None, Query(description=f"{NAMES}, separated by commas. Default: all.")] = None,
) -> FaultsRead:
    """Get the fault bits of several servos, each as in `GET /servos/{uid}/faults`."""
    listed = [one.uid for one in host.fleet.all()] if uids is None else [one.strip() for one in uids.split(",")]
    return FaultsRead(servos={uid: _one(host, uid) for uid in listed if uid})


@routes.get("/servos/{uid}/faults", Role.VIEW, "unknown_servo")
async def list_faults(host: TheHost, uid: UidPath, page: Every) -> list[Fault]:
    """List all fault bits of a servo that are or were set, also of a servo off the bus. Failures first, then warnings,
    then notifications; active before past. Bits clear automatically or at a restart and cannot be cleared here.
    """
    return page.of(_faults(host, known_uid(host, uid)), lambda one: one.key)


@routes.post("/servos/{uid}/faults/acknowledge", Role.OPERATE, *ACKNOWLEDGE_PROBLEMS)
async def acknowledge_faults(host: TheHost, uid: UidPath, by: By = None, lease: LeaseHeader = None) -> list[Fault]:
    """Acknowledge all faults of a servo. Sends nothing to the servo."""
    known = known_uid(host, uid)
    await host.faults.acknowledge(known, _who(host, by, lease))
    return _faults(host, known)


@routes.post(
    "/servos/{uid}/faults/{key}/acknowledge",
    Role.OPERATE,
    "unknown_servo",
    "unknown_fault",
    "invalid_value",
    "store_failed",
)
async def acknowledge_fault(host: TheHost, uid: UidPath, key: Key, by: By = None, lease: LeaseHeader = None) -> Fault:
    """Acknowledge one fault. The first acknowledgement stays until the bit is set again. Sends nothing to the servo."""
    known = known_uid(host, uid)
    await host.faults.acknowledge(known, _who(host, by, lease), key)
    return next(one for one in _faults(host, known) if one.key == key)


def _one(host: Host, uid: str) -> ServoFaults:
    try:
        return ServoFaults(faults=_faults(host, known_uid(host, uid)))
    except Unknown as error:
        return ServoFaults(faults=[], problem=problem(error))


def _faults(host: Host, uid: Uid) -> list[Fault]:
    return list(host.faults.of(uid))


def _who(host: Host, by: str | None, lease: str | None) -> str:
    return signed(by) if by else host.leases.who(lease, host.base.now())

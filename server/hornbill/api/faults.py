"""Owns the routes of faults: what a servo's bits tell, now and in the past, and that somebody has seen it."""

from typing import Annotated

from fastapi import APIRouter, Path, Query

from hornbill.api import PREFIX
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.motion_models import Fault
from hornbill.api.problems import declared
from hornbill.errors import Unknown
from hornbill.servo.acting import signed
from hornbill.servo.host import Host
from hornbill.units import Uid

router = APIRouter(prefix=PREFIX, tags=["faults"])

ServoUid = Annotated[str, Path(description="unique id, 32 lower-case hex digits")]
Key = Annotated[str, Path(description="key of the bit, as in the list")]
By = Annotated[str | None, Query(max_length=64, description="who has seen it; null: the holder of the lease")]
ACKNOWLEDGE_PROBLEMS = declared("unknown_servo", "invalid_value", "store_failed")


@router.get("/servos/{uid}/faults", operation_id="list_faults", responses=declared("unknown_servo"))
async def list_faults(host: TheHost, uid: ServoUid) -> list[Fault]:
    """Every bit that is set or ever was, of a servo on the bus or remembered: failures before warnings before
    notifications, active before past. A bit goes by itself, or when the servo starts again: nothing clears it here.
    """
    return _faults(host, _known(host, uid))


@router.post("/servos/{uid}/faults/acknowledge", operation_id="acknowledge_faults", responses=ACKNOWLEDGE_PROBLEMS)
async def acknowledge_faults(host: TheHost, uid: ServoUid, by: By = None, lease: LeaseHeader = None) -> list[Fault]:
    """Somebody has seen all of them. The servo is not told."""
    known = _known(host, uid)
    host.faults.acknowledge(known, _who(host, by, lease))
    return _faults(host, known)


@router.post(
    "/servos/{uid}/faults/{key}/acknowledge",
    operation_id="acknowledge_fault",
    responses=declared("unknown_servo", "unknown_fault", "invalid_value", "store_failed"),
)
async def acknowledge_fault(host: TheHost, uid: ServoUid, key: Key, by: By = None, lease: LeaseHeader = None) -> Fault:
    """Somebody has seen this one; who was first stays until the bit comes up again. The servo is not told."""
    known = _known(host, uid)
    host.faults.acknowledge(known, _who(host, by, lease), key)
    return next(one for one in _faults(host, known) if one.key == key)


def _faults(host: Host, uid: Uid) -> list[Fault]:
    return [Fault.model_validate(one) for one in host.faults.of(uid)]


def _known(host: Host, uid: str) -> Uid:
    if not host.fleet.knows(uid) and host.store.servos.get(Uid(uid)) is None:
        raise Unknown("unknown_servo", f"No servo {uid!r} was ever met. GET /api/v1/inventory lists them.", uid=uid)
    return Uid(uid)


def _who(host: Host, by: str | None, lease: str | None) -> str:
    return signed(by) if by else host.leases.who(lease, host.base.now())

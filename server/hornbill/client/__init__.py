"""Typed client of a running server, for test rigs.

    from hornbill.client import Hornbill

    with Hornbill() as hornbill, hornbill.lease("my rig"):
        servo = hornbill.find(label="Elevator L")
        servo.torque("on")
        servo.move(30)

AsyncHornbill is the asyncio version. Methods raise the errors of hornbill.errors, ServerUnreachable and WaitTimeout.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hornbill.client.aio.hornbill import AsyncHornbill
    from hornbill.client.aio.lease import AsyncLease
    from hornbill.client.aio.servo import AsyncServo
    from hornbill.client.live import Gap, Sample
    from hornbill.client.problems import ServerUnreachable, WaitTimeout
    from hornbill.client.sync.hornbill import Hornbill, unconfirmed
    from hornbill.client.sync.lease import Lease
    from hornbill.client.sync.servo import Servo

__all__ = [
    "AsyncHornbill", "AsyncLease", "AsyncServo", "Gap", "Hornbill", "Lease", "Sample", "ServerUnreachable", "Servo",
    "WaitTimeout", "unconfirmed",
]  # fmt: skip

_MODULES = {
    "AsyncHornbill": "aio.hornbill",
    "AsyncLease": "aio.lease",
    "AsyncServo": "aio.servo",
    "Gap": "live",
    "Hornbill": "sync.hornbill",
    "Lease": "sync.lease",
    "Sample": "live",
    "ServerUnreachable": "problems",
    "Servo": "sync.servo",
    "WaitTimeout": "problems",
    "unconfirmed": "sync.hornbill",
}
"""Module of each name, imported at its first use: a program needs one of the two clients."""


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)

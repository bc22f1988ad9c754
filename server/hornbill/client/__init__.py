"""A small typed client of a running server, for rigs.

    from hornbill.client import Hornbill

    with Hornbill() as hornbill, hornbill.lease("my rig"):
        servo = hornbill.find(label="Elevator L")
        servo.torque("on")
        servo.move(30)

AsyncHornbill is the same with `await`. Errors are those of hornbill.errors, and NoServer and TookTooLong.
"""

from hornbill.client.aio.hornbill import AsyncHornbill
from hornbill.client.aio.lease import AsyncLease
from hornbill.client.aio.servo import AsyncServo
from hornbill.client.problems import NoServer, TookTooLong
from hornbill.client.sync.hornbill import Hornbill, unconfirmed
from hornbill.client.sync.lease import Lease
from hornbill.client.sync.servo import Servo

__all__ = [
    "AsyncHornbill", "AsyncLease", "AsyncServo", "Hornbill", "Lease", "NoServer", "Servo", "TookTooLong", "unconfirmed",
]  # fmt: skip

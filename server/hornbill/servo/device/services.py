"""Collaborators shared by most classes of the servo layer, passed as one argument."""

from dataclasses import dataclass

from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.temporary_values import OwedValues
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub
from hornbill.servo.runtime.jobs import Jobs
from hornbill.servo.runtime.leases import Leases
from hornbill.servo.runtime.timebase import TimeBase


@dataclass(frozen=True, slots=True)
class HostServices:
    """Shared collaborators, one of each per host."""

    requests: ServoRequests
    hub: Hub
    base: TimeBase
    audit: Audit
    leases: Leases
    jobs: Jobs
    owed: OwedValues

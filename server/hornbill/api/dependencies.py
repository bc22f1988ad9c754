"""Dependencies of routes: the host, the servo in the path, the lease in the header."""

import asyncio
import sys
from importlib import import_module
from typing import Annotated

from fastapi import Depends, Header, Path, Request

from hornbill.api.addressing import NAMES, ServoRef, ServoText, address_by, resolve, servo_never_seen
from hornbill.bus.listing import Adapters
from hornbill.bus.recordings.bus_log import BusLog
from hornbill.bus.recordings.folder import FileFolder
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.units import Uid


def host_of(request: Request) -> Host:
    """Host of the application."""
    host = request.app.state.host
    assert isinstance(host, Host)
    return host


async def _host(request: Request) -> Host:
    host = host_of(request)
    address_by(host)
    return host


# Async although they await nothing: FastAPI runs plain functions in a thread.
TheHost = Annotated[Host, Depends(_host)]


async def _adapters(request: Request) -> Adapters:
    adapters = request.app.state.adapters
    assert isinstance(adapters, Adapters)
    return adapters


TheAdapters = Annotated[Adapters, Depends(_adapters)]


async def _bus_log(request: Request) -> BusLog:
    bus_log = request.app.state.bus_log
    assert isinstance(bus_log, BusLog)
    return bus_log


TheBusLog = Annotated[BusLog, Depends(_bus_log)]


async def _recordings(request: Request) -> FileFolder:
    recordings = request.app.state.recordings
    assert isinstance(recordings, FileFolder)
    return recordings


TheRecordings = Annotated[FileFolder, Depends(_recordings)]


UidPath = Annotated[ServoRef, Path(description=f"{NAMES}.")]
"""A `{uid}` that may be off the bus. Its value is the unique ID."""


UidText = Annotated[ServoText, Path(description=f"{NAMES}.")]
"""The same, not resolved."""


async def servo_of(request: Request, uid: UidText) -> Servo:
    """Servo of `{uid}`. Takes the request itself: another dependency would take as long as all of this."""
    host = await _host(request)
    return host.fleet.get(resolve(host, uid))


TheServo = Annotated[Servo, Depends(servo_of)]
"""Servo of `{uid}`; unknown_servo (404) if there is none."""


async def load_lab() -> None:
    """Import what measurements need, in a thread, when it is first used: NumPy takes 0.1 s and 12 MiB."""
    for name in ("stored", "step", "frequency_job", "mechanics_export", "improve"):
        if f"hornbill.lab.{name}" not in sys.modules:
            await asyncio.to_thread(import_module, f"hornbill.lab.{name}")


def known_uid(host: Host, uid: str) -> Uid:
    """Unique ID of a servo on the bus or in the inventory. Raises Unknown(unknown_servo) otherwise."""
    if not host.fleet.knows(uid) and host.store.servos.get(Uid(uid)) is None:
        raise servo_never_seen(uid)
    return Uid(uid)


LeaseHeader = Annotated[
    str | None, Header(alias="Lease", description="ID of a valid lease, which grants motion control.")
]
IfMatch = Annotated[
    str | None,
    Header(alias="If-Match", description="`revision` of the last read. If values have changed: `stale_revision`."),
]
JobId = Annotated[str, Path(description="ID of the job.")]
LeaseId = Annotated[str, Path(description="ID of the lease.")]
RequestId = Annotated[str, Path(description="ID of the request for motion control.")]
StreamId = Annotated[str, Path(description="ID of the stream.")]

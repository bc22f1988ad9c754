"""Owns what routes are handed: the host, the servo of the path, and the lease of the header."""

from typing import Annotated

from fastapi import Depends, Header, Path, Request

from hornbill.bus.adapters import Adapters
from hornbill.bus.bundles import BundleFolder
from hornbill.bus.recorder import Recorder
from hornbill.servo.host import Host
from hornbill.servo.servo import Servo


async def _host(request: Request) -> Host:
    host = request.app.state.host
    assert isinstance(host, Host)
    return host


# Both are async although they wait for nothing: FastAPI would run plain functions in a thread.
TheHost = Annotated[Host, Depends(_host)]


async def _adapters(request: Request) -> Adapters:
    adapters = request.app.state.adapters
    assert isinstance(adapters, Adapters)
    return adapters


TheAdapters = Annotated[Adapters, Depends(_adapters)]


async def _recorder(request: Request) -> Recorder:
    recorder = request.app.state.recorder
    assert isinstance(recorder, Recorder)
    return recorder


TheRecorder = Annotated[Recorder, Depends(_recorder)]


async def _bundles(request: Request) -> BundleFolder:
    bundles = request.app.state.bundles
    assert isinstance(bundles, BundleFolder)
    return bundles


TheBundles = Annotated[BundleFolder, Depends(_bundles)]


async def _servo(host: TheHost, uid: Annotated[str, Path(description="unique id, 32 lower-case hex digits")]) -> Servo:
    return host.fleet.get(uid)


TheServo = Annotated[Servo, Depends(_servo)]
"""The servo of `{uid}`; unknown_servo (404) where there is none."""

LeaseHeader = Annotated[str | None, Header(alias="Lease", description="id of a live lease")]

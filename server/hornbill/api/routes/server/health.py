"""Health of the server: alive, ready, and the state of each part, derived from the findings of the doctor."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final, Literal, get_args

from fastapi import Request, Response
from pydantic import Field
from typing_extensions import TypeAliasType

from hornbill import __version__, resources
from hornbill.api import present, remedies
from hornbill.api.dependencies import TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.roles import LOCAL, PUBLIC
from hornbill.domain.bus import Finding, FindingCode, Severity
from hornbill.domain.fields import Model
from hornbill.servo.host import Host

routes = Routes("server")
probes = Routes("server", prefix="")
"""Short paths for monitors, load balancers and containers."""

PartName = TypeAliasType("PartName", Literal["store", "disk", "bus", "allocator", "view", "loop"])
"""Part of the server: database, disk of the data folder, adapter, node ID allocator, 3D view, event loop."""

PartState = TypeAliasType("PartState", Literal["ok", "degraded", "failed", "off"])
"""off: not in use, or it cannot be checked now."""

PARTS: Final[Mapping[FindingCode, PartName]] = {
    "database": "store",
    "disk_space": "disk",
    "adapter": "bus",
    "adapter_failed": "bus",
    "adapter_lost": "bus",
    "interface_down": "bus",
    "bus_off": "bus",
    "second_allocator": "allocator",
    "allocation_refused": "allocator",
    "allocation_stuck": "allocator",
    "view": "view",
    "computer_busy": "loop",
}
"""Part of each finding that counts for its state."""

_STATES: Final[Mapping[Severity, PartState]] = {"ok": "ok", "notice": "ok", "warning": "degraded", "failure": "failed"}
STATES: Final[Sequence[PartState]] = ("off", "ok", "degraded", "failed")
"""Best first."""


class Part(Model):
    """State of one part of the server."""

    state: PartState = Field(description="State of the part.")
    findings: list[Finding] = Field(description="Why it is degraded or failed.")


class Health(Model):
    """Health of the server."""

    status: PartState = Field(description="Worst state of the parts.")
    ready: bool = Field(description="No part has failed; `/ready` returns 200.")
    version: str = Field(description="Version of hornbill.")
    commit: str | None = Field(description="Commit it was built from, `+` if changed since. Null if unknown.")
    uptime_s: float = Field(description="Time since its start, s.")
    bus: str = Field(description="State of the bus.")
    demo: bool = Field(description="Simulated servos on an embedded bus.")
    parts: dict[PartName, Part] = Field(description="State of each part, by name.")


class Alive(Model):
    """Response while the server is alive."""

    status: Literal["ok"] = Field(description="Always ok: the server responds.")


class Readiness(Model):
    """States of the parts, without details."""

    ready: bool = Field(description="No part has failed.")
    parts: dict[PartName, PartState] = Field(description="State of each part, by name.")
    findings: list[FindingCode] = Field(description="Codes of the findings of failed parts.")


@routes.get("/health", LOCAL)
async def get_health(host: TheHost, request: Request) -> Health:
    """Get the state of the server and of its parts."""
    parts = parts_of(host)
    return Health(
        status=STATES[max(STATES.index(part.state) for part in parts.values())],
        ready=_is_ready(parts),
        version=__version__,
        commit=await asyncio.to_thread(resources.commit),
        uptime_s=round(host.base.now() - host.started_at, 1),
        bus=present.bus(host).state,
        demo=bool(request.app.state.demo),
        parts=parts,
    )


@probes.get("/health", PUBLIC, include_in_schema=False)
async def get_alive() -> Alive:
    """Check that the server responds."""
    return Alive(status="ok")


@probes.get("/ready", PUBLIC, include_in_schema=False)
async def get_ready(host: TheHost, response: Response) -> Readiness:
    """Check that no part has failed; 503 otherwise. Contains no names, addresses or texts."""
    parts = parts_of(host)
    ready = _is_ready(parts)
    response.status_code = 200 if ready else 503
    response.headers["Cache-Control"] = "no-store"
    failed: list[FindingCode] = [one.code for part in parts.values() if part.state == "failed" for one in part.findings]
    return Readiness(ready=ready, parts={name: part.state for name, part in parts.items()}, findings=failed)


def parts_of(host: Host) -> dict[PartName, Part]:
    """State of every part."""
    parts: dict[PartName, Part] = {name: Part(state="off", findings=[]) for name in _names()}
    for one in host.doctor.checks():
        name = PARTS.get(one.code)
        if name is None:
            continue
        part, state = parts[name], _STATES[one.severity]
        if STATES.index(state) > STATES.index(part.state):
            part.state = state
        if state != "ok":
            part.findings.append(replace(one, remedy=remedies.remedy(one)))
    return parts


def _names() -> tuple[PartName, ...]:
    return get_args(PartName.__value__)


def _is_ready(parts: Mapping[PartName, Part]) -> bool:
    return all(part.state != "failed" for part in parts.values())

"""Benches that share a database."""

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.bus import ConnectionRoleName
from hornbill.domain.fields import STRICT, Utc

SiteBenchState = TypeAliasType("SiteBenchState", Literal["online", "no_contact", "stopped"])
"""online: its server works. no_contact: its server has not written to the database for 15 s; it may still move its
servos. stopped: its server has exited."""


@dataclass(frozen=True, slots=True, config=STRICT)
class BenchStatus:
    """Condition of a bench, as its server last reported it."""

    bus: Annotated[str | None, Field(description="Address of its bus. Null without one.")]
    bus_state: Annotated[str, Field(description="State of its bus, as in `GET /bus`.")]
    role: Annotated[ConnectionRoleName | None, Field(description="Connection role. Null without a bus.")]
    servos_online: Annotated[int, Field(ge=0, description="Number of servos on its bus.")]
    servos_total: Annotated[int, Field(ge=0, description="Number of servos in the inventory that were last there.")]
    faults: Annotated[int, Field(ge=0, description="Number of its online servos with a warning or failure.")]
    bus_load_pct: Annotated[float | None, Field(description="Bus load, %. Null without a bus.")]
    holder: Annotated[str | None, Field(description="Holders of motion control, separated by commas. Null if free.")]
    torque_stopped: Annotated[bool, Field(description="Stop is latched.")]


@dataclass(frozen=True, slots=True, config=STRICT)
class SiteBench(BenchStatus):
    """A bench of the site, in the condition that its server last reported."""

    name: Annotated[str, Field(description="Name of the bench.")]
    host: Annotated[str, Field(description="Name of the computer of its server.")]
    url: Annotated[str | None, Field(description="Address of its page. Null if unknown.")]
    version: Annotated[str, Field(description="Version of hornbill.")]
    since: Annotated[Utc | None, Field(description="Start of its server, seconds since 1970 UTC. Null if unknown.")]
    last_contact: Annotated[Utc, Field(description="Last contact, seconds since 1970 UTC.")]
    state: Annotated[SiteBenchState, Field(description="State of its server.")]
    is_this: Annotated[bool, Field(description="The bench of this server.")]

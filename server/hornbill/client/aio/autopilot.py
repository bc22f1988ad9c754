"""Servos commanded by an autopilot: parameter files, live verification and failsafe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import quote

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.aio.connection import AsyncConnection


class AsyncAutopilot:
    """Autopilot on the bus, as `hornbill.autopilot`. Sends nothing to it."""

    def __init__(self, connection: AsyncConnection) -> None:
        self._connection = connection
        self._request = connection.request

    async def plan(self, program: Literal["ardupilot", "px4"] = "ardupilot") -> list[responses.PlanOutput]:
        """Outputs proposed for the connected servos, as `outputs` of a plan."""
        return await self._request("GET", "/autopilot/plan", program=program)

    async def write_parameters(self, plan: Mapping[str, Any]) -> responses.ParameterFile:
        """Parameter file of a plan: program, outputs, rate_hz. Raises InvalidValue or OutOfRange with the number."""
        return await self._request("POST", "/autopilot/export", dict(plan))

    async def read_parameters(self, text: str, program: Literal["ardupilot", "px4"]) -> responses.ImportedPlan:
        """Plan of a parameter file."""
        return await self._request("POST", "/autopilot/import", {"program": program, "text": text})

    async def begin_verification(self, plan: Mapping[str, Any]) -> responses.Verification:
        """Start to compare what is on the bus with a plan."""
        return await self._request("PUT", "/autopilot/verification", dict(plan))

    async def verification(self) -> responses.Verification:
        """State of the verification."""
        return await self._request("GET", "/autopilot/verification")

    async def begin_verification_step(
        self, kind: Literal["neutral", "positive"], output: int | None = None
    ) -> responses.Verification:
        """Start a step: all controls centred, or that of one output fully positive, for 3 s."""
        return await self._request("POST", "/autopilot/verification/steps", {"kind": kind, "output": output})

    async def end_verification(self) -> None:
        """End the verification."""
        await self._request("DELETE", "/autopilot/verification")

    async def failsafe(self, uid: str) -> responses.Failsafe:
        """What a servo does when commands stop, and the last gap that confirmed it."""
        return await self._request("GET", f"/servos/{quote(uid)}/failsafe")

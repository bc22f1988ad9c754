"""Servos commanded by an autopilot: parameter files, live verification and failsafe."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import quote

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection


class Autopilot:
    """Autopilot on the bus, as `hornbill.autopilot`. Sends nothing to it."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._request = connection.request

    def plan(self, program: Literal["ardupilot", "px4"] = "ardupilot") -> list[responses.PlanOutput]:
        """Outputs proposed for the connected servos, as `outputs` of a plan."""
        return self._request("GET", "/autopilot/plan", program=program)

    def write_parameters(self, plan: Mapping[str, Any]) -> responses.ParameterFile:
        """Parameter file of a plan: program, outputs, rate_hz. Raises InvalidValue or OutOfRange with the number."""
        return self._request("POST", "/autopilot/export", dict(plan))

    def read_parameters(self, text: str, program: Literal["ardupilot", "px4"]) -> responses.ImportedPlan:
        """Plan of a parameter file."""
        return self._request("POST", "/autopilot/import", {"program": program, "text": text})

    def begin_verification(self, plan: Mapping[str, Any]) -> responses.Verification:
        """Start to compare what is on the bus with a plan."""
        return self._request("PUT", "/autopilot/verification", dict(plan))

    def verification(self) -> responses.Verification:
        """State of the verification."""
        return self._request("GET", "/autopilot/verification")

    def begin_verification_step(
        self, kind: Literal["neutral", "positive"], output: int | None = None
    ) -> responses.Verification:
        """Start a step: all controls centred, or that of one output fully positive, for 3 s."""
        return self._request("POST", "/autopilot/verification/steps", {"kind": kind, "output": output})

    def end_verification(self) -> None:
        """End the verification."""
        self._request("DELETE", "/autopilot/verification")

    def failsafe(self, uid: str) -> responses.Failsafe:
        """What a servo does when commands stop, and the last gap that confirmed it."""
        return self._request("GET", f"/servos/{quote(uid)}/failsafe")

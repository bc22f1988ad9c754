"""Jobs that restart a servo (save, restart, factory reset): start one, stop in the middle of it, wait for its end."""

import asyncio
from collections.abc import Callable
from typing import Any, TypeVar

import pytest

from behaviour.rig import Rig, json
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.services import Services
from hornbill.wire.datatype import Kind
from hornbill.wire.services import ExecuteOpcodeRequest, ExecuteOpcodeResponse, Opcode, RestartNodeRequest

Request = TypeVar("Request", ExecuteOpcodeRequest, RestartNodeRequest)


async def run(rig: Rig, servo: Servo, verb: str, body: object = None, *, lease: str | None = None) -> Any:
    """The ended job of a save, restart or factory reset."""
    return json(await rig.call("POST", f"/servos/{servo.uid}/{verb}?wait=true", body, lease=lease))


async def run_until(
    rig: Rig, servo: Servo, verb: str, reached: Callable[[RunningJob], bool], body: object = None
) -> str:
    """Start a job and return its id as soon as `reached`."""
    job_id = str(json(await rig.call("POST", f"/servos/{servo.uid}/{verb}", body), 202)["id"])
    job = rig.host.jobs.get(job_id)
    async with asyncio.timeout(30):
        while not reached(job):
            await asyncio.sleep(0.0001)
            assert not job.ended, job.error
    return job_id


async def run_until_step(rig: Rig, servo: Servo, verb: str, step: str, body: object = None) -> str:
    """Start a job and return its id as soon as it is at this step."""
    return await run_until(rig, servo, verb, lambda job: job.step == step, body)


async def ended(rig: Rig, job_id: str) -> Any:
    """The job, once it has ended."""
    await rig.host.jobs.wait(rig.host.jobs.get(job_id))
    return json(await rig.call("GET", f"/jobs/{job_id}"))


def succeeded(job: Any) -> Any:
    """This job, which must have succeeded."""
    assert job["state"] == "succeeded", job
    return job


def failed_with(job: Any, code: str) -> Any:
    """The error of a job that must have failed with this code."""
    assert (job["state"], job["error"] and job["error"]["code"]) == ("failed", code), job
    return job["error"]


def requests(rig: Rig, request: type[Request]) -> list[Request]:
    """The requests of this type that the host sent."""
    sent = rig.transfers("host")
    found = [request.decode(one.payload) for one in sent if one.kind is Kind.REQUEST and one.type_id == request.TYPE.id]
    return [one for one in found if one is not None]


def opcodes(rig: Rig, opcode: Opcode = Opcode.SAVE) -> int:
    """The number of requests with this opcode that the host sent."""
    return sum(one.opcode == opcode for one in requests(rig, ExecuteOpcodeRequest))


def refuse(monkeypatch: pytest.MonkeyPatch, refused: Opcode) -> None:
    """Let servos refuse this opcode."""
    opcode = Services.opcode

    def refusing(self: Services, request: ExecuteOpcodeRequest, behaviour: Behaviour) -> ExecuteOpcodeResponse:
        return ExecuteOpcodeResponse(0, False) if request.opcode == refused else opcode(self, request, behaviour)

    monkeypatch.setattr(Services, "opcode", refusing)

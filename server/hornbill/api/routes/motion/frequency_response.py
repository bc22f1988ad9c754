"""Routes of frequency responses."""

from collections.abc import Iterator
from typing import Annotated

from fastapi import Path, Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo, load_lab
from hornbill.api.downloads import CSV, attachment
from hornbill.api.paging import Page, pages
from hornbill.api.routes.motion.lab import STEP_PROBLEMS
from hornbill.api.routes.server.jobs import Wait, job_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.csv_text import csv_text
from hornbill.domain.fields import Model
from hornbill.domain.frequency_response import Excitation, FrequencyResponse
from hornbill.domain.set_up import SetUp
from hornbill.lab.conditions import set_up_of
from hornbill.servo.host import Host
from hornbill.units import Uid

routes = Routes("lab", after=load_lab)


class FrequencyTest(Model):
    """Options of a frequency response."""

    excitation: Excitation = Field(
        default="chirp", description="chirp: one sine of rising frequency. multisine: many sines at once."
    )
    amplitude_deg: float = Field(
        default=2.0, ge=0.2, le=20, description="Peak amplitude of the command about the current angle, °."
    )
    from_hz: float = Field(default=0.5, ge=0.1, le=10, description="Lowest frequency, Hz.")
    to_hz: float = Field(default=20.0, ge=1, le=25, description="Highest frequency, Hz.")
    duration_s: float = Field(default=20.0, ge=3, le=60, description="Duration at one amplitude, s.")
    ladder: bool = Field(
        default=False,
        description="Also measure at half and at two times the amplitude, to find a dependence on it. At most 10°.",
    )
    note: str = Field(default="", max_length=200, description="Note on other conditions.")
    set_up: SetUp | None = Field(default=None, description="Set-up of this run. Null for that of the servo.")


RunPath = Annotated[int, Path(description="ID of the frequency response.", ge=1, le=2**31 - 1)]


@routes.post("/servos/{uid}/frequency-response", Role.OPERATE, *STEP_PROBLEMS, **starts())
async def measure_frequency_response(
    host: TheHost,
    servo: TheServo,
    body: FrequencyTest | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Measure the frequency response about the current angle. Requires a lease and torque on. Writes no parameters."""
    from hornbill.lab.frequency_job import FrequencyPlan, FrequencyTests

    wanted = body or FrequencyTest()
    host.connected()
    plan = FrequencyPlan(
        wanted.excitation, wanted.amplitude_deg, wanted.from_hz, wanted.to_hz, wanted.duration_s, wanted.ladder,
        wanted.note, wanted.set_up or set_up_of(host.store.servos.get(servo.uid)),
    )  # fmt: skip
    tests = FrequencyTests(host.requests, host.motion, host.base, host.jobs, host.store)
    return await job_response(host, tests.begin(servo, lease, plan), wait)


@routes.get("/frequency-responses", Role.VIEW, "unknown_servo")
async def list_frequency_responses(
    host: TheHost,
    page: Annotated[Page, pages(50, 200)],
    uid: Annotated[ServoRef | None, Query(description="Servo of the frequency responses.")] = None,
) -> list[FrequencyResponse]:
    """List frequency responses of one or all servos, newest first, without the lists of their curves."""
    from hornbill.lab import stored

    wanted = None if uid is None else Uid(uid)
    found = await host.store.run(
        host.store.runs.of, wanted, kind="frequency_response", limit=page.limit + 1, before_id=page.before_id
    )
    return [stored.frequency_response(run, curves=False) for run in page.cut(found, lambda run: run.id)]


@routes.get("/frequency-responses/{run_id}", Role.VIEW, "unknown_run")
async def get_frequency_response(host: TheHost, run_id: RunPath) -> FrequencyResponse:
    """Get a frequency response with its curves."""
    return await _found(host, run_id)


@routes.get("/frequency-responses/{run_id}/csv", Role.VIEW, "unknown_run")
async def get_frequency_response_csv(host: TheHost, run_id: RunPath) -> Response:
    """Download a frequency response as CSV: one line per amplitude and frequency."""
    found = await _found(host, run_id)
    name = f"frequency-response-{run_id}.csv"
    return Response(csv_text(_table(found)), media_type=CSV, headers=attachment(name))


@routes.delete("/frequency-responses/{run_id}", Role.ADMIN, "unknown_run", status_code=204)
async def delete_frequency_response(host: TheHost, run_id: RunPath) -> None:
    """Delete a frequency response."""
    await host.store.run(host.store.runs.find, run_id, "frequency_response")
    await host.store.run(host.store.runs.drop, run_id)


async def _found(host: Host, number: int) -> FrequencyResponse:
    from hornbill.lab import stored

    return stored.frequency_response(await host.store.run(host.store.runs.find, number, "frequency_response"))


def _table(run: FrequencyResponse) -> Iterator[tuple[object, ...]]:
    yield (
        "amplitude_deg", "frequency_hz", "gain_db", "gain_error_db", "phase_deg", "phase_error_deg", "coherence",
        "reliable",
    )  # fmt: skip
    for one in run.curves:
        lists = (
            one.frequency_hz, one.gain_db, one.gain_error_db, one.phase_deg, one.phase_error_deg, one.coherence,
            one.reliable,
        )  # fmt: skip
        for values in zip(*lists, strict=True):
            yield one.amplitude_deg, *values

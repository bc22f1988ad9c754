"""Routes of step tests and their runs."""

from collections.abc import Iterator
from typing import Annotated

from fastapi import Path, Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo, load_lab
from hornbill.api.downloads import CSV, attachment
from hornbill.api.paging import Page, pages
from hornbill.api.routes.server.jobs import Wait, job_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.csv_text import csv_text
from hornbill.domain.fields import Model
from hornbill.domain.set_up import SetUp
from hornbill.domain.step_test import RunOverlay, StepRun
from hornbill.errors import InvalidValue
from hornbill.lab.conditions import set_up_of
from hornbill.servo.host import Host
from hornbill.units import Uid

routes = Routes("lab", after=load_lab)


class StepTest(Model):
    """Options of a step test."""

    step_deg: float = Field(default=5.0, ge=-45, le=45, description="Step size, °. The sign gives the direction.")
    runs: int = Field(default=1, ge=1, le=20, description="Number of repetitions.")
    dwell_s: float = Field(default=1.0, ge=0.3, le=10, description="Time measured on each side, s.")
    band_deg: float | None = Field(
        default=None, gt=0, le=10, description="Settling band, °. Null for 0.5° or the deadband, whichever is larger."
    )
    note: str = Field(default="", max_length=200, description="Note on other conditions.")
    set_up: SetUp | None = Field(default=None, description="Set-up of this run. Null for that of the servo.")


RunPath = Annotated[int, Path(description="ID of the run.", ge=1, le=2**31 - 1)]
STEP_PROBLEMS = (
    "unknown_servo", "invalid_value", "out_of_range", "torque_off", "not_in_this_model", "busy", "stopped",
    "lease_required", "lease_held", "commanded_elsewhere", "configuration_lost", "no_response", "bus_disconnected",
)  # fmt: skip


@routes.post("/servos/{uid}/step-test", Role.OPERATE, *STEP_PROBLEMS, **starts())
async def step_test(
    host: TheHost,
    servo: TheServo,
    body: StepTest | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Measure a small step from the current angle and back. Requires a lease and torque on. Writes no parameters."""
    from hornbill.lab.step import StepPlan, StepTests

    wanted = body or StepTest()
    host.connected()
    set_up = wanted.set_up or set_up_of(host.store.servos.get(servo.uid))
    plan = StepPlan(wanted.step_deg, wanted.runs, wanted.dwell_s, wanted.band_deg, wanted.note, set_up)
    tests = StepTests(host.requests, host.motion, host.base, host.jobs, host.store)
    return await job_response(host, tests.begin(servo, lease, plan), wait)


@routes.get("/runs", Role.VIEW, "unknown_servo")
async def list_runs(
    host: TheHost,
    page: Annotated[Page, pages(50, 200)],
    uid: Annotated[ServoRef | None, Query(description="Servo of the runs.")] = None,
) -> list[StepRun]:
    """List runs of one or all servos, newest first, without samples."""
    from hornbill.lab import stored

    found = await host.store.run(
        host.store.runs.of, None if uid is None else Uid(uid), limit=page.limit + 1, before_id=page.before_id
    )
    return [stored.step_run(run, traces=False) for run in page.cut(found, lambda run: run.id)]


@routes.get("/runs/overlay", Role.VIEW, "unknown_run", "invalid_value")
async def overlay_runs(
    host: TheHost, ids: Annotated[str, Query(description="IDs of up to eight runs, separated by commas.")]
) -> RunOverlay:
    """Get several runs for comparison, and the parameters in which they differ."""
    from hornbill.lab import stored

    numbers = [part.strip() for part in ids.split(",")]
    if not 1 <= len(numbers) <= 8 or not all(part.isascii() and part.isdigit() and len(part) < 10 for part in numbers):
        raise InvalidValue(
            f'Invalid run IDs "{ids[:60]}". Give one to eight IDs, separated by commas.',
            cause="runs_missing",
        )
    return stored.overlay([await _run(host, int(part)) for part in numbers])


@routes.get("/runs/{run_id}", Role.VIEW, "unknown_run")
async def get_run(host: TheHost, run_id: RunPath) -> StepRun:
    """Get a run with its samples."""
    return await _run(host, run_id)


@routes.get("/runs/{run_id}/csv", Role.VIEW, "unknown_run")
async def get_run_csv(host: TheHost, run_id: RunPath) -> Response:
    """Download the samples of a run as CSV: step, direction, time after the command (s), angle and target (°)."""
    run = await _run(host, run_id)
    return Response(csv_text(_table(run)), media_type=CSV, headers=attachment(f"step-run-{run_id}.csv"))


@routes.delete("/runs/{run_id}", Role.ADMIN, "unknown_run", status_code=204)
async def delete_run(host: TheHost, run_id: RunPath) -> None:
    """Delete a run."""
    await host.store.run(host.store.runs.find, run_id, "step")
    await host.store.run(host.store.runs.drop, run_id)


def _table(run: StepRun) -> Iterator[tuple[object, ...]]:
    yield "step", "direction", "t_s", "angle_deg", "target_deg"
    for number, step in enumerate(run.steps, 1):
        for t, angle in zip(step.t, step.angle_deg, strict=True):
            yield number, step.direction, t, angle, step.to_deg


async def _run(host: Host, number: int) -> StepRun:
    from hornbill.lab import stored

    return stored.step_run(await host.store.run(host.store.runs.find, number, "step"))

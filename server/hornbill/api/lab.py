"""Owns the routes of measured motion: step tests, and the runs that are kept of them."""

import csv
import io
from typing import Annotated

from fastapi import APIRouter, Path, Query
from starlette.responses import Response

from hornbill.api import PREFIX
from hornbill.api import motion_models as models
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.jobs import JOB_ANSWERS, Wait, answer
from hornbill.api.models import Job, UidField
from hornbill.api.problems import declared
from hornbill.errors import InvalidValue
from hornbill.lab.step import StepTests, Wish
from hornbill.servo.host import Host
from hornbill.store.runs import Run
from hornbill.units import Uid

router = APIRouter(prefix=PREFIX, tags=["lab"])

RunPath = Annotated[int, Path(description="number of the run", ge=1, le=2**31 - 1)]
STEP_PROBLEMS = declared(
    "unknown_servo", "invalid_value", "out_of_range", "torque_off", "not_in_this_model", "busy", "stopped",
    "lease_required", "lease_held", "configuration_lost", "no_answer", "bus_disconnected",
)  # fmt: skip


@router.post(
    "/servos/{uid}/step-test",
    operation_id="step_test",
    status_code=202,
    response_model=Job,
    responses={**STEP_PROBLEMS, **JOB_ANSWERS},
)
async def step_test(
    host: TheHost,
    servo: TheServo,
    body: models.StepTest | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """A small step there and back where the horn stands, measured. Needs a lease and torque on; writes no parameter."""
    wanted = body or models.StepTest()
    host.connected()
    wish = Wish(wanted.step_deg, wanted.runs, wanted.dwell_s, wanted.band_deg, wanted.note)
    tests = StepTests(host.asker, host.motion, host.base, host.jobs, host.store.runs)
    return await answer(host, tests.begin(servo, lease, wish), wait)


@router.get("/runs", operation_id="list_runs")
async def list_runs(
    host: TheHost,
    uid: UidField | None = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> list[models.StepRun]:
    """Runs of a servo, or of all, newest first, without their samples."""
    return [
        _shown(host, run, traces=False) for run in host.store.runs.of(None if uid is None else Uid(uid), limit=limit)
    ]


@router.get("/runs/overlay", operation_id="overlay_runs", responses=declared("unknown_run", "invalid_value"))
async def overlay_runs(
    host: TheHost, ids: Annotated[str, Query(description="numbers of up to eight runs, with commas")]
) -> models.RunOverlay:
    """Runs to lay over one another, and the parameters in which they differ."""
    numbers = [part.strip() for part in ids.split(",")]
    if not 1 <= len(numbers) <= 8 or not all(part.isascii() and part.isdigit() and len(part) < 10 for part in numbers):
        raise InvalidValue(f'"{ids[:60]}" names no runs. Give the numbers of one to eight, with commas between them.')
    runs = [_shown(host, host.store.runs.get(int(part)), traces=True) for part in numbers]
    keys = {key: None for run in runs for key in run.parameters}
    differ = {key: [run.parameters.get(key) for run in runs] for key in keys}
    return models.RunOverlay(runs=runs, differences={k: v for k, v in differ.items() if any(one != v[0] for one in v)})


@router.get("/runs/{run_id}", operation_id="get_run", responses=declared("unknown_run"))
async def get_run(host: TheHost, run_id: RunPath) -> models.StepRun:
    """One run with its samples."""
    return _shown(host, host.store.runs.get(run_id), traces=True)


@router.get("/runs/{run_id}/csv", operation_id="get_run_csv", responses=declared("unknown_run"))
async def get_run_csv(host: TheHost, run_id: RunPath) -> Response:
    """The samples of a run: step, direction, time after the command in s, angle and target in degrees."""
    run = _shown(host, host.store.runs.get(run_id), traces=True)
    out = io.StringIO()
    rows = csv.writer(out)
    rows.writerow(("step", "direction", "t_s", "angle_deg", "target_deg"))
    for number, step in enumerate(run.steps, 1):
        rows.writerows((number, step.direction, t, a, step.to_deg) for t, a in zip(step.t, step.angle_deg, strict=True))
    name = {"Content-Disposition": f'attachment; filename="step-run-{run_id}.csv"'}
    return Response(out.getvalue(), media_type="text/csv; charset=utf-8", headers=name)


@router.delete("/runs/{run_id}", operation_id="drop_run", status_code=204, responses=declared("unknown_run"))
async def drop_run(host: TheHost, run_id: RunPath) -> None:
    """Forget a run."""
    host.store.runs.drop(run_id)


def _shown(host: Host, run: Run, *, traces: bool) -> models.StepRun:
    shown = models.StepRun.model_validate(
        {"id": run.id, "uid": run.uid, "at": run.at, "note": run.note, **run.document}
    )
    if not traces:
        for step in shown.steps:
            step.t, step.angle_deg = [], []
    return shown

"""Routes of mechanics: measure, results, export."""

from typing import Annotated, Literal

from fastapi import Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo, load_lab
from hornbill.api.downloads import attachment
from hornbill.api.routes.motion.lab import STEP_PROBLEMS
from hornbill.api.routes.server.jobs import Wait, job_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.domain.mechanics import Mechanics, MechanicsTest
from hornbill.domain.set_up import SetUp
from hornbill.errors import Unknown
from hornbill.lab.conditions import set_up_of
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.store.runs import Run

routes = Routes("lab", after=load_lab)


class MeasureMechanics(Model):
    """Options of a measurement of mechanics."""

    tests: list[MechanicsTest] = Field(
        default=["friction"],
        min_length=1,
        max_length=7,
        description="What to measure. friction and backlash are one test.",
    )
    from_deg: float | None = Field(
        default=None, ge=-170, le=170, description="Lower end of the range, °. Null for 20° below the present angle."
    )
    to_deg: float | None = Field(
        default=None, ge=-170, le=170, description="Upper end of the range, °. Null for 20° above the present angle."
    )
    torque_pct: float = Field(
        default=60.0, ge=10, le=100, description="Highest torque command, % of stall torque. End stops: at most 30 %."
    )
    speed_rpm: float = Field(default=60.0, ge=5, le=150, description="Speed at which a torque is reversed, rpm.")
    note: str = Field(default="", max_length=200, description="Note on other conditions.")
    set_up: SetUp | None = Field(default=None, description="Set-up of this run. Null for that of the servo.")


ExportFormat = Literal["json", "mujoco", "urdf"]


@routes.post("/servos/{uid}/mechanics", Role.OPERATE, *STEP_PROBLEMS, **starts())
async def measure_mechanics(
    host: TheHost,
    servo: TheServo,
    body: MeasureMechanics | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Measure friction, backlash, load, deadband or end stops by moving the horn within a range. Requires a lease and
    torque on. Gains and limits are changed in RAM meanwhile; every ending restores and verifies them."""
    from hornbill.lab.mechanics_job import MechanicsPlan, MechanicsTests

    wanted = body or MeasureMechanics()
    host.connected()
    plan = MechanicsPlan(
        wanted.tests, wanted.from_deg, wanted.to_deg, wanted.torque_pct, wanted.speed_rpm, wanted.note,
        wanted.set_up or set_up_of(host.store.servos.get(servo.uid)),
    )  # fmt: skip
    tests = MechanicsTests(host.services, host.motion, host.store, host.compute)
    return await job_response(host, tests.begin(servo, lease, plan), wait)


@routes.get("/servos/{uid}/mechanics", Role.VIEW, "unknown_servo")
async def get_mechanics(host: TheHost, servo: TheServo) -> Mechanics:
    """Get the newest measured mechanics of a servo, with 95 % intervals."""
    from hornbill.lab import mechanics_export

    return mechanics_export.known(servo.uid, await _runs(host, servo))


@routes.get("/servos/{uid}/mechanics/export", Role.VIEW, "unknown_servo", "unknown_run")
async def export_mechanics(
    host: TheHost,
    servo: TheServo,
    format: Annotated[
        ExportFormat, Query(description="json: twin for the simulator. mujoco: MJCF model. urdf: joint.")
    ] = "json",
    stall_nm: Annotated[
        float | None,
        Query(gt=0, le=100, description="Stall torque, N·m, for mujoco and urdf. Null: torque in shares of it."),
    ] = None,
) -> Response:
    """Download the measured mechanics as a twin for the simulator, or as an actuator for MuJoCo or URDF."""
    from hornbill.lab import mechanics_export

    runs = await _runs(host, servo)
    if not runs:
        raise Unknown(
            "unknown_run", f"{servo.title} has no measured mechanics. Measure them first.", cause="not_measured",
            servo=servo.title,
        )  # fmt: skip
    twin = mechanics_export.twin(mechanics_export.known(servo.uid, runs), runs[0])
    name = f"hornbill-{servo.uid[:8]}"
    if format == "json":
        return Response(
            twin.model_dump_json(indent=2), media_type="application/json", headers=attachment(f"{name}.json")
        )
    one = mechanics_export.actuator(twin, runs[0], servo.catalog, stall_nm)
    if one is None:
        raise Unknown(
            "unknown_run", f"The model of {servo.title} was unknown when its mechanics were measured. Measure again.",
            cause="not_measured", servo=servo.title,
        )  # fmt: skip
    text = mechanics_export.mjcf(name, one) if format == "mujoco" else mechanics_export.urdf(name, one)
    ending = "xml" if format == "mujoco" else "urdf"
    return Response(text, media_type="application/xml", headers=attachment(f"{name}.{ending}"))


async def _runs(host: Host, servo: Servo) -> list[Run]:
    return await host.store.run(host.store.runs.of, servo.uid, kind="mechanics")

"""`hornbill mechanics`: measure, show, export."""

from enum import StrEnum
from typing import Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, AsJson, Server, ServoName, client
from hornbill.cli.showing import print_job, print_json, print_table, progress

app = typer.Typer(no_args_is_help=True, help="Friction, inertia, backlash, load and end stops of a servo.")


class Test(StrEnum):
    """What to measure."""

    DEADBAND = "deadband"
    REPEATABILITY = "repeatability"
    SPEED = "speed"
    FRICTION = "friction"
    BACKLASH = "backlash"
    TRAVEL = "travel"
    END_STOPS = "end_stops"


@app.command("measure")
def measure(
    servo: ServoName,
    tests: Annotated[
        list[Test] | None, typer.Option("--test", help="What to measure. Repeatable. Default: friction.")
    ] = None,
    from_deg: Annotated[
        float | None, typer.Option("--from", help="Lower end of the range, °. Default: 20° below the present angle.")
    ] = None,
    to_deg: Annotated[
        float | None, typer.Option("--to", help="Upper end of the range, °. Default: 20° above the present angle.")
    ] = None,
    torque: Annotated[float, typer.Option(help="Highest torque, % of stall torque.", min=10, max=100)] = 60.0,
    speed: Annotated[float, typer.Option(help="Speed at which a torque is reversed, rpm.", min=5, max=150)] = 60.0,
    note: Annotated[str, typer.Option(help="Note on other conditions.")] = "",
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Measure mechanics: turn torque on, move the horn within the range, and turn torque off. Prompts for
    confirmation."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        low = "20° below its angle" if from_deg is None else f"{from_deg:g}°"
        high = "20° above it" if to_deg is None else f"{to_deg:g}°"
        require_confirmation(
            f"Turn torque on and move the horn of {found.title} between {low} and {high}, with up to {torque:g} % "
            "torque?",
            yes,
            as_json=as_json,
        )
        with hornbill.lease(hornbill.by, uids=[found.uid]):
            found.torque("on")
            with progress() as bar:
                job = found.measure_mechanics(
                    [str(one) for one in tests or [Test.FRICTION]], from_deg=from_deg, to_deg=to_deg,
                    torque_pct=torque, speed_rpm=speed, note=note, on_progress=bar,
                )  # fmt: skip
        print_json(job) if as_json else print_job(job)


@app.command("show")
def show(servo: ServoName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the newest measured values with their 95 % intervals."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).mechanics()
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["name"],
            "" if one["estimate"] is None else f"{one['estimate']['value']:.4g}",
            "" if one["estimate"] is None else f"{one['estimate']['low']:.4g} to {one['estimate']['high']:.4g}",
            one["unit"],
            one["run"],
            "" if one["note"] is None else one["note"]["text"],
        )
        for one in found["values"]
    ]
    print_table(("quantity", "value", "95 % interval", "unit", "run", "note"), rows)
    if found["travel"]:
        points = [
            (
                one["angle_deg"],
                f"{one['load_pct']:.1f}",
                f"{one['friction_pct']:.1f}",
                "binds" if one["binding"] else "",
            )
            for one in found["travel"]
        ]
        print_table(("angle °", "load %", "friction %", "binds"), points)


@app.command("export")
def export(
    servo: ServoName,
    form: Annotated[
        Literal["json", "mujoco", "urdf"],
        typer.Option("--format", help="json: twin for the simulator. mujoco: MJCF model. urdf: joint."),
    ] = "json",
    stall_nm: Annotated[
        float | None, typer.Option(help="Stall torque, N·m. Without it, torque is in shares of it.", min=0.001, max=100)
    ] = None,
    server: Server = LOCAL_URL,
) -> None:
    """Write the measured mechanics to standard output: for hornbill sim --plant, MuJoCo or URDF."""
    with client(server) as hornbill:
        typer.echo(hornbill.look_up(servo).export_mechanics(form, stall_nm=stall_nm), nl=False)

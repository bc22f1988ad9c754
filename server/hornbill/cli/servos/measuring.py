"""The commands that measure: step and its runs, samples, position-unit."""

import sys
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, agree
from hornbill.cli.connection import HERE, AsJson, Server, Which, client, complete_key, complete_servo
from hornbill.cli.showing import instant, print_job, print_json, print_table, progress

if TYPE_CHECKING:
    from hornbill.client import answers

runs = typer.Typer(no_args_is_help=True, help="Steps that were measured.")

RunNumber = Annotated[int, typer.Argument(metavar="RUN", help="its number, as 'hornbill runs list' has it")]


def step(
    servo: Which,
    degrees: Annotated[float, typer.Option("--step", help="° there and back", min=-45, max=45)] = 5.0,
    times: Annotated[int, typer.Option("--runs", help="so often", min=1, max=20)] = 1,
    dwell: Annotated[float, typer.Option(help="seconds each side is watched", min=0.3, max=10)] = 1.0,
    note: Annotated[str, typer.Option(help="load, mounting, whatever will matter later")] = "",
    yes: Yes = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Measure a small step around where the horn stands: turns torque on, moves, and lets go. Asks first."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        agree(
            f"{found.title} turns torque on and moves its horn by {degrees:g}° and back. Do it?", yes, as_json=as_json
        )
        with hornbill.lease(hornbill.by):
            found.torque("on")
            with progress() as bar:
                job = found.step_test(degrees, runs=times, dwell_s=dwell, note=note, on_progress=bar)
        print_json(job) if as_json else print_job(job)


@runs.command("list")
def list_(
    servo: Annotated[str | None, typer.Option(help="only of this one", autocompletion=complete_servo)] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Every run, the newest first."""
    with client(server) as hornbill:
        found = hornbill.records.runs(uid=None if servo is None else hornbill.look_up(servo).uid)
    if as_json:
        print_json(found)
        return
    rows = [
        (one["id"], instant(one["at"]), one["uid"][:8], one["model"], f"{one['step_deg']:g}°", one["note"])
        for one in found
    ]
    print_table(("run", "measured", "uid", "model", "step", "note"), rows)


@runs.command("show")
def show(number: RunNumber, server: Server = HERE, as_json: AsJson = False) -> None:
    """What was measured of each step."""
    with client(server) as hornbill:
        found = hornbill.records.run(number)
    if as_json:
        print_json(found)
        return
    _show_steps([found])
    for warning in found["warnings"]:
        print(warning, file=sys.stderr)


@runs.command("compare")
def compare(
    numbers: Annotated[list[int], typer.Argument(metavar="RUN…", help="up to eight")],
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Several runs, and the parameters in which they differ."""
    with client(server) as hornbill:
        found = hornbill.records.overlay(numbers)
    if as_json:
        print_json(found)
        return
    _show_steps(found["runs"])
    for key, values in found["differences"].items():
        print(f"{key}: {values}")


@runs.command("csv")
def csv(number: RunNumber, server: Server = HERE) -> None:
    """Write every sample of a run to standard output."""
    with client(server) as hornbill:
        typer.echo(hornbill.records.run_csv(number), nl=False)


@runs.command("delete")
def delete(number: RunNumber, server: Server = HERE) -> None:
    """Forget a run."""
    with client(server) as hornbill:
        hornbill.records.drop_run(number)


def samples(
    servo: Which,
    seconds: Annotated[float, typer.Option(help="so far back", min=0.1, max=7200)] = 60.0,
    channel: Annotated[
        list[str] | None,
        typer.Option(help="only this parameter; may be repeated", autocompletion=complete_key),
    ] = None,
    server: Server = HERE,
) -> None:
    """Write a servo's recent samples as CSV. What is polled is sampled: hornbill watch --channel current_angle"""
    with client(server) as hornbill:
        typer.echo(hornbill.look_up(servo).samples_csv(seconds, channel), nl=False)


def position_unit(
    servo: Which,
    unit: Annotated[
        Literal["measured", "hundred_degrees", "radian", "degree", "tenth_degree"] | None,
        typer.Argument(help="say it, or have it measured; only shown unless given"),
    ] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """What position 1.0 on the bus means for a servo, and how that is known."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        wanted = None if unit == "measured" else unit
        state = found.position_unit() if unit is None else found.set_position_unit(wanted)
    print_json(state) if as_json else print(f"{state['unit']}, {state['state']}: {state['evidence']}")


def _show_steps(found: "list[answers.StepRun]") -> None:
    rows = [
        (
            run["id"], f"{one['from_deg']:+.1f}° → {one['to_deg']:+.1f}°", _seconds(one["metrics"]["rise_s"]),
            _seconds(one["metrics"]["settling_s"]), _number(one["metrics"]["overshoot_pct"]),
            _number(one["metrics"]["steady_state_error_deg"]), one["metrics"]["hunting"],
        )
        for run in found
        for one in run["steps"]
    ]  # fmt: skip
    print_table(("run", "step", "rise", "settled after", "overshoot %", "error °", "hunting"), rows)


def _seconds(value: float | None) -> str | None:
    return None if value is None else f"{value:.3f} s"


def _number(value: float | None) -> str | None:
    return None if value is None else f"{value:.2f}"

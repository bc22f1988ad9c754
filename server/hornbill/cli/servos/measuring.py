"""Commands for measuring: set-up, step-test, runs, frequency-response, samples, position-unit."""

import sys
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import (
    LOCAL_URL,
    AsJson,
    Server,
    ServoName,
    changes_of,
    client,
    complete_key,
    complete_servo,
)
from hornbill.cli.showing import instant, print_job, print_json, print_table, progress

if TYPE_CHECKING:
    from hornbill.client import responses

runs = typer.Typer(no_args_is_help=True, help="Stored runs of step tests.")
responses_ = typer.Typer(no_args_is_help=True, help="Stored frequency responses.")

RunNumber = Annotated[int, typer.Argument(metavar="RUN", help="ID, as shown by 'hornbill runs list'.")]
ResponseNumber = Annotated[
    int, typer.Argument(metavar="ID", help="ID, as shown by 'hornbill frequency-responses list'.")
]


def set_up(
    servo: ServoName,
    values: Annotated[
        list[str] | None,
        typer.Argument(metavar="KEY=VALUE…", help="Changes, such as arm_mm=60. KEY= removes a value."),
    ] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Show or change the set-up of a servo: load, mounting and surroundings, which runs copy."""
    changes = {key: None if value == "" else value for key, value in changes_of(values or []).items()}
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        state = found.set_up()
        if changes:
            merged: dict[str, Any] = {**state, **changes}
            state = found.put_set_up(merged)
    print_json(state) if as_json else print_table(("key", "value"), state.items())


def step_test(
    servo: ServoName,
    degrees: Annotated[float, typer.Option("--step", help="Step size, °.", min=-45, max=45)] = 5.0,
    times: Annotated[int, typer.Option("--runs", help="Number of repetitions.", min=1, max=20)] = 1,
    dwell: Annotated[float, typer.Option(help="Time measured on each side, s.", min=0.3, max=10)] = 1.0,
    note: Annotated[str, typer.Option(help="Note on load, mounting or other conditions.")] = "",
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Run a step test: turn torque on, step the horn and back, and turn torque off. Prompts for confirmation."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        require_confirmation(
            f"Turn torque on and move the horn of {found.title} by {degrees:g}° and back?", yes, as_json=as_json
        )
        with hornbill.lease(hornbill.by, uids=[found.uid]):
            found.torque("on")
            with progress() as bar:
                job = found.step_test(degrees, runs=times, dwell_s=dwell, note=note, on_progress=bar)
        print_json(job) if as_json else print_job(job)


@runs.command("list")
def list_(
    servo: Annotated[str | None, typer.Option(help="Only runs of this servo.", autocompletion=complete_servo)] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """List runs, newest first."""
    with client(server) as hornbill:
        found = hornbill.records.runs(uid=None if servo is None else hornbill.look_up(servo).uid)
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["id"],
            instant(one["at"]),
            one["uid"][:8],
            one["model"],
            f"{one['step_deg']:g}°",
            one["verdict"]["text"],
            one["note"],
        )
        for one in found
    ]
    print_table(("run", "time", "uid", "model", "step", "verdict", "note"), rows)


@runs.command("show")
def show(number: RunNumber, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the metrics of a run."""
    with client(server) as hornbill:
        found = hornbill.records.run(number)
    if as_json:
        print_json(found)
        return
    _print_verdict(found["verdict"])
    _show_steps([found])
    for warning in found["warnings"]:
        print(warning["text"], file=sys.stderr)


@runs.command("compare")
def compare(
    numbers: Annotated[list[int], typer.Argument(metavar="RUN…", help="Up to eight IDs.")],
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Compare runs, and show the parameters in which they differ."""
    with client(server) as hornbill:
        found = hornbill.records.overlay(numbers)
    if as_json:
        print_json(found)
        return
    _show_steps(found["runs"])
    for key, values in found["differences"].items():
        print(f"{key}: {values}")
    if found["not_comparable"] is not None:
        print(found["not_comparable"]["text"], file=sys.stderr)


@runs.command("export")
def export(number: RunNumber, server: Server = LOCAL_URL) -> None:
    """Write the samples of a run as CSV to standard output."""
    with client(server) as hornbill:
        typer.echo(hornbill.records.run_csv(number), nl=False)


@runs.command("delete")
def delete(number: RunNumber, server: Server = LOCAL_URL) -> None:
    """Delete a run."""
    with client(server) as hornbill:
        hornbill.records.delete_run(number)


def frequency_response(
    servo: ServoName,
    amplitude: Annotated[float, typer.Option(help="Amplitude, °.", min=0.2, max=20)] = 2.0,
    from_hz: Annotated[float, typer.Option("--from", help="Lowest frequency, Hz.", min=0.1, max=10)] = 0.5,
    to_hz: Annotated[float, typer.Option("--to", help="Highest frequency, Hz.", min=1, max=25)] = 20.0,
    duration: Annotated[float, typer.Option(help="Duration at one amplitude, s.", min=3, max=60)] = 20.0,
    excitation: Annotated[Literal["chirp", "multisine"], typer.Option(help="Kind of excitation.")] = "chirp",
    ladder: Annotated[bool, typer.Option("--ladder", help="Also at half and two times the amplitude.")] = False,
    note: Annotated[str, typer.Option(help="Note on other conditions.")] = "",
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Measure a frequency response: turn torque on, swing the horn, and turn torque off. Prompts for confirmation."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        reach, took = (2 * amplitude, 3 * duration) if ladder else (amplitude, duration)
        require_confirmation(
            f"Turn torque on and swing the horn of {found.title} by ±{reach:g}° for {took:g} s?", yes, as_json=as_json
        )
        with hornbill.lease(hornbill.by, uids=[found.uid]):
            found.torque("on")
            with progress() as bar:
                job = found.frequency_response(
                    excitation=excitation, amplitude_deg=amplitude, from_hz=from_hz, to_hz=to_hz, duration_s=duration,
                    ladder=ladder, note=note, on_progress=bar,
                )  # fmt: skip
        print_json(job) if as_json else print_job(job)


@responses_.command("list")
def list_responses(
    servo: Annotated[str | None, typer.Option(help="Only those of this servo.", autocompletion=complete_servo)] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """List frequency responses, newest first."""
    with client(server) as hornbill:
        found = hornbill.records.frequency_responses(uid=None if servo is None else hornbill.look_up(servo).uid)
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["id"], instant(one["at"]), one["uid"][:8], one["model"], f"±{one['amplitude_deg']:g}°",
            one["verdict"]["text"], one["note"],
        )
        for one in found
    ]  # fmt: skip
    print_table(("id", "time", "uid", "model", "amplitude", "verdict", "note"), rows)


@responses_.command("show")
def show_response(number: ResponseNumber, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the verdict and the metrics of a frequency response, with their 95 % intervals."""
    with client(server) as hornbill:
        found = hornbill.records.frequency_response(number)
    if as_json:
        print_json(found)
        return
    _print_verdict(found["verdict"])
    rows = [
        (f"±{curve['amplitude_deg']:g}°", name, f"{metric['value']:.3g}", f"{metric['low']:.3g} … {metric['high']:.3g}")
        for curve in found["curves"]
        for name, metric in curve["metrics"].items()
        if isinstance(metric, dict)
    ]
    print_table(("amplitude", "metric", "value", "95 %"), rows)


@responses_.command("export")
def export_response(number: ResponseNumber, server: Server = LOCAL_URL) -> None:
    """Write the curves of a frequency response as CSV to standard output."""
    with client(server) as hornbill:
        typer.echo(hornbill.records.frequency_response_csv(number), nl=False)


@responses_.command("delete")
def delete_response(number: ResponseNumber, server: Server = LOCAL_URL) -> None:
    """Delete a frequency response."""
    with client(server) as hornbill:
        hornbill.records.delete_frequency_response(number)


def samples(
    servo: ServoName,
    seconds: Annotated[float, typer.Option(help="Time span up to now, s.", min=0.1, max=7200)] = 60.0,
    channel: Annotated[
        list[str] | None,
        typer.Option(help="Parameter to include. Repeatable. Default: all.", autocompletion=complete_key),
    ] = None,
    server: Server = LOCAL_URL,
) -> None:
    """Write recent samples of a servo as CSV to standard output. Only polled parameters have samples."""
    with client(server) as hornbill:
        typer.echo(hornbill.look_up(servo).samples_csv(seconds, channel), nl=False)


def position_unit(
    servo: ServoName,
    unit: Annotated[
        Literal["measured", "hundred_degrees", "radian", "degree", "tenth_degree"] | None,
        typer.Argument(help="Unit to set, or measured. Default: show the current unit."),
    ] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Show or set the unit of a servo's positions on the bus."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        wanted = None if unit == "measured" else unit
        state = found.position_unit() if unit is None else found.set_position_unit(wanted)
    print_json(state) if as_json else print(f"{state['unit']}, {state['state']}: {state['evidence']}")


def _show_steps(found: "list[responses.StepRun]") -> None:
    rows = [
        (
            run["id"], f"{one['from_deg']:+.1f}° → {one['to_deg']:+.1f}°", _seconds(one["metrics"]["rise_s"]),
            _seconds(one["metrics"]["settling_s"]), _number(one["metrics"]["overshoot_pct"]),
            _number(one["metrics"]["steady_state_error_deg"]), one["metrics"]["hunting"],
        )
        for run in found
        for one in run["steps"]
    ]  # fmt: skip
    print_table(("run", "step", "rise time", "settling time", "overshoot %", "error °", "hunting"), rows)


def _print_verdict(verdict: "responses.Verdict") -> None:
    print(verdict["text"])
    if verdict["advice"] is not None:
        print(verdict["advice"]["text"])


def _seconds(value: float | None) -> str | None:
    return None if value is None else f"{value:.3f} s"


def _number(value: float | None) -> str | None:
    return None if value is None else f"{value:.2f}"

"""Command for tuning: improve."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, AsJson, Server, client, complete_servo
from hornbill.cli.showing import print_job, print_json, print_table, progress

if TYPE_CHECKING:
    from hornbill.client import responses


def improve(
    servos: Annotated[
        list[str],
        typer.Argument(metavar="SERVO…", help="Label, serial or UID; several in turn.", autocompletion=complete_servo),
    ],
    goal: Annotated[Literal["calm", "fast", "stiff"], typer.Option(help="What to improve.")] = "calm",
    from_deg: Annotated[float | None, typer.Option("--from", help="Lowest angle, °.")] = None,
    to_deg: Annotated[float | None, typer.Option("--to", help="Highest angle, °.")] = None,
    torque: Annotated[float | None, typer.Option(help="Largest torque, %.", min=5, max=100)] = None,
    speed: Annotated[float | None, typer.Option(help="Highest speed, rpm.", min=5, max=300)] = None,
    seconds: Annotated[float, typer.Option("--time", help="Longest duration of each, s.", min=10, max=600)] = 120.0,
    expert: Annotated[bool, typer.Option(help="Also change the speed loop, against the maker's advice.")] = False,
    dry_run: Annotated[bool, typer.Option(help="Show what would move, and change nothing.")] = False,
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Find better gains by measured steps. They are kept in RAM only if measured better; otherwise the previous ones
    are restored and verified. Turns torque on, and off at the end. Prompts for confirmation."""
    given = {"from_deg": from_deg, "to_deg": to_deg, "torque_pct": torque, "speed_rpm": speed, "time_s": seconds}
    bounds = {name: value for name, value in given.items() if value is not None}
    with client(server) as hornbill:
        found = [hornbill.look_up(one) for one in servos]
        if dry_run:
            plans = [one.plan_improve(goal, bounds=bounds, expert=expert) for one in found]
            print_json(plans) if as_json else _print_plans([one.title for one in found], plans)
            return
        titles = ", ".join(one.title for one in found)
        require_confirmation(f"Turn torque on and move {titles} repeatedly to find better gains?", yes, as_json=as_json)
        with hornbill.lease(hornbill.by, uids=[one.uid for one in found]):
            for one in found:
                one.torque("on")
            with progress() as bar:
                if len(found) == 1:
                    job = found[0].improve(goal, bounds=bounds, expert=expert, on_progress=bar)
                else:
                    job = hornbill.improve(found, goal, bounds=bounds, expert=expert, on_progress=bar)
    if as_json:
        print_json(job)
        return
    print_job(job)
    result = job["result"] or {}
    if "text" in result:
        typer.echo(result["text"])


def _print_plans(titles: "list[str]", plans: "list[responses.ImprovePreview]") -> None:
    rows = [
        (
            title, f"{one['from_deg']:g}° to {one['to_deg']:g}°", f"{one['step_deg']:g}°", one["steps"],
            f"{one['duration_s']:g} s", ", ".join(one["changes"]), ", ".join(one["limits"]),
        )
        for title, one in zip(titles, plans, strict=True)
    ]  # fmt: skip
    print_table(("servo", "range", "step", "steps at most", "time at most", "changes", "limits"), rows)

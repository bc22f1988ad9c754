"""Commands for servos commanded by an autopilot: parameter files, live verification and failsafe."""

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from hornbill.cli.connection import LOCAL_URL, AsJson, Server, ServoName, client
from hornbill.cli.showing import print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hornbill.client import responses

app = typer.Typer(no_args_is_help=True, help="Export to ArduPilot or PX4, and verify what it sends.")

Program = Annotated[Literal["ardupilot", "px4"], typer.Option(help="Autopilot program.")]
PlanFile = Annotated[Path, typer.Argument(metavar="PLAN", help="JSON file written by `autopilot plan`.")]

POLL_S = 0.2


@app.command("plan")
def plan(program: Program = "ardupilot", server: Server = LOCAL_URL) -> None:
    """Print a plan for the connected servos as JSON: outputs, ends and neutral. Edit it, then export it."""
    with client(server) as hornbill:
        print_json({"program": program, "outputs": hornbill.autopilot.plan(program), "rate_hz": 50})


@app.command("export")
def export(
    plan: PlanFile,
    file: Annotated[Path | None, typer.Option("--output", "-o", help="File to write. Default: print it.")] = None,
    server: Server = LOCAL_URL,
) -> None:
    """Write the parameter file of a plan. Points to check are printed to standard error."""
    with client(server) as hornbill:
        made = hornbill.autopilot.write_parameters(_read(plan))
    if file is None:
        print(made["text"], end="")
    else:
        file.write_text(made["text"], encoding="utf-8")
    _print_advice(made["advice"])


@app.command("import")
def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Parameter file of the autopilot.")],
    program: Program = "ardupilot",
    server: Server = LOCAL_URL,
) -> None:
    """Print the plan of a parameter file as JSON. Points to check are printed to standard error."""
    with client(server) as hornbill:
        found = hornbill.autopilot.read_parameters(file.read_text(encoding="utf-8", errors="replace"), program)
    print_json(found["plan"])
    _print_advice(found["advice"])


@app.command("verify")
def verify(plan: PlanFile, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Compare what the autopilot sends with a plan: prompts to hold each control. The exit code is 1 if one differs."""
    with client(server) as hornbill:
        state = hornbill.autopilot.begin_verification(_read(plan))
        for output in (None, *(row["output"] for row in state["rows"])):
            kind: Literal["neutral", "positive"] = "neutral" if output is None else "positive"
            what = "Centre all controls" if output is None else f"Hold the control of output {output} fully positive"
            typer.prompt(f"{what}, then press Enter", default="", show_default=False, err=True)
            state = hornbill.autopilot.begin_verification_step(kind, output)
            while state["left_s"] is not None:
                time.sleep(POLL_S)
                state = hornbill.autopilot.verification()
        hornbill.autopilot.end_verification()
    if as_json:
        print_json(state)
    else:
        _print_rows(state["rows"])
    if any(row["result"] != "matches" for row in state["rows"]):
        raise typer.Exit(1)


@app.command("failsafe")
def failsafe(servo: ServoName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show what a servo does when commands stop (0x26, 0x27)."""
    with client(server) as hornbill:
        found = hornbill.autopilot.failsafe(hornbill.look_up(servo).uid)
    if as_json:
        print_json(found)
        return
    print(found["text"])
    gap = found["confirmed"]
    if gap is not None and gap["gap_s"] is not None:
        print(f"Measured: node {gap['node_id']} paused for {gap['gap_s']:.2f} s.")


def _read(plan: Path) -> Any:
    try:
        return json.loads(plan.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise typer.BadParameter(f"{plan} is not a JSON file: {error}") from None


def _print_advice(advice: "Sequence[responses.AdviceItem]") -> None:
    for one in advice:
        where = "" if one["output"] is None else f"output {one['output']}: "
        print(f"{where}{one['text']}", file=sys.stderr)


def _print_rows(rows: "Sequence[responses.VerifyRow]") -> None:
    print_table(
        ("output", "servo ID", "name", "exported", "on the bus", "result"),
        [
            (
                one["output"], one["servo_id"], one["label"], f"{one['positive_deg']:+.1f}°",
                "no entry" if one["held_deg"] is None else f"{one['held_deg']:+.1f}°",
                one["result"] if one["swapped_with"] is None else f"swapped with {one['swapped_with']}",
            )
            for one in rows
        ],
    )  # fmt: skip

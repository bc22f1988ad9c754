"""`hornbill run`: test plans."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, AsJson, Confirm, DryRun, Server, client, complete_job
from hornbill.cli.failing import Exit
from hornbill.cli.plain_text import text_of
from hornbill.cli.showing import print_job, print_json, print_table, progress
from hornbill.errors import HornbillError, InvalidValue

if TYPE_CHECKING:
    from hornbill.client import Hornbill, responses


def run(
    plan: Annotated[
        Path | None, typer.Argument(exists=True, dir_okay=False, help="Test plan (TOML). Not with --resume.")
    ] = None,
    dry_run: DryRun = False,
    resume: Annotated[
        str | None,
        typer.Option(metavar="JOB", help="Resume this job with its own plan.", autocompletion=complete_job),
    ] = None,
    junit: Annotated[Path | None, typer.Option(dir_okay=False, help="Write a JUnit report to this file.")] = None,
    csv: Annotated[Path | None, typer.Option(dir_okay=False, help="Write a CSV report to this file.")] = None,
    html: Annotated[Path | None, typer.Option(dir_okay=False, help="Write a printable report to this file.")] = None,
    detach: Annotated[bool, typer.Option("--detach", help="Print the job ID and exit. The run continues.")] = False,
    confirm: Confirm = None,
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Run a test plan: turn torque on, move servos in cycles within limits, turn torque off. Prompts for confirmation.

    The server carries it out, also if this command ends. The exit code is 0 if all limits were kept.
    """
    if (plan is None) == (resume is None):
        raise typer.BadParameter("Give a plan, or --resume JOB.")
    if resume is not None and dry_run:
        raise typer.BadParameter("--dry-run needs a plan.")
    files = {form: file for form, file in {"junit": junit, "csv": csv, "html": html}.items() if file is not None}
    with client(server) as hornbill:
        if plan is not None:
            document = _read(plan)
            if dry_run:
                _show_dry_run(hornbill.check_plan(document, confirm=confirm or ()), as_json)
                return
            question = f"Turn torque on and run {document.get('name')} with {document.get('servos')}?"
            require_confirmation(question, yes, as_json=as_json)
            job = hornbill.start_plan(document, confirm=confirm or ())
        else:
            require_confirmation(f"Turn torque on and resume job {resume}?", yes, as_json=as_json)
            job = hornbill.jobs.resume(str(resume))
        if detach:
            print_json(job) if as_json else print(job["id"])
            return
        print(f"Job {job['id']}. 'hornbill jobs cancel {job['id']}' ends it.", file=sys.stderr)
        _follow(hornbill, job["id"], files, as_json)


def _follow(hornbill: "Hornbill", job: str, files: dict[str, Path], as_json: bool) -> None:
    """Wait for the job, print it and write the reports. Raises its error."""
    problem: HornbillError | None = None
    try:
        with progress() as bar:
            hornbill.wait(job, on_progress=bar)
    except HornbillError as error:
        if "job" not in error.facts:
            raise  # of the connection, not of the job
        problem = error
    done = hornbill.jobs.get(job)
    print_json(done) if as_json else print_job(done)
    for form, file in files.items():
        file.write_text(hornbill.jobs.report(job, form), encoding="utf-8")  # pyright: ignore[reportArgumentType]
    if problem is not None:
        raise problem


def _read(file: Path) -> dict[str, Any]:
    """Contents of a plan file. Raises InvalidValue."""
    import tomllib

    try:
        found = tomllib.loads(text_of(file))
    except tomllib.TOMLDecodeError as error:
        raise InvalidValue(f"{file.name}: Invalid TOML: {error}.", cause=None) from None
    return json.loads(json.dumps(found, default=str))  # dates, which no plan has, are refused by the server as text


def _show_dry_run(found: "responses.PlanPreview", as_json: bool) -> None:
    """Print what would run. Exit code 1 if a servo has a problem."""
    problems = [one["problem"] for one in found["servos"] if one["problem"] is not None]
    if as_json:
        print_json(found)
    else:
        print(f"{found['name']}: {found['cycles']} × {found['steps']} steps, at least {found['least_s']:g} s")
        rows = [
            (
                one["title"], "ready" if one["problem"] is None else one["problem"]["detail"],
                " ".join(caution["text"] for caution in one["cautions"]),
            )
            for one in found["servos"]
        ]  # fmt: skip
        print_table(("servo", "state", "cautions"), rows)
    if problems:
        raise typer.Exit(Exit.FAILED)

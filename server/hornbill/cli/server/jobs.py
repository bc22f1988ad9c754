"""`hornbill jobs`."""

from typing import Annotated, Literal

import typer

from hornbill.cli.connection import LOCAL_URL, AsJson, Server, client, complete_job, complete_servo
from hornbill.cli.showing import instant, print_job, print_json, print_table, progress

app = typer.Typer(no_args_is_help=True, help="List, wait for, cancel and resume jobs; print reports.")

JobId = Annotated[str, typer.Argument(metavar="JOB", help="Job ID.", autocompletion=complete_job)]


@app.command("list")
def list_(
    state: Annotated[
        Literal["queued", "running", "succeeded", "failed", "cancelled"] | None,
        typer.Option(help="Only jobs in this state."),
    ] = None,
    servo: Annotated[str | None, typer.Option(help="Only jobs of this servo.", autocompletion=complete_servo)] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """List running and recently ended jobs, newest first."""
    with client(server) as hornbill:
        found = hornbill.jobs.all(state=state, uid=None if servo is None else hornbill.look_up(servo).uid)
    if as_json:
        print_json(found)
        return
    rows = [
        (one["id"], one["kind"], one["state"], f"{one['progress']:.0%}", instant(one["created_at"]), one["step"])
        for one in found
    ]
    print_table(("job", "kind", "state", "progress", "created", "step"), rows)


@app.command("show")
def show(job: JobId, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show a job: steps with evidence, and its error."""
    with client(server) as hornbill:
        found = hornbill.jobs.get(job)
    if as_json:
        print_json(found)
        return
    print(f"{found['kind']}: {found['state']}")
    print_job(found)
    if found["error"] is not None:
        print(f"{found['error']['code']}: {found['error']['detail']}")


@app.command("wait")
def wait(
    job: JobId,
    timeout: Annotated[float | None, typer.Option(help="Timeout, s. The job continues after it.", min=0.1)] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Wait for a job. The exit code is that of its failure, or 1 if it was cancelled."""
    with client(server) as hornbill:
        with progress() as bar:
            done = hornbill.wait(job, timeout_s=timeout, on_progress=bar)
        print_json(done) if as_json else print_job(done)


@app.command("cancel")
def cancel(job: JobId, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Cancel a job. Steps already carried out are not undone."""
    with client(server) as hornbill:
        done = hornbill.jobs.cancel(job)
    print_json(done) if as_json else print(f"{done['kind']}: {done['state']}")


@app.command("resume")
def resume(job: JobId, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Resume a job that failed, was cancelled or was interrupted. Completed steps are kept."""
    with client(server) as hornbill:
        with progress() as bar:
            done = hornbill.wait(hornbill.jobs.resume(job)["id"], on_progress=bar)
        print_json(done) if as_json else print_job(done)


@app.command("report")
def report(
    job: JobId,
    form: Annotated[
        Literal["csv", "json", "junit", "html"],
        typer.Option(
            "--format", help="csv: one row per servo; junit: one test case per servo and step; html: printable page."
        ),
    ] = "json",
    server: Server = LOCAL_URL,
) -> None:
    """Write the report of a job to standard output: hornbill jobs report JOB --format junit > result.xml"""
    with client(server) as hornbill:
        typer.echo(hornbill.jobs.report(job, form), nl=False)

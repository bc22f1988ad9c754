"""`hornbill jobs`: what takes time, waiting for it, and its results as a file."""

from typing import Annotated, Literal

import typer

from hornbill.cli.connection import HERE, AsJson, Server, client, complete_job, complete_servo
from hornbill.cli.showing import instant, print_job, print_json, print_table, progress

app = typer.Typer(no_args_is_help=True, help="What takes time, under way and done.")

JobId = Annotated[str, typer.Argument(metavar="JOB", help="its id", autocompletion=complete_job)]


@app.command("list")
def list_(
    state: Annotated[
        Literal["queued", "running", "succeeded", "failed", "cancelled"] | None, typer.Option(help="only these")
    ] = None,
    servo: Annotated[str | None, typer.Option(help="only of this servo", autocompletion=complete_servo)] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Jobs under way and the last ones that ended, the oldest first."""
    with client(server) as hornbill:
        found = hornbill.jobs.all(state=state, uid=None if servo is None else hornbill.look_up(servo).uid)
    if as_json:
        print_json(found)
        return
    rows = [
        (one["id"], one["kind"], one["state"], f"{one['progress']:.0%}", instant(one["created_at"]), one["step"])
        for one in found
    ]
    print_table(("job", "kind", "state", "done", "began", "step"), rows)


@app.command("show")
def show(job: JobId, server: Server = HERE, as_json: AsJson = False) -> None:
    """One job: every step with its evidence, and what went wrong."""
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
    timeout: Annotated[float | None, typer.Option(help="seconds; the job goes on after them", min=0.1)] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Wait until a job has ended. The exit code says how: that of its failure, 1 when it was cancelled."""
    with client(server) as hornbill:
        with progress() as bar:
            done = hornbill.wait(job, timeout_s=timeout, on_progress=bar)
        print_json(done) if as_json else print_job(done)


@app.command("cancel")
def cancel(job: JobId, server: Server = HERE, as_json: AsJson = False) -> None:
    """Cancel a job. What it already sent to the servo stays sent."""
    with client(server) as hornbill:
        done = hornbill.jobs.cancel(job)
    print_json(done) if as_json else print(f"{done['kind']}: {done['state']}")


@app.command("resume")
def resume(job: JobId, server: Server = HERE, as_json: AsJson = False) -> None:
    """Go on with a job that failed, was cancelled or was cut off; steps that are done stay done."""
    with client(server) as hornbill:
        with progress() as bar:
            done = hornbill.wait(hornbill.jobs.resume(job)["id"], on_progress=bar)
        print_json(done) if as_json else print_job(done)


@app.command("report")
def report(
    job: JobId,
    form: Annotated[
        Literal["csv", "json", "junit", "html"],
        typer.Option("--format", help="csv: a row a servo; junit: a test case a servo and step; html: to print"),
    ] = "json",
    server: Server = HERE,
) -> None:
    """Write what a job did to standard output: hornbill jobs report JOB --format junit > result.xml"""
    with client(server) as hornbill:
        typer.echo(hornbill.jobs.report(job, form), nl=False)

"""The command line: flags, nothing else."""

import asyncio
import json
import sys
from collections.abc import Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from hornbill.errors import HornbillError
from hornbill.settings import Settings

app = typer.Typer(no_args_is_help=True, add_completion=False, help="Configure BLA15 and BLA21 servos over DroneCAN.")

Host = Annotated[str | None, typer.Option(help="address to listen on; 127.0.0.1 unless told", show_default=False)]
Port = Annotated[int | None, typer.Option(help="port to listen on; 8000 unless told, 0 for any", show_default=False)]
Seed = Annotated[int | None, typer.Option(help="seed of everything random in the simulated servos")]
Server = Annotated[str, typer.Option(envvar="HORNBILL_SERVER", help="address of a running server")]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]
Which = Annotated[str, typer.Argument(metavar="SERVO", help="uid (or the start of it), label or serial")]
HERE = "http://127.0.0.1:8000"


@app.command()
def demo(
    servos: Annotated[int | None, typer.Option(help="number of simulated servos; 6 unless told")] = None,
    host: Host = None,
    port: Port = None,
    seed: Seed = None,
) -> None:
    """Serve simulated servos on an embedded bus with true 1 Mbit/s bit times. No hardware needed."""
    settings = _settings(servos=servos, host=host, port=port, seed=seed)
    _serve(settings, demo=True, announce=f"hornbill demo with {settings.servos} simulated servos: open {{url}}")


@app.command()
def serve(
    bus: Annotated[
        str | None, typer.Option(help="INTERFACE:CHANNEL, for example socketcan:can0; file:LOG plays a log")
    ] = None,
    bitrate: Annotated[int | None, typer.Option(help="bit/s; 1000000 unless told")] = None,
    host: Host = None,
    port: Port = None,
    data_dir: Annotated[Path | None, typer.Option(help="folder of the database and of logs")] = None,
    database: Annotated[
        str | None,
        typer.Option(help="URL of a database elsewhere, as postgresql://USER@HOST/NAME; or set HORNBILL_DATABASE"),
    ] = None,
    allocator: Annotated[
        Literal["on", "off", "insist"] | None,
        typer.Option(help="give node ids; insist: beside another allocator, too; as chosen last unless told"),
    ] = None,
    position_unit: Annotated[
        Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None,
        typer.Option(help="what position 1.0 means on the bus, for every servo; measured unless told"),
    ] = None,
    sim_api: Annotated[
        bool | None,
        typer.Option("--sim-api", help="let REST add simulated servos to the bus, or to one of their own"),
    ] = None,
) -> None:
    """Serve the servos on a real adapter. Without --bus it starts disconnected."""
    settings = _settings(
        bus=bus, bitrate=bitrate, host=host, port=port, data_dir=data_dir, database=database, allocator=allocator,
        position_unit=position_unit, sim_api=sim_api,
    )  # fmt: skip
    _serve(settings, demo=False, announce="hornbill: open {url}")


@app.command()
def sim(
    bus: Annotated[str, typer.Option(help="INTERFACE:CHANNEL the servos live on")],
    servos: Annotated[int, typer.Option(help="how many")] = 1,
    model: Annotated[str | None, typer.Option(help="for example BLA21-06U-A0; a mix unless told")] = None,
    firmware: Annotated[str | None, typer.Option(help="for example 1.300")] = None,
    node_id: Annotated[str, typer.Option(help="auto, or the node id of the first servo")] = "auto",
    seed: Annotated[int, typer.Option(help="seed of everything random")] = 1,
) -> None:
    """Simulated servos alone, on any bus, for other DroneCAN tools to talk to. Ends with Ctrl-C."""
    from hornbill.simulating import simulate

    with _errors():
        say = partial(print, flush=True)  # whoever reads a pipe waits for it
        asyncio.run(simulate(bus, servos, model, firmware, node_id, seed, say))


@app.command("list")
def list_(server: Server = HERE, as_json: AsJson = False) -> None:
    """List the servos."""
    with _client(server) as client:
        servos = client.ask("GET", "/servos")
        if as_json:
            _print_json(servos)
            return
        for one in servos:
            name = one["label"] or one["serial"]
            angle = "no angle" if one["angle_deg"] is None else f"{one['angle_deg']:+.1f}°"
            print(
                f"{one['uid'][:8]}  {name:<16} {one['model'] or 'unknown model':<13} fw {one['firmware'] or '–':<6} "
                f"node {one['node_id'] or '–':<4} {one['state']:<11} {angle}"
            )


@app.command()
def get(
    servo: Which,
    key: Annotated[str | None, typer.Argument(help="parameter; all unless given")] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Read one parameter from the servo, or all of them."""
    with _client(server) as client:
        uid = client.servo(servo)["uid"]
        if key is not None:
            reading = client.ask("GET", f"/servos/{uid}/parameters/{key}")
            _print_json(reading) if as_json else _print_reading(reading)
            return
        found = client.ask("GET", f"/servos/{uid}/parameters", refresh="true")
        if as_json:
            _print_json(found)
            return
        for reading in found["parameters"].values():
            _print_reading(reading)


@app.command("set")
def set_(
    servo: Which,
    changes: Annotated[list[str], typer.Argument(metavar="KEY=VALUE…", help="one or more")],
    server: Server = HERE,
    save: Annotated[bool, typer.Option(help="save to ROM as well: the servo restarts and its horn may move")] = False,
    as_json: AsJson = False,
) -> None:
    """Write parameters to RAM, all or nothing."""
    with _client(server) as client:
        uid = client.servo(servo)["uid"]
        values = {key: _value(text) for key, _, text in (change.partition("=") for change in changes)}
        outcome = client.ask("PATCH", f"/servos/{uid}/parameters", {"values": values})
        _print_json(outcome) if as_json else _print_outcome(outcome)
        if outcome["outcome"] != "applied":
            raise typer.Exit(1)
        if save:
            _finish(client.ask("POST", f"/servos/{uid}/save", wait="true"), as_json)


@app.command()
def save(servo: Which, server: Server = HERE, as_json: AsJson = False) -> None:
    """Write RAM to ROM, and read it back after the restart. The servo restarts; its horn may move to 0°."""
    with _client(server) as client:
        uid = client.servo(servo)["uid"]
        _finish(client.ask("POST", f"/servos/{uid}/save", wait="true"), as_json)


@app.command()
def stop(
    brake: Annotated[bool, typer.Option("--brake", help="brake instead of letting go")] = False,
    clear: Annotated[bool, typer.Option("--clear", help="clear the stop; nothing moves or is turned on")] = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Stop every servo now: torque off, until cleared. The exit code is 1 when one did not confirm."""
    from hornbill.client import unconfirmed

    if brake and clear:
        raise typer.BadParameter("--clear goes with no other word")
    with _client(server) as client:
        state = client.ask("DELETE", "/stop", by="command line") if clear else client.stop("brake" if brake else "off")
    silent = unconfirmed(state)
    if as_json:
        _print_json(state)
    elif clear:
        print("Cleared. Torque stays off until it is turned on.")
    else:
        every = len(state["servos"]) + len(state["nodes"])
        print(f"Stopped: {every - len(silent)} of {every} servos have confirmed torque {state['mode']}.")
    if silent:
        print(
            f"Not confirmed: {', '.join(silent)}. Torque may still be on there. If they can move, cut their supply.",
            file=sys.stderr,
        )
        raise typer.Exit(1)


@app.command()
def doctor(server: Server = HERE, as_json: AsJson = False) -> None:
    """Say what is wrong with the bus and what helps. The exit code is 1 when there is a warning or a failure."""
    with _client(server) as client:
        examined = client.ask("GET", "/bus/doctor", all="true")
    found = [one for one in examined if one["severity"] != "ok"]
    if as_json:
        _print_json(found)
    else:
        for one in found:
            print(f"{one['severity'].capitalize()}: {one['text']}\n  {one['evidence']}")
            if one["remedy"]:
                print(f"  → {one['remedy']}")
        passed = len(examined) - len(found)
        print(f"{f'{len(found)} found' if found else 'Nothing wrong found'}: {passed} checks passed.")
    if any(one["severity"] in ("warning", "failure") for one in found):
        raise typer.Exit(1)


@app.command()
def decode(
    log: Annotated[str, typer.Argument(metavar="LOG", help="candump -l, ASC, BLF or CSV file; - is standard input")],
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object a line")] = False,
) -> None:
    """Print the DroneCAN transfers of a recording, or live: candump -L can0 | hornbill decode -"""
    from hornbill.decoding import decode_log

    with _errors():
        decode_log(log, as_json, sys.stdin.buffer, sys.stdout.buffer, lambda text: print(text, file=sys.stderr))


@app.command()
def openapi() -> None:
    """Print the OpenAPI document."""
    from hornbill.api.http import create_api
    from hornbill.schema.catalog import Catalog

    _print_json(create_api(Catalog.load()).openapi())


def main() -> None:
    """Run the command line."""
    app()


def _settings(**flags: Any) -> Settings:
    return Settings(**{name: value for name, value in flags.items() if value is not None})


def _serve(settings: Settings, *, demo: bool, announce: str) -> None:
    from hornbill import app as application
    from hornbill import serving

    if settings.host not in ("127.0.0.1", "localhost", "::1"):
        print(
            f"Cannot listen on {settings.host}: hornbill has no access control yet, and whoever reaches it can move "
            "servos. It serves this machine only: use --host 127.0.0.1.",
            file=sys.stderr,
        )
        raise typer.Exit(2)
    with _errors():
        listening = serving.listen(settings.host, settings.port)
        built = application.build(settings, demo=demo, log=lambda text: print(text, file=sys.stderr))
        try:
            asyncio.run(serving.serve(built, listening, announce))
        except KeyboardInterrupt:
            pass


@contextmanager
def _errors() -> Generator[None]:
    try:
        yield
    except HornbillError as error:
        print(error.detail, file=sys.stderr)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


@contextmanager
def _client(server: str) -> "Generator[Any]":
    from hornbill.client import Client, Problem

    try:
        with Client(server) as client:
            yield client
    except Problem as problem:
        print(f"{problem.code}: {problem.detail}", file=sys.stderr)
        raise typer.Exit(1) from None


def _value(text: str) -> object:
    """What a user typed: a number or true/false where it is one, else a word."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def _print_json(what: object) -> None:
    print(json.dumps(what, indent=2, ensure_ascii=False))


def _print_reading(reading: dict[str, Any]) -> None:
    value = "inactive" if reading["value"] is None else reading["value"]
    rom = "not known" if reading["rom"] is None else reading["rom"]
    print(f"{reading['key']:<24} {value!s:>12} {reading['unit']:<4} ROM {rom}")


def _print_outcome(outcome: dict[str, Any]) -> None:
    for change in outcome["changes"]:
        print(f"{change['key']:<24} {change['before']} → {change['after']}  {change['verdict']}")
    if outcome["failure"]:
        print(f"rolled back: {outcome['failure']}", file=sys.stderr)


def _finish(job: dict[str, Any], as_json: bool) -> None:
    if as_json:
        _print_json(job)
    else:
        for step in job["steps"]:
            print(f"{step['state']:<8} {step['text']}: {step['evidence'] or ''}")
    if job["state"] != "succeeded":
        if job["error"]:
            print(job["error"]["detail"], file=sys.stderr)
        raise typer.Exit(1)

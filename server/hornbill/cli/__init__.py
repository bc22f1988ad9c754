"""Owns the command line: which commands there are. Nothing heavy is imported before a command runs."""

import typer

from hornbill.cli import bench, bus, commissioning, moving, parameters, probing, profiles, starting, tokens, watching

app = typer.Typer(no_args_is_help=True, help="Configure BLA15 and BLA21 servos over DroneCAN.")

for _name, _command in {
    "demo": starting.demo,
    "serve": starting.serve,
    "sim": starting.sim,
    "list": parameters.list_,
    "get": parameters.get,
    "set": parameters.set_,
    "save": parameters.save,
    "apply": bench.apply,
    "export": bench.export,
    "command": moving.command,
    "stop": moving.stop,
    "watch": watching.watch,
    "commission": commissioning.commission,
    "doctor": bus.doctor,
    "probe": probing.probe,
    "decode": starting.decode,
    "openapi": starting.openapi,
}.items():
    app.command(_name)(_command)
app.add_typer(profiles.app, name="profile")
app.add_typer(bus.log, name="log")
app.add_typer(tokens.app, name="token")


def main() -> None:
    """Run the command line."""
    app()

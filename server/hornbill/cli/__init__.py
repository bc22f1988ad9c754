"""The command line: all commands, grouped by task. A module of commands is imported when one of them is used."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from typing import Any, Final

import typer
from typer.core import TyperGroup

from hornbill.cli import plain_text
from hornbill.cli.server import version

COMMANDS: Final[dict[str, dict[str, str]]] = {
    "Start": {
        "demo": "server.starting:demo",
        "serve": "server.starting:serve",
        "check": "server.starting:check",
    },
    "Servos": {
        "list": "servos.parameters:list_",
        "identify": "servos.restarting:identify",
        "label": "servos.restarting:label",
        "commission": "servos.commissioning:commission",
        "faults": "servos.faults:app",
        "restart": "servos.restarting:restart",
        "factory-reset": "servos.restarting:factory_reset",
    },
    "Parameters": {
        "get": "servos.parameters:get",
        "set": "servos.parameters:set_",
        "save": "servos.parameters:save",
        "undo": "servos.history:undo",
        "compare": "servos.history:compare",
        "copy": "servos.history:copy",
        "apply": "bench.commands:apply",
        "export": "bench.commands:export",
        "profiles": "servos.profiles:app",
        "snapshots": "servos.history:snapshots",
        "drift": "servos.history:drift",
        "lost-values": "servos.history:lost_values",
    },
    "Move, stop and measure": {
        "stop": "servos.moving:stop",
        "move": "servos.moving:move",
        "torque": "servos.restarting:torque",
        "leases": "server.bus:leases",
        "run": "servos.running:run",
        "watch": "server.watching:watch",
        "samples": "servos.measuring:samples",
        "set-up": "servos.measuring:set_up",
        "step-test": "servos.measuring:step_test",
        "runs": "servos.measuring:runs",
        "improve": "servos.tuning:improve",
        "frequency-response": "servos.measuring:frequency_response",
        "mechanics": "servos.mechanics:app",
        "frequency-responses": "servos.measuring:responses_",
        "position-unit": "servos.measuring:position_unit",
    },
    "Bus": {
        "doctor": "server.doctor:doctor",
        "bus": "server.bus:bus",
        "node-ids": "server.bus:node_ids",
        "autopilot": "server.autopilot:app",
        "logs": "server.doctor:logs",
    },
    "Records": {
        "jobs": "server.jobs:app",
        "inventory": "server.records:inventory",
        "site": "server.records:site",
        "audit": "server.records:audit",
        "recordings": "server.records:recordings",
    },
    "Administration": {
        "tokens": "server.tokens:app",
        "backup": "server.backup:backup",
        "restore": "server.backup:restore",
        "systemd-unit": "server.backup:systemd_unit",
        "health": "server.bus:health",
        "version": "server.version:version",
    },
    "Development": {
        "sim": "server.starting:simulator",
        "decode": "server.starting:decode",
        "probe": "servos.probing:probe",
        "openapi": "server.starting:openapi",
    },
}
"""Function or group of each command, as `module:name`, by panel of `hornbill --help`."""


class _Commands(Mapping[str, Any]):
    """All commands of Click by name, each made at its first use."""

    def __init__(self) -> None:
        self._places = {name: place for commands in COMMANDS.values() for name, place in commands.items()}
        self._made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            self._made[name] = _command(name, self._places[name])
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


class _Group(TyperGroup):
    """Group whose help is the first paragraph of each command."""

    panels: Mapping[str, Iterable[str]] | None = None

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write names and help of the commands, by panel."""
        for panel, names in (self.panels or {"Commands": self.commands}).items():
            with formatter.section(panel):
                formatter.write_dl([(name, (self.commands[name].help or "").partition("\n\n")[0]) for name in names])


class _Root(_Group):
    """Group of all commands."""

    panels = COMMANDS

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands: Any = _Commands()

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands."""
        return list(self.commands)


app = typer.Typer(
    cls=_Root,
    no_args_is_help=True,
    rich_markup_mode=None,  # importing rich takes as long as all else
    help="Configure BLA15, BLA21 and BLA34 servos over DroneCAN.",
)
app.callback()(version.options)


def main() -> None:
    """Run the command line."""
    plain_text.configure_output()
    app()


def _command(name: str, place: str) -> Any:
    """Command or group of Click."""
    module, _, attribute = place.partition(":")
    found: Callable[..., Any] | typer.Typer = getattr(import_module(f"{__name__}.{module}"), attribute)
    parent = typer.Typer(rich_markup_mode=None)
    if isinstance(found, typer.Typer):
        parent.add_typer(found, name=name, cls=_Group)
    else:
        parent.command(name)(found)
    return typer.main.get_group(parent).commands[name]

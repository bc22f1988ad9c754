"""The command line: all commands, grouped by task. Nothing heavy is imported before a command runs."""

from collections.abc import Callable
from typing import Any, Final

import typer

from hornbill.cli import plain_text
from hornbill.cli.bench import commands as bench
from hornbill.cli.server import autopilot, backup, bus, doctor, jobs, records, starting, tokens, version, watching
from hornbill.cli.servos import (
    commissioning,
    faults,
    history,
    measuring,
    mechanics,
    moving,
    parameters,
    probing,
    profiles,
    restarting,
    running,
    tuning,
)

app = typer.Typer(no_args_is_help=True, help="Configure BLA15, BLA21 and BLA34 servos over DroneCAN.")

COMMANDS: Final[dict[str, dict[str, Callable[..., Any] | typer.Typer]]] = {
    "Start": {
        "demo": starting.demo,
        "serve": starting.serve,
        "check": starting.check,
    },
    "Servos": {
        "list": parameters.list_,
        "identify": restarting.identify,
        "label": restarting.label,
        "commission": commissioning.commission,
        "faults": faults.app,
        "restart": restarting.restart,
        "factory-reset": restarting.factory_reset,
    },
    "Parameters": {
        "get": parameters.get,
        "set": parameters.set_,
        "save": parameters.save,
        "undo": history.undo,
        "compare": history.compare,
        "copy": history.copy,
        "apply": bench.apply,
        "export": bench.export,
        "profiles": profiles.app,
        "snapshots": history.snapshots,
        "drift": history.drift,
        "lost-values": history.lost_values,
    },
    "Move, stop and measure": {
        "stop": moving.stop,
        "move": moving.move,
        "torque": restarting.torque,
        "leases": bus.leases,
        "run": running.run,
        "watch": watching.watch,
        "samples": measuring.samples,
        "set-up": measuring.set_up,
        "step-test": measuring.step_test,
        "runs": measuring.runs,
        "improve": tuning.improve,
        "frequency-response": measuring.frequency_response,
        "mechanics": mechanics.app,
        "frequency-responses": measuring.responses_,
        "position-unit": measuring.position_unit,
    },
    "Bus": {
        "doctor": doctor.doctor,
        "bus": bus.bus,
        "node-ids": bus.node_ids,
        "autopilot": autopilot.app,
        "logs": doctor.logs,
    },
    "Records": {
        "jobs": jobs.app,
        "inventory": records.inventory,
        "site": records.site,
        "audit": records.audit,
        "recordings": records.recordings,
    },
    "Administration": {
        "tokens": tokens.app,
        "backup": backup.backup,
        "restore": backup.restore,
        "systemd-unit": backup.systemd_unit,
        "health": bus.health,
        "version": version.version,
    },
    "Development": {
        "sim": starting.simulator,
        "decode": starting.decode,
        "probe": probing.probe,
        "openapi": starting.openapi,
    },
}
"""Commands and command groups by panel of `hornbill --help`."""

app.callback()(version.options)

for _panel, _commands in COMMANDS.items():
    for _name, _command in _commands.items():
        if isinstance(_command, typer.Typer):
            app.add_typer(_command, name=_name, rich_help_panel=_panel)
        else:
            app.command(_name, rich_help_panel=_panel)(_command)


def main() -> None:
    """Run the command line."""
    plain_text.configure_output()
    app()

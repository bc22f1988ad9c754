"""The command line: which commands there are. Nothing heavy is imported before a command runs."""

import typer

from hornbill.cli import plain_text
from hornbill.cli.bench import commands as bench
from hornbill.cli.server import bus, doctor, jobs, records, starting, tokens, watching
from hornbill.cli.servos import (
    commissioning,
    faults,
    history,
    measuring,
    moving,
    parameters,
    probing,
    profiles,
    restarting,
)

app = typer.Typer(no_args_is_help=True, help="Configure BLA15, BLA21 and BLA34 servos over DroneCAN.")

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
    "compare": history.compare,
    "copy": history.copy,
    "undo": history.undo,
    "label": restarting.label,
    "identify": restarting.identify,
    "restart": restarting.restart,
    "factory-reset": restarting.factory_reset,
    "command": moving.command,
    "stop": moving.stop,
    "torque": restarting.torque,
    "step": measuring.step,
    "samples": measuring.samples,
    "position-unit": measuring.position_unit,
    "watch": watching.watch,
    "commission": commissioning.commission,
    "doctor": doctor.doctor,
    "probe": probing.probe,
    "leases": bus.leases,
    "health": bus.health,
    "audit": records.audit,
    "decode": starting.decode,
    "openapi": starting.openapi,
}.items():
    app.command(_name)(_command)
for _name, _group in {
    "profile": profiles.app,
    "snapshots": history.snapshots,
    "drift": history.drift,
    "lost": history.lost,
    "faults": faults.app,
    "jobs": jobs.app,
    "runs": measuring.runs,
    "inventory": records.inventory,
    "bus": bus.bus,
    "ids": bus.ids,
    "log": doctor.log,
    "recordings": records.recordings,
    "token": tokens.app,
}.items():
    app.add_typer(_group, name=_name)


def main() -> None:
    """Run the command line."""
    plain_text.speak()
    app()

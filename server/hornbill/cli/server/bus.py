"""Commands for the bus: bus and node-ids; and leases and health."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, AsJson, Server, client
from hornbill.cli.failing import Exit
from hornbill.cli.server.version import shown
from hornbill.cli.showing import cell, instant, print_json, print_table

if TYPE_CHECKING:
    from hornbill.client import Hornbill, responses

bus = typer.Typer(no_args_is_help=True, help="Connect an adapter; show the bus and its nodes.")
node_ids = typer.Typer(no_args_is_help=True, help="Allocate node IDs.")

NodeName = Annotated[
    str, typer.Argument(metavar="SERVO", help="Label, serial or unique ID of a servo, or unique ID of any node.")
]


@bus.command("show")
def show(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show state, load and errors of the bus."""
    with client(server) as hornbill:
        _show_bus(hornbill.bus.state(), as_json)


@bus.command("adapters")
def adapters(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List the adapters of the server."""
    with client(server) as hornbill:
        found = hornbill.bus.adapters()
    if as_json:
        print_json(found)
        return
    rows = [(one["address"], one["name"], one["state"], one["remedy"] or one["reason"] or "") for one in found]
    print_table(("address", "adapter", "state", "remedy"), rows)


@bus.command("connect")
def connect(
    address: Annotated[str, typer.Argument(help="INTERFACE:CHANNEL, for example socketcan:can0.")],
    bitrate: Annotated[int, typer.Option(help="Bit rate, bit/s.")] = 1_000_000,
    frame_gap_ms: Annotated[
        float | None, typer.Option(help="Pause between the frames of one transfer, ms. Default: none.")
    ] = None,
    role: Annotated[
        Literal["auto", "host", "guest", "observer"] | None,
        typer.Option(help="guest: beside an autopilot. observer: send nothing. auto: listen, then host or guest."),
    ] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Connect the server to an adapter, in place of the current one. Moves nothing."""
    with client(server) as hornbill:
        _show_bus(hornbill.bus.connect(address, bitrate=bitrate, frame_gap_ms=frame_gap_ms, role=role), as_json)


@bus.command("set-role")
def set_role(
    role: Annotated[
        Literal["host", "guest", "observer"],
        typer.Argument(help="guest: beside an autopilot, allocate nothing. observer: send nothing."),
    ],
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Change the connection role. Torque goes off first on servos under command."""
    with client(server) as hornbill:
        _show_bus(hornbill.bus.set_role(role), as_json)


@bus.command("disconnect")
def disconnect(yes: Yes = False, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Disconnect the bus. Servos cannot be stopped afterwards. Prompts for confirmation."""
    with client(server) as hornbill:
        require_confirmation(
            "Disconnect the bus? Servos that are on stay on and can no longer be stopped from here.",
            yes,
            as_json=as_json,
        )
        _show_bus(hornbill.bus.disconnect(), as_json)


@bus.command("nodes")
def nodes(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List the nodes on the bus."""
    with client(server) as hornbill:
        found = hornbill.bus.nodes()
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["node_id"], one["kind"], one["name"], "yes" if one["online"] else "no", one["health"], one["mode"],
            f"{one['uptime_s']} s", one["note"] or "",
        )
        for one in found
    ]  # fmt: skip
    print_table(("node", "kind", "name", "online", "health", "mode", "uptime", "note"), rows)


@node_ids.command("list")
def list_(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List allocated node IDs and pending requests."""
    with client(server) as hornbill:
        found = hornbill.bus.allocations()
    if as_json:
        print_json(found)
        return
    rows = [
        (one["node_id"], one["uid"], "yes" if one["pinned"] else "", instant(one["last_seen"]))
        for one in found["allocations"]
    ]
    print_table(("node", "unique id", "pinned", "last seen"), rows)
    for one in found["pending"]:
        print(f"{one['uid_part']}… waiting for {one['waiting_s']:.0f} s, {one['stage']} of 3 parts received.")
    print(f"{found['free']} node IDs free.")


@node_ids.command("pin")
def pin(
    servo: NodeName,
    node_id: Annotated[int, typer.Argument(help="Node ID, 1 to 125.", min=1, max=125)],
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Reserve a node ID for a servo."""
    with client(server) as hornbill:
        _show_change(hornbill.bus.pin(_uid(hornbill, servo), node_id), as_json)


@node_ids.command("release")
def release(servo: NodeName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Free the node ID of a servo."""
    with client(server) as hornbill:
        _show_change(hornbill.bus.release_node_id(_uid(hornbill, servo)), as_json)


@node_ids.command("recycle")
def recycle(
    days: Annotated[float, typer.Argument(help="Minimum time since the servo was last seen, days.", min=0)],
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Free the node IDs of servos not seen for some time, except pinned ones. Prompts for confirmation."""
    with client(server) as hornbill:
        require_confirmation(f"Free all node IDs not seen for {days:g} days?", yes, as_json=as_json)
        done = hornbill.bus.recycle_node_ids(days * 86400)
    print_json(done) if as_json else print(f"{len(done['freed'])} node IDs freed, {done['free']} free in total.")


@node_ids.command("set-allocator")
def set_allocator(
    mode: Annotated[
        Literal["on", "off", "force"], typer.Argument(help="force: allocate even if there is another allocator.")
    ],
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Turn the server's node ID allocator on or off."""
    with client(server) as hornbill:
        done = hornbill.bus.set_allocator(mode)
    print_json(done) if as_json else print(f"Allocator: {done['state']}. {done['free']} node IDs free.")


def leases(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List leases (motion control)."""
    with client(server) as hornbill:
        found = hornbill.leases()
    if as_json:
        print_json(found)
        return
    for one in found:
        of = "" if one["uids"] is None else f", {len(one['uids'])} servos"
        print(cell(f"{one['holder']}{of}: expires in {one['expires_in_s']:.1f} s unless renewed."))
    if not found:
        print("No leases.")


def health(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show version, uptime and parts of the server. The exit code is 1 if a part has failed."""
    with client(server) as hornbill:
        found = hornbill.health()
    if as_json:
        print_json(found)
    else:
        print(f"{shown(found['version'], found['commit'])}, uptime {found['uptime_s']:.0f} s, bus {found['bus']}")
        rows = [
            (name, part["state"], " ".join(one["text"] for one in part["findings"]))
            for name, part in found["parts"].items()
        ]
        print_table(("part", "state", "finding"), rows)
    if not found["ready"]:
        raise typer.Exit(Exit.FAILED)


def _uid(hornbill: "Hornbill", name: str) -> str:
    """Unique ID. A complete one may belong to a node that is not a servo."""
    complete = len(name) == 32 and set(name.lower()) <= set("0123456789abcdef")
    return name.lower() if complete else hornbill.look_up(name).uid


def _show_bus(state: "responses.Bus", as_json: bool) -> None:
    if as_json:
        print_json(state)
        return
    load = "" if state["load_pct"] is None else f", load {state['load_pct']:.1f} %"
    print(f"{state['state']}: {state['address'] or 'no adapter'}{load}")
    print(f"received {state['rx_frames']}, sent {state['tx_frames']}, errors {state['errors']}")
    line = state["serial_line"]
    if line is not None:
        print(_line_text(line))
    if state["frame_gap_ms"]:
        print(f"pause between the frames of a transfer: {state['frame_gap_ms']:g} ms")
    for note in state["notes"]:
        print(f"note: {note['text']}")
    if state["trouble"]:
        print(state["trouble"])


def _line_text(line: "responses.SerialLine") -> str:
    known = "" if line["confirmed"] else ", not confirmed"
    how = f"detected{known}" if line["found"] else f"as configured{known}"
    number = "" if line["serial_number"] is None else f", adapter {line['serial_number']}"
    if line["budget"] is None:
        return f"serial line: USB, the baud rate has no effect{number}"
    load = "" if line["load_pct"] is None else f", load {line['load_pct']:.0f} %"
    return f"serial line: {line['baud']} baud ({how}), up to {line['budget']} frames/s{load}{number}"


def _show_change(done: "responses.AllocationChange", as_json: bool) -> None:
    print_json(done) if as_json else print(f"node ID {done['node_id']}: {done['note']}")

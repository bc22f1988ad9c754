"""`hornbill bus` and `hornbill ids`: the server's adapter, who is heard, node ids; and leases and health."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, agree
from hornbill.cli.connection import HERE, AsJson, Server, client
from hornbill.cli.showing import cell, instant, print_json, print_table

if TYPE_CHECKING:
    from hornbill.client import Hornbill, answers

bus = typer.Typer(no_args_is_help=True, help="The server's adapter, and who is heard on the bus.")
ids = typer.Typer(no_args_is_help=True, help="Node ids: who has one, who waits for one.")

Unique = Annotated[str, typer.Argument(metavar="SERVO", help="uid, label or serial; a whole uid of anybody")]


@bus.command("show")
def show(server: Server = HERE, as_json: AsJson = False) -> None:
    """State, load and errors of the bus."""
    with client(server) as hornbill:
        _show_bus(hornbill.bus.state(), as_json)


@bus.command("adapters")
def adapters(server: Server = HERE, as_json: AsJson = False) -> None:
    """What is plugged into the server's machine, and what keeps it from being used."""
    with client(server) as hornbill:
        found = hornbill.bus.adapters()
    if as_json:
        print_json(found)
        return
    rows = [(one["address"], one["name"], one["state"], one["remedy"] or one["reason"] or "") for one in found]
    print_table(("address", "adapter", "state", "what helps"), rows)


@bus.command("connect")
def connect(
    address: Annotated[str, typer.Argument(help="INTERFACE:CHANNEL, for example socketcan:can0")],
    bitrate: Annotated[int, typer.Option(help="bit/s")] = 1_000_000,
    frame_gap_ms: Annotated[
        float | None, typer.Option(help="pause between the frames of one transfer, ms; none unless given")
    ] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Have the server open an adapter, in place of the present one. Nothing moves by it."""
    with client(server) as hornbill:
        _show_bus(hornbill.bus.connect(address, bitrate=bitrate, frame_gap_ms=frame_gap_ms), as_json)


@bus.command("disconnect")
def disconnect(yes: Yes = False, server: Server = HERE, as_json: AsJson = False) -> None:
    """Have the server let go of its adapter. Nobody can stop servos through it then: asks first."""
    with client(server) as hornbill:
        agree("Let go of the bus? Servos that are on stay on.", yes, as_json=as_json)
        _show_bus(hornbill.bus.disconnect(), as_json)


@bus.command("nodes")
def nodes(server: Server = HERE, as_json: AsJson = False) -> None:
    """Who is heard, servo or not."""
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
    print_table(("node", "kind", "name", "online", "health", "mode", "up", "note"), rows)


@ids.command("list")
def list_(server: Server = HERE, as_json: AsJson = False) -> None:
    """Node ids given, and who waits for one at which stage."""
    with client(server) as hornbill:
        found = hornbill.bus.ids()
    if as_json:
        print_json(found)
        return
    rows = [
        (one["node_id"], one["uid"], "yes" if one["pinned"] else "", instant(one["last_seen"]))
        for one in found["allocations"]
    ]
    print_table(("node", "unique id", "pinned", "last seen"), rows)
    for one in found["pending"]:
        print(f"{one['uid_part']}… waits for {one['waiting_s']:.0f} s, {one['stage']} of 3 parts heard.")
    print(f"{found['free']} left.")


@ids.command("pin")
def pin(
    servo: Unique,
    node_id: Annotated[int, typer.Argument(help="1 to 125", min=1, max=125)],
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Keep a node id for a servo."""
    with client(server) as hornbill:
        _show_change(hornbill.bus.pin(_uid(hornbill, servo), node_id), as_json)


@ids.command("forget")
def forget(servo: Unique, server: Server = HERE, as_json: AsJson = False) -> None:
    """Free a servo's node id."""
    with client(server) as hornbill:
        _show_change(hornbill.bus.forget_id(_uid(hornbill, servo)), as_json)


@ids.command("recycle")
def recycle(
    days: Annotated[float, typer.Argument(help="free those not seen for so many days, unless pinned", min=0)],
    yes: Yes = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Free the node ids of servos that were not seen for long. Asks first."""
    with client(server) as hornbill:
        agree(f"Free every node id not seen for {days:g} days?", yes, as_json=as_json)
        done = hornbill.bus.recycle_ids(days * 86400)
    print_json(done) if as_json else print(f"{len(done['freed'])} freed, {done['free']} left.")


@ids.command("allocator")
def allocator(
    mode: Annotated[Literal["on", "off", "force"], typer.Argument(help="force: beside another allocator, too")],
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Have the server give node ids, or not."""
    with client(server) as hornbill:
        done = hornbill.bus.set_allocator(mode)
    print_json(done) if as_json else print(f"allocator {done['state']}, {done['free']} node ids left.")


def leases(server: Server = HERE, as_json: AsJson = False) -> None:
    """Who has motion control, and for how long."""
    with client(server) as hornbill:
        found = hornbill.leases()
    if as_json:
        print_json(found)
        return
    for one in found:
        print(cell(f"{one['holder']}: {one['expires_in_s']:.1f} s from now, unless renewed."))
    if not found:
        print("Nobody has motion control.")


def health(server: Server = HERE, as_json: AsJson = False) -> None:
    """Version and uptime of the server."""
    with client(server) as hornbill:
        found = hornbill.health()
    if as_json:
        print_json(found)
    else:
        print(f"hornbill {found['version']}, up for {found['uptime_s']:.0f} s, bus {found['bus']}")


def _uid(hornbill: "Hornbill", name: str) -> str:
    """A whole unique id may be of a node that is no servo, or not yet."""
    whole = len(name) == 32 and set(name.lower()) <= set("0123456789abcdef")
    return name.lower() if whole else hornbill.look_up(name).uid


def _show_bus(state: "answers.Bus", as_json: bool) -> None:
    if as_json:
        print_json(state)
        return
    load = "" if state["load_pct"] is None else f", load {state['load_pct']:.1f} %"
    print(f"{state['state']}: {state['address'] or 'no adapter'}{load}")
    print(f"received {state['rx_frames']}, sent {state['tx_frames']}, errors {state['errors']}")
    line = state["serial_line"]
    if line is not None:
        print(_line_words(line))
    if state["frame_gap_ms"]:
        print(f"pause of {state['frame_gap_ms']:g} ms between the frames of a transfer")
    for note in state["notes"]:
        print(f"note: {note['text']}")
    if state["trouble"]:
        print(state["trouble"])


def _line_words(line: "answers.SerialLine") -> str:
    known = "" if line["confirmed"] else ", not confirmed"
    how = f"found{known}" if line["found"] else f"as given{known}"
    number = "" if line["serial_number"] is None else f", adapter {line['serial_number']}"
    if line["budget"] is None:
        return f"serial line: USB, the baud rate has no effect{number}"
    load = "" if line["load_pct"] is None else f", load {line['load_pct']:.0f} %"
    return f"serial line: {line['baud']} baud ({how}), up to {line['budget']} frames/s{load}{number}"


def _show_change(done: "answers.AllocationChange", as_json: bool) -> None:
    print_json(done) if as_json else print(f"node id {done['node_id']}: {done['note']}")

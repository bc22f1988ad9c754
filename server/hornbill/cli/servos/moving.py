"""The commands that move servos, or keep them from it: command and stop."""

import contextlib
import sys
import time
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, agree
from hornbill.cli.connection import HERE, AsJson, Confirm, Server, Which, client
from hornbill.cli.failing import Exit
from hornbill.cli.showing import print_job, print_json

if TYPE_CHECKING:
    from hornbill.client import Hornbill

FOR_EVER_S = 10 * 365 * 86_400.0


def command(
    servo: Which,
    value: Annotated[float, typer.Argument(help="°, rpm or %; a negative one after --: hornbill command front -- -30")],
    kind: Annotated[Literal["angle", "speed", "torque"], typer.Option("--type", help="what the value is")] = "angle",
    energise: Annotated[bool, typer.Option("--torque-on", help="turn torque on first, where the horn stands")] = False,
    hold: Annotated[float, typer.Option(help="seconds to stay after that; torque goes off then", min=0)] = 0.0,
    speed: Annotated[float | None, typer.Option(help="°/s, for angles: go there at this speed", min=0.1)] = None,
    timeout: Annotated[float, typer.Option(help="seconds an angle may take", min=0.1, max=120)] = 5.0,
    band: Annotated[float, typer.Option(help="° around the angle that count as there", min=0.01, max=30)] = 0.5,
    clamp: Annotated[bool, typer.Option("--clamp", help="go to the nearest legal value instead of failing")] = False,
    confirm: Confirm = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Move a servo, wait until it is there, and let go: motion control is taken for it, and torque is off afterwards.

    Ctrl-C ends it at once, also while it holds.
    """
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        with hornbill.lease(hornbill.by):
            if energise:
                found.torque("on")
            words = confirm or ()
            if kind == "angle":
                done = found.move(
                    value, timeout_s=timeout, band_deg=band, clamp=clamp, confirm=words, speed_deg_s=speed
                )
            else:
                done = found.command(kind, value, clamp=clamp, confirm=words)
            if as_json:
                print_json(done)
            else:
                unit = {"angle": "°", "speed": " rpm", "torque": " %"}[kind]
                at = f" It is at {done['angle_deg']:+.1f}°" if done["angle_deg"] is not None else ""
                took = f" after {done['settle_time_s']:.2f} s" if done["settle_time_s"] is not None else ""
                print(f"Commanded {done['value']:g}{unit}.{at}{took}{'.' if at else ''}")
                for warning in done["warnings"]:
                    print(warning, file=sys.stderr)
            sys.stdout.flush()
            time.sleep(hold)


def stop(
    brake: Annotated[bool, typer.Option("--brake", help="brake instead of letting go")] = False,
    clear: Annotated[bool, typer.Option("--clear", help="clear the stop; nothing moves or is turned on")] = False,
    restore: Annotated[
        bool, typer.Option("--restore", help="clear the stop and switch on again what it switched off. Asks first")
    ] = False,
    hold: Annotated[
        float | None, typer.Option(help="with --restore: seconds to keep on what lets go by itself; else until Ctrl-C")
    ] = None,
    confirm: Confirm = None,
    yes: Yes = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Stop every servo now: torque off, until cleared. The exit code is 1 when one did not confirm."""
    if brake + clear + restore > 1:
        raise typer.BadParameter("--brake, --clear and --restore exclude one another")
    with client(server) as hornbill:
        if restore:
            _restore(hornbill, confirm or [], hold, yes=yes, as_json=as_json)
            return
        from hornbill.client import unconfirmed

        state = hornbill.clear_stop() if clear else hornbill.stop("brake" if brake else "off")
        silent = unconfirmed(state)
        if as_json:
            print_json(state)
        elif clear:
            print("Cleared. Torque stays off until it is turned on.")
        else:
            every = len(state["servos"]) + len(state["nodes"])
            print(f"Stopped: {every - len(silent)} of {every} servos have confirmed torque {state['mode']}.")
        if silent:
            told = "Torque may still be on there. If they can move, cut their supply."
            print(f"Not confirmed: {', '.join(silent)}. {told}", file=sys.stderr)
            raise typer.Exit(Exit.FAILED)


def _restore(hornbill: "Hornbill", confirm: list[str], hold: float | None, *, yes: bool, as_json: bool) -> None:
    """After a look at whom, and at who is under load. Under motion control only where a servo lets go by itself."""
    plan = hornbill.plan_restore_output()
    if not as_json:
        for one in plan["servos"]:
            said = [one["output"]["state"], *(["under load"] if one["under_load"] else [])]
            said += [one["problem"]["detail"]] if one["problem"] is not None else []
            print(f"{one['title']}: {', '.join(said)}", file=sys.stderr)
    loaded = [one["title"] for one in plan["servos"] if one["under_load"]]
    question = f"Switch {len(plan['servos'])} outputs on, each horn held where it stands?"
    question += f" Under load: {', '.join(loaded)}." if loaded else ""
    agree(question, yes, as_json=as_json)
    words = confirm if yes or not loaded else [*confirm, "load"]
    let_go = any(one["needs_lease"] for one in plan["servos"])
    with hornbill.lease(hornbill.by) if let_go else contextlib.nullcontext():
        job = hornbill.restore_output(confirm=words)
        print_json(job) if as_json else print_job(job)
        if let_go:
            end = "with Ctrl-C" if hold is None else f"in {hold:g} s"
            print(f"On until motion control ends, {end}.", file=sys.stderr, flush=True)
            with contextlib.suppress(KeyboardInterrupt):
                time.sleep(hold if hold is not None else FOR_EVER_S)

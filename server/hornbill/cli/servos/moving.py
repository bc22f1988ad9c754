"""Commands for motion: move and stop."""

import contextlib
import sys
import time
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, AsJson, Confirm, Server, ServoName, client
from hornbill.cli.failing import Exit
from hornbill.cli.showing import print_job, print_json

if TYPE_CHECKING:
    from hornbill.client import Hornbill

INDEFINITELY_S = 10 * 365 * 86_400.0


def move(
    servo: ServoName,
    value: Annotated[
        float,
        typer.Argument(
            help="Angle (°), speed (rpm) or torque (%). Negative values after --: hornbill move front -- -30"
        ),
    ],
    kind: Annotated[Literal["angle", "speed", "torque"], typer.Option("--type", help="Type of the value.")] = "angle",
    torque_on: Annotated[bool, typer.Option("--torque-on", help="Turn torque on first, at the current angle.")] = False,
    hold: Annotated[float, typer.Option(help="Time to hold before torque goes off, s.", min=0)] = 0.0,
    speed: Annotated[float | None, typer.Option(help="Speed limit for angles, °/s. Default: none.", min=0.1)] = None,
    timeout: Annotated[float, typer.Option(help="Timeout for settling, s.", min=0.1, max=120)] = 5.0,
    band: Annotated[float, typer.Option(help="Settling band around the angle, °.", min=0.01, max=30)] = 0.5,
    clamp: Annotated[bool, typer.Option("--clamp", help="Move to the nearest valid value instead of failing.")] = False,
    confirm: Confirm = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Move a servo and wait until it settles. Takes motion control of it (a lease); torque is off afterwards.

    Ctrl-C ends the command immediately, also while holding.
    """
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        with hornbill.lease(hornbill.by, uids=[found.uid]):
            if torque_on:
                found.torque("on")
            codes = confirm or ()
            if kind == "angle":
                done = found.move(
                    value, timeout_s=timeout, band_deg=band, clamp=clamp, confirm=codes, speed_deg_s=speed
                )
            else:
                done = found.command(kind, value, clamp=clamp, confirm=codes)
            if as_json:
                print_json(done)
            else:
                unit = {"angle": "°", "speed": " rpm", "torque": " %"}[kind]
                at = f" At {done['angle_deg']:+.1f}°" if done["angle_deg"] is not None else ""
                took = f" after {done['settle_time_s']:.2f} s" if done["settle_time_s"] is not None else ""
                print(f"Commanded {done['value']:g}{unit}.{at}{took}{'.' if at else ''}")
                for warning in done["warnings"]:
                    print(warning, file=sys.stderr)
            sys.stdout.flush()
            time.sleep(hold)


def stop(
    brake: Annotated[bool, typer.Option("--brake", help="Brake instead of torque off.")] = False,
    clear: Annotated[bool, typer.Option("--clear", help="Clear the stop. Torque stays off.")] = False,
    everyone: Annotated[
        bool, typer.Option("--everyone", help="As guest, also servos that an autopilot commands.")
    ] = False,
    restore: Annotated[
        bool,
        typer.Option("--restore", help="Clear the stop and turn outputs on again. Prompts for confirmation."),
    ] = False,
    hold: Annotated[
        float | None,
        typer.Option(help="With --restore: time to keep outputs on that need a lease, s. Default: until Ctrl-C."),
    ] = None,
    confirm: Confirm = None,
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Stop all servos immediately: torque off until cleared. The exit code is 1 if a servo did not confirm."""
    if brake + clear + restore > 1:
        raise typer.BadParameter("--brake, --clear and --restore are mutually exclusive")
    with client(server) as hornbill:
        if restore:
            _restore(hornbill, confirm or [], hold, yes=yes, as_json=as_json)
            return
        from hornbill.client import unconfirmed

        state = hornbill.clear_stop() if clear else hornbill.stop("brake" if brake else "off", everyone=everyone)
        silent = unconfirmed(state)
        if as_json:
            print_json(state)
        elif clear:
            print("Stop cleared. Torque stays off until it is turned on.")
        else:
            every = len(state["servos"]) + len(state["nodes"])
            print(f"Stopped: {every - len(silent)} of {every} servos confirmed torque {state['mode']}.")
        if silent:
            advice = "Torque may still be on. If they can move, cut their supply."
            print(f"Not confirmed: {', '.join(silent)}. {advice}", file=sys.stderr)
            raise typer.Exit(Exit.FAILED)


def _restore(hornbill: "Hornbill", confirm: list[str], hold: float | None, *, yes: bool, as_json: bool) -> None:
    """Show the servos and their load, confirm, and restore. Takes a lease only if a servo needs one."""
    plan = hornbill.plan_restore_output()
    if not as_json:
        for one in plan["servos"]:
            facts = [one["output"]["state"], *(["under load"] if one["under_load"] else [])]
            facts += [one["problem"]["detail"]] if one["problem"] is not None else []
            print(f"{one['title']}: {', '.join(facts)}", file=sys.stderr)
    loaded = [one["title"] for one in plan["servos"] if one["under_load"]]
    question = f"Turn {len(plan['servos'])} outputs on, each holding its current angle?"
    question += f" Under load: {', '.join(loaded)}." if loaded else ""
    require_confirmation(question, yes, as_json=as_json)
    codes = confirm if yes or not loaded else [*confirm, "load"]
    needs_lease = any(one["needs_lease"] for one in plan["servos"])
    with hornbill.lease(hornbill.by) if needs_lease else contextlib.nullcontext():
        job = hornbill.restore_output(confirm=codes)
        print_json(job) if as_json else print_job(job)
        if needs_lease:
            end = "with Ctrl-C" if hold is None else f"in {hold:g} s"
            print(f"Outputs stay on until motion control ends, {end}.", file=sys.stderr, flush=True)
            with contextlib.suppress(KeyboardInterrupt):
                time.sleep(hold if hold is not None else INDEFINITELY_S)

"""The commands that start something here, without asking a server: demo, serve, sim, decode, openapi."""

import asyncio
import gc
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from hornbill.cli.failing import failures
from hornbill.cli.showing import print_json

if TYPE_CHECKING:
    from hornbill.app.settings import Settings

Host = Annotated[str | None, typer.Option(help="address to listen on; 127.0.0.1 unless told", show_default=False)]
Port = Annotated[int | None, typer.Option(help="port to listen on; 8000 unless told, 0 for any", show_default=False)]
Token = Annotated[
    str | None,
    typer.Option(
        help="a token for admin, of 16 characters or more, beside those of 'hornbill token add'; HORNBILL_TOKEN hides "
        "it from others"
    ),
]
AllowHost = Annotated[list[str] | None, typer.Option(help="a name under which it is reached; may be given again")]
BehindProxy = Annotated[
    bool | None, typer.Option("--behind-proxy", help="a reverse proxy is in front: believe its X-Forwarded-… headers")
]
RootPath = Annotated[str | None, typer.Option(help="where a reverse proxy puts it, for example /hornbill")]
TlsCert = Annotated[Path | None, typer.Option(help="certificate chain in PEM: serve https")]
TlsKey = Annotated[Path | None, typer.Option(help="its private key in PEM")]
Seed = Annotated[int | None, typer.Option(help="seed of everything random in the simulated servos")]


def demo(
    servos: Annotated[int | None, typer.Option(help="number of simulated servos; 6 unless told")] = None,
    bus: Annotated[
        Literal["embedded", "auto"] | None,
        typer.Option(help="auto: the kernel's virtual CAN where there is one; embedded unless told"),
    ] = None,
    host: Host = None,
    port: Port = None,
    seed: Seed = None,
    token: Token = None,
    allow_host: AllowHost = None,
    behind_proxy: BehindProxy = None,
    root_path: RootPath = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
) -> None:
    """Serve simulated servos on an embedded bus with true 1 Mbit/s bit times. No hardware needed."""
    settings = _settings(
        servos=servos, bus=bus, host=host, port=port, seed=seed, token=token, allow_host=allow_host or None,
        behind_proxy=behind_proxy, root_path=root_path, tls_cert=tls_cert, tls_key=tls_key,
    )  # fmt: skip
    address, why = _demo_bus(settings.bus)
    announce = f"hornbill demo with {settings.servos} simulated servos: open {{url}}" + why
    _serve(settings.model_copy(update={"bus": address}), demo=True, announce=announce)


def serve(
    bus: Annotated[
        str | None, typer.Option(help="INTERFACE:CHANNEL, for example socketcan:can0; file:LOG plays a log")
    ] = None,
    bitrate: Annotated[int | None, typer.Option(help="bit/s; 1000000 unless told")] = None,
    frame_gap_ms: Annotated[
        float | None, typer.Option(help="pause between the frames of one transfer, ms; none unless given")
    ] = None,
    host: Host = None,
    port: Port = None,
    data_dir: Annotated[Path | None, typer.Option(help="folder of the database and of logs")] = None,
    database: Annotated[
        str | None,
        typer.Option(help="URL of a database elsewhere, as postgresql://USER@HOST/NAME; or set HORNBILL_DATABASE"),
    ] = None,
    allocator: Annotated[
        Literal["on", "off", "force"] | None,
        typer.Option(help="give node ids; force: beside another allocator, too; as chosen last unless told"),
    ] = None,
    position_unit: Annotated[
        Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None,
        typer.Option(help="what position 1.0 means on the bus, for every servo; measured unless told"),
    ] = None,
    sim_api: Annotated[
        bool | None,
        typer.Option("--sim-api", help="let REST add simulated servos to the bus, or to one of their own"),
    ] = None,
    token: Token = None,
    allow_host: AllowHost = None,
    behind_proxy: BehindProxy = None,
    root_path: RootPath = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
) -> None:
    """Serve the servos on a real adapter. Without --bus it starts disconnected."""
    settings = _settings(
        bus=bus, bitrate=bitrate, frame_gap_ms=frame_gap_ms, host=host, port=port, data_dir=data_dir,
        database=database, allocator=allocator,
        position_unit=position_unit, sim_api=sim_api, token=token, allow_host=allow_host or None,
        behind_proxy=behind_proxy, root_path=root_path, tls_cert=tls_cert, tls_key=tls_key,
    )  # fmt: skip
    _serve(settings, demo=False, announce="hornbill: open {url}")


def sim(
    bus: Annotated[str, typer.Option(help="INTERFACE:CHANNEL the servos live on")],
    servos: Annotated[int, typer.Option(help="how many")] = 1,
    model: Annotated[str | None, typer.Option(help="for example BLA21-06U-A0; a mix unless told")] = None,
    firmware: Annotated[str | None, typer.Option(help="for example 1.300")] = None,
    node_id: Annotated[
        str,
        typer.Option(
            help="node ID of the first servo, the others follow; none or 0: all as delivered, without one; auto: as in "
            "the demo, static from 10 on, and every second of the first eight without one"
        ),
    ] = "auto",
    seed: Annotated[int, typer.Option(help="seed of everything random")] = 1,
    any_firmware: Annotated[
        bool, typer.Option("--any-firmware", help="allow a firmware the model was never built with, for tests")
    ] = False,
) -> None:
    """Simulated servos alone, on any bus, for other DroneCAN tools to talk to. Ends with Ctrl-C."""
    from hornbill.app.simulate import simulate

    with failures():
        say = partial(print, flush=True)  # whoever reads a pipe waits for it
        asyncio.run(simulate(bus, servos, model, firmware, node_id, seed, say, any_firmware=any_firmware))


def decode(
    log: Annotated[str, typer.Argument(metavar="LOG", help="candump -l, ASC, BLF or CSV file; - is standard input")],
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object a line")] = False,
) -> None:
    """Print the DroneCAN transfers of a recording, or live: candump -L can0 | hornbill decode -"""
    from hornbill.app.decode import decode_log

    with failures():
        decode_log(log, as_json, sys.stdin.buffer, sys.stdout.buffer, lambda text: print(text, file=sys.stderr))


def openapi() -> None:
    """Print the OpenAPI document."""
    from hornbill.api.http import create_api
    from hornbill.schema.catalog import Catalog

    print_json(create_api(Catalog.load()).openapi())


def _settings(**flags: Any) -> "Settings":
    from hornbill.app.settings import Settings

    return Settings(**{name: value for name, value in flags.items() if value is not None})


def _demo_bus(asked: str | None) -> tuple[str | None, str]:
    """Where the demo's servos live, None for the embedded bus, and what is said of it.

    An adapter that HORNBILL_BUS names is for `serve`: no simulated servo gets onto it.
    """
    if asked != "auto":
        return None, ""
    from hornbill.bus.adapters.virtual import find_vcan

    address, why = find_vcan()
    return address, f"\nbus: {address or 'embedded'}, as {why}"


def _serve(settings: "Settings", *, demo: bool, announce: str) -> None:
    # Nearly all that starting makes is kept, and looking it through again and again is a sixth of its time.
    # `serving.serve` sets it apart and switches this on.
    gc.disable()
    from hornbill.app import composition as application
    from hornbill.app import network_policy as exposure
    from hornbill.app import serving
    from hornbill.cli.server.tokens import first_link

    with failures():
        try:
            exposed = exposure.decide(settings, demo=demo)
        except exposure.NotExposed as error:
            print(error.detail, file=sys.stderr)
            raise typer.Exit(2) from None
        listening = serving.listen(settings.host, settings.port)
        built = application.build(
            settings, demo=demo, log=lambda text: print(text, file=sys.stderr), exposure=exposed
        )  # fmt: skip
        tls = None if settings.tls_cert is None or settings.tls_key is None else (settings.tls_cert, settings.tls_key)
        announce += first_link(exposed.first_token, "http" if tls is None else "https", listening.getsockname()[1])
        try:
            asyncio.run(serving.serve(built, listening, announce, tls))
        except KeyboardInterrupt:
            pass

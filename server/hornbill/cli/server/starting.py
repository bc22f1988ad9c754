"""Commands that need no running server: demo, serve, check, sim, decode, openapi."""

import gc
import os
import sys
from collections.abc import Generator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from socket import gethostname
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

import typer

from hornbill.cli import remedies
from hornbill.cli.connection import LOCAL_URL, AsJson, AsJsonLines, Server, ServoName, client
from hornbill.cli.failing import Exit, code_of, failures
from hornbill.cli.server.server_settings import settings_of
from hornbill.cli.showing import print_json, print_table
from hornbill.errors import CannotStart, InvalidValue

if TYPE_CHECKING:
    from hornbill.app.settings import Settings

Host = Annotated[str | None, typer.Option(help="Address to listen on. Default: 127.0.0.1.", show_default=False)]
Port = Annotated[
    int | None, typer.Option(help="Port to listen on; 0 for any free one. Default: 8000.", show_default=False)
]
Token = Annotated[
    str | None,
    typer.Option(
        help="Additional admin token, at least 16 characters. Use HORNBILL_TOKEN to keep it out of the process list."
    ),
]
AllowHost = Annotated[list[str] | None, typer.Option(help="Additional host name of this server. Repeatable.")]
BehindProxy = Annotated[
    bool | None, typer.Option("--behind-proxy", help="Trust the X-Forwarded-… headers of a reverse proxy.")
]
RootPath = Annotated[str | None, typer.Option(help="Sub-path behind a reverse proxy, for example /hornbill.")]
PublicUrl = Annotated[
    str | None,
    typer.Option(help="Address of the page for other benches, for example https://bench.example/hornbill/."),
]
TlsCert = Annotated[Path | None, typer.Option(help="Certificate chain, PEM. Enables https.")]
TlsKey = Annotated[Path | None, typer.Option(help="Private key of the certificate, PEM.")]
Bus = Annotated[
    str | None, typer.Option(help="INTERFACE:CHANNEL, for example socketcan:can0. file:LOG plays back a log.")
]
DataDir = Annotated[Path | None, typer.Option(help="Data folder: database, logs and recordings.")]
DatabaseUrl = Annotated[
    str | None, typer.Option(help="Database URL, for example postgresql://USER@HOST/NAME. Also HORNBILL_DATABASE.")
]
Seed = Annotated[int | None, typer.Option(help="Random seed of the simulated servos.")]
ChaosSeed = Annotated[
    int | None,
    typer.Option("--chaos", metavar="SEED", help="Inject faults at random, the same for the same seed. Default: none."),
]
Speed = Annotated[
    str | None,
    typer.Option(
        metavar="N|max", help="Virtual time, N times as fast as real time, or as fast as possible. Default: real time."
    ),
]


def demo(
    servos: Annotated[int | None, typer.Option(help="Number of simulated servos. Default: 6.")] = None,
    bus: Annotated[
        Literal["embedded", "auto"] | None,
        typer.Option(help="auto: virtual CAN of the kernel if available, else embedded. Default: embedded."),
    ] = None,
    autopilot: Annotated[
        Literal["ardupilot", "px4"] | None,
        typer.Option(help="Add an armed autopilot that moves the servos. hornbill connects as guest."),
    ] = None,
    host: Host = None,
    port: Port = None,
    seed: Seed = None,
    speed: Speed = None,
    chaos: ChaosSeed = None,
    token: Token = None,
    allow_host: AllowHost = None,
    behind_proxy: BehindProxy = None,
    root_path: RootPath = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
) -> None:
    """Start the server with simulated servos, on an embedded bus with true 1 Mbit/s timing. Needs no hardware."""
    settings = _settings(
        servos=servos, bus=bus, autopilot=autopilot, host=host, port=port, seed=seed, speed=speed, chaos=chaos,
        token=token, allow_host=allow_host or None, behind_proxy=behind_proxy, root_path=root_path, tls_cert=tls_cert,
        tls_key=tls_key,
    )  # fmt: skip
    address, why = _demo_bus(settings.bus)
    if settings.speed is not None and address is not None:
        with failures():
            raise InvalidValue(
                f"{address} cannot be used with --speed: other programs on it run in real time. Omit --bus.",
                cause=None,
            )
    announce = f"hornbill demo with {settings.servos} simulated servos: open {{url}}" + why
    _serve(settings.model_copy(update={"bus": address}), demo=True, announce=announce)


def serve(
    bus: Bus = None,
    bitrate: Annotated[int | None, typer.Option(help="Bit rate, bit/s. Default: 1000000.")] = None,
    frame_gap_ms: Annotated[
        float | None, typer.Option(help="Pause between the frames of one transfer, ms. Default: none.")
    ] = None,
    host: Host = None,
    port: Port = None,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    bench: Annotated[
        str | None,
        typer.Option(
            help="Name of this bench in a shared database. Default: the only bench in the data folder, otherwise the "
            "host name."
        ),
    ] = None,
    allocator: Annotated[
        Literal["on", "off", "force"] | None,
        typer.Option(help="Node ID allocator. force: allocate even if there is another. Default: last setting."),
    ] = None,
    role: Annotated[
        Literal["auto", "host", "guest", "observer"] | None,
        typer.Option(
            help="Connection role. guest: beside an autopilot; observer: send nothing; auto: listen, then host or "
            "guest. Default: last used with the adapter, otherwise auto."
        ),
    ] = None,
    position_unit: Annotated[
        Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None,
        typer.Option(help="Unit of positions on the bus, for all servos. Default: measured."),
    ] = None,
    sim_api: Annotated[
        bool | None,
        typer.Option("--sim-api", help="Allow simulated servos to be added over REST."),
    ] = None,
    token: Token = None,
    allow_host: AllowHost = None,
    behind_proxy: BehindProxy = None,
    root_path: RootPath = None,
    public_url: PublicUrl = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
) -> None:
    """Start the server for servos on a real bus. Without --bus it starts disconnected."""
    settings = _settings(
        bus=bus, bitrate=bitrate, frame_gap_ms=frame_gap_ms, host=host, port=port, data_dir=data_dir,
        database=database, bench=bench, allocator=allocator, role=role,
        position_unit=position_unit, sim_api=sim_api, token=token, allow_host=allow_host or None,
        behind_proxy=behind_proxy, root_path=root_path, public_url=public_url, tls_cert=tls_cert, tls_key=tls_key,
    )  # fmt: skip
    _serve(settings, demo=False, announce="hornbill: open {url}")


def check(
    bus: Bus = None,
    host: Host = None,
    port: Port = None,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    token: Token = None,
    allow_host: AllowHost = None,
    behind_proxy: BehindProxy = None,
    root_path: RootPath = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    as_json: AsJson = False,
) -> None:
    """Check what 'hornbill serve' needs, without serving: data folder, database, access, certificate, port and bus.

    Nothing is migrated or sent; a data folder that does not exist is created. The exit code is that of the first
    failure, as for 'hornbill serve'.
    """
    settings = _settings(
        bus=bus, host=host, port=port, data_dir=data_dir, database=database, token=token,
        allow_host=allow_host or None, behind_proxy=behind_proxy, root_path=root_path, tls_cert=tls_cert,
        tls_key=tls_key,
    )  # fmt: skip
    import asyncio

    from hornbill.app import start_up

    async def collect() -> list[start_up.Checked]:
        return [one async for one in start_up.check(settings)]

    with failures(), _files_of_start():
        found = asyncio.run(collect())
    if as_json:
        print_json([
            {"part": one.part, "ok": one.error is None, "detail": one.detail,
             "exit_code": Exit.DONE if one.error is None else code_of(one.error)}
            for one in found
        ])  # fmt: skip
    else:
        rows = [
            (one.part.replace("_", " "), "ok" if one.error is None else "failed",
             one.detail if one.error is None else remedies.detail(one.error))
            for one in found
        ]  # fmt: skip
        print_table(("part", "result", "detail"), rows)
    raise typer.Exit(next((code_of(one.error) for one in found if one.error is not None), Exit.DONE))


simulator = typer.Typer(invoke_without_command=True)


@simulator.callback()
def sim(
    context: typer.Context,
    bus: Annotated[str, typer.Option(help="INTERFACE:CHANNEL of the bus.")] = "",
    servos: Annotated[int, typer.Option(help="Number of servos.")] = 1,
    model: Annotated[str | None, typer.Option(help="Model, for example BLA21-06U-A0. Default: mixed.")] = None,
    firmware: Annotated[str | None, typer.Option(help="Firmware version, for example 1.300.")] = None,
    node_id: Annotated[
        str,
        typer.Option(
            help="Node ID of the first servo; the others follow. none or 0: no node IDs, as delivered. auto: as in the "
            "demo, static from 10 on, except every second of the first eight."
        ),
    ] = "auto",
    seed: Annotated[int, typer.Option(help="Random seed.")] = 1,
    any_firmware: Annotated[
        bool, typer.Option("--any-firmware", help="Allow firmware versions that do not exist for the model.")
    ] = False,
    autopilot: Annotated[
        Literal["ardupilot", "px4"] | None,
        typer.Option(help="Add an armed autopilot that allocates node IDs and moves the servos."),
    ] = None,
    plant: Annotated[
        Path | None,
        typer.Option(help="TOML or JSON file of the constants of the horn, or an exported twin. Default: no load."),
    ] = None,
    chaos: ChaosSeed = None,
) -> None:
    """Simulate servos on any bus, without a server, for other DroneCAN tools. Ends with Ctrl-C."""
    if context.invoked_subcommand is not None:
        return
    import asyncio

    from hornbill.app.simulate import read_plant, simulate

    with failures():
        if not bus:
            raise typer.BadParameter("--bus is missing. Enter INTERFACE:CHANNEL, for example socketcan:vcan0.")
        constants = None if plant is None else read_plant(plant)
        say = partial(print, flush=True)  # also into a pipe
        asyncio.run(
            simulate(
                bus, servos, model, firmware, node_id, seed, say, any_firmware=any_firmware, autopilot=autopilot,
                plant=constants, chaos=chaos,
            )
        )  # fmt: skip


@simulator.command()
def truth(servo: ServoName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the true constants and state of a simulated servo of the server, to compare measurements with."""
    with client(server) as hornbill:
        found = hornbill.sim.truth(hornbill.look_up(servo))
    if as_json:
        print_json(found)
        return
    print_table(("constant", "value"), found["plant"].items())
    print_table(("state", "value"), [one for one in found.items() if one[0] not in ("uid", "plant")])


def decode(
    log: Annotated[str, typer.Argument(metavar="LOG", help="candump -l, ASC, BLF or CSV file; - for standard input.")],
    as_json: AsJsonLines = False,
) -> None:
    """Print the DroneCAN transfers of a log, or live: candump -L can0 | hornbill decode -"""
    from hornbill.app.decode import decode_log

    with failures():
        decode_log(log, as_json, sys.stdin.buffer, sys.stdout.buffer, lambda text: print(text, file=sys.stderr))


def openapi() -> None:
    """Print the OpenAPI document."""
    from hornbill.api.http import create_api
    from hornbill.schema.catalog import Catalog

    print_json(create_api(Catalog.load()).openapi())


def _settings(**flags: Any) -> "Settings":
    with failures():
        return settings_of(**flags)


def _demo_bus(requested: str | None) -> tuple[str | None, str]:
    """Bus address of the demo (None: embedded), and its announcement.

    HORNBILL_BUS may name a real adapter for `serve`; simulated servos never use it.
    """
    if requested != "auto":
        return None, ""
    from hornbill.bus.adapters.virtual import find_vcan

    address, why = find_vcan()
    return address, f"\nbus: {address or 'embedded'}, because {why}"


def _serve(settings: "Settings", *, demo: bool, announce: str) -> None:
    # Garbage collection takes a sixth of the start-up time and finds hardly anything. `serving.serve` freezes the
    # objects and enables it again.
    gc.disable()
    # FastAPI imports pydantic.v1 to recognize models of it. There are none, and the import takes 50 ms and 3 MiB.
    sys.modules["pydantic.v1"] = cast(Any, None)
    os.umask(0o077)  # files in the data folder are for this user alone
    import asyncio

    from hornbill.app import composition as application
    from hornbill.app import network_policy, serving
    from hornbill.cli.server.tokens import first_link

    with failures(), _files_of_start():
        exposed = network_policy.decide(settings, demo=demo)
        with closing(serving.listen(settings.host, settings.port)) as listening:
            tls = settings.tls
            scheme = "http" if tls is None else "https"
            built = application.build(
                settings, demo=demo, log=lambda text: print(text, file=sys.stderr), exposure=exposed,
                url=settings.public_url or serving.url_of(listening, scheme, everywhere=gethostname()),
            )  # fmt: skip
            announce += first_link(exposed.first_token, scheme, listening.getsockname()[1])
            try:
                with asyncio.Runner(loop_factory=lambda: serving.loop_of(settings.speed if demo else None)) as runner:
                    runner.run(serving.serve(built, listening, announce, tls))
            except KeyboardInterrupt:
                pass


@contextmanager
def _files_of_start() -> Generator[None]:
    """Turn errors of the operating system, such as a full disk, into CannotStart."""
    try:
        yield
    except OSError as error:
        raise CannotStart(f"Cannot start: {error}.", cause=None, part="files", retry=False) from error

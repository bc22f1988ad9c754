"""Network policy: whether the server may be reached from a network, under which names, and with which access."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from hornbill.app.bus_ports import EMBEDDED
from hornbill.app.settings import Settings
from hornbill.errors import CannotStart, PortOpenFailed
from hornbill.store.data_folder import FIRST_TOKEN, prepare
from hornbill.store.store import Store
from hornbill.store.tokens import new_secret
from hornbill.wire.port import REPLAYS

LOCAL: Final = frozenset(("127.0.0.1", "localhost", "::1"))
FIRST: Final = "first start"
"""Name of the token that a container creates at its first start."""
SHORTEST: Final = 16
"""Minimum length of a token given by the user, because guesses at Stop are not limited."""
CONTAINER: Final = "HORNBILL_CONTAINER"
_NETWORKS: Final = ("socketcand", "udp_multicast", "remote", "mcast")
"""Interfaces that reach other machines."""
_MAVLINK_UDP: Final = "udp:"
"""Prefix of the channels of mavcan that do; the others are serial ports."""
_SERIAL: Final = re.compile(
    r"/dev/(tty(ACM|USB|AMA|S|THS|mxc)\d+|rfcomm\d+|(cu|tty)\.[\w.-]+|serial/by-(id|path)/[\w.:+,@-]+)(@\d+)?", re.ASCII
)
"""Paths of serial ports, excluding terminals (/dev/tty1, /dev/pts/0)."""
_MARKS: Final = (Path("/.dockerenv"), Path("/run/.containerenv"))


@dataclass(frozen=True, slots=True)
class NetworkPolicy:
    """Reachability of the server. `hosts`: allowed host names; `addresses`: whether any IP address is allowed, too."""

    hosts: frozenset[str] = LOCAL
    addresses: bool = False
    required: bool = False
    simulated_only: bool = False
    """Whether only simulated servos may be connected, because the server is reachable without access control."""
    first_token: str | None = None
    """Token that was just created, to be shown once."""


def decide(
    settings: Settings, *, demo: bool, environment: Mapping[str, str] | None = None, has_tokens: bool | None = None
) -> NetworkPolicy:
    """Network policy for these settings.

    Loopback is open unless there are tokens. Any other address requires a token, except for simulated servos in a
    container, which has a network of its own. A container with real servos creates a token at its first start.
    `has_tokens`: whether tokens are stored; the database is then neither opened nor changed. Raises CannotStart with
    the remedy, and StoreFailed.
    """
    _tls(settings)
    given = None if settings.token is None else settings.token.get_secret_value()
    if given is not None and len(given) < SHORTEST:
        raise _refused(
            f"The token has {len(given)} characters and could be guessed. Use at least {SHORTEST} characters, or "
            "create one with 'hornbill tokens create NAME --role admin'."
        )
    wide = settings.host not in LOCAL
    reached = wide or settings.behind_proxy or bool(settings.allow_host)
    if not reached:
        return NetworkPolicy(required=given is not None)
    hosts = LOCAL | set(settings.allow_host)
    if given is not None:
        return NetworkPolicy(_named(hosts, settings.host), wide, required=True)
    contained = in_container(os.environ if environment is None else environment)
    if demo:
        if contained and not settings.behind_proxy and not settings.allow_host:
            return NetworkPolicy(hosts, simulated_only=True)
        raise _refused(_refusal(settings) + "set a token with --token TOKEN or HORNBILL_TOKEN.")
    first: str | None = None
    if has_tokens is None:
        with Store(settings.database or settings.data_dir, bench=settings.bench) as store:
            has_tokens = bool(store.tokens.all())
            if not has_tokens and contained:
                first = new_secret()
                _write_first(settings.data_dir, first)  # before it is valid: otherwise a failure here would hide it
                store.tokens.add(FIRST, "admin", first)
    if not has_tokens and not contained:
        raise _refused(
            _refusal(settings) + "create a token first: hornbill tokens create NAME --role admin"
            + ("" if settings.database is None else " (with the same HORNBILL_DATABASE)")
            + f" --data-dir {settings.data_dir}. Or set one with --token or HORNBILL_TOKEN."
        )  # fmt: skip
    return NetworkPolicy(_named(hosts, settings.host), wide, required=True, first_token=first)


def _write_first(folder: Path, token: str) -> None:
    """Write the first token to a file that only its owner can read: the log that shows it may rotate."""
    prepare(folder)
    file = folder / FIRST_TOKEN
    file.unlink(missing_ok=True)
    file.touch(mode=0o600, exist_ok=False)  # before it has content
    file.write_text(f"{token}\n", encoding="utf-8")


def may_open(exposed: NetworkPolicy, given: str | None, address: str, *, virtual: bool = False) -> None:
    """Check whether `address` may be connected over REST; `given` is the address of the command line.

    With access control, only adapters of this machine can be connected over REST: recordings in the data folder, paths
    of serial ports only (opening writes to them), no URLs (those of pyserial reach other machines, and spy:// writes to
    any file), and no network interfaces. Neither a reachable server without access control nor one
    in `virtual` time connects any adapter. Raises PortOpenFailed.
    """
    if address in (given, EMBEDDED):
        return
    recording = address.startswith(REPLAYS)
    if virtual and not recording:
        raise PortOpenFailed(
            f"Cannot open {address}: this server runs in virtual time, and real servos do not. Start it without "
            "--speed.", address=address, cause="virtual_time",
        )  # fmt: skip
    if exposed.simulated_only and not recording:
        raise PortOpenFailed(
            f"Cannot open {address}: this demo is reachable without a token, so it allows simulated servos only. "
            "Start 'hornbill serve' for real servos.", address=address, cause="demo_only",
        )  # fmt: skip
    if "://" in address and exposed.required:
        raise PortOpenFailed(
            f"Cannot open {address}: with access control, URLs are allowed only at start, with --bus.",
            address=address,
            cause="bus_option_required",
        )
    if exposed.required and not recording:
        _adapter_of_this_machine(address)
    elsewhere = any(mark in address.partition(":")[2] for mark in ("/", "\\", ".."))
    if recording and elsewhere and (exposed.required or exposed.simulated_only):
        raise PortOpenFailed(
            f"Cannot open {address}: over a network, only recordings in the data folder can be opened, by name.",
            address=address,
            cause="data_folder_only",
        )


def _adapter_of_this_machine(address: str) -> None:
    interface, _, channel = (part.strip() for part in address.partition(":"))
    if interface in _NETWORKS or (interface == "mavcan" and channel.startswith(_MAVLINK_UDP)):
        raise PortOpenFailed(
            f"Cannot open {address}: with access control, network interfaces are allowed only at start, with --bus.",
            address=address,
            cause="bus_option_required",
        )
    path = re.sub(r"\?bus=\d{1,3}$", "", channel, flags=re.ASCII) if interface == "mavcan" else channel
    if any(mark in channel for mark in ("/", "\\", "..")) and not _SERIAL.fullmatch(path):
        raise PortOpenFailed(
            f"Cannot open {address}: with access control, the path must be that of a serial port (/dev/ttyACM0, "
            "/dev/cu.…, /dev/serial/…). Other paths are allowed only at start, with --bus.",
            address=address,
            cause="bus_option_required",
        )


def in_container(environment: Mapping[str, str]) -> bool:
    """Whether this process runs in a container: as configured, else as detected."""
    configured = environment.get(CONTAINER)
    if configured is not None:
        return configured not in ("", "0")
    return any(mark.exists() for mark in _MARKS)


def _named(hosts: frozenset[str], host: str) -> frozenset[str]:
    """Hosts including the listening address, unless it stands for all addresses."""
    return hosts if host in ("0.0.0.0", "::", "") else hosts | {host.lower()}


def _refused(detail: str) -> CannotStart:
    return CannotStart(detail, cause=None, part="access", retry=False)


def _refusal(settings: Settings) -> str:
    if settings.host not in LOCAL:
        where = f"Cannot listen on {settings.host}"
    else:
        where = "Cannot serve a proxy or additional host names"
    return f"{where} without a token: any client could move servos. Serve this machine only (--host 127.0.0.1), or "


def _tls(settings: Settings) -> None:
    files = {"--tls-cert": settings.tls_cert, "--tls-key": settings.tls_key}
    for flag, file in files.items():
        if file is None and any(files.values()):
            raise CannotStart(
                f"TLS needs a certificate and its key. Add {flag}.", cause=None, part="settings", retry=False
            )
        if file is not None and not file.is_file():
            raise CannotStart(
                f"{flag}: file {file} not found. Specify a PEM file.", cause=None, part="certificate", retry=False
            )

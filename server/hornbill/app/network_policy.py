"""Whether this server may be reached from a network, under which names, and who may then come in."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from hornbill.app.bus_ports import EMBEDDED
from hornbill.app.settings import Settings
from hornbill.errors import HornbillError, PortOpenFailed
from hornbill.store.store import Store
from hornbill.wire.port import REPLAYS

LOCAL: Final = frozenset(("127.0.0.1", "localhost", "::1"))
FIRST: Final = "first start"
"""What the token is called that a container makes itself."""
SHORTEST: Final = 16
"""Characters of the shortest token somebody may think of themselves: at Stop one can guess at it unhindered."""
CONTAINER: Final = "HORNBILL_CONTAINER"
_NETWORKS: Final = ("socketcand", "udp_multicast", "remote")
"""Interfaces of python-can that reach other machines."""
_SERIAL: Final = re.compile(
    r"/dev/(tty(ACM|USB|AMA|S|THS|mxc)\d+|rfcomm\d+|(cu|tty)\.[\w.-]+|serial/by-(id|path)/[\w.:+,@-]+)(@\d+)?", re.ASCII
)
"""Paths of serial ports; not the terminals of people (/dev/tty1, /dev/pts/0)."""
_MARKS: Final = (Path("/.dockerenv"), Path("/run/.containerenv"))


class NotExposed(HornbillError):
    """It would be reached from a network, and nobody would have to say who they are."""

    code = "unauthorized"
    title = "A token is needed"


@dataclass(frozen=True, slots=True)
class NetworkPolicy:
    """How far the server may be reached. `hosts`: names it answers to; `addresses`: whether to any number as well."""

    hosts: frozenset[str] = LOCAL
    addresses: bool = False
    required: bool = False
    simulated_only: bool = False
    """Whether nothing but simulated servos may be connected: nobody has to say who they are, and a network can ask."""
    first_token: str | None = None
    """A token that was made just now; told once."""


def decide(settings: Settings, *, demo: bool, environment: Mapping[str, str] | None = None) -> NetworkPolicy:
    """How far the server may be reached with these settings.

    Loopback is open unless there are tokens. Anything wider takes a token, but for simulated servos in a container,
    whose network is its own; a container that serves real ones makes a token at its first start. Raises NotExposed
    with the remedy, and StoreFailed.
    """
    _tls(settings)
    given = None if settings.token is None else settings.token.get_secret_value()
    if given is not None and len(given) < SHORTEST:
        raise NotExposed(
            f"A token of {len(given)} characters can be guessed. Give one of {SHORTEST} or more, or none and make "
            "one with 'hornbill token add NAME --role admin'.",
            cause=None,
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
        raise NotExposed(_refusal(settings) + "give a token of your own: --token TOKEN, or HORNBILL_TOKEN.", cause=None)
    first: str | None = None
    with Store(settings.database or settings.data_dir) as store:
        if not store.tokens.all():
            if not contained:
                raise NotExposed(
                    _refusal(settings) + "make a token first: hornbill token add NAME --role admin"
                    + ("" if settings.database is None else " (with HORNBILL_DATABASE as here)")
                    + f" --data-dir {settings.data_dir}. Or give one with --token or HORNBILL_TOKEN.", cause=None
                )  # fmt: skip
            _, first = store.tokens.add(FIRST, "admin")
    return NetworkPolicy(_named(hosts, settings.host), wide, required=True, first_token=first)


def may_open(exposed: NetworkPolicy, given: str | None, address: str) -> None:
    """Whether somebody who asks over REST may connect `address`; `given` is the one of the command line.

    Where a token is needed nobody opens, over REST, what is no adapter of this machine: of recordings those of the data
    folder, of paths serial ports alone (opening writes to them), no URL (pyserial's reach other machines, and one of
    them, spy://, writes to any file), and no interface that is a network. Where nobody has to say who they are, no
    adapter. Raises PortOpenFailed.
    """
    if address in (given, EMBEDDED):
        return
    recording = address.startswith(REPLAYS)
    if exposed.simulated_only and not recording:
        raise PortOpenFailed(
            f"{address} is not opened: this is a demo that anybody may reach, so it has simulated servos only. "
            "Start 'hornbill serve' for real ones.", address=address, cause="demo_only",
        )  # fmt: skip
    if "://" in address and exposed.required:
        raise PortOpenFailed(
            f"{address} is not opened: where a token is needed, an adapter behind a URL is named at start, by --bus.",
            address=address,
            cause="bus_option_required",
        )
    if exposed.required and not recording:
        _adapter_of_this_machine(address)
    elsewhere = any(mark in address.partition(":")[2] for mark in ("/", "\\", ".."))
    if recording and elsewhere and (exposed.required or exposed.simulated_only):
        raise PortOpenFailed(
            f"{address} is not opened: over a network only recordings in the data folder are, by their name.",
            address=address,
            cause="data_folder_only",
        )


def _adapter_of_this_machine(address: str) -> None:
    interface, _, channel = (part.strip() for part in address.partition(":"))
    if interface in _NETWORKS:
        raise PortOpenFailed(
            f"{address} is not opened: where a token is needed, a bus behind a network is named at start, by --bus.",
            address=address,
            cause="bus_option_required",
        )
    if any(mark in channel for mark in ("/", "\\", "..")) and not _SERIAL.fullmatch(channel):
        raise PortOpenFailed(
            f"{address} is not opened: where a token is needed, the path is one of a serial port "
            "(/dev/ttyACM0, /dev/cu.…, /dev/serial/…). Name any other at start, by --bus.",
            address=address,
            cause="bus_option_required",
        )


def in_container(environment: Mapping[str, str]) -> bool:
    """Whether this process is in a container: told so, or found so."""
    told = environment.get(CONTAINER)
    if told is not None:
        return told not in ("", "0")
    return any(mark.exists() for mark in _MARKS)


def _named(hosts: frozenset[str], host: str) -> frozenset[str]:
    """With the address that is listened on, unless it stands for all."""
    return hosts if host in ("0.0.0.0", "::", "") else hosts | {host.lower()}


def _refusal(settings: Settings) -> str:
    if settings.host not in LOCAL:
        where = f"Cannot listen on {settings.host}"
    else:
        where = "Cannot be reached through a proxy or by another name"
    return (
        f"{where} without a token: whoever reaches hornbill could move servos. Serve this machine only "
        "(--host 127.0.0.1), or "
    )


def _tls(settings: Settings) -> None:
    files = {"--tls-cert": settings.tls_cert, "--tls-key": settings.tls_key}
    for flag, file in files.items():
        if file is None and any(files.values()):
            raise NotExposed(f"TLS takes a certificate and its key: {flag} is missing.", cause=None)
        if file is not None and not file.is_file():
            raise NotExposed(f"{flag}: there is no file {file}. Give a PEM file.", cause=None)

"""open_port: open a CanPort by address, such as `socketcan:can0`. Errors state the cause and the remedy."""

import asyncio
import threading
from functools import partial
from typing import Any, Final

import can

from hornbill.bus.adapters import socketcan
from hornbill.bus.adapters.diagnosis import Diagnosis, diagnose
from hornbill.bus.adapters.serial_ports import UNKNOWN_ADAPTER, BaudMemory, usb_of
from hornbill.bus.ports.candle import CandleLink
from hornbill.bus.ports.link import AdapterLink
from hornbill.bus.ports.mavcan import MavcanLink, parse_mavcan
from hornbill.bus.ports.mcast import MulticastLink, parse_bus
from hornbill.bus.ports.pythoncan import PythonCanPort
from hornbill.bus.ports.slcan import SlcanBus, split_baud
from hornbill.bus.ports.socketcand import SocketcandLink, parse_channel
from hornbill.bus.threads import OwnThread
from hornbill.errors import PortOpenFailed
from hornbill.wire.port import CanPort, Note, PortStatistics

OPEN_S = 8.0
"""Timeout for opening: a serial adapter that restarts on opening receives nothing for 2 s."""

_HIGHEST_BITRATE = 1_000_000
_HANGS = "Unplug the adapter, plug it in again and retry."
_EXAMPLES = "for example socketcan:can0 or slcan:/dev/ttyACM0"
_CANDLE = "candle"
_MULTICAST = "mcast"
_MAVLINK = "mavcan"
_LISTEN_ONLY: Final[dict[str, dict[str, Any]]] = {
    "pcan": {"state": can.BusState.PASSIVE},
    "kvaser": {"driver_mode": False},
    "systec": {"state": can.BusState.PASSIVE},
    "vector": {"listen_only": True},
    "nixnet": {"listen_only": True},
    "cantact": {"monitor": True},
}
"""Options of python-can that put an adapter into listen-only mode."""
INTERFACES = can.VALID_INTERFACES | {_CANDLE, _MULTICAST, _MAVLINK}
"""Interfaces: the part of an address before the colon."""


def parse(address: str) -> tuple[str, str]:
    """Split `INTERFACE:CHANNEL`. Raises PortOpenFailed if either is missing or the interface is unknown."""
    interface, colon, channel = (part.strip() for part in address.partition(":"))
    if not colon:
        raise PortOpenFailed(
            f"{address!r} is not a bus address. Enter INTERFACE:CHANNEL, {_EXAMPLES}.",
            address=address,
            cause="bus_address_invalid",
        )
    if interface not in INTERFACES:
        known = ", ".join(sorted(INTERFACES))
        raise PortOpenFailed(
            f"Unknown interface {interface!r}. Supported: {known}.",
            address=address,
            cause="interface_unsupported",
            interface=interface,
            known=known,
        )
    if not channel and interface != _CANDLE:
        raise PortOpenFailed(
            f"{address!r} has no channel. Enter INTERFACE:CHANNEL, {_EXAMPLES}.",
            address=address,
            cause="bus_address_invalid",
        )
    if interface == "socketcand":
        parse_channel(channel)
    elif interface == _MULTICAST:
        parse_bus(channel)
    elif interface == _MAVLINK:
        parse_mavcan(channel)
    return interface, channel


def check(address: str, bitrate: int) -> str:
    """Return the address without spaces. Raises PortOpenFailed if it, or `bitrate` (bit/s), is invalid."""
    interface, channel = parse(address)
    if not 0 < bitrate <= _HIGHEST_BITRATE:
        raise PortOpenFailed(
            f"{bitrate} bit/s is outside 1 to {_HIGHEST_BITRATE} bit/s. The factory setting of the servos is 1000000.",
            address=address,
            cause="bit_rate_unsupported",
            bitrate=bitrate,
        )
    return f"{interface}:{channel}"


async def open_port(
    address: str,
    *,
    bitrate: int = 1_000_000,
    deadline_s: float = OPEN_S,
    statistics: PortStatistics | None = None,
    memory: BaudMemory | None = None,
    listen_only: bool = False,
) -> CanPort:
    """Open `INTERFACE:CHANNEL` at `bitrate` (bit/s, up to 1000000) with python-can.

    SocketCAN and the virtual interfaces do not take the bit rate from here; SocketCAN's must be set already. Opening
    runs in a thread. If it takes longer than `deadline_s`, it is abandoned, and closed if it succeeds later.
    `listen_only`: the adapter neither sends nor acknowledges frames, if it supports that (`PortDetails.listen_only`).
    Counters continue in `statistics` if given. `memory` stores the baud rates of serial adapters. Raises
    PortOpenFailed with the cause and the remedy; facts: address, remedy.
    """
    plain = check(address, bitrate)
    interface, _, channel = plain.partition(":")
    opening = _Opening(interface, channel, bitrate, listen_only=listen_only)
    limit = asyncio.timeout(deadline_s)
    run = partial(asyncio.get_running_loop().run_in_executor, OwnThread("open bus"))
    try:
        async with limit:
            if interface == "slcan":
                opening.usb = await run(usb_of, split_baud(channel)[0])
                if memory is not None and opening.usb.serial_number:
                    opening.first_baud = memory.baud(opening.usb.serial_number)
            elif interface == _MAVLINK and (device := parse_mavcan(channel).device):
                opening.usb = await run(usb_of, device)
            await run(opening.run)
    except asyncio.CancelledError:
        opening.abandon()
        raise
    except PortOpenFailed as error:
        error.facts.setdefault("address", address)
        raise
    except Exception as error:
        if limit.expired():
            opening.abandon()
            found = Diagnosis(
                f"Opening timed out after {deadline_s:g} s: its driver hangs.", _HANGS, "driver_open_timeout"
            )
        else:
            found = diagnose(interface, channel.partition("?")[0], error)
        driver = f" (Driver: {error})" if str(error) else ""
        raise PortOpenFailed(
            f"{address} cannot be opened. {found.cause} {found.remedy}{driver}",
            address=address,
            remedy=found.remedy,
            cause=found.code,
            **found.params,
        ) from error
    port = PythonCanPort(
        opening.take(), address=plain, bitrate=bitrate, statistics=statistics,
        on_baud=(lambda _serial_number, _baud: None) if memory is None else memory.remember_baud,
    )  # fmt: skip
    port.sample_point = opening.sample_point
    port.listen_only = opening.listens_only
    if listen_only and not opening.listens_only:
        port.notes = (_acknowledges(interface, channel, bitrate),)
    return port


def _acknowledges(interface: str, channel: str, bitrate: int) -> Note:
    """Note that an adapter still acknowledges frames of other nodes, with a command as remedy where there is one."""
    text = "The adapter is not in listen-only mode: it sends no frames, but acknowledges those of other nodes."
    if interface != "socketcan" or socketcan.is_virtual(channel):
        return Note("not_listen_only", text)
    command = socketcan.listen_only_command(channel, bitrate)
    return Note("not_listen_only", f"{text} To prevent that: {command}", {"command": command})


class _Opening:
    """One attempt to open a bus. If it is abandoned, the thread or the caller closes the bus, whichever is later."""

    def __init__(self, interface: str, channel: str, bitrate: int, *, listen_only: bool) -> None:
        self.sample_point: float | None = None
        self.listens_only = False
        self._listen_only = listen_only
        self.usb = UNKNOWN_ADAPTER
        self.first_baud: int | None = None
        self._interface = interface
        self._channel = channel
        self._bitrate = bitrate
        self._lock = threading.Lock()
        self._bus: can.BusABC | AdapterLink | None = None
        self._abandoned = False

    def run(self) -> None:
        """Open the bus. Raises any exception of python-can and its drivers."""
        if self._interface == "socketcan":
            found = socketcan.check(self._channel, self._bitrate)
            self.sample_point = None if found is None else found.sample_point
            self.listens_only = found is not None and found.listen_only
        bus = self._open()
        if self._interface == "socketcan":
            socketcan.keep_backlog_short(bus)
        with self._lock:
            if not self._abandoned:
                self._bus = bus
                return
        bus.shutdown()

    def _open(self) -> can.BusABC | AdapterLink:
        match self._interface:
            case "slcan":  # python-can's own driver loses frames on a saturated bus
                self.listens_only = self._listen_only
                return SlcanBus(
                    self._channel, self._bitrate, usb=self.usb, first_baud=self.first_baud, wanted=self._is_wanted,
                    listen_only=self._listen_only,
                )  # fmt: skip
            case "socketcand":
                return SocketcandLink(self._channel, self._is_wanted)
            case "mcast":
                return MulticastLink(self._channel)
            case "mavcan":
                return MavcanLink(self._channel, self._is_wanted, usb=self.usb)
            case "candle":
                return CandleLink(self._channel, self._bitrate)
            case _:
                options: dict[str, Any] = {"fd": False} if self._interface == "udp_multicast" else {}
                if self._listen_only and self._interface in _LISTEN_ONLY:
                    options |= _LISTEN_ONLY[self._interface]
                    self.listens_only = True
                return can.Bus(
                    interface=self._interface,
                    channel=self._channel,
                    bitrate=self._bitrate,
                    ignore_config=True,  # only the address counts: no file in the home folder may change it
                    **options,
                )

    def _is_wanted(self) -> bool:
        return not self._abandoned

    def take(self) -> can.BusABC | AdapterLink:
        """Return the open bus. The caller owns it."""
        with self._lock:
            bus, self._bus = self._bus, None
        assert bus is not None
        return bus

    def abandon(self) -> None:
        """Close the bus now or when it is open."""
        with self._lock:
            self._abandoned = True
            bus, self._bus = self._bus, None
        if bus is not None:
            bus.shutdown()

"""Owns open_port: from an address such as `socketcan:can0` to an open CanPort, or to the reason and its remedy."""

import asyncio
import errno
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any, ParamSpec, TypeVar

import can

from hornbill.bus import socketcan
from hornbill.bus.pythoncan import PythonCanPort
from hornbill.errors import PortOpenFailed
from hornbill.wire.port import CanPort

OPEN_S = 8.0
"""How long opening may take: python-can waits 2 s for a serial adapter that restarts when it is opened."""

_HIGHEST_BITRATE = 1_000_000
_EXAMPLES = "for example socketcan:can0 or slcan:/dev/ttyACM0"

_P = ParamSpec("_P")
_T = TypeVar("_T")


def parse(address: str) -> tuple[str, str]:
    """Split `INTERFACE:CHANNEL`. Raises PortOpenFailed when either is missing or the interface is unknown."""
    interface, colon, channel = (part.strip() for part in address.partition(":"))
    if not colon:
        raise PortOpenFailed(
            f"{address!r} is not the address of a bus. Write INTERFACE:CHANNEL, {_EXAMPLES}.", address=address
        )
    if interface not in can.VALID_INTERFACES:
        known = ", ".join(sorted(can.VALID_INTERFACES))
        raise PortOpenFailed(f"There is no interface {interface!r}. Known: {known}.", address=address)
    if not channel:
        raise PortOpenFailed(f"{address!r} names no channel. Write INTERFACE:CHANNEL, {_EXAMPLES}.", address=address)
    return interface, channel


async def open_port(address: str, *, bitrate: int = 1_000_000, deadline_s: float = OPEN_S) -> CanPort:
    """Open `INTERFACE:CHANNEL` at `bitrate` (bit/s, up to 1000000) with python-can.

    SocketCAN and the virtual interfaces take no bitrate from here. Opening runs in a thread; one that
    takes longer than `deadline_s` is given up, and closed again should it succeed later. Raises
    PortOpenFailed, whose text says what to do; facts: address, and remedy where it is a command.
    """
    interface, channel = parse(address)
    if not 0 < bitrate <= _HIGHEST_BITRATE:
        raise PortOpenFailed(
            f"{bitrate} bit/s is outside 1 to {_HIGHEST_BITRATE} bit/s. The servos are delivered with 1000000.",
            address=address,
        )
    if interface == "socketcan":
        socketcan.check(channel, bitrate)
    opening = _Opening(interface, channel, bitrate)
    try:
        async with asyncio.timeout(deadline_s):
            await asyncio.get_running_loop().run_in_executor(_OwnThread(), opening.run)
    except TimeoutError as error:
        opening.give_up()
        raise PortOpenFailed(
            f"{address} did not open within {deadline_s:g} s. Unplug the adapter, plug it in again and retry.",
            address=address,
        ) from error
    except asyncio.CancelledError:
        opening.give_up()
        raise
    except Exception as error:
        raise PortOpenFailed(f"{address} cannot be opened: {error}. {_remedy(error)}", address=address) from error
    return PythonCanPort(opening.take(), address=f"{interface}:{channel}", bitrate=bitrate)


class _Opening:
    """One attempt to open a bus; whoever comes too late, the thread or the caller, closes it."""

    def __init__(self, interface: str, channel: str, bitrate: int) -> None:
        self._interface = interface
        self._channel = channel
        self._bitrate = bitrate
        self._lock = threading.Lock()
        self._bus: can.BusABC | None = None
        self._given_up = False

    def run(self) -> None:
        """Open the bus. Raises what python-can and its drivers raise, which is anything."""
        options: dict[str, Any] = {"fd": False} if self._interface == "udp_multicast" else {}
        bus = can.Bus(
            interface=self._interface,
            channel=self._channel,
            bitrate=self._bitrate,
            ignore_config=True,  # the address says it all: no file in the home folder may change it
            **options,
        )
        if self._interface == "socketcan":
            socketcan.keep_backlog_short(bus)
        with self._lock:
            if not self._given_up:
                self._bus = bus
                return
        bus.shutdown()

    def take(self) -> can.BusABC:
        """The open bus, which is the caller's from now on."""
        with self._lock:
            bus, self._bus = self._bus, None
        assert bus is not None
        return bus

    def give_up(self) -> None:
        """Nobody waits any longer."""
        with self._lock:
            self._given_up = True
            bus, self._bus = self._bus, None
        if bus is not None:
            bus.shutdown()


class _OwnThread(Executor):
    """Runs each call in a thread of its own that nobody joins: a driver that hangs must not keep us from ending."""

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        future: Future[_T] = Future()
        future.set_running_or_notify_cancel()

        def work() -> None:
            try:
                future.set_result(fn(*args, **kwargs))
            except Exception as error:
                future.set_exception(error)

        threading.Thread(target=work, name="open bus", daemon=True).start()
        return future


def _remedy(error: BaseException) -> str:
    cause: BaseException | None = error
    while cause is not None:
        number = cause.errno if isinstance(cause, OSError) else getattr(cause, "error_code", None)
        match number:
            case errno.ENOENT | errno.ENODEV | errno.ENXIO:
                return "There is no such device: plug the adapter in and check its name."
            case errno.EACCES | errno.EPERM:
                return (
                    "This user may not use it. For a serial adapter run: "
                    "sudo usermod -aG dialout $USER, then log in again."
                )
            case errno.EBUSY:
                return "Another program uses it: close that program first."
            case errno.EAFNOSUPPORT:
                return "This kernel has no SocketCAN. Run: sudo modprobe can_raw"
            case _:
                pass
        if isinstance(cause, ImportError | can.CanInterfaceNotImplementedError):
            return "Install the driver or the Python package it names."
        cause = cause.__cause__
    return "Check that the adapter is plugged in and that its driver is installed."

"""Owns Adapters: everything plugged in that a bus can be opened on, and why one cannot be used just now."""

import asyncio
import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any

from can.interfaces import BACKENDS

from hornbill.bus.adapter import Adapter
from hornbill.bus.kernel_adapters import kernel_adapters
from hornbill.bus.serial_ports import serial_adapters
from hornbill.bus.threads import OwnThread

log = logging.getLogger(__name__)
logging.getLogger("can").addHandler(logging.NullHandler())  # its drivers say on stderr which of them are missing

ANSWER_S = 1.5
"""How long looking may take; what hangs longer is listed as such."""

LOOKED_AT = frozenset(("slcan", "socketcan", "socketcand", "serial", "udp_multicast", "virtual"))
"""python-can's interfaces that are looked at without their drivers, or have no hardware to find."""


Look = Callable[[], list[Adapter]]


class Adapters:
    """Looks at everything at once, each in a thread of its own, so that a driver that hangs hides only its own.

    A driver that still hangs from the last time is not asked again. The driver of the bus that is open is not asked
    either, lest it be disturbed: what it said before is told again.
    """

    def __init__(self, own: Sequence[Adapter] = (), looks: dict[str, Look] | None = None) -> None:
        """`own` are adapters that are always there: the embedded bus. `looks`: where to look, by name, unless given
        the whole machine."""
        self._own = list(own)
        self._looks = _everywhere() if looks is None else looks
        self._looking: dict[str, asyncio.Future[list[Adapter]]] = {}
        self._last: dict[str, list[Adapter]] = {}

    async def plugged_in(self, connected: str | None = None) -> list[Adapter]:
        """What is plugged in now, within ANSWER_S. `connected` is the address of the bus that is open. Never raises."""
        open_now = (connected or "").partition(":")[0]
        asked = [name for name in self._looks if name in LOOKED_AT or name != open_now]
        waiting = [self._look(name) for name in asked]
        if waiting:
            await asyncio.wait(waiting, timeout=ANSWER_S)
        found = list(self._own)
        for name in self._looks:
            found += self._result(name) if name in asked else self._last.get(name, [])
        return _with_connected(found, connected)

    def close(self) -> None:
        """Wait for nobody any more."""
        for future in self._looking.values():
            future.cancel()

    def _look(self, name: str) -> "asyncio.Future[list[Adapter]]":
        before = self._looking.get(name)
        if before is None or before.done():
            loop = asyncio.get_running_loop()
            before = self._looking[name] = loop.run_in_executor(OwnThread(f"look for {name}"), self._looks[name])
        return before

    def _result(self, name: str) -> list[Adapter]:
        future = self._looking[name]
        if not future.done():
            return [
                Adapter(
                    f"{name}:", f"{name} driver", "no_driver", "It does not answer.",
                    "Unplug its adapter and plug it in again; if that does not help, restart the computer.",
                )
            ]  # fmt: skip
        error = None if future.cancelled() else future.exception()
        if error is not None:
            log.debug("looking for %s: %s", name, error)
        self._last[name] = [] if future.cancelled() or error is not None else future.result()
        return self._last[name]


def detect(interface: str) -> list[Adapter]:
    """What python-can detects of one interface; nothing where its driver or its Python package is missing.

    Raises whatever a driver raises. `can.detect_available_configs` would do it in threads that are waited for when
    the process ends, hung or not.
    """
    module, name = BACKENDS[interface]
    bus: Any = getattr(import_module(module), name)
    found: list[Adapter] = []
    for config in bus._detect_available_configs():
        words = (config.get("device_name"), config.get("serial"))
        title = " ".join(str(word) for word in words if word) or interface
        channel = config.get("channel")
        if channel is None:
            reason = "Its driver does not tell the names of its channels."
            remedy = f"Enter the address yourself: {interface}:CHANNEL, as python-can's manual has it."
            found.append(Adapter(f"{interface}:", title, "no_driver", reason, remedy))
        else:
            found.append(Adapter(f"{interface}:{channel}", title))
    return found


def _everywhere() -> dict[str, Look]:
    found: dict[str, Look] = {"socketcan": kernel_adapters, "slcan": serial_adapters}
    return found | {name: partial(detect, name) for name in sorted(BACKENDS) if name not in LOOKED_AT}


def _with_connected(found: list[Adapter], connected: str | None) -> list[Adapter]:
    if connected is None:
        return found
    same = [one for one in found if _same(one.address, connected)]
    if not same:
        return [Adapter(connected, "connected now", "connected"), *found]
    return [replace(one, state="connected", reason=None, remedy=None) if one is same[0] else one for one in found]


def _same(one: str, other: str) -> bool:
    """Whether two addresses mean one adapter: /dev/serial/by-id/… and the speed after @ make no difference."""
    interface, _, channel = one.partition(":")
    interface_too, _, channel_too = other.partition(":")
    return interface == interface_too and _device(channel) == _device(channel_too)


def _device(channel: str) -> str:
    path = channel.partition("@")[0]
    return os.path.realpath(path) if path.startswith("/") else channel

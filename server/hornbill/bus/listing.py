"""Adapters: everything plugged in that a bus can be opened on, and why one cannot be used just now."""

import asyncio
import logging
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any

from can.interfaces import BACKENDS

from hornbill.bus.adapters.adapter import FoundAdapter
from hornbill.bus.adapters.kernel_adapters import kernel_adapters
from hornbill.bus.adapters.serial_ports import BaudMemory, serial_adapters
from hornbill.bus.ports.candle import candle_adapters
from hornbill.bus.threads import OwnThread
from hornbill.wire.port import same_device, split_frame_gap

log = logging.getLogger(__name__)

ANSWER_S = 1.5
"""How long looking may take; what hangs longer is listed as such."""

HANGS_S = 15.0
"""A driver that has been looking for so long hangs. Sooner it may just be slow: loading one takes seconds somewhere."""

LOOKED_AT = frozenset(("slcan", "socketcan", "socketcand", "serial", "udp_multicast", "virtual"))
"""python-can's interfaces that are looked at without their drivers, or have no hardware to find."""


Look = Callable[[], list[FoundAdapter]]


class Adapters:
    """Looks at everything at once, each in a thread of its own, so that a driver that hangs hides only its own.

    A driver that still hangs from the last time is not asked again. The driver of the bus that is open is not asked
    either, lest it be disturbed: what it said before is told again.
    """

    def __init__(
        self, own: Sequence[FoundAdapter] = (), looks: dict[str, Look] | None = None, memory: BaudMemory | None = None
    ) -> None:
        """`own` are adapters that are always there: the embedded bus. `looks`: where to look, by name, unless given
        the whole machine. `memory` holds the baud rates of serial adapters."""
        self._own = list(own)
        self._memory = memory
        self._looks = _everywhere() if looks is None else looks
        self._looking: dict[str, asyncio.Future[list[FoundAdapter]]] = {}
        self._last: dict[str, list[FoundAdapter]] = {}
        self._since: dict[str, float] = {}

    async def plugged_in(self, connected: str | None = None) -> list[FoundAdapter]:
        """What is plugged in now, within ANSWER_S. `connected` is the address of the bus that is open. Never raises."""
        open_now = (connected or "").partition(":")[0]
        asked = [name for name in self._looks if name in LOOKED_AT or name != open_now]
        waiting = [self._look(name) for name in asked]
        if waiting:
            await asyncio.wait(waiting, timeout=ANSWER_S)
        found = list(self._own)
        for name in self._looks:
            found += self._result(name) if name in asked else self._last.get(name, [])
        return _with_connected([self._with_baud(one) for one in found], connected)

    def close(self) -> None:
        """Wait for nobody any more."""
        for future in self._looking.values():
            future.cancel()

    def _look(self, name: str) -> "asyncio.Future[list[FoundAdapter]]":
        before = self._looking.get(name)
        if before is None or before.done():
            loop = asyncio.get_running_loop()
            before = self._looking[name] = loop.run_in_executor(OwnThread(f"look for {name}"), self._looks[name])
            self._since[name] = time.monotonic()
        return before

    def _result(self, name: str) -> list[FoundAdapter]:
        future = self._looking[name]
        if not future.done():
            return self._unanswered(name)
        error = None if future.cancelled() else future.exception()
        if error is not None:
            log.debug("looking for %s: %s", name, error)
        self._last[name] = [] if future.cancelled() or error is not None else future.result()
        return self._last[name]

    def _unanswered(self, name: str) -> list[FoundAdapter]:
        """What is told of a driver that has not answered: nothing, unless it has adapters or surely hangs."""
        why = "Its driver does not answer."
        remedy = "Unplug the adapter and plug it in again; if that does not help, restart the computer."
        known = self._last.get(name, [])
        if known:
            return [
                replace(one, state="no_driver", reason=why, remedy=remedy, cause="driver_silent", params={})
                for one in known
            ]
        if time.monotonic() - self._since[name] < HANGS_S:
            return []
        text = f"It has not answered for {HANGS_S:g} s. Adapters of this kind cannot be listed."
        return [
            FoundAdapter(
                f"{name}:", f"{name} driver", "no_driver", text, f"If you use one: {remedy}", cause="driver_silent"
            )
        ]

    def _with_baud(self, one: FoundAdapter) -> FoundAdapter:
        if self._memory is None or one.serial_number is None or one.interface != "slcan":
            return one
        return replace(one, baud=self._memory.baud(one.serial_number))


def detect(interface: str) -> list[FoundAdapter]:
    """What python-can detects of one interface; nothing where its driver or its Python package is missing.

    Raises whatever a driver raises. `can.detect_available_configs` would do it in threads that are waited for when
    the process ends, hung or not.
    """
    module, name = BACKENDS[interface]
    bus: Any = getattr(import_module(module), name)
    found: list[FoundAdapter] = []
    for config in bus._detect_available_configs():
        words = (config.get("device_name"), config.get("serial"))
        title = " ".join(str(word) for word in words if word) or interface
        channel = config.get("channel")
        if channel is None:
            reason = "Its driver does not tell the names of its channels."
            remedy = f"Enter the address yourself: {interface}:CHANNEL, as python-can's manual has it."
            found.append(
                FoundAdapter(
                    f"{interface}:",
                    title,
                    "no_driver",
                    reason,
                    remedy,
                    cause="no_names_of_channels",
                    params={"interface": interface},
                )
            )
        else:
            found.append(FoundAdapter(f"{interface}:{channel}", title))
    return found


def _everywhere() -> dict[str, Look]:
    found: dict[str, Look] = {"socketcan": kernel_adapters, "slcan": serial_adapters, "candle": candle_adapters}
    return found | {name: partial(detect, name) for name in sorted(BACKENDS) if name not in {*LOOKED_AT, *found}}


def _with_connected(found: list[FoundAdapter], connected: str | None) -> list[FoundAdapter]:
    if connected is None:
        return found
    same = [one for one in found if _same(one.address, connected)]
    if not same:
        return [FoundAdapter(connected, connected.partition(":")[2], "connected"), *found]
    return [
        replace(one, state="connected", reason=None, remedy=None, cause=None, params={}) if one is same[0] else one
        for one in found
    ]


def _same(one: str, other: str) -> bool:
    """Whether two addresses mean one adapter: /dev/serial/by-id/…, the baud rate and options make no difference."""
    return same_device(one, other) or _device(one) == _device(other)


def _device(address: str) -> tuple[str, str]:
    interface, _, channel = split_frame_gap(address)[0].partition(":")
    path = channel.partition("@")[0]
    return interface, os.path.realpath(path) if path.startswith("/") else channel

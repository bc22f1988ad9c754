"""Adapters: list of the adapters of this computer, with the reason if one cannot be used."""

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

DETECT_S = 1.5
"""Timeout of detection. Drivers that take longer are listed as not responding."""

HANGS_S = 15.0
"""A driver that takes this long hangs. Before that it may just be slow: loading one can take seconds."""

OWN_DETECTION = frozenset(("slcan", "socketcan", "socketcand", "serial", "udp_multicast", "virtual"))
"""python-can interfaces detected without their drivers, or without hardware to detect."""


Detector = Callable[[], list[FoundAdapter]]


class Adapters:
    """Runs all detectors in parallel, each in its own thread, so that a hanging driver hides only its own adapters.

    A driver that still hangs from the last time is not called again. The driver of the open bus is not called either,
    to avoid disturbing it: its previous result is repeated.
    """

    def __init__(
        self,
        own: Sequence[FoundAdapter] = (),
        detectors: dict[str, Detector] | None = None,
        memory: BaudMemory | None = None,
    ) -> None:
        """`own` are adapters that always exist: the embedded bus. `detectors` by name default to all of this
        computer. `memory` stores the baud rates of serial adapters."""
        self._own = list(own)
        self._memory = memory
        self._detectors = _all_detectors() if detectors is None else detectors
        self._running: dict[str, asyncio.Future[list[FoundAdapter]]] = {}
        self._last: dict[str, list[FoundAdapter]] = {}
        self._since: dict[str, float] = {}

    async def plugged_in(self, connected: str | None = None) -> list[FoundAdapter]:
        """Detect adapters, within DETECT_S. `connected` is the address of the open bus. Never raises."""
        open_now = (connected or "").partition(":")[0]
        called = [name for name in self._detectors if name in OWN_DETECTION or name != open_now]
        waiting = [self._detect(name) for name in called]
        if waiting:
            await asyncio.wait(waiting, timeout=DETECT_S)
        found = list(self._own)
        for name in self._detectors:
            found += self._result(name) if name in called else self._last.get(name, [])
        return _with_connected([self._with_baud(one) for one in found], connected)

    def close(self) -> None:
        """Stop waiting for detectors."""
        for future in self._running.values():
            future.cancel()

    def _detect(self, name: str) -> "asyncio.Future[list[FoundAdapter]]":
        before = self._running.get(name)
        if before is None or before.done():
            loop = asyncio.get_running_loop()
            before = self._running[name] = loop.run_in_executor(OwnThread(f"detect {name}"), self._detectors[name])
            # Retrieved even if the search was cancelled, as by a closed page: asyncio would log it as never retrieved.
            before.add_done_callback(lambda done: done.cancelled() or done.exception())
            self._since[name] = time.monotonic()
        return before

    def _result(self, name: str) -> list[FoundAdapter]:
        future = self._running[name]
        if not future.done():
            return self._pending(name)
        error = None if future.cancelled() else future.exception()
        if error is not None:
            log.debug("detecting %s: %s", name, error)
        self._last[name] = [] if future.cancelled() or error is not None else future.result()
        return self._last[name]

    def _pending(self, name: str) -> list[FoundAdapter]:
        """Result of a driver that has not responded yet: none, unless it has known adapters or certainly hangs."""
        why = "Its driver does not respond."
        remedy = "Unplug the adapter and plug it in again. If that does not help, restart the computer."
        known = self._last.get(name, [])
        if known:
            return [
                replace(one, state="no_driver", reason=why, remedy=remedy, cause="driver_not_responding", params={})
                for one in known
            ]
        if time.monotonic() - self._since[name] < HANGS_S:
            return []
        text = f"It has not responded for {HANGS_S:g} s. Adapters of this kind cannot be listed."
        return [
            FoundAdapter(
                f"{name}:",
                f"{name} driver",
                "no_driver",
                text,
                f"If you use such an adapter: {remedy}",
                cause="driver_not_responding",
            )
        ]

    def _with_baud(self, one: FoundAdapter) -> FoundAdapter:
        if self._memory is None or one.serial_number is None or one.interface != "slcan":
            return one
        return replace(one, baud=self._memory.baud(one.serial_number))


def detect(interface: str) -> list[FoundAdapter]:
    """Adapters of one interface that python-can detects. Empty if its driver or Python package is missing.

    Raises any exception of a driver. `can.detect_available_configs` is not used, because it runs them in threads
    that the process waits for on exit, even if they hang.
    """
    module, name = BACKENDS[interface]
    bus: Any = getattr(import_module(module), name)
    found: list[FoundAdapter] = []
    for config in bus._detect_available_configs():
        words = (config.get("device_name"), config.get("serial"))
        title = " ".join(str(word) for word in words if word) or interface
        channel = config.get("channel")
        if channel is None:
            reason = "Its driver does not report channel names."
            remedy = f"Enter the address manually as {interface}:CHANNEL (see the python-can manual)."
            found.append(
                FoundAdapter(
                    f"{interface}:",
                    title,
                    "no_driver",
                    reason,
                    remedy,
                    cause="channel_names_unavailable",
                    params={"interface": interface},
                )
            )
        else:
            found.append(FoundAdapter(f"{interface}:{channel}", title))
    return found


def _all_detectors() -> dict[str, Detector]:
    found: dict[str, Detector] = {"socketcan": kernel_adapters, "slcan": serial_adapters, "candle": candle_adapters}
    return found | {name: partial(detect, name) for name in sorted(BACKENDS) if name not in {*OWN_DETECTION, *found}}


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
    """Whether two addresses name one adapter. Links such as /dev/serial/by-id/…, baud rate and options are resolved."""
    return same_device(one, other) or _device(one) == _device(other)


def _device(address: str) -> tuple[str, str]:
    interface, _, channel = split_frame_gap(address)[0].partition(":")
    path = channel.partition("@")[0]
    return interface, os.path.realpath(path) if path.startswith("/") else channel

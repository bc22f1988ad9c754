"""BusPorts: what an address opens in this process: an adapter, the embedded bus, or a recording."""

import logging
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from pathlib import Path

from hornbill.bus.adapters.adapter import FoundAdapter
from hornbill.bus.adapters.serial_ports import BaudMemory
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.ports.frame_gap import parse_frame_gap
from hornbill.bus.recordings.replay import open_replay
from hornbill.bus.reopening import ReopeningPort, adapter_port
from hornbill.bus.sharing import SharedBus
from hornbill.errors import PortError, StoreFailed
from hornbill.servo.host import Host
from hornbill.store.settings import SettingTable
from hornbill.wire.port import LOG_SCHEME, RECORDING_SCHEME, REPLAYS, CanPort, PortStatistics, split_frame_gap

EMBEDDED = "memory:demo"

log = logging.getLogger(__name__)


class StoredBauds:
    """The baud rates at which serial adapters were last used, in the store, by USB serial number."""

    def __init__(self, settings: SettingTable) -> None:
        self._settings = settings

    def baud(self, serial_number: str) -> int | None:
        """The rate of an adapter, bit/s; None if it is not known."""
        value = self._settings.get(_key(serial_number))
        return value if isinstance(value, int) else None

    def remember_baud(self, serial_number: str, baud: int) -> None:
        """Store the rate of an adapter, bit/s. A store that fails costs no more than another search."""
        try:
            if self.baud(serial_number) != baud:
                self._settings.put(_key(serial_number), baud)
        except StoreFailed as error:
            log.warning("the baud rate of %s is not stored: %s", serial_number, error.detail)


def _key(serial_number: str) -> str:
    return f"baud/{serial_number[:80]}"


def with_frame_gap(address: str, gap_ms: float | None) -> str:
    """The address of a bus with a pause between frames as its option, unless it has one of its own."""
    if gap_ms is None or split_frame_gap(address)[1] is not None or address.startswith(REPLAYS):
        return address
    return f"{address}?frame_gap_ms={gap_ms:g}"


class BusPorts:
    """Opens ports for the host."""

    def __init__(
        self,
        embedded: MemoryBus | None,
        logs: Path,
        recordings: Path | None = None,
        memory: BaudMemory | None = None,
        *,
        allow: Callable[[str], None] = lambda _address: None,
        before_embedded: Callable[[], Awaitable[None]] | None = None,
    ) -> None:
        """`embedded` is the bus within this process, if there is one.

        `logs` and `recordings` are where recordings without a folder are looked for. `memory` holds the baud rates of
        serial adapters. `allow` is called before anything is opened for somebody who asks over the network, and raises
        PortOpenFailed. `before_embedded` is awaited before the embedded bus is opened: its servos may be switched on
        only once somebody asks for them.
        """
        self._embedded = embedded
        self._memory = memory
        self._logs = logs
        self._recordings = recordings
        self.own = [] if embedded is None else [FoundAdapter(EMBEDDED, "Simulated servos", bitrate=embedded.bitrate)]
        """What can be connected beside what is plugged in."""
        self._allow = allow
        self._before_embedded = before_embedded

    async def open(self, address: str, bitrate: int) -> CanPort:
        """An open port. Raises PortOpenFailed with the reason and the remedy."""
        self._allow(split_frame_gap(address)[0])
        if address.startswith(LOG_SCHEME):
            return await open_replay(address, bitrate=bitrate, folder=self._logs)
        if address.startswith(RECORDING_SCHEME):
            return await open_replay(address, bitrate=bitrate, folder=self._recordings)
        port = self._port(address, bitrate)
        await port.open()
        return port

    async def join(self, host: Host, address: str, bitrate: int, log: Callable[[str], None]) -> None:
        """Connect `host` at start: an adapter that does not open is said so through `log` and tried on by itself.

        What can never open is said so and left.
        """
        try:
            if address.startswith(REPLAYS) or (self._embedded is not None and _is_embedded(address)):
                await host.connect(address, bitrate)
                return
            port = self._port(address, bitrate)
        except PortError as error:
            log(f"{error.detail}\nThe page starts all the same; connect from there.")
            return
        await port.open_sooner_or_later()
        if port.trouble is not None:
            log(f"{port.trouble.detail}\nIt is tried again by itself until it opens.")
        await host.attach(port)

    def _port(self, address: str, bitrate: int) -> ReopeningPort:
        """A port that opens itself again. Raises PortOpenFailed for an address that makes no sense."""
        bus = self._embedded
        if bus is None or not _is_embedded(address):
            return adapter_port(address, bitrate, self._memory)
        plain, gap_s = parse_frame_gap(address)

        async def open_embedded(statistics: PortStatistics) -> CanPort:
            if self._before_embedded is not None:
                await self._before_embedded()
            port = bus.port("demo", bitrate=bitrate)
            port.statistics = statistics
            return port

        return ReopeningPort(open_embedded, address=plain, bitrate=bitrate, frame_gap_s=gap_s)


async def places(
    embedded: MemoryBus | None, address: str | None, memory: BaudMemory, stack: AsyncExitStack
) -> Callable[[str], CanPort]:
    """Places for simulated servos: on the embedded bus, or all behind one more handle of the adapter `address`.

    The handle is closed by `stack`. Raises PortOpenFailed for an address that can never open.
    """
    if embedded is not None:
        return embedded.port
    assert address is not None
    handle = adapter_port(address, memory=memory)
    await handle.open_sooner_or_later()
    shared = SharedBus(handle)
    stack.push_async_callback(shared.close)
    return shared.port


def _is_embedded(address: str) -> bool:
    return split_frame_gap(address)[0] == EMBEDDED

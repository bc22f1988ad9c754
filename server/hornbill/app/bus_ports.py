"""BusPorts: opens the port of an address: an adapter, the embedded bus, or a recording."""

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
from hornbill.domain.bus import ConnectionRoleChoice
from hornbill.errors import PortError, StoreFailed
from hornbill.node.role import ConnectionRole
from hornbill.servo.host import Host
from hornbill.store.settings import SettingTable
from hornbill.wire.port import LOG_SCHEME, RECORDING_SCHEME, REPLAYS, CanPort, PortStatistics, split_frame_gap

EMBEDDED = "memory:demo"

log = logging.getLogger(__name__)


class StoredBauds:
    """Baud rates of the last use of serial adapters, in the store, by USB serial number."""

    def __init__(self, settings: SettingTable) -> None:
        self._settings = settings

    def baud(self, serial_number: str) -> int | None:
        """Baud rate of an adapter, bit/s; None if unknown."""
        value = self._settings.get(_key(serial_number))
        return value if isinstance(value, int) else None

    def remember_baud(self, serial_number: str, baud: int) -> None:
        """Store the baud rate of an adapter, bit/s. If that fails, it is detected again the next time."""
        try:
            if self.baud(serial_number) != baud:
                self._settings.put(_key(serial_number), baud)
        except StoreFailed as error:
            log.warning("cannot store the baud rate of %s: %s", serial_number, error.detail)


def _key(serial_number: str) -> str:
    return f"baud/{serial_number[:80]}"


def with_frame_gap(address: str, gap_ms: float | None) -> str:
    """Address with the frame gap as an option, unless it already has one."""
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
        """`embedded`: bus within this process, if any.

        `logs` and `recordings`: folders of files given without a folder. `memory`: stored baud rates of serial
        adapters. `allow` is called before an address requested over the network is opened, and raises PortOpenFailed.
        `before_embedded` is awaited before the embedded bus is opened, to switch its servos on.
        """
        self._embedded = embedded
        self._memory = memory
        self._logs = logs
        self._recordings = recordings
        self.own = [] if embedded is None else [FoundAdapter(EMBEDDED, "Simulated servos", bitrate=embedded.bitrate)]
        """Addresses that are available in addition to adapters."""
        self._allow = allow
        self._before_embedded = before_embedded

    async def open(self, address: str, bitrate: int, *, listen_only: bool = False) -> CanPort:
        """Open a port, in listen-only mode if requested and supported. Raises PortOpenFailed."""
        self._allow(split_frame_gap(address)[0])
        if address.startswith(LOG_SCHEME):
            return await open_replay(address, bitrate=bitrate, folder=self._logs)
        if address.startswith(RECORDING_SCHEME):
            return await open_replay(address, bitrate=bitrate, folder=self._recordings)
        port = self._port(address, bitrate, listen_only=listen_only)
        await port.open()
        return port

    async def join(
        self,
        host: Host,
        address: str,
        bitrate: int,
        log: Callable[[str], None],
        role: ConnectionRoleChoice | None = None,
    ) -> None:
        """Connect `host` at start. If an adapter does not open, this is logged with `log`, and retried automatically.

        `role` None: the role last chosen for this adapter, otherwise auto.
        An address that can never open is logged and not retried.
        """
        chosen = host.roles.choose(address, role)
        try:
            if address.startswith(REPLAYS) or (self._embedded is not None and _is_embedded(address)):
                await host.connect(address, bitrate, chosen)
                return
            port = self._port(address, bitrate, listen_only=chosen is ConnectionRole.OBSERVER)
        except PortError as error:
            log(f"{error.detail}\nThe server starts anyway. Connect the bus on the page.")
            return
        await port.open_with_retries()
        if port.trouble is not None:
            log(f"{port.trouble.detail}\nRetrying until it opens.")
        await host.attach(port, chosen)

    def _port(self, address: str, bitrate: int, *, listen_only: bool) -> ReopeningPort:
        """Port that reconnects automatically. Raises PortOpenFailed for an invalid address."""
        bus = self._embedded
        if bus is None or not _is_embedded(address):
            return adapter_port(address, bitrate, self._memory, listen_only=listen_only)
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
    """Factory of ports for simulated servos: on the embedded bus, or on a shared handle of the adapter `address`.

    `stack` closes the handle. Raises PortOpenFailed for an address that can never open.
    """
    if embedded is not None:
        return embedded.port
    assert address is not None
    handle = adapter_port(address, memory=memory)
    await handle.open_with_retries()
    shared = SharedBus(handle)
    stack.push_async_callback(shared.close)
    return shared.port


def _is_embedded(address: str) -> bool:
    return split_frame_gap(address)[0] == EMBEDDED

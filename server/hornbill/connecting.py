"""Owns BusPorts: what an address opens in this process: an adapter, the embedded bus, or a recording."""

from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from pathlib import Path

from hornbill.bus.adapter import Adapter
from hornbill.bus.memory import MemoryBus
from hornbill.bus.reopening import ReopeningPort, adapter_port
from hornbill.bus.replay import open_replay
from hornbill.bus.sharing import SharedBus
from hornbill.errors import LogFailed, PortError, PortOpenFailed
from hornbill.servo.bundle import read_about
from hornbill.servo.host import Host
from hornbill.wire.port import BUNDLE, RECORDING, RECORDINGS, CanPort, PortStatistics

EMBEDDED = "memory:demo"


class BusPorts:
    """Opens ports for the host and places for simulated servos."""

    def __init__(self, embedded: MemoryBus | None, logs: Path, bundles: Path | None = None) -> None:
        """`embedded` is the bus within this process, if there is one.

        `logs` and `bundles` are where recordings without a folder are looked for.
        """
        self._embedded = embedded
        self._logs = logs
        self._bundles = bundles
        self.own = [] if embedded is None else [Adapter(EMBEDDED, "Simulated servos", bitrate=embedded.bitrate)]
        """What can be connected beside what is plugged in."""
        self.allow: Callable[[str], None] = lambda _address: None
        """Asked before anything is opened for somebody who asks over the network; raises PortOpenFailed."""
        self.before_embedded: Callable[[], Awaitable[None]] | None = None
        """Awaited before the embedded bus is opened: its servos may be switched on only once somebody asks for them."""

    async def open(self, address: str, bitrate: int) -> CanPort:
        """An open port. Raises PortOpenFailed with the reason and the remedy."""
        self.allow(address)
        if address.startswith(RECORDING):
            return await open_replay(address, bitrate=bitrate, folder=self._logs)
        if address.startswith(BUNDLE):
            return await self._open_bundle(address, bitrate)
        port = self._port(address, bitrate)
        await port.open()
        return port

    async def _open_bundle(self, address: str, bitrate: int) -> CanPort:
        port = await open_replay(address, bitrate=bitrate, folder=self._bundles)
        try:
            read_about(port.about or b"", address.removeprefix(BUNDLE))
        except LogFailed as error:
            await port.close()
            raise PortOpenFailed(f"{address} cannot be played: {error.detail}", address=address) from error
        return port

    async def join(self, host: Host, address: str, bitrate: int, log: Callable[[str], None]) -> None:
        """Connect `host` at start: an adapter that does not open is said so through `log` and tried on by itself.

        What can never open is said so and left.
        """
        try:
            if address.startswith(RECORDINGS) or (self._embedded is not None and address == EMBEDDED):
                await host.connect(address, bitrate)
                return
            port = self._port(address, bitrate)
        except PortError as error:
            log(f"{error.detail}\nThe page starts all the same; connect from there.")
            return
        await port.open_sooner_or_later()
        if port.trouble is not None:
            log(f"{port.trouble}\nIt is tried again by itself until it opens.")
        await host.attach(port)

    async def places(self, address: str | None, stack: AsyncExitStack) -> Callable[[str], CanPort]:
        """Places for simulated servos: on the embedded bus, or all behind one more handle of the adapter `address`.

        The handle is closed by `stack`. Raises PortOpenFailed for an address that can never open.
        """
        if self._embedded is not None:
            return self._embedded.port
        assert address is not None
        handle = adapter_port(address)
        await handle.open_sooner_or_later()
        shared = SharedBus(handle)
        stack.push_async_callback(shared.close)
        return shared.port

    def _port(self, address: str, bitrate: int) -> ReopeningPort:
        """A port that opens itself again. Raises PortOpenFailed for an address that makes no sense."""
        bus = self._embedded
        if bus is None or address != EMBEDDED:
            return adapter_port(address, bitrate)

        async def open_embedded(statistics: PortStatistics) -> CanPort:
            if self.before_embedded is not None:
                await self.before_embedded()
            port = bus.port("demo", bitrate=bitrate)
            port.statistics = statistics
            return port

        return ReopeningPort(open_embedded, address=address, bitrate=bitrate)

"""Helpers of the tests of slcan adapters."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Any

from hornbill.bus.address import open_port
from hornbill.wire.port import CanPort, SerialLineInfo
from unit.bus.adapter import FakeAdapter


@asynccontextmanager
async def opened(
    adapter: FakeAdapter | None = None, baud: str = "", **options: Any
) -> AsyncGenerator[tuple[FakeAdapter, CanPort]]:
    """`adapter`, by default a plain one, and its open port; both are closed afterwards."""
    with adapter or FakeAdapter() as adapter:
        port = await open_port(f"slcan:{adapter.channel}{baud}", **options)
        try:
            yield adapter, port
        finally:
            await port.close()


def line_of(port: CanPort) -> SerialLineInfo:
    """The serial line of `port`."""
    line = port.details.serial_line
    assert line is not None
    return line

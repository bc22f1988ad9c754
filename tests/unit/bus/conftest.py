"""An embedded bus in virtual time, with ports a, b and c where a test names them."""

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.embedded.memory_port import MemoryPort


@pytest.fixture
def bus() -> MemoryBus:
    return MemoryBus(history=1000)


@pytest.fixture
def a(bus: MemoryBus) -> MemoryPort:
    return bus.port("a")


@pytest.fixture
def b(bus: MemoryBus) -> MemoryPort:
    return bus.port("b")


@pytest.fixture
def c(bus: MemoryBus) -> MemoryPort:
    return bus.port("c")

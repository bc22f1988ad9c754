"""Memory: RAM and ROM, and what a reset preserves."""

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.sim.memory import Memory
from unit.sim.desk import FIRMWARE, MODELS, catalog

DATE = (2024, 6, 22, 15, 30)
PLAIN = Behaviour()


def memory(model: str = "BLA21-06U-A0", firmware: int = 1300, rom: dict[str, int] | None = None) -> Memory:
    return Memory(catalog().models[model], firmware, serial=4711, production=DATE, rom=rom)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("firmware", FIRMWARE)
def test_rom_contains_only_the_configuration(model: str, firmware: str) -> None:
    kept = memory(model, round(float(firmware) * 1000))
    for at in range(0x60):
        assert (kept.stored(at) is not None) == (at in kept.rows and 0x20 <= at <= 0x46)


def test_product_rows_survive_everything() -> None:
    kept = memory()
    kept.reset(PLAIN, rom=True)
    for _ in range(2):
        assert [kept.get(at) for at in (0x51, 0x52, 0x58, 0x59, 0x5A, 0x5B, 0x5C)] == [4711, 1300, *DATE]
        kept.load()


def test_firmware_newer_than_all_known_has_the_newest_rows() -> None:
    assert set(memory(firmware=1400).rows) == set(memory(firmware=1300).rows)
    assert memory(firmware=1400).get(0x52) == 1400

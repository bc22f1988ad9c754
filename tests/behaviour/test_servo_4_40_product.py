"""Sections 4.40 to 4.44: model, production number, versions and date of production."""

import pytest

from hornbill.sim.bench.recipe import Recipe
from unit.sim.desk import MODELS, Desk, catalog

PRODUCT = ("0x50", "0x51", "0x52", "0x53", "0x58", "0x59", "0x5A", "0x5B", "0x5C")


@pytest.mark.states("B98", "B99")
@pytest.mark.parametrize("model", MODELS)
def test_model_and_hardware_version_identify_the_model(model: str) -> None:
    desk = Desk(model)
    found = catalog().model(desk.value("0x50"), desk.value("0x53"))
    assert found is not None
    assert found.name == model


@pytest.mark.states("B100", "B103")
@pytest.mark.parametrize(
    ("firmware", "raw", "first", "last"),
    [
        ("1.010", 1_010, (2021, 1), (2023, 12)), ("1.100", 1_100, (2021, 10), (2022, 4)),
        ("1.200", 1_200, (2022, 5), (2023, 12)), ("1.300", 1_300, (2024, 1), (2030, 12)),
    ],
)  # fmt: skip
def test_the_firmware_is_in_thousandths_and_matches_the_date_of_production(
    firmware: str, raw: int, first: tuple[int, int], last: tuple[int, int]
) -> None:
    for seed in range(30):
        desk = Desk(firmware=firmware, seed=seed)
        assert desk.read("0x52") == raw
        assert first <= (desk.value("0x58"), desk.value("0x59")) <= last
        assert 1 <= desk.value("0x59") <= 12
        assert 1 <= desk.value("0x5A") <= 31
        assert 0 <= desk.value("0x5B") <= 23
        assert 0 <= desk.value("0x5C") <= 59


@pytest.mark.states("B102")
def test_servos_have_different_production_numbers_or_the_given_one() -> None:
    assert Desk(seed=1).read("0x51") != Desk(seed=2).read("0x51")
    servo = Recipe(serial=4_711, node_id=5).build(catalog(), 1)
    assert (servo.serial, servo.register(0x51)) == (4_711, 4_711)


@pytest.mark.states("B49", "B102", "B103")
def test_product_rows_never_change() -> None:
    desk = Desk(rom={"soft_start": 0})
    before = desk.reads(*PRODUCT)
    for name in PRODUCT:
        assert desk.write(name, 1) is None
    desk.write("0x10", 1)
    desk.opcode(1)
    desk.power_cycle()
    assert desk.reads(*PRODUCT) == before

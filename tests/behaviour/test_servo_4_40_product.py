"""Sections 4.40 to 4.44: what a servo says of itself: model, production number, versions, date of production."""

import pytest

from hornbill.sim.bench.recipe import Recipe
from unit.sim.desk import MODELS, Desk, catalog

PRODUCT = ("0x50", "0x51", "0x52", "0x53", "0x58", "0x59", "0x5A", "0x5B", "0x5C")
HARDWARE = {
    "BLA21-06U-A0": 6_010, "BLA21-06U-AB": 6_050, "BLA21-12U-A0": 12_010, "BLA21-12U-AB": 12_050,
    "BLA21-28U-A0": 28_010, "BLA21-28U-AB": 28_050, "BLA15-06U-A0": 6_010, "BLA15-12U-A0": 12_010,
    "BLA34-12U-AB": 12_050, "BLA34-28U-AB": 28_050,
}  # fmt: skip


@pytest.mark.states("B98", "B99", "B100")
@pytest.mark.parametrize("model", MODELS)
def test_model_and_hardware_version_name_the_model(model: str) -> None:
    desk = Desk(model, "1.300")
    assert desk.read("0x50") == {"BLA21": 61, "BLA15": 62, "BLA34": 86}[model[:5]]
    assert desk.read("0x53") == HARDWARE[model]
    assert desk.read("0x52") == 1_300


@pytest.mark.states("B98", "B99")
def test_the_two_numbers_together_name_one_model() -> None:
    assert len({(Desk(model).read("0x50"), Desk(model).read("0x53")) for model in MODELS}) == len(MODELS)


@pytest.mark.states("B100")
@pytest.mark.parametrize(("firmware", "raw"), [("1.010", 1_010), ("1.100", 1_100), ("1.200", 1_200), ("1.300", 1_300)])
def test_the_firmware_is_an_integer_of_thousandths(firmware: str, raw: int) -> None:
    assert Desk(firmware=firmware).read("0x52") == raw


@pytest.mark.states("B102", "B103")
def test_product_rows_are_those_of_the_one_servo() -> None:
    one, other = Desk(seed=1), Desk(seed=2)
    assert one.read("0x51") != other.read("0x51")
    assert 2020 <= (one.read("0x58") or 0) <= 2030
    assert 1 <= (one.read("0x59") or 0) <= 12
    assert 1 <= (one.read("0x5A") or 0) <= 31
    assert 0 <= (one.read("0x5B") or 0) <= 23
    assert 0 <= (one.read("0x5C") or 0) <= 59


@pytest.mark.states("B100", "B103")
@pytest.mark.parametrize(
    ("firmware", "first", "last"),
    [
        ("1.010", (2021, 1), (2023, 12)), ("1.100", (2021, 10), (2022, 4)),
        ("1.200", (2022, 5), (2023, 12)), ("1.300", (2024, 1), (2030, 12)),
    ],
)  # fmt: skip
def test_the_firmware_is_the_one_of_the_time_of_production(
    firmware: str, first: tuple[int, int], last: tuple[int, int]
) -> None:
    for seed in range(30):
        desk = Desk(firmware=firmware, seed=seed)
        assert first <= (desk.read("0x58") or 0, desk.read("0x59") or 0) <= last


@pytest.mark.states("B102")
def test_the_production_number_can_be_given() -> None:
    servo = Recipe(serial=4_711, node_id=5).build(catalog(), 1)
    assert (servo.serial, servo.register(0x51)) == (4_711, 4_711)


@pytest.mark.states("B49", "B102", "B103")
def test_nothing_changes_them() -> None:
    desk = Desk(rom={"soft_start": 0})
    before = [desk.read(name) for name in PRODUCT]
    for name in PRODUCT:
        assert desk.write(name, 1) is None
    desk.write("0x10", 1)
    desk.opcode(1)
    desk.power_cycle()
    assert [desk.read(name) for name in PRODUCT] == before

"""Recipe: what is said of a servo is what is built, and what cannot be is refused."""

import pytest

from hornbill.errors import InvalidValue
from hornbill.sim.recipe import Recipe
from unit.sim.desk import START, catalog


def test_surroundings_and_spoilt_rom_are_those_of_the_recipe() -> None:
    recipe = Recipe(node_id=9, room_c=60.0, load_pct=-12.0, load_inertia=2.0, rom={"angle_p_gain": 50}, rom_sound=False)
    servo = recipe.build(catalog(), 1)
    servo.power_on(START)
    servo.advance(START + 0.3)
    conditions = servo.conditions
    assert (conditions.temperature_c, conditions.load_pct, conditions.load_inertia) == (60.0, -12.0, 2.0)
    assert (servo.register(0x0B), servo.register(0x2C), servo.register(0x1A)) == (60, 40, 1 << 15)
    assert servo.node_id == 0


def test_what_is_not_said_comes_from_the_seed() -> None:
    one, same, other = (Recipe().build(catalog(), seed) for seed in (1, 1, 2))
    assert (one.uid, one.serial) == (same.uid, same.serial) != (other.uid, other.serial)


@pytest.mark.parametrize("recipe", [Recipe("BLA99"), Recipe(firmware="2.000")])
def test_a_model_or_firmware_that_does_not_exist_is_refused_with_those_that_do(recipe: Recipe) -> None:
    with pytest.raises(InvalidValue, match=r"BLA21-06U-A0|1\.300"):
        recipe.build(catalog(), 1)


@pytest.mark.parametrize("rom", [{"nothing": 1}, {"angle_p_gain": 101}, {"command_angle": 5}, {"angle_boost": 5}])
def test_rom_holds_only_what_it_could(rom: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="cannot be in the ROM"):
        Recipe(firmware="1.100", rom=rom).build(catalog(), 1)

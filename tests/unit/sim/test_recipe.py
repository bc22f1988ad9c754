"""Recipe: the servo is built as described, and invalid descriptions are refused."""

from dataclasses import replace

import pytest

from hornbill.domain.plant import PlantConstants
from hornbill.errors import InvalidValue
from hornbill.sim.bench.recipe import Recipe
from unit.sim.desk import START, catalog


def test_conditions_and_invalid_rom_are_those_of_the_recipe() -> None:
    plant = PlantConstants(load_pct=-12.0, inertia=2.0)
    recipe = Recipe(
        node_id=9,
        room_c=60.0,
        plant=plant,
        rom={"angle_p_gain": 50},
        rom_sound=False,
    )
    servo = recipe.build(catalog(), 1)
    servo.power_on(START)
    servo.advance(START + 0.3)
    conditions = servo.conditions
    assert (conditions.temperature_c, conditions.load_pct, conditions.load_inertia) == (60.0, -12.0, 2.0)
    assert (servo.register(0x0B), servo.register(0x2C), servo.register(0x1A)) == (60, 40, 1 << 15)
    assert servo.node_id == 0


def test_values_not_given_come_from_the_seed() -> None:
    one, same, other = (Recipe().build(catalog(), seed) for seed in (1, 1, 2))
    assert (one.uid, one.serial) == (same.uid, same.serial) != (other.uid, other.serial)


@pytest.mark.parametrize("recipe", [Recipe("BLA99"), Recipe(firmware="2.000")])
def test_an_unknown_model_or_firmware_is_refused_with_the_known_ones(recipe: Recipe) -> None:
    with pytest.raises(InvalidValue, match=r"BLA21-06U-A0|1\.300"):
        recipe.build(catalog(), 1)


@pytest.mark.parametrize("rom", [{"nothing": 1}, {"angle_p_gain": 101}, {"command_angle": 5}, {"angle_boost": 5}])
def test_invalid_rom_values_are_refused(rom: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="is not valid in ROM"):
        Recipe(firmware="1.010", rom=rom).build(catalog(), 1)


def test_only_identifying_rows_can_read_other_values() -> None:
    servo = Recipe(reads={"model_number": 99, "firmware_version": 3_210}).build(catalog(), 1)
    servo.power_on(START)
    servo.advance(START + 0.3)
    assert [servo.register(at) for at in (0x50, 0x52, 0x53)] == [99, 3_210, 6_010]
    with pytest.raises(InvalidValue, match="Only firmware_version"):
        Recipe(reads={"angle_p_gain": 1}).build(catalog(), 1)


def test_firmware_the_model_was_never_built_with_must_be_allowed() -> None:
    for model in catalog().models.values():
        for step in catalog().firmware_steps:
            recipe = Recipe(model.name, step)
            if step not in model.firmware:
                with pytest.raises(InvalidValue, match=f"never built with firmware {step}"):
                    recipe.build(catalog(), 1)
                recipe = replace(recipe, any_firmware=True)
            assert recipe.build(catalog(), 1).model is model

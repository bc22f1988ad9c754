"""The demo fleet: mixed, buildable, stable for a seed, and quick to come up."""

import pytest

from hornbill.sim.demo import demo_fleet
from unit.sim.desk import catalog


@pytest.mark.parametrize("n", [1, 6, 16, 100])
def test_every_recipe_can_be_built_and_no_static_id_is_used_twice(n: int) -> None:
    fleet = demo_fleet(catalog(), n, 1)
    assert len(fleet) == n
    assert len({recipe.build(catalog(), 1).uid for recipe in fleet}) == n
    static = [recipe.node_id for recipe in fleet if recipe.node_id]
    assert len(set(static)) == len(static)
    # The top is where allocators begin, 126 and 127 are for tools.
    assert all(10 <= node_id <= 115 for node_id in static)


def test_six_are_mixed_and_at_most_half_ask_for_their_id() -> None:
    fleet = demo_fleet(catalog(), 6, 1)
    assert len({recipe.model for recipe in fleet}) >= 4
    assert len({recipe.firmware for recipe in fleet}) >= 3
    assert 1 <= sum(not recipe.node_id for recipe in fleet) <= 3
    ids = [recipe.servo_id for recipe in fleet if recipe.servo_id]
    assert len(ids) >= 4
    assert len(set(ids)) == len(ids)
    assert any(recipe.rom.get("angle_limit_cw") for recipe in fleet)


def test_only_firmware_a_model_was_built_with() -> None:
    for recipe in demo_fleet(catalog(), 8, 1):
        assert recipe.firmware in catalog().models[recipe.model].firmware


def test_a_seed_decides_and_a_larger_fleet_begins_like_a_smaller_one() -> None:
    assert demo_fleet(catalog(), 6, 5) == demo_fleet(catalog(), 12, 5)[:6]
    assert demo_fleet(catalog(), 6, 5)[0].uid != demo_fleet(catalog(), 6, 6)[0].uid


@pytest.mark.parametrize("n", [0, 101])
def test_too_few_or_too_many_are_refused(n: int) -> None:
    with pytest.raises(ValueError, match="outside 1 to 100"):
        demo_fleet(catalog(), n, 1)

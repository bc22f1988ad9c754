"""The demo fleet: mixed, buildable, reproducible, quickly online, and with the described faults."""

from dataclasses import replace

import pytest

from hornbill.sim.bench.demo import demo_fleet
from hornbill.sim.bench.recipe import Recipe
from unit.sim.desk import NODE, START, Desk, catalog
from unit.sim.response import step


@pytest.mark.parametrize("n", [1, 6, 16, 100])
def test_every_recipe_can_be_built_and_no_static_id_is_used_twice(n: int) -> None:
    fleet = demo_fleet(catalog(), n, 1)
    assert len(fleet) == n
    assert len({recipe.build(catalog(), 1).uid for recipe in fleet}) == n
    static = [recipe.node_id for recipe in fleet if recipe.node_id]
    assert len(set(static)) == len(static)
    # Allocators begin at the top; 126 and 127 are for tools.
    assert all(10 <= node_id <= 115 for node_id in static)


def test_six_servos_are_mixed_and_at_most_half_request_an_id() -> None:
    fleet = demo_fleet(catalog(), 6, 1)
    assert len({recipe.model for recipe in fleet}) >= 4
    assert len({recipe.firmware for recipe in fleet}) >= 3
    assert 1 <= sum(not recipe.node_id for recipe in fleet) <= 3
    ids = [recipe.servo_id for recipe in fleet if recipe.servo_id]
    assert len(ids) >= 4
    assert len(set(ids)) == len(ids)
    assert any(recipe.rom.get("angle_limit_cw") for recipe in fleet)


def test_a_seed_determines_the_fleet_and_a_larger_one_begins_like_a_smaller_one() -> None:
    assert demo_fleet(catalog(), 6, 5) == demo_fleet(catalog(), 12, 5)[:6]
    assert demo_fleet(catalog(), 6, 5)[0].uid != demo_fleet(catalog(), 6, 6)[0].uid


@pytest.mark.parametrize("n", [0, 101])
def test_too_few_or_too_many_servos_are_refused(n: int) -> None:
    with pytest.raises(ValueError, match="outside 1 to 100"):
        demo_fleet(catalog(), n, 1)


def servo_of(word: str) -> Recipe:
    """The servo whose story has this word."""
    (found,) = (recipe for recipe in demo_fleet(catalog(), 11, 1) if word in recipe.story)
    return found


def at_desk(recipe: Recipe) -> Desk:
    """That servo on a desk, at rest, with a node ID so that it can be read."""
    desk = Desk(up=False)
    desk.servo = recipe.build(catalog(), 1)
    desk.servo.power_on(START)
    desk.wait(8.0)
    return desk


def test_every_servo_of_the_fleet_has_its_own_story_and_every_series_occurs() -> None:
    fleet = demo_fleet(catalog(), 11, 1)
    assert len({recipe.story for recipe in fleet if recipe.story}) == 11
    assert {catalog().models[recipe.model].series for recipe in fleet} == set(catalog().series)


def test_one_servo_hunts_until_its_gain_is_lowered() -> None:
    desk = at_desk(servo_of("hunts"))
    desk.write("0x26", 0)
    assert step(desk, 300).hunting >= 10
    desk.write("0x2C", 30)
    assert step(desk, 0).hunting == 0


def test_one_servo_overheats_under_load_and_disables_torque() -> None:
    desk = at_desk(servo_of("hot"))
    assert 70 <= (desk.read("0x0B") or 0) <= 80
    desk.write("0x26", 0)
    desk.under(load_pct=60.0)
    for _ in range(240):
        desk.wait(0.5)
        if desk.servo.output:
            break
    assert (desk.servo.output, (desk.read("0x1A") or 0) & 1 << 8) == (1, 1 << 8)


def test_every_horn_rests_after_torque_off() -> None:
    for recipe in demo_fleet(catalog(), 11, 1):
        desk = at_desk(replace(recipe, node_id=NODE, rom_sound=True))
        desk.write("0x20", 1)
        desk.wait(3.0)
        rested = desk.servo.angle_deg
        desk.wait(3.0)
        assert desk.servo.angle_deg == rested, recipe.story


def test_one_servo_has_the_first_firmware_without_later_rows() -> None:
    servo = at_desk(servo_of("first firmware")).servo
    assert (servo.register(0x52), servo.register(0x25), servo.register(0x2A)) == (1_010, 0, 0)


def test_one_servo_is_new_and_one_lost_its_settings() -> None:
    new, lost = servo_of("new servo"), at_desk(servo_of("lost")).servo
    assert (new.model[:5], new.servo_id, new.node_id) == ("BLA15", 0, 0)
    assert (lost.register(0x1A), lost.register(0x25), lost.node_id) == (1 << 15, 0, 0)


def test_of_a_hundred_servos_four_request_an_id_and_the_others_have_one() -> None:
    requesting = 0
    for recipe in demo_fleet(catalog(), 100, 1):
        servo = recipe.build(catalog(), 1)
        servo.power_on(START)
        servo.advance(START + 0.2)
        assert servo.node_id == recipe.node_id
        requesting += not servo.node_id
    assert requesting == 4

"""The servos of the demo: a bench with a bit of everything, the same ones for the same seed."""

from dataclasses import replace
from random import Random
from typing import Final

from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.recipe import Recipe

_FIRST_STATIC: Final = 10
_MOST_DYNAMIC: Final = 4
"""Allocation goes one servo after the other, about 1.1 s each, so few of a large fleet ask for their id."""

_STORIES: Final[tuple[Recipe, ...]] = (
    Recipe(
        "BLA21-06U-A0", "1.300", rom={"angle_limit_cw": 600, "angle_limit_ccw": -600},
        story="A steering servo with its stops set.",
    ),
    Recipe("BLA15-06U-A0", "1.300", story="Just out of its box: servo id 0, and no node id of its own."),
    Recipe(
        "BLA21-12U-A0", "1.300", load_inertia=3.0,
        rom={"speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0},
        story="A heavy arm under too much gain: it hunts about its target. Less P, more D or a dead band calms it.",
    ),
    Recipe(
        "BLA21-06U-A0", "1.010", rom={"reverse": 1, "angle_limit_cw": 450, "angle_limit_ccw": -450},
        story="A rudder mounted the other way round, with the first firmware: many parameters are not there yet.",
    ),
    Recipe(
        "BLA21-28U-AB", "1.200", room_c=74.0, load_pct=2.0, rom={"overcurrent_limit": 20, "pwm_output_range": 600},
        story="Beside an engine: hot, and near the limit at which it lets go. A receiver may drive it.",
    ),
    Recipe(
        "BLA15-12U-A0", "1.200", rom_sound=False, rom={"speed_torque_control": 1, "torque_limit_cw": 40},
        story="Its supply failed while it saved: its settings are lost and the factory's are in use.",
    ),
    Recipe(
        "BLA21-12U-AB", "1.100", rom={"soft_start": 0, "angle_dead_band": 5},
        story="A camera mount that does not move at power-on.",
    ),
    Recipe("BLA21-28U-A0", "1.010", rom={"origin": 150}, story="A flap with its zero moved by a spline tooth."),
    Recipe(
        "BLA21-12U-A0", "1.300", rom={"speed_torque_control": 1, "extended_angle": 1, "speed_limit_cw": 120},
        story="A turntable that is driven by speed and counts its turns.",
    ),
    Recipe(
        "BLA15-12U-A0", "1.200", rom={"speed_torque_control": 1, "torque_limit_cw": 40, "timeout_action": 2},
        story="A gripper: little torque, and it brakes when nobody commands it.",
    ),
    Recipe(
        "BLA34-28U-AB", "1.500", load_inertia=2.0, rom={"speed_torque_control": 1, "speed_limit_cw": 60},
        story="A landing-gear door: much torque, and slow.",
    ),
)  # fmt: skip


def demo_fleet(catalog: Catalog, n: int, seed: int) -> list[Recipe]:
    """`n` servos (1..100) of different models and firmware; the first of a larger fleet are those of a smaller one.

    Every second one, at most four, asks for its node id; the others have theirs, from 10 up. New ones have servo id 0.
    Raises ValueError outside 1..100.
    """
    if not 1 <= n <= 100:
        raise ValueError(f"{n} servos are outside 1 to 100.")
    fleet: list[Recipe] = []
    for index in range(n):
        random = Random(f"{seed}/{index}")
        story = _STORIES[index % len(_STORIES)]
        dynamic = index % 2 == 1 and index < 2 * _MOST_DYNAMIC
        offered = catalog.models[story.model].rows()
        fleet.append(
            replace(
                story,
                servo_id=index + 1 if story.rom else 0,
                node_id=0 if dynamic else _FIRST_STATIC + index,
                rom_sound=story.rom_sound or not dynamic,  # who lost its settings lost its node id, too
                rom={key: raw for key, raw in story.rom.items() if key in offered},
                angle_deg=round(random.uniform(-150.0, 150.0), 1),
                uid=random.randbytes(16),
                serial=random.randrange(1, 1_000_000),
            )
        )
    return fleet

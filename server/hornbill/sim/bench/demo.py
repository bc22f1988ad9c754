"""The servos of the demo: a varied bench, identical for the same seed."""

from dataclasses import replace
from random import Random
from typing import Final

from hornbill.domain.plant import PlantConstants
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.recipe import Recipe

_FIRST_STATIC: Final = 10
_MAX_DYNAMIC: Final = 4
"""Allocation handles one servo after the other, about 1.1 s each, so only a few of a large fleet request an ID."""

_STORIES: Final[tuple[Recipe, ...]] = (
    Recipe(
        "BLA21-06U-A0", "1.300", rom={"angle_limit_cw": 600, "angle_limit_ccw": -600},
        story="A steering servo with angle limits.",
    ),
    Recipe("BLA15-06U-A0", "1.300", story="A new servo with servo ID 0 and no fixed node ID."),
    Recipe(
        "BLA21-12U-A0", "1.300", plant=PlantConstants(inertia=3.0),
        rom={"speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0},
        story="A heavy arm with excessive gain that hunts around its target. Less P, more D or a deadband helps.",
    ),
    Recipe(
        "BLA21-06U-A0", "1.010", rom={"reverse": 1, "angle_limit_cw": 450, "angle_limit_ccw": -450},
        story="A rudder mounted in reverse, with the first firmware, which lacks many parameters.",
    ),
    Recipe(
        "BLA21-28U-AB", "1.200", room_c=74.0,
        plant=PlantConstants(load_pct=2.0), rom={"overcurrent_limit": 20, "pwm_output_range": 600},
        story="Next to an engine: hot, and close to its temperature limit. Can be driven by a receiver.",
    ),
    Recipe(
        "BLA15-12U-A0", "1.200", rom_sound=False, rom={"speed_torque_control": 1, "torque_limit_cw": 40},
        story="The supply failed during a save: its settings are lost, and defaults are in use.",
    ),
    Recipe(
        "BLA21-12U-AB", "1.100", rom={"soft_start": 0, "angle_dead_band": 5},
        story="A camera mount that does not move at power-on.",
    ),
    Recipe("BLA21-28U-A0", "1.010", rom={"origin": 150}, story="A flap with its zero moved by a spline tooth."),
    Recipe(
        "BLA21-12U-A0", "1.300", rom={"speed_torque_control": 1, "extended_angle": 1, "speed_limit_cw": 120},
        story="A turntable with speed commands that counts its turns.",
    ),
    Recipe(
        "BLA15-12U-A0", "1.200", rom={"speed_torque_control": 1, "torque_limit_cw": 40, "timeout_action": 2},
        story="A gripper with low torque that brakes without commands.",
    ),
    Recipe(
        "BLA34-28U-AB", "1.500", plant=PlantConstants(inertia=2.0),
        rom={"speed_torque_control": 1, "speed_limit_cw": 60},
        story="A landing-gear door: high torque, low speed.",
    ),
)  # fmt: skip


def demo_fleet(catalog: Catalog, n: int, seed: int) -> list[Recipe]:
    """`n` servos (1..100) of different models and firmware. A larger fleet starts with the servos of a smaller one.

    Every second servo, at most four, requests its node ID; the others have fixed IDs from 10 up. New servos have servo
    ID 0. Raises ValueError outside 1..100.
    """
    if not 1 <= n <= 100:
        raise ValueError(f"{n} servos are outside 1 to 100.")
    fleet: list[Recipe] = []
    for index in range(n):
        random = Random(f"{seed}/{index}")
        story = _STORIES[index % len(_STORIES)]
        dynamic = index % 2 == 1 and index < 2 * _MAX_DYNAMIC
        offered = catalog.models[story.model].rows()
        fleet.append(
            replace(
                story,
                servo_id=index + 1 if story.rom else 0,
                node_id=0 if dynamic else _FIRST_STATIC + index,
                rom_sound=story.rom_sound or not dynamic,  # a servo that lost its settings also lost its node ID
                rom={key: raw for key, raw in story.rom.items() if key in offered},
                angle_deg=round(random.uniform(-150.0, 150.0), 1),
                uid=random.randbytes(16),
                serial=random.randrange(1, 1_000_000),
            )
        )
    return fleet

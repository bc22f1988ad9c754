"""Owns the servos of the demo: a bench with a bit of everything, the same ones for the same seed."""

from random import Random
from typing import Final

from hornbill.schema.catalog import Catalog
from hornbill.sim.recipe import Recipe
from hornbill.units import Raw

_FIRST_STATIC: Final = 10
_MOST_DYNAMIC: Final = 4
"""Allocation goes one servo after the other, about 1.1 s each, so few of a large fleet ask for their id."""

_STORIES: Final[tuple[tuple[str, str, dict[str, Raw]], ...]] = (
    # A steering servo with its stops set.
    ("BLA21-06U-A0", "1.300", {"angle_limit_cw": 600, "angle_limit_ccw": -600}),
    # A small one, just out of its box.
    ("BLA15-06U-A0", "1.300", {}),
    # A turntable that is driven by speed and counts its turns.
    ("BLA21-12U-A0", "1.300", {"speed_torque_control": 1, "extended_angle": 1, "speed_limit_cw": 120}),
    # A rudder linkage mounted the other way round, with the early firmware.
    ("BLA21-06U-A0", "1.010", {"reverse": 1, "angle_limit_cw": 450, "angle_limit_ccw": -450}),
    # A servo that a receiver drives too, gentle on its supply.
    ("BLA21-28U-AB", "1.200", {"overcurrent_limit": 20, "pwm_output_range": 600}),
    # A gripper: limited torque, brake on silence.
    ("BLA15-12U-A0", "1.200", {"speed_torque_control": 1, "torque_limit_cw": 40, "timeout_action": 2}),
    # A camera mount that must not move at power-on.
    ("BLA21-12U-AB", "1.100", {"soft_start": 0, "angle_dead_band": 5}),
    # A flap with its zero moved by a spline tooth.
    ("BLA21-28U-A0", "1.010", {"origin": 150}),
)


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
        model, firmware, rom = _STORIES[index % len(_STORIES)]
        dynamic = index % 2 == 1 and index < 2 * _MOST_DYNAMIC
        new = not rom
        offered = catalog.models[model].rows()
        fleet.append(
            Recipe(
                model,
                firmware,
                servo_id=0 if new else index + 1,
                node_id=0 if dynamic else _FIRST_STATIC + index,
                rom={key: raw for key, raw in rom.items() if key in offered},
                angle_deg=round(random.uniform(-150.0, 150.0), 1),
                uid=random.randbytes(16),
                serial=random.randrange(1, 1_000_000),
            )
        )
    return fleet

"""Physics of the horn: friction, load, brake, sleep, and independence of the step size."""

from dataclasses import replace

import pytest

from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants
from hornbill.sim.mechanics.motion import Controller, HornMotion, Orders, load_at
from hornbill.sim.mechanics.plant import STEP_S, plant_of
from unit.sim.desk import MODELS, catalog

HOLD = Orders(
    Controller.ANGLE_DIRECT, 0.0, angle_p=1 / 6, dead_band=0.3, torque_low=-1.0, torque_high=1.0,
    speed_low=-1e4, speed_high=1e4,
)  # fmt: skip


BREAKAWAY = DEFAULT_PLANT.breakaway


def motion(
    orders: Orders | None = None, model: str = "BLA21-06U-A0", angle: float = 0.0, **constants: float
) -> HornMotion:
    made = HornMotion(plant_of(catalog().models[model]), angle, constants=replace(DEFAULT_PLANT, **constants))
    if orders is not None:
        made.obey(orders)
    return made


def test_steps_are_at_least_200_a_second() -> None:
    assert STEP_S <= 0.005


def test_a_free_horn_stays_and_sleeps() -> None:
    horn = motion(angle=12.5)
    horn.advance(0.1)
    assert horn.asleep
    assert (horn.angle, horn.speed, horn.torque) == (12.5, 0.0, 0.0)


@pytest.mark.parametrize(("load", "moves"), [(BREAKAWAY * 0.99, False), (-BREAKAWAY * 1.01, True)])
def test_friction_holds_a_small_load(load: float, moves: bool) -> None:
    horn = motion(load_pct=100 * load)
    horn.advance(1.0)
    assert (horn.angle != 0.0) is moves
    assert horn.asleep is not moves


def test_it_wakes_only_for_changed_orders_or_constants_and_manual_turning() -> None:
    horn = motion(HOLD)
    horn.advance(0.1)
    assert horn.asleep
    horn.obey(HOLD)
    assert horn.asleep
    horn.turn(20.0)
    assert not horn.asleep
    horn.advance(2.0)
    assert abs(horn.angle) <= 0.31
    assert horn.asleep
    horn.obey(HOLD._replace(target=30.0))
    assert not horn.asleep
    horn.advance(4.0)
    assert horn.asleep
    horn.constants = PlantConstants()
    assert horn.asleep
    horn.constants = PlantConstants(load_pct=50.0)
    assert not horn.asleep


def test_a_day_of_sleep_moves_nothing() -> None:
    horn = motion(HOLD._replace(target=30.0))
    horn.advance(2.0)
    rest = horn.angle
    horn.advance(86_400.0)
    assert horn.angle == rest


def test_sleeping_under_load_heats_up() -> None:
    horn = motion(HOLD._replace(dead_band=0.0), load_pct=50.0)
    horn.advance(3.0)
    assert horn.asleep
    assert horn.torque == pytest.approx(-0.5, abs=BREAKAWAY)
    horn.heat()
    horn.advance(13.0)
    assert horn.heat() == pytest.approx(horn.torque**2 * 10, rel=0.01)


def test_small_and_large_steps_give_the_same_angle() -> None:
    whole, bits = motion(HOLD._replace(target=90.0)), motion(HOLD._replace(target=90.0))
    whole.advance(0.1 + 1e-9)
    for n in range(1, 1001):
        bits.advance(n * 0.0001 + 1e-9)
    assert (bits.angle, bits.speed) == (whole.angle, whole.speed)


def test_backward_time_is_ignored() -> None:
    horn = motion(HOLD._replace(target=90.0))
    horn.advance(0.1)
    before = horn.angle
    horn.advance(0.05)
    assert horn.angle == before


@pytest.mark.parametrize("model", MODELS)
def test_the_no_load_speed_is_that_of_the_model_and_proportional_to_voltage(model: str) -> None:
    full = Orders(Controller.TORQUE, 1.0, torque_low=-1.0, torque_high=1.0)
    top = plant_of(catalog().models[model]).top_rpm * 6
    speeds: list[float] = []
    for volts in (1.0, 0.5):
        horn = motion(full._replace(volts=volts), model)
        horn.advance(3.0)
        speeds.append(horn.speed)
    assert speeds[0] == pytest.approx(top, rel=0.01)
    assert speeds[1] == pytest.approx(top / 2, rel=0.03)


def test_a_new_controller_starts_at_the_current_angle() -> None:
    horn = motion(angle=100.0)
    horn.obey(HOLD._replace(target=100.0, smooth=True))
    horn.advance(1.0)
    assert horn.angle == 100.0


def test_active_limits_are_reported() -> None:
    orders = HOLD._replace(
        controller=Controller.SPEED, target=500.0, speed_p=0.01, speed_high=100.0, torque_high=0.05
    )  # fmt: skip
    horn = motion(orders)
    horn.advance(0.01)
    assert (horn.limited_speed, horn.limited_torque) == (1, 1)
    horn.obey(orders._replace(target=-500.0, speed_low=-1e4))
    horn.advance(0.02)
    assert (horn.limited_speed, horn.limited_torque) == (0, -1)


@pytest.mark.parametrize("gain", [0.015, 0.15])
def test_the_integral_is_reset_in_the_deadband(gain: float) -> None:
    plant = plant_of(catalog().models["BLA21-12U-A0"])
    orders = HOLD._replace(
        controller=Controller.ANGLE_CASCADE, target=45.0, angle_p=100 * plant.angle_p, dead_band=3.0,
        speed_p=50 * plant.speed_p, speed_i=gain, speed_dead_band=3.6, speed_i_limit=0.2,
    )  # fmt: skip
    horn = motion(orders, "BLA21-12U-A0", inertia=3.0)
    horn.advance(3.0)
    assert horn.asleep
    assert abs(horn.angle - 45.0) <= 3.0


def test_in_the_deadband_the_integral_still_holds_a_load() -> None:
    plant = plant_of(catalog().models["BLA21-06U-A0"])
    orders = HOLD._replace(
        controller=Controller.ANGLE_CASCADE, angle_p=40 * plant.angle_p, speed_p=50 * plant.speed_p, speed_i=0.015,
        speed_dead_band=3.6, speed_i_limit=1.0,
    )  # fmt: skip
    horn = motion(orders, load_pct=-30.0)
    horn.advance(5.0)
    rest = horn.angle
    horn.advance(60.0)
    assert horn.angle == rest
    assert abs(rest) <= 0.4
    assert horn.torque == pytest.approx(0.3, abs=BREAKAWAY)


PUSH = Orders(Controller.TORQUE, 0.5, torque_low=-1.0, torque_high=1.0)


@pytest.mark.parametrize("sign", [1, -1])
def test_an_end_stop_stops_the_horn_and_lets_it_sleep(sign: int) -> None:
    horn = motion(PUSH._replace(target=0.5 * sign), stop_cw_deg=40.0, stop_ccw_deg=-40.0, backlash_deg=0.6)
    horn.advance(3.0)
    assert (horn.angle, horn.speed, horn.asleep) == (40.0 * sign, 0.0, True)
    assert horn.motor == pytest.approx(40.3 * sign), "the motor crosses the backlash"
    assert horn.torque == pytest.approx(0.5 * sign, abs=1e-3)
    horn.obey(PUSH._replace(target=-0.5 * sign))
    horn.advance(3.05)
    assert abs(horn.angle) < 39.0, "it leaves the stop"


def test_a_load_by_angle_is_an_equilibrium_where_it_is_zero() -> None:
    horn = HornMotion(
        plant_of(catalog().models["BLA21-06U-A0"]), 60.0,
        constants=PlantConstants(load_by_angle=((-90.0, 60.0), (30.0, 0.0), (90.0, -60.0))),
    )  # fmt: skip
    horn.advance(20.0)
    assert horn.asleep
    assert horn.angle == pytest.approx(30.0, abs=8.0), "within its breakaway: 3 % of 60 % per 120° or 60°"
    assert horn.angle != 60.0


@pytest.mark.parametrize(
    ("angle", "load"), [(-100.0, 0.2), (-10.0, 0.2), (0.0, 0.3), (5.0, 0.35), (10.0, 0.4), (99.0, 0.4)]
)
def test_a_load_between_points_is_linear_and_beyond_them_constant(angle: float, load: float) -> None:
    assert load_at(((-10.0, 0.2), (10.0, 0.4)), angle) == pytest.approx(load)


def test_friction_grows_with_time_in_motion_only() -> None:
    worn, fresh = motion(PUSH._replace(target=0.1), wear_per_hour=3600.0), motion(PUSH._replace(target=0.1))
    for n in range(1, 41):
        worn.advance(n * 0.05)
        fresh.advance(n * 0.05)
    assert worn.friction == pytest.approx(3.0, abs=0.01)
    assert fresh.friction == 1.0
    assert worn.speed < 0.5 * fresh.speed
    worn.obey(Orders())
    worn.advance(20.0)
    rested = worn.friction
    worn.advance(3600.0)
    assert worn.friction == rested

"""The simulated horn against an independent integration, energy, and random commands."""

import math

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants
from hornbill.sim.mechanics.motion import Controller, HornMotion, Orders
from hornbill.sim.mechanics.plant import plant_of
from unit.sim.desk import MODELS, START, Desk, catalog
from unit.sim.reference import CONTROL_S, Reference, orders_of

DRIVES: list[tuple[Controller, float, dict[str, float]]] = [
    (Controller.ANGLE_CASCADE, 60.0, {}),
    (Controller.ANGLE_CASCADE, -90.0, {"speed_low": -300.0}),
    (Controller.ANGLE_CASCADE, 45.0, {"torque_high": 0.5}),
    (Controller.ANGLE_DIRECT, 60.0, {}),
    (Controller.ANGLE_DIRECT, 60.0, {"volts": 0.8}),
    (Controller.SPEED, 480.0, {}),
    (Controller.TORQUE, 0.3, {}),
]


def compare(model: str, orders: Orders, constants: PlantConstants, steps: int) -> tuple[float, float]:
    """Farthest angle of the reference, and the largest difference from it, °."""
    plant = plant_of(catalog().models[model])
    motion, reference = HornMotion(plant, 0.0, constants=constants), Reference(plant, orders, constants)
    motion.obey(orders)
    farthest = worst = 0.0
    for number in range(1, steps + 1):
        motion.advance(number * CONTROL_S + 1e-9)
        reference.step()
        farthest = max(farthest, abs(reference.horn))
        worst = max(worst, abs(motion.angle - reference.horn))
    return farthest, worst


@pytest.mark.parametrize("model", ["BLA21-28U-AB", "BLA15-12U-A0"])
@pytest.mark.parametrize(
    ("drive", "constants"),
    [
        *((drive, DEFAULT_PLANT) for drive in DRIVES),
        (DRIVES[2], PlantConstants(inertia=2.0)),
        (DRIVES[4], PlantConstants(inertia=1.0)),
        (DRIVES[5], PlantConstants(load_pct=-10.0)),
        (DRIVES[0], PlantConstants(stop_cw_deg=30.0)),
        (DRIVES[3], PlantConstants(load_by_angle=((0.0, 0.0), (60.0, -30.0)))),
        (DRIVES[3], PlantConstants(breakaway=0.05, coulomb=0.03, viscous=0.25, torque_lag_s=0.008)),  # current limit
    ],
)
def test_a_step_is_within_1_percent_of_an_independent_integration(
    model: str, drive: tuple[Controller, float, dict[str, float]], constants: PlantConstants
) -> None:
    controller, target, more = drive
    orders = orders_of(plant_of(catalog().models[model]), controller, target, **more)
    farthest, worst = compare(model, orders, constants, 300)
    assert farthest > 20.0, "the horn moves"
    assert worst < 0.01 * farthest


@st.composite
def random_constants(draw: st.DrawFn) -> PlantConstants:
    coulomb = draw(st.floats(0.005, 0.06))
    return PlantConstants(
        breakaway=1.5 * coulomb,
        coulomb=coulomb,
        inertia=draw(st.floats(0.0, 20.0)),
        viscous=draw(st.floats(0.05, 1.0)),
        backlash_deg=draw(st.floats(0.0, 0.6)),
        torque_lag_s=draw(st.floats(0.001, 0.01)),
        load_pct=draw(st.floats(-30.0, 30.0)),
        load_by_angle=draw(st.sampled_from(CURVES)),
        stop_cw_deg=draw(st.none() | st.floats(15.0, 60.0)),
        stop_ccw_deg=draw(st.none() | st.floats(-60.0, -15.0)),
    )


CURVES: tuple[tuple[tuple[float, float], ...], ...] = (
    (),
    ((-60.0, 20.0), (0.0, 0.0), (60.0, -20.0)),
    ((-10.0, 5.0), (10.0, -15.0)),
)


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(MODELS), st.sampled_from(DRIVES), random_constants())
def test_with_random_constants_it_agrees_with_an_independent_integration(
    model: str, drive: tuple[Controller, float, dict[str, float]], constants: PlantConstants
) -> None:
    controller, target, more = drive
    orders = orders_of(plant_of(catalog().models[model]), controller, target, **more)
    farthest, worst = compare(model, orders, constants, 150)
    assert worst < 0.015 * max(farthest, 10.0)


def turning(model: str = "BLA21-06U-A0", *, torque: float = 0.8, inertia: float = 0.0, until: float) -> HornMotion:
    """A horn that this torque has turned for a while."""
    motion = HornMotion(plant_of(catalog().models[model]), 0.0, constants=PlantConstants(inertia=inertia))
    motion.obey(Orders(Controller.TORQUE, torque, torque_high=1.0, torque_low=-1.0))
    motion.advance(until)
    return motion


@pytest.mark.parametrize("controller", [Controller.OFF, Controller.BRAKE])
@pytest.mark.parametrize("inertia", [0.0, 5.0])
@pytest.mark.parametrize("model", MODELS)
def test_without_a_command_energy_never_grows(model: str, inertia: float, controller: Controller) -> None:
    motion = turning(model, inertia=inertia, until=0.5)
    assert motion.speed > 100.0
    motion.obey(Orders(controller))
    now, before = 0.5, math.inf
    motion.advance(now := now + 5 * DEFAULT_PLANT.torque_lag_s)  # the torque of the winding decays first
    while motion.speed:
        energy = motion.speed**2
        assert energy < before
        before = energy
        motion.advance(now := now + 0.002)
    assert now < 20.0
    resting = motion.angle
    motion.advance(now + 60.0)
    assert motion.angle == resting
    assert motion.torque == pytest.approx(0.0, abs=1e-4)


def test_a_brake_stops_sooner_than_friction_alone() -> None:
    def runs_on(controller: Controller) -> float:
        motion = turning(until=0.5)
        began = motion.angle
        motion.obey(Orders(controller))
        motion.advance(30.0)
        return motion.angle - began

    assert runs_on(Controller.BRAKE) < 0.7 * runs_on(Controller.OFF)


def test_inertia_slows_the_start_but_not_the_final_speed() -> None:
    (bare, bare_end), (loaded, loaded_end) = (
        [turning(torque=0.5, inertia=inertia, until=seconds).speed for seconds in (0.02, 10.02)]
        for inertia in (0.0, 4.0)
    )
    assert loaded < 0.3 * bare
    assert loaded_end == pytest.approx(bare_end, rel=0.01)


_WAIT = st.floats(10.0, 120.0)
_ACTS = st.one_of(
    st.tuples(st.just("0x00"), st.integers(-4_000, 4_000), _WAIT),
    st.tuples(st.just("0x01"), st.integers(-300, 300), _WAIT),
    st.tuples(st.just("0x02"), st.integers(-100, 100), _WAIT),
    st.tuples(st.just("0x20"), st.integers(0, 2), _WAIT),
    st.tuples(st.just("0x25"), st.integers(0, 1), _WAIT),
    st.tuples(st.just("0x26"), st.integers(0, 2), _WAIT),
    st.tuples(st.just("0x2C"), st.integers(1, 100), _WAIT),
    st.tuples(st.just("0x23"), st.integers(0, 1), _WAIT),
    st.tuples(st.just("restart"), st.just(0), _WAIT),
    st.tuples(st.just("load"), st.integers(-60, 60), _WAIT),
)


@settings(max_examples=2, deadline=None, phases=[Phase.generate], suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(_ACTS, min_size=8, max_size=20), st.sampled_from(MODELS))
def test_random_commands_end_at_the_last_target(acts: list[tuple[str, int, float]], model: str) -> None:
    desk = Desk(model)
    until, turn = START + 1200.0, 0
    while desk.now < until - 200.0:  # the longest wait is 120 s: at least 80 s remain to come to rest
        what, value, seconds = acts[turn % len(acts)]
        turn += 1
        if what == "restart":
            desk.restart()
        elif what == "load":
            desk.servo.conditions.load_pct = float(value)
        else:
            desk.write(what, value)
        received = desk.wait(seconds)
        assert all(math.isfinite(status.position) for status in desk.statuses(received))
        assert math.isfinite(desk.servo.angle_deg)
        assert abs(desk.servo.speed_rpm) < 400
        desk.received.clear()
    desk.servo.conditions.load_pct = 0.0
    # A load may have turned it many times; speed 0 without 0x24 discards the turns.
    forget = (("0x24", 0), ("0x25", 1), ("0x01", 0))
    for name, value in (("0x2C", 40), ("0x20", 0), ("0x26", 0), ("0x23", 0), *forget, ("0x25", 0), ("0x00", 0)):
        assert desk.write(name, value) == value
    desk.wait(until - desk.now)
    assert desk.read("0x08") == pytest.approx(0, abs=4)
    assert desk.now == pytest.approx(until)

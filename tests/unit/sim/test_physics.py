"""The simulated horn against an independent integration, energy, and random commands."""

import math
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from hornbill.sim.mechanics.motion import Controller, HornMotion, Orders
from hornbill.sim.mechanics.plant import BACKLASH_DEG, BREAKAWAY, COULOMB, TORQUE_LAG_S, VISCOUS, Plant, plant_of
from unit.sim.desk import MODELS, START, Desk, catalog

CONTROL_S = 0.001
solve: Any = solve_ivp  # pyright: ignore[reportUnknownVariableType]


class Reference:
    """Independent model of the same plant: torque lag, inertia, friction and play, solved to seven digits.

    As in the servo, the controller samples once per CONTROL_S and holds its output.
    """

    def __init__(self, plant: Plant, orders: Orders) -> None:
        self.plant, self.orders = plant, orders
        self.motor = self.speed = self.torque = self.horn = 0.0

    def step(self) -> None:
        """One period of the controller."""
        commanded = self.output()
        gain = self.plant.gain / (1.0 + self.orders.inertia)
        viscous = VISCOUS / self.plant.synchronous
        load = self.orders.load

        left = CONTROL_S
        while left > 1e-12:
            force = self.torque + load
            if self.speed == 0.0 and abs(force) <= BREAKAWAY:
                self.torque = commanded + (self.torque - commanded) * math.exp(-left / TORQUE_LAG_S)
                break
            direction = math.copysign(1.0, self.speed or force)

            def slope(_time: float, state: list[float], direction: float = direction) -> list[float]:
                _, speed, torque = state
                acceleration = gain * (torque + load - COULOMB * direction - viscous * speed)
                return [speed, acceleration, (commanded - torque) / TORQUE_LAG_S]

            def stopped(_time: float, state: list[float], direction: float = direction) -> float:
                return direction * state[1] + 1e-12

            stopped.terminal = True  # pyright: ignore[reportFunctionMemberAccess] - a flag for scipy
            state = [self.motor, self.speed, self.torque]
            found = solve(slope, (0.0, left), state, events=stopped, rtol=1e-7, atol=1e-9)
            self.motor, self.speed, self.torque = (float(row[-1]) for row in found.y)
            left -= float(found.t[-1])
            if found.status == 1:
                self.speed = 0.0
        play = BACKLASH_DEG / 2.0
        self.horn = min(max(self.horn, self.motor - play), self.motor + play)
        if load:
            self.horn = self.motor + math.copysign(play, load)

    def output(self) -> float:
        """Angle, then speed, then torque; or angle, then voltage (4.18)."""
        orders, emf = self.orders, self.speed / self.plant.synchronous
        if orders.controller == Controller.TORQUE:
            torque = orders.target
        elif orders.controller == Controller.ANGLE_DIRECT:
            error = orders.target - self.horn
            away = orders.angle_p * error if abs(error) > orders.dead_band else 0.0
            return self.limit(away - 2.4 * emf, -orders.volts, orders.volts) - emf
        else:
            error = orders.target - self.horn
            speed = orders.angle_p * error - orders.angle_d * self.speed if abs(error) > orders.dead_band else 0.0
            if orders.controller == Controller.SPEED:
                speed = orders.target
            speed = self.limit(speed, orders.speed_low, orders.speed_high)
            torque = orders.speed_p * (speed - self.speed)
        torque = self.limit(torque, orders.torque_low, orders.torque_high)
        return self.limit(torque + emf, -orders.volts, orders.volts) - emf

    @staticmethod
    def limit(value: float, low: float, high: float) -> float:
        return min(max(value, low), high)


def orders_of(plant: Plant, controller: Controller, target: float, **more: float) -> Orders:
    """Orders with default gains and without smoothing."""
    direct = controller == Controller.ANGLE_DIRECT
    defaults: dict[str, float] = {
        "angle_p": 40 * (plant.angle_p_direct if direct else plant.angle_p), "angle_d": 40 * plant.angle_d,
        "dead_band": 0.3, "speed_p": 50 * plant.speed_p, "speed_low": -1800.0, "speed_high": 1800.0,
        "torque_low": -1.0, "torque_high": 1.0,
    }  # fmt: skip
    return Orders(controller, target)._replace(**{**defaults, **more})


@pytest.mark.parametrize("model", ["BLA21-28U-AB", "BLA15-12U-A0"])
@pytest.mark.parametrize(
    ("controller", "target", "more"),
    [
        (Controller.ANGLE_CASCADE, 60.0, {}),
        (Controller.ANGLE_CASCADE, -90.0, {"speed_low": -300.0}),
        (Controller.ANGLE_CASCADE, 45.0, {"inertia": 2.0, "torque_high": 0.5}),
        (Controller.ANGLE_DIRECT, 60.0, {}),
        (Controller.ANGLE_DIRECT, 60.0, {"volts": 0.8, "inertia": 1.0}),
        (Controller.SPEED, 480.0, {"load": -0.1}),
        (Controller.TORQUE, 0.3, {}),
    ],
)
def test_a_step_is_within_1_percent_of_an_independent_integration(
    model: str, controller: Controller, target: float, more: dict[str, float]
) -> None:
    plant = plant_of(catalog().models[model])
    orders = orders_of(plant, controller, target, **more)
    motion, reference = HornMotion(plant, 0.0), Reference(plant, orders)
    motion.obey(orders)
    furthest = worst = 0.0
    for number in range(1, 301):
        motion.advance(number * CONTROL_S + 1e-9)
        reference.step()
        furthest = max(furthest, abs(reference.horn))
        worst = max(worst, abs(motion.angle - reference.horn))
    assert furthest > 20.0, "the horn moves"
    assert worst < 0.01 * furthest


def turning(model: str = "BLA21-06U-A0", *, torque: float = 0.8, inertia: float = 0.0, until: float) -> HornMotion:
    """A horn that this torque has turned for a while."""
    motion = HornMotion(plant_of(catalog().models[model]), 0.0)
    motion.obey(Orders(Controller.TORQUE, torque, torque_high=1.0, torque_low=-1.0, inertia=inertia))
    motion.advance(until)
    return motion


@pytest.mark.parametrize("controller", [Controller.OFF, Controller.BRAKE])
@pytest.mark.parametrize("inertia", [0.0, 5.0])
@pytest.mark.parametrize("model", MODELS)
def test_without_a_command_energy_never_grows(model: str, inertia: float, controller: Controller) -> None:
    motion = turning(model, inertia=inertia, until=0.5)
    assert motion.speed > 100.0
    motion.obey(Orders(controller, inertia=inertia))
    now, before = 0.5, math.inf
    motion.advance(now := now + 5 * TORQUE_LAG_S)  # the torque of the winding decays first
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

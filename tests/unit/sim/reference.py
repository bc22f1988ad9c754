"""An independent integration of the simulated horn, for tests and benches. It shares no code with the simulator."""

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants
from hornbill.sim.mechanics.motion import Controller, Orders
from hornbill.sim.mechanics.plant import Plant

CONTROL_S = 0.001
solve: Any = solve_ivp  # pyright: ignore[reportUnknownVariableType]


class Reference:
    """Independent model of the same plant: torque lag, inertia, friction, load, play and stops, to seven digits.

    As in the servo, the controller samples once per CONTROL_S and holds its output, and the load is that at the angle
    of the sample.
    """

    def __init__(
        self, plant: Plant, orders: Orders, constants: PlantConstants = DEFAULT_PLANT, angle: float = 0.0
    ) -> None:
        self.plant, self.orders, self.constants = plant, orders, constants
        self.speed = self.torque = 0.0
        self.motor = self.horn = angle

    def load(self) -> float:
        """Load at the horn's angle, share of stall torque."""
        points = self.constants.load_by_angle
        curve = float(np.interp(self.horn, [x for x, _ in points], [y for _, y in points])) if points else 0.0
        return (self.constants.load_pct + curve) / 100.0

    def step(self) -> None:
        """One period of the controller."""
        commanded = self.output()
        one = self.constants
        gain = self.plant.gain / (1.0 + one.inertia)
        viscous = one.viscous / self.plant.synchronous
        load = self.load()
        play = one.backlash_deg / 2.0
        low = -math.inf if one.stop_ccw_deg is None else one.stop_ccw_deg
        high = math.inf if one.stop_cw_deg is None else one.stop_cw_deg

        left = CONTROL_S
        while left > 1e-12:
            force = self.torque + load
            if self.speed == 0.0 and abs(force) <= one.breakaway:
                self.torque = commanded + (self.torque - commanded) * math.exp(-left / one.torque_lag_s)
                break
            direction = math.copysign(1.0, self.speed or force)

            def slope(_time: float, state: list[float], direction: float = direction) -> list[float]:
                _, speed, torque = state
                acceleration = gain * (torque + load - one.coulomb * direction - viscous * speed)
                return [speed, acceleration, (commanded - torque) / one.torque_lag_s]

            def stopped(_time: float, state: list[float], direction: float = direction) -> float:
                return direction * state[1] + 1e-12

            stopped.terminal = True  # pyright: ignore[reportFunctionMemberAccess] - a flag for scipy
            state = [self.motor, self.speed, self.torque]
            found = solve(slope, (0.0, left), state, events=stopped, rtol=1e-7, atol=1e-9)
            self.motor, self.speed, self.torque = (float(row[-1]) for row in found.y)
            left -= float(found.t[-1])
            if found.status == 1:
                self.speed = 0.0
        if not low - play < self.motor < high + play:
            self.motor = min(max(self.motor, low - play), high + play)
            self.speed = 0.0
        self.horn = min(max(self.horn, self.motor - play), self.motor + play)
        if abs(load) > one.coulomb:
            self.horn = self.motor + math.copysign(play, load)
        self.horn = min(max(self.horn, low), high)

    def output(self) -> float:
        """Demanded torque, within the current limit (4.20)."""
        return self.limit(self.uncapped(), -self.orders.current_limit, self.orders.current_limit)

    def uncapped(self) -> float:
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

"""Constants of the plant as the servo's registers show them: supply, noise of the sensor, end stops."""

import statistics

import pytest

from hornbill.domain.plant import PlantConstants
from hornbill.sim.mechanics.plant import plant_of
from unit.sim.desk import FREE, Desk, catalog

HELD = 1e7
"""Inertia of a horn in a vice."""


@pytest.mark.parametrize("torque", [20, 60, -60])
def test_the_supply_sags_by_its_resistance_times_the_current(torque: int) -> None:
    def volts(ohm: float) -> float:
        desk = Desk("BLA21-12U-A0", rom=FREE).under(plant=PlantConstants(inertia=HELD, supply_ohm=ohm))
        desk.write("0x02", torque)
        desk.wait(1.0)
        assert desk.read("0x0A") == torque
        return desk.servo.supply_v

    amperes = plant_of(catalog().models["BLA21-12U-A0"]).stall_a * abs(torque) / 100
    assert volts(0.0) - volts(0.3) == pytest.approx(0.3 * amperes, abs=0.03)


def test_readings_have_the_noise_of_the_sensor_and_the_horn_has_none() -> None:
    desk = Desk(rom=FREE).under(plant=PlantConstants(sensor_noise_deg=0.5))
    desk.write("0x00", 200)
    desk.wait(2.0)
    rest = desk.servo.angle_deg
    found = [(desk.read("0x08") or 0) / 10 for _ in range(400)]
    assert desk.servo.angle_deg == rest
    assert statistics.mean(found) == pytest.approx(rest, abs=0.1)
    assert statistics.stdev(found) == pytest.approx(0.5, rel=0.15)


def test_the_horn_reaches_no_target_behind_an_end_stop() -> None:
    desk = Desk(rom=FREE).under(plant=PlantConstants(stop_cw_deg=30.0, stop_ccw_deg=-50.0))
    for target, reached in ((900, 300), (-900, -500), (100, 100)):
        desk.write("0x00", target)
        desk.wait(2.0)
        assert desk.read("0x08") == pytest.approx(reached, abs=4)

"""A simulated servo as a function of frames and time: reproducible, and unaffected by reading."""

from collections.abc import Callable

import pytest

from hornbill.domain.plant import PlantConstants
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from unit.sim.desk import FREE, QUIET, START, Desk, catalog


def test_the_same_seed_gives_the_same_servo_to_the_last_bit() -> None:
    def life(seed: int) -> list[object]:
        desk = Desk(rom=FREE, seed=seed)
        desk.write("0x00", 1_234)
        desk.wait(0.3)
        desk.write("0x01", -77)
        received = [(each.at, each.payload) for each in desk.wait(2.0)]
        return [*received, desk.read("0x0C"), desk.servo.angle_deg]

    assert life(3) == life(3)


def test_reading_does_not_change_the_motion() -> None:
    def travel(step: float) -> float:
        desk = Desk(rom=FREE)
        desk.write("0x00", 900)
        end = desk.now + 0.2
        while desk.now < end - 1e-9:
            desk.wait(step)
            desk.read("0x08")
        return desk.servo.angle_deg

    assert travel(0.0013) == pytest.approx(travel(0.2), abs=1.5)


def test_next_due_is_the_next_transmission_or_never_without_supply() -> None:
    desk = Desk(up=False)
    assert desk.servo.next_due() == float("inf")
    desk.servo.power_on(START)
    assert desk.servo.next_due() == pytest.approx(START + 0.1)
    desk.wait(1.0)
    assert desk.now < desk.servo.next_due() <= desk.now + 0.05
    desk.servo.power_off(desk.now)
    desk.wait(0.1)
    assert desk.servo.next_due() == float("inf")


def test_a_servo_that_is_advanced_for_its_messages_only_sends_the_same() -> None:
    def sent(due: Callable[[SimulatedServo], float]) -> list[tuple[float, bytes]]:
        desk = Desk(rom=FREE)
        desk.servo.conditions.plant = PlantConstants(sensor_noise_deg=0.1)
        desk.write("0x00", 1_200)
        servo, frames, end = desk.servo, list[tuple[float, bytes]](), desk.now + 3.0
        while (at := due(servo)) <= end:
            servo.advance(at)
            frames += [(at, frame.data) for frame in servo.take_outbox()]
        return frames

    assert len(sent(SimulatedServo.next_message)) > 30
    assert sent(SimulatedServo.next_message) == sent(SimulatedServo.next_due)


def test_a_late_advance_catches_up_without_a_burst() -> None:
    desk = Desk()
    desk.now += 60.0
    desk.servo.advance(desk.now)
    assert 60 <= len(desk.node_statuses(desk.collect())) <= 61
    assert desk.node_statuses(desk.received)[-1].uptime_sec == 60


def test_a_unique_id_has_16_bytes() -> None:
    recipe = Recipe("BLA21-06U-A0", "1.300", uid=bytes(15))
    with pytest.raises(ValueError, match="must have 16"):
        recipe.build(catalog(), 1)


def test_an_update_that_ends_without_supply_needs_no_second_start() -> None:
    desk = Desk(rom=QUIET).under(software_update=True)
    desk.servo.power_off(desk.now)
    desk.servo.conditions.software_update = False
    desk.servo.power_on(desk.now)
    desk.wait(1.0)
    assert desk.servo.starts == 2
    assert desk.servo.output == 0


def test_a_start_during_an_update_still_loses_the_output() -> None:
    desk = Desk(rom=QUIET).under(software_update=True)
    desk.power_cycle()
    assert desk.servo.output == 1
    desk.under(software_update=False).wait(0.5)
    assert (desk.servo.starts, desk.servo.output) == (3, 0)

"""Section 4.12: the four words of abnormality information. The bit numbers are those of the document."""

from collections.abc import Callable

import pytest

from behaviour.servo_story import Rom, Steps, follow, go, near, stories, turned, under
from unit.sim.desk import FREE, QUIET, Desk

NOTIFICATION, WARNING, FAILURE = "0x19", "0x1A", "0x1B"
BITS = {
    "sensor_weak": (WARNING, 4), "sensor_strong": (WARNING, 5), "temperature_high": (WARNING, 8),
    "temperature_low": (WARNING, 9), "voltage_high": (WARNING, 10), "voltage_low": (WARNING, 11),
    "rom_lost": (WARNING, 15), "motor_driver": (FAILURE, 0), "motor_signal": (FAILURE, 1),
    "sensor_failure": (FAILURE, 5), "clock_restart": (FAILURE, 8), "watchdog_restart": (FAILURE, 9),
    "ram_restart": (FAILURE, 11), "memory_warning": (WARNING, 6), "cpu_clock_warning": (WARNING, 14),
    "sensor_interface_failure": (FAILURE, 4), "cpu_rom_failure": (FAILURE, 10),
    "angle_limit_cw_reached": (NOTIFICATION, 8),
    "angle_limit_ccw_reached": (NOTIFICATION, 9), "speed_limit_cw_reached": (NOTIFICATION, 10),
    "speed_limit_ccw_reached": (NOTIFICATION, 11), "torque_limit_cw_reached": (NOTIFICATION, 12),
    "torque_limit_ccw_reached": (NOTIFICATION, 13), "pwm_missing": (NOTIFICATION, 20),
    "pwm_low": (NOTIFICATION, 21), "pwm_high": (NOTIFICATION, 22),
}  # fmt: skip
LEVEL = {NOTIFICATION: 0, WARNING: 1, FAILURE: 2}
RESTARTS = ["clock_restart", "watchdog_restart", "ram_restart"]
UNTIL_START = [*RESTARTS, "rom_lost"]
BROKEN = ["motor_driver", "motor_signal", "sensor_failure"]
OLDER = ["memory_warning", "cpu_clock_warning", "sensor_interface_failure", "cpu_rom_failure"]
"""Reported by older firmware. The names are those of the maker's program; the document has none."""


def push(desk: Desk, percent: int) -> None:
    """Command more torque than the limit of 50 %, against a load that needs slightly less than the command."""
    desk.under(load_pct=-0.8 * percent)
    desk.write("0x02", percent)


def lose_rom(desk: Desk) -> None:
    desk.write("0x12", 1)
    desk.power_cycle()


def injected(key: str) -> Callable[[Desk], None]:
    return lambda desk: desk.servo.faults.inject(key, True)


def removed(key: str) -> Callable[[Desk], None]:
    return lambda desk: desk.servo.faults.inject(key, False)


CAUSES: dict[str, Callable[[Desk], object]] = {
    "angle_limit_cw_reached": lambda desk: desk.write("0x00", 2_000),
    "angle_limit_ccw_reached": lambda desk: desk.write("0x00", -2_000),
    "speed_limit_cw_reached": lambda desk: desk.write("0x01", 90),
    "speed_limit_ccw_reached": lambda desk: desk.write("0x01", -90),
    "torque_limit_cw_reached": lambda desk: push(desk, 60),
    "torque_limit_ccw_reached": lambda desk: push(desk, -60),
    "pwm_missing": under(pwm_us=None),
    "pwm_low": under(pwm_us=800.0),
    "pwm_high": under(pwm_us=2_300.0),
    "temperature_high": under(temperature_c=90.0),
    "temperature_low": under(temperature_c=-30.0),
    "voltage_high": under(voltage_v=11.0),
    "voltage_low": under(voltage_v=3.5),
    "rom_lost": lose_rom,
}
"""Bits with a cause outside the servo. The others report internal defects."""
LIMITED = FREE | {
    "speed_limit_cw": 40, "speed_limit_ccw": -40, "torque_limit_cw": 50, "torque_limit_ccw": -50,
    "temperature_limit_lower": -20,
}  # fmt: skip


@pytest.mark.states("B53", "B54", "B55", "B57", "B58")
@pytest.mark.parametrize("key", BITS)
def test_every_bit_shows_in_its_word_and_in_the_overview(key: str) -> None:
    desk = Desk("BLA21-06U-AB")
    desk.servo.conditions.pwm_us = 1_520
    desk.settle()
    desk.servo.faults.inject(key, True)
    name, bit = BITS[key]
    assert desk.read(name) == 1 << bit
    assert desk.read("0x18") == 1 << (bit // 8 * 8 + LEVEL[name])
    desk.servo.faults.inject(key, False)
    assert desk.read(name) == (1 << bit if key in UNTIL_START else 0)


@pytest.mark.states("B54", "B55", "B56")
@pytest.mark.parametrize("key", CAUSES)
def test_a_cause_sets_its_bit_and_no_other(key: str) -> None:
    desk = Desk("BLA21-06U-AB", rom=LIMITED)
    desk.servo.conditions.pwm_us = 1_520
    CAUSES[key](desk)
    desk.wait(0.9)  # long enough to reach the angle limit, too short for the pulses to take over
    name, bit = BITS[key]
    words = {each: desk.servo.register(int(each, 16)) for each in LEVEL}
    assert words.pop(name) == 1 << bit
    assert set(words.values()) == {0}


AT_A_LIMIT = [
    ({"angle_limit_cw": 300}, "0x00", 300, "0x08", 1 << 8), ({"angle_limit_ccw": -300}, "0x00", -300, "0x08", 1 << 9),
    ({"angle_limit_cw": 400, "angle_limit_ccw": -400}, "0x00", 300, "0x08", 0),
    ({"speed_limit_cw": 40}, "0x01", 40, "0x09", 1 << 10), ({"speed_limit_ccw": -40}, "0x01", -40, "0x09", 1 << 11),
    ({"speed_limit_cw": 60}, "0x01", 40, "0x09", 0),
]  # fmt: skip


@pytest.mark.states("B53", "B54", "B55", "B57")
def test_bits_without_an_outside_cause_report_internal_defects() -> None:
    assert set(BITS) - set(CAUSES) == {"sensor_weak", "sensor_strong", *BROKEN, *RESTARTS, *OLDER}
    assert set(Desk("BLA21-06U-AB").servo.faults.keys) == set(BITS)


@pytest.mark.states("B53")
def test_bits_of_every_level_and_group_are_combined() -> None:
    desk = Desk("BLA21-06U-AB", rom=FREE)
    for key in BITS:
        desk.servo.faults.inject(key, True)
    words = {name: sum(1 << bit for word, bit in BITS.values() if word == name) for name in LEVEL}
    assert {name: desk.read(name) for name in LEVEL} == words
    software, hardware, communication = 0b111 << 8, 0b110, 1 << 16
    assert desk.read("0x18") == software | hardware | communication


@pytest.mark.states("B60")
@pytest.mark.parametrize("key", ["pwm_missing", "pwm_low", "pwm_high"])
def test_a_model_without_pwm_has_no_pwm_bits(key: str) -> None:
    desk = Desk("BLA21-06U-A0")
    with pytest.raises(ValueError, match="not a fault bit of this model"):
        desk.servo.faults.inject(key, True)
    desk.wait(1.0)
    assert desk.read(NOTIFICATION) == 0


@pytest.mark.states("B57", "B58", "B59")
@pytest.mark.parametrize("key", UNTIL_START)
@pytest.mark.parametrize("start", [Desk.restart, Desk.power_cycle])
@pytest.mark.parametrize("cause_ends", [True, False])
def test_a_bit_about_a_restart_or_rom_remains_until_the_next_start(
    key: str, start: Callable[[Desk], object], cause_ends: bool
) -> None:
    (name, bit), (starts, gain) = BITS[key], (1, 77) if key == "rom_lost" else (2, 40)
    desk = Desk(rom=FREE)
    follow(desk, ("0x2C", 77, 0), injected(key), *([removed(key)] if cause_ends else []), 5.0)
    follow(desk, {"starts": starts, name: 1 << bit, "0x2C": gain}, start, 0.2, {name: 0, "starts": starts + 1})


@pytest.mark.states("B59")
@pytest.mark.parametrize("key", RESTARTS)
def test_a_start_after_a_brownout_does_not_report_an_earlier_restart(key: str) -> None:
    desk = Desk(rom=QUIET)
    follow(desk, injected(key), 0.5)
    assert desk.node_statuses(desk.received)[-1].uptime_sec == 0
    assert desk.read(FAILURE) != 0
    follow(desk, under(voltage_v=2.0), under(voltage_v=7.4), 0.5, {"starts": 3, FAILURE: 0})


@pytest.mark.states("B53", "B54", "B55", "B57", "B58")
@stories({
    **{f"B58: a defect is reported again after a start, {key}": (
        {}, [injected(key), Desk.power_cycle, {BITS[key][0]: 1 << BITS[key][1]}],
    ) for key in (*BROKEN, "sensor_weak", "sensor_strong")},
    **{f"B57: with a broken motor circuit there is no output, {key}": ({}, [
        Desk.settle, {"output": 0}, injected(key), 0.1, {"output": 1}, removed(key), 0.1, {"output": 0},
    ]) for key in BROKEN},
    **{f"B55: with a weak or strong magnet the servo works, {key}": (
        FREE, [injected(key), go(300), {"0x08": near(300)}],
    ) for key in ("sensor_weak", "sensor_strong")},
    **{f"B54: a value at its limit sets the bit, {limits}": (
        FREE | {"angle_dead_band": 0, "speed_dead_band": 0} | limits, [(name, raw, 1.5), {reading: raw, "0x19": bits}],
    ) for limits, name, raw, reading, bits in AT_A_LIMIT},
    "B53: a healthy servo reads 0": ({}, [Desk.settle, {"0x18": 0, "0x19": 0, "0x1A": 0, "0x1B": 0}]),
})  # fmt: skip
def test_faults(rom: Rom, steps: Steps) -> None:
    follow(Desk(rom=rom), *steps)


@pytest.mark.states("B57")
def test_with_a_failed_sensor_the_last_angle_is_read_until_it_recovers() -> None:
    desk = Desk(rom=FREE, angle_deg=30.0)
    follow(desk, injected("sensor_failure"), 0.1, turned(90.0), {"0x08": 300})
    assert {round(status.position, 2) for status in desk.statuses(desk.wait(0.5))} == {0.3}
    follow(desk, removed("sensor_failure"), 0.1, {"0x08": 900}, 0.5, {"0x08": near(900)})

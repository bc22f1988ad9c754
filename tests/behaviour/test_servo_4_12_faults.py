"""Section 4.12: the four words of abnormality information. The bit numbers are those of the document."""

from collections.abc import Callable

import pytest

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


CAUSES: dict[str, Callable[[Desk], object]] = {
    "angle_limit_cw_reached": lambda desk: desk.write("0x00", 2_000),
    "angle_limit_ccw_reached": lambda desk: desk.write("0x00", -2_000),
    "speed_limit_cw_reached": lambda desk: desk.write("0x01", 90),
    "speed_limit_ccw_reached": lambda desk: desk.write("0x01", -90),
    "torque_limit_cw_reached": lambda desk: push(desk, 60),
    "torque_limit_ccw_reached": lambda desk: push(desk, -60),
    "pwm_missing": lambda desk: desk.under(pwm_us=None),
    "pwm_low": lambda desk: desk.under(pwm_us=800.0),
    "pwm_high": lambda desk: desk.under(pwm_us=2_300.0),
    "temperature_high": lambda desk: desk.under(temperature_c=90.0),
    "temperature_low": lambda desk: desk.under(temperature_c=-30.0),
    "voltage_high": lambda desk: desk.under(voltage_v=11.0),
    "voltage_low": lambda desk: desk.under(voltage_v=3.5),
    "rom_lost": lose_rom,
}
"""Bits with a cause outside the servo. The others report internal defects."""
LIMITED = FREE | {
    "speed_limit_cw": 40, "speed_limit_ccw": -40, "torque_limit_cw": 50, "torque_limit_ccw": -50,
    "temperature_limit_lower": -20,
}  # fmt: skip


@pytest.mark.states("B53")
def test_a_healthy_servo_reads_0() -> None:
    desk = Desk()
    desk.settle()
    assert desk.reads("0x18", "0x19", "0x1A", "0x1B") == [0, 0, 0, 0]


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


@pytest.mark.states("B54")
@pytest.mark.parametrize(
    ("limits", "command", "bits"),
    [
        ({"angle_limit_cw": 300}, ("0x00", 300), 1 << 8),
        ({"angle_limit_ccw": -300}, ("0x00", -300), 1 << 9),
        ({"angle_limit_cw": 400, "angle_limit_ccw": -400}, ("0x00", 300), 0),
        ({"speed_limit_cw": 40}, ("0x01", 40), 1 << 10),
        ({"speed_limit_ccw": -40}, ("0x01", -40), 1 << 11),
        ({"speed_limit_cw": 60}, ("0x01", 40), 0),
    ],
)
def test_a_value_at_its_limit_sets_the_bit(limits: dict[str, int], command: tuple[str, int], bits: int) -> None:
    desk = Desk(rom=FREE | {"angle_dead_band": 0, "speed_dead_band": 0} | limits)
    desk.run(*command, 1.5)
    assert desk.read("0x08" if command[0] == "0x00" else "0x09") == command[1]
    assert desk.read(NOTIFICATION) == bits


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
def test_a_bit_about_a_restart_or_rom_remains_until_the_next_start(key: str) -> None:
    name, bit = BITS[key]
    for removed in (True, False):
        for start in (Desk.restart, Desk.power_cycle):
            desk = Desk(rom=FREE)
            desk.write("0x2C", 77)
            desk.servo.faults.inject(key, True)
            if removed:
                desk.servo.faults.inject(key, False)
            desk.wait(5.0)
            starts = 1 if key == "rom_lost" else 2
            assert desk.servo.starts == starts
            assert desk.reads(name, "0x2C") == [1 << bit, 77 if key == "rom_lost" else 40]
            start(desk)
            desk.wait(0.2)
            assert (desk.read(name), desk.servo.starts) == (0, starts + 1)


@pytest.mark.states("B59")
@pytest.mark.parametrize("key", RESTARTS)
def test_a_start_after_a_brownout_does_not_report_an_earlier_restart(key: str) -> None:
    desk = Desk(rom=QUIET)
    desk.servo.faults.inject(key, True)
    desk.wait(0.5)
    assert desk.node_statuses(desk.received)[-1].uptime_sec == 0
    assert desk.read(FAILURE) != 0
    desk.under(voltage_v=2.0).under(voltage_v=7.4).wait(0.5)
    assert desk.servo.starts == 3
    assert desk.read(FAILURE) == 0


@pytest.mark.states("B58")
@pytest.mark.parametrize("key", [*BROKEN, "sensor_weak", "sensor_strong"])
def test_a_defect_is_reported_again_after_a_start(key: str) -> None:
    desk = Desk()
    desk.servo.faults.inject(key, True)
    desk.power_cycle()
    name, bit = BITS[key]
    assert desk.read(name) == 1 << bit


@pytest.mark.states("B57")
@pytest.mark.parametrize("key", BROKEN)
def test_with_a_broken_motor_circuit_there_is_no_output(key: str) -> None:
    desk = Desk()
    desk.settle()
    assert desk.servo.output == 0
    for broken in (True, False):
        desk.servo.faults.inject(key, broken)
        desk.wait(0.1)
        assert desk.servo.output == broken


@pytest.mark.states("B57")
def test_with_a_failed_sensor_the_last_angle_is_read_until_it_recovers() -> None:
    desk = Desk(rom=FREE, angle_deg=30.0)
    desk.servo.faults.inject("sensor_failure", True)
    desk.wait(0.1)
    assert desk.turn(90.0)
    assert desk.read("0x08") == 300
    assert {round(status.position, 2) for status in desk.statuses(desk.wait(0.5))} == {0.3}
    desk.servo.faults.inject("sensor_failure", False)
    desk.wait(0.1)
    assert desk.read("0x08") == 900
    desk.wait(0.5)
    assert desk.read("0x08") == pytest.approx(900, abs=3)


@pytest.mark.states("B55")
@pytest.mark.parametrize("key", ["sensor_weak", "sensor_strong"])
def test_with_a_weak_or_strong_magnet_the_servo_works(key: str) -> None:
    desk = Desk(rom=FREE)
    desk.servo.faults.inject(key, True)
    desk.go(300)
    assert desk.read("0x08") == pytest.approx(300, abs=3)

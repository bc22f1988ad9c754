"""SimFaults: conditions, injected bits and latches in the four words, and the effect of a start."""

import pytest

from hornbill.sim.faults import SimFaults
from unit.sim.desk import catalog

WEAK, DRIVER, WATCHDOG, HOT = "sensor_weak", "motor_driver", "watchdog_restart", "temperature_high"


def faults() -> SimFaults:
    return SimFaults(catalog().faults_of(True))


def test_a_condition_and_an_injected_fault_share_their_bit() -> None:
    found = faults()
    found.inject(HOT, True)
    found.show([HOT])
    assert found.words == (0, 1 << 8, 0)
    found.inject(HOT, False)
    assert found.words == (0, 1 << 8, 0)
    found.show([])
    assert found.words == (0, 0, 0)


def test_only_restart_bits_request_a_restart() -> None:
    found = faults()
    for key in (WEAK, DRIVER, "rom_lost"):
        found.inject(key, True)
    assert found.crashed == set()
    found.inject(WATCHDOG, True)
    assert found.crashed == {WATCHDOG}
    found.start()
    assert found.crashed == set()


def test_a_start_keeps_permanent_faults_and_clears_others() -> None:
    found = faults()
    for key in (WEAK, DRIVER, WATCHDOG):
        found.inject(key, True)
    found.show([HOT])
    found.start("ram_restart")
    assert found.active == {WEAK, DRIVER, "ram_restart"}


def test_latching_is_a_switch_that_affects_failures_only() -> None:
    found = faults()
    found.failures_latch = True
    for key in (WEAK, DRIVER):
        found.inject(key, True)
        found.inject(key, False)
    assert found.active == {DRIVER}
    assert found.output_off
    found.start()
    assert found.active == set()


def test_conditions_a_model_does_not_have_are_ignored() -> None:
    found = SimFaults(catalog().faults_of(False))
    found.show(["pwm_missing", WEAK])
    assert found.words == (0, 1 << 4, 0)
    with pytest.raises(ValueError, match="pwm_missing"):
        found.inject("pwm_missing", True)

"""The switch by which failures latch. tests/behaviour/test_servo_4_12_faults.py has everything else about faults."""

from hornbill.sim.faults import SimFaults
from unit.sim.desk import catalog

WEAK, DRIVER = "sensor_weak", "motor_driver"


def test_latching_is_a_switch_that_affects_failures_only() -> None:
    found = SimFaults(catalog().faults_of(True))
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

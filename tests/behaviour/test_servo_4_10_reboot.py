"""Section 4.10: 0x11 is a start like that at power-on."""

import pytest

from unit.sim.desk import QUIET, Desk


@pytest.mark.states("B44", "B47")
def test_0x11_is_a_power_cycle() -> None:
    desk = Desk(rom=QUIET | {"angle_limit_cw": 9_000})
    desk.write("0x00", 2_700)
    desk.settle()
    assert desk.write("0x11", 1) == 1
    assert desk.wait(0.09) == []
    desk.wait(0.1)
    assert desk.servo.starts == 2
    assert desk.read("0x08") == pytest.approx(-900, abs=3)


@pytest.mark.states("B47", "B66")
def test_soft_start_comes_again() -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.write("0x00", 1_200)
    desk.settle()
    desk.write("0x11", 1)
    desk.wait(0.2)
    assert desk.servo.soft_starting
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B47")
def test_everything_reads_as_after_power_on() -> None:
    def all_registers(desk: Desk) -> dict[int, int | None]:
        # Current values are measured anew each time.
        return {at: desk.read(f"0x{at:02X}") for at in range(0x60) if not 0x08 <= at <= 0x0C}

    rebooted, cycled = Desk(rom=QUIET), Desk(rom=QUIET)
    for desk in (rebooted, cycled):
        desk.write("0x2C", 77)
        desk.write("0x00", 300)
        desk.servo.faults.inject("rom_lost", True)
        desk.settle()
    rebooted.write("0x11", 1)
    rebooted.wait(0.2)
    cycled.power_cycle()
    assert all_registers(rebooted) == all_registers(cycled)


@pytest.mark.states("B44")
def test_0_does_nothing_and_2_is_refused() -> None:
    desk = Desk(rom=QUIET)
    assert (desk.write("0x11", 0), desk.write("0x11", 2)) == (0, None)
    desk.wait(0.5)
    assert desk.servo.starts == 1

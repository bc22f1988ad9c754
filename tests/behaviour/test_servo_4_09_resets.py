"""Sections 4.9 and 4.10: the factory reset by 0x10, and the restart by 0x11."""

import pytest

from unit.sim.desk import FREE, MODELS, QUIET, Desk


@pytest.mark.states("B08", "B44", "B45", "B61")
def test_a_factory_reset_resets_ram_and_commands_so_that_the_horn_moves() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    desk.go(900)
    desk.write("0x20", 1)
    assert desk.servo.output == 1
    assert desk.write("0x10", 1) == 1
    assert desk.reads("0x20", "0x2C", "0x00", "0x01", "0x45", "0x46") == [0, 40, 0, 0, 0, 0]
    assert (desk.servo.output, desk.servo.node_id) == (0, 42)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    desk.restart()
    desk.wait(0.2)
    assert desk.read("0x2C") == 55


@pytest.mark.states("B45")
def test_a_factory_reset_and_0x12_reset_rom_too() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    desk.write("0x10", 1)
    desk.save()
    assert desk.servo.register(0x2C) == 40
    assert desk.servo.node_id == 0


@pytest.mark.states("B45")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_a_factory_reset_ends_a_speed_or_torque_and_the_horn_goes_to_0(name: str) -> None:
    desk = Desk(rom=FREE)
    desk.run(name, 30, 0.2)
    assert desk.write("0x10", 1) == 1
    assert desk.reads("0x00", "0x01", "0x02", "0x25") == [0, 0, 0, 0]
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B45", "B71")
def test_a_factory_reset_discards_turns_made_at_a_speed() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 150)
    while desk.servo.angle_deg < 725:
        desk.wait(0.01)
    desk.run("0x01", 0, 0.3)
    desk.write("0x10", 1)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(720, abs=0.4)


@pytest.mark.states("B45", "B105")
@pytest.mark.parametrize("model", MODELS)
def test_a_factory_reset_resets_every_row_to_the_default_of_the_model(model: str) -> None:
    used = Desk(model, rom={"soft_start": 0})
    rows = [row for row in used.servo.model.rows(1300).values() if row.rom and row.default is not None]
    for row in rows:
        if row.minimum is not None and row.maximum is not None:
            assert used.write(row.name, row.maximum if row.maximum != row.default else row.minimum) is not None
    used.write("0x10", 1)
    assert {row.name: used.read(row.name) for row in rows} == {row.name: row.default for row in rows}


@pytest.mark.states("B44", "B47")
def test_0x11_restarts_as_at_power_on() -> None:
    restarted, cycled = (Desk(rom=QUIET | {"angle_limit_cw": 9_000}) for _ in range(2))
    for desk in (restarted, cycled):
        desk.write("0x2C", 77)
        desk.servo.faults.inject("rom_lost", True)
        desk.go(2_700)
    assert restarted.write("0x11", 1) == 1
    assert restarted.wait(0.09) == []
    restarted.wait(0.1)
    cycled.power_cycle()
    assert restarted.servo.starts == 2
    assert restarted.read("0x08") == pytest.approx(-900, abs=3)
    # All but measured values, and the angle that is held.
    names = [f"0x{at:02X}" for at in range(1, 0x60) if not 0x08 <= at <= 0x0C]
    assert restarted.reads(*names) == cycled.reads(*names)


@pytest.mark.states("B47", "B66")
def test_soft_start_runs_again_after_0x11() -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.go(1_200)
    desk.run("0x11", 1, 0.2)
    assert desk.servo.soft_starting
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)

"""Section 4.9: 0x10 brings parameters and running commands to their defaults, in RAM."""

import pytest

from unit.sim.desk import FREE, MODELS, QUIET, Desk


@pytest.mark.states("B44", "B45", "B08")
def test_initialise_resets_ram_and_commands_so_that_the_horn_moves() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    desk.write("0x00", 900)
    desk.settle()
    assert desk.write("0x10", 1) == 1
    assert (desk.read("0x2C"), desk.read("0x00"), desk.read("0x01")) == (40, 0, 0)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    desk.restart()
    desk.wait(0.2)
    assert desk.read("0x2C") == 55


@pytest.mark.states("B45")
def test_initialise_and_0x12_reset_rom_too() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    desk.write("0x10", 1)
    desk.write("0x12", 1)
    desk.wait(0.3)
    assert desk.servo.register(0x2C) == 40
    assert desk.servo.node_id == 0


@pytest.mark.states("B45")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_a_speed_or_torque_that_runs_ends_and_the_horn_goes_to_0(name: str) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, 30)
    desk.wait(0.2)
    assert desk.write("0x10", 1) == 1
    assert [desk.read(each) for each in ("0x00", "0x01", "0x02", "0x25")] == [0, 0, 0, 0]
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B45", "B71")
def test_turns_made_at_a_speed_are_forgotten_with_it() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 150)
    while desk.servo.angle_deg < 725:
        desk.wait(0.01)
    desk.write("0x01", 0)
    desk.wait(0.3)
    desk.write("0x10", 1)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(720, abs=0.4)


@pytest.mark.states("B45", "B61")
def test_it_switches_the_output_on_as_delivered() -> None:
    desk = Desk(rom=QUIET)
    desk.write("0x20", 1)
    assert desk.servo.output == 1
    desk.write("0x10", 1)
    assert (desk.read("0x20"), desk.servo.output) == (0, 0)


@pytest.mark.states("B45", "B105")
@pytest.mark.parametrize("model", MODELS)
def test_every_row_goes_back_to_the_default_of_its_model(model: str) -> None:
    used = Desk(model, rom={"soft_start": 0})
    rows = [row for row in used.servo.model.rows(1300).values() if row.rom and row.default is not None]
    for row in rows:
        if row.minimum is not None and row.maximum is not None:
            assert used.write(row.name, row.maximum if row.maximum != row.default else row.minimum) is not None
    used.write("0x10", 1)
    assert {row.name: used.read(row.name) for row in rows} == {row.name: row.default for row in rows}


@pytest.mark.states("B45")
def test_node_and_servo_id_go_with_the_rest_but_the_node_id_is_kept_until_the_next_start() -> None:
    desk = Desk(rom=QUIET)
    desk.write("0x10", 1)
    assert (desk.read("0x45"), desk.read("0x46")) == (0, 0)
    assert desk.servo.node_id == 42

"""Sections 4.9 and 4.10: the factory reset by 0x10, and the restart by 0x11."""

import pytest

from behaviour.servo_story import Rom, Steps, follow, go, near, stories
from unit.sim.desk import FREE, MODELS, QUIET, Desk


@pytest.mark.states("B08", "B44", "B45", "B47", "B61", "B66")
@stories({
    "B08, B44, B45, B61: a factory reset resets RAM, so that the horn moves": (QUIET | {"angle_p_gain": 55}, [
        go(900), ("0x20", 1, 0), {"output": 1}, ("0x10", 1, 0),
        {"0x20": 0, "0x2C": 40, "0x00": 0, "0x01": 0, "0x45": 0, "0x46": 0, "output": 0, "node_id": 42},
        Desk.settle, {"0x08": near(0)}, Desk.restart, 0.2, {"0x2C": 55},
    ]),
    **{f"B45: a factory reset ends a speed or torque and the horn goes to 0, {name}": (FREE, [
        (name, 30, 0.2), ("0x10", 1, 0), {"0x00": 0, "0x01": 0, "0x02": 0, "0x25": 0}, Desk.settle, {"0x08": near(0)},
    ]) for name in ("0x01", "0x02")},
    "B47, B66: soft start runs again after 0x11": ({"timeout_action": 0}, [
        go(1_200), ("0x11", 1, 0.2), {"soft_starting": True}, Desk.settle, {"0x08": near(0)},
    ]),
})  # fmt: skip
def test_resets(rom: Rom, steps: Steps) -> None:
    follow(Desk(rom=rom), *steps)


@pytest.mark.states("B45")
def test_a_factory_reset_and_0x12_reset_rom_too() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    desk.write("0x10", 1)
    desk.save()
    assert desk.servo.register(0x2C) == 40
    assert desk.servo.node_id == 0


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

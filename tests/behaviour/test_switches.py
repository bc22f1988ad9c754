"""Every switch of `Behaviour`: both answers to each question the document leaves open.

The questions are those of docs/reference/fidelity.toml; the reasons for the defaults are in sim/behaviour.py.
"""

from collections.abc import Callable
from dataclasses import fields, replace
from math import radians
from typing import Any, get_args, get_type_hints

import pytest

from behaviour.servo_story import follow, go, near, refused
from hornbill.schema.parameter import DUMMY
from hornbill.sim.behaviour import Behaviour
from hornbill.wire.messages import CommandType, NodeHealth
from hornbill.wire.services import EMPTY, GetSetRequest
from unit.sim.desk import FREE, QUIET, Desk

SAVE, ERASE = 0, 1


def settings_of(name: str) -> tuple[object, ...]:
    return get_args(get_type_hints(Behaviour)[name]) or (True, False)


def both(name: str, *, firmware: str = "1.300", **more: Any) -> list[Desk]:
    """Two servos that differ in one switch: with its default and with the other setting."""
    default = getattr(Behaviour(), name)
    (other,) = (setting for setting in settings_of(name) if setting != default)
    more.setdefault("rom", FREE if firmware != "1.010" else QUIET)
    switched = (Behaviour(), replace(Behaviour(), **{name: other}))
    return [Desk("BLA21-06U-A0", firmware, behaviour=behaviour, **more) for behaviour in switched]


def array(value: float, kind: CommandType = CommandType.POSITION, to: int = 7) -> Callable[[Desk], None]:
    return lambda desk: desk.array(to, kind, value)


@pytest.mark.states("B14")
@pytest.mark.switch("reserved")
def test_reserved_registers_fail_or_read_0_and_ignore_writes() -> None:
    fails, zero = both("reserved")
    for name in ("0x03", "0x0D", "0x28", "0x29", "0x42", "0x4F", "0x54", "0x5F"):
        assert (fails.read(name), fails.write(name, 5), fails.read(name)) == (None, None, None)
        assert (zero.read(name), zero.write(name, 5), zero.read(name)) == (0, 0, 0)
    beyond = zero.get_set("", index=0x60)
    assert beyond is not None
    assert beyond.value == EMPTY


@pytest.mark.states("B44")
@pytest.mark.switch("write_only")
def test_reading_an_action_fails_or_returns_0_and_writing_it_acts() -> None:
    for desk, expected in zip(both("write_only"), (None, 0), strict=True):
        assert desk.reads("0x10", "0x11", "0x12") == [expected] * 3
        follow(desk, ("0x2C", 77, 0), ("0x10", 1, 0), {"0x2C": 40})


@pytest.mark.states("B22")
@pytest.mark.switch("array_command_id_0")
def test_a_new_servo_obeys_commands_for_id_0_or_ignores_them() -> None:
    for desk, command in zip(both("array_command_id_0", servo_id=0), (500, 0), strict=True):
        for other in range(1, 255):
            desk.array(other, CommandType.POSITION, 0.3)
        follow(desk, {"0x45": 0, "0x00": 0}, array(0.5, to=0), {"0x00": command}, array(0.7, to=255), {"0x00": 700})


@pytest.mark.states("B15")
@pytest.mark.switch("health_of_notifications")
def test_a_notification_leaves_health_ok_or_makes_it_a_warning() -> None:
    for desk, health in zip(both("health_of_notifications"), (NodeHealth.OK, NodeHealth.WARNING), strict=True):
        assert desk.node_statuses(desk.wait(1.1))[-1].health == NodeHealth.OK
        desk.go(360_000_000)
        assert desk.reads("0x19", "0x1A") == [1 << 8, 0]
        assert desk.node_statuses(desk.wait(1.1))[-1].health == health


@pytest.mark.states("B09")
@pytest.mark.switch("lower_case_names")
def test_names_in_lower_case_fail_or_are_accepted_with_a_response_in_capitals() -> None:
    strict, lenient = both("lower_case_names")
    assert strict.read("0x2C") == lenient.read("0x2C") == 40
    failed, accepted = strict.get_set("0x2c"), lenient.get_set("0x2c")
    assert failed is not None
    assert accepted is not None
    assert (failed.value, failed.name) == (EMPTY, "")
    assert (accepted.value.value, accepted.name) == (40, "0x2C")


@pytest.mark.states("B11", "B25")
@pytest.mark.switch("out_of_range")
def test_a_value_out_of_range_is_refused_or_clamped() -> None:
    refusing, clamping = both("out_of_range")
    follow(refusing, refused("0x3E", 99), {"0x3E": 80}, array(130.0, CommandType.FORCE), {"0x02": 0})
    assert clamping.write("0x3E", 1) == 20
    follow(clamping, {"0x3E": 20}, array(130.0, CommandType.FORCE), {"0x02": 100})


@pytest.mark.states("B23", "B27")
@pytest.mark.switch("position_unit")
@pytest.mark.parametrize(
    ("unit", "position"), [("hundred_degrees", 0.6), ("radian", radians(60)), ("degree", 60.0), ("tenth_degree", 600.0)]
)
def test_a_position_has_one_of_four_units_in_either_direction(unit: Any, position: float) -> None:
    desk = Desk(rom=FREE, behaviour=Behaviour(position_unit=unit))
    desk.array(7, CommandType.POSITION, position)
    assert desk.read("0x00") == pytest.approx(600, abs=1)
    desk.settle()
    assert desk.statuses(desk.wait(0.2))[-1].position / position == pytest.approx(desk.value("0x08") / 600, abs=2e-3)


@pytest.mark.states("B48")
@pytest.mark.switch("acknowledges_save")
@pytest.mark.parametrize("by", ["0x12", "opcode"])
def test_a_save_is_acknowledged_or_not_and_always_made(by: str) -> None:
    for desk, acknowledged in zip(both("acknowledges_save"), (True, False), strict=True):
        desk.write("0x2C", 77)
        sent = desk.send_write("0x12", 1) if by == "0x12" else [desk.opcode(SAVE)]
        assert bool(sent and sent[0]) is acknowledged
        desk.wait(0.3)
        desk.power_cycle()
        assert desk.read("0x2C") == 77


@pytest.mark.states("B48")
@pytest.mark.switch("save_opcode_restarts")
def test_the_opcode_save_restarts_or_not_and_0x12_always_restarts() -> None:
    for desk, starts in zip(both("save_opcode_restarts"), (2, 1), strict=True):
        desk.go(300)
        assert desk.opcode(SAVE) is True
        assert desk.wait(0.049) == []
        follow(desk, 0.3, {"starts": starts}, Desk.save, {"starts": starts + 1})


@pytest.mark.states("B06", "B47")
@pytest.mark.switch("acknowledges_restart")
@pytest.mark.parametrize("by", ["0x11", "RestartNode"])
def test_a_restart_is_acknowledged_or_not(by: str) -> None:
    for desk, acknowledged in zip(both("acknowledges_restart"), (True, False), strict=True):
        sent = desk.send_write("0x11", 1) if by == "0x11" else [desk.restart()]
        assert bool(sent and sent[0]) is acknowledged
        desk.wait(0.3)
        assert desk.servo.starts == 2


@pytest.mark.states("B46")
@pytest.mark.switch("erase_rom")
def test_erase_resets_ram_alone_or_rom_too() -> None:
    for desk, after_power in zip(both("erase_rom", rom=FREE | {"angle_p_gain": 77}), (77, 40), strict=True):
        assert desk.opcode(ERASE) is True
        follow(desk, {"0x2C": 40}, Desk.power_cycle)
        assert desk.servo.register(0x2C) == after_power


@pytest.mark.states("B46")
@pytest.mark.switch("erase_keeps_identity")
@pytest.mark.parametrize("by", ["0x10", "opcode"])
def test_a_factory_reset_includes_origin_and_ids_or_not(by: str) -> None:
    desks = both("erase_keeps_identity", rom=FREE | {"origin": 100, "angle_p_gain": 77})
    for desk, identity in zip(desks, ([0, 0, 0], [100, 7, 42]), strict=True):
        assert (desk.write("0x10", 1) if by == "0x10" else desk.opcode(ERASE)) == 1
        assert desk.reads("0x44", "0x45", "0x46", "0x2C") == [*identity, 40]


@pytest.mark.states("B72")
@pytest.mark.switch("timeout_from")
def test_the_timeout_starts_at_power_on_or_at_the_first_command() -> None:
    for desk, output in zip(both("timeout_from", rom={"soft_start": 0}), (1, 0), strict=True):
        follow(desk, 30.0, {"output": output}, ("0x00", 0, 0), {"output": 0}, 1.1, {"output": 1})


@pytest.mark.states("B32")
@pytest.mark.switch("array_command_shows")
@pytest.mark.parametrize(
    ("kind", "value", "place", "raw"),
    [(CommandType.POSITION, 0.5, 0, 500), (CommandType.SPEED, 60.0, 1, 60), (CommandType.FORCE, 20.0, 2, 20)],
)
def test_an_array_command_is_stored_in_the_registers_or_separately(
    kind: CommandType, value: float, place: int, raw: int
) -> None:
    shown, separately = both("array_command_shows")
    for desk in (shown, separately):
        follow(desk, go(100), array(value, kind), 0.5)
    commands = ("0x00", "0x01", "0x02")
    assert shown.reads(*commands) == [raw if at == place else DUMMY for at in range(3)]
    assert separately.reads(*commands) == [100, DUMMY, DUMMY]
    assert shown.servo.angle_deg == separately.servo.angle_deg > 30


@pytest.mark.states("B62")
@pytest.mark.switch("array_command_shows")
def test_a_command_stored_separately_is_dropped_like_any_other() -> None:
    for desk in both("array_command_shows"):
        follow(desk, array(1.5), 0.05, ("0x20", 1, 0.5))
        there = desk.value("0x08")
        follow(desk, ("0x20", 0, 0.5), {"0x00": there, "0x08": near(there)})


@pytest.mark.states("B72")
@pytest.mark.switch("array_command_feeds_timeout")
def test_an_array_command_restarts_the_timeout_or_not() -> None:
    for desk, output in zip(both("array_command_feeds_timeout", rom={"soft_start": 0}), (0, 1), strict=True):
        follow(desk, ("0x00", 100, 0), *([0.4, array(0.1)] * 4), {"output": output})


@pytest.mark.states("B94", "B31")
@pytest.mark.switch("limits_follow_origin")
def test_the_limits_move_with_the_origin_or_not() -> None:
    rom = FREE | {"angle_limit_cw": 600, "angle_limit_ccw": -600, "origin": 200}
    for desk, (cw, ccw) in zip(both("limits_follow_origin", rom=rom), ((80, -40), (60, -60)), strict=True):
        follow(desk, go(1_500), {"angle_deg": near(cw, 0.4), "0x19": 1 << 8})
        follow(desk, go(-1_500), {"angle_deg": near(ccw, 0.4), "0x19": 1 << 9})


@pytest.mark.states("B58")
@pytest.mark.switch("failures_latch")
@pytest.mark.parametrize("key", ["motor_driver", "motor_signal", "sensor_failure"])
def test_a_failure_ends_with_its_cause_or_at_the_next_start(key: str) -> None:
    for desk, output in zip(both("failures_latch"), (0, 1), strict=True):
        desk.servo.faults.inject(key, True)
        desk.wait(0.2)
        desk.servo.faults.inject(key, False)
        follow(desk, 5.0, {"output": output})
        assert bool(desk.read("0x1B")) is bool(output)
        follow(desk, Desk.power_cycle, {"0x1B": 0, "output": 0})


@pytest.mark.states("B58")
@pytest.mark.switch("failures_latch")
def test_a_lasting_cause_shows_again_after_a_start_and_warnings_never_latch() -> None:
    for desk in both("failures_latch"):
        desk.servo.faults.inject("motor_driver", True)
        desk.servo.faults.inject("sensor_weak", True)
        desk.power_cycle()
        assert desk.reads("0x1B", "0x1A") == [1, 1 << 4]
        for on in (True, False):
            desk.servo.faults.inject("sensor_weak", on)
        assert desk.read("0x1A") == 0


@pytest.mark.states("B67")
@pytest.mark.switch("soft_start_shows")
def test_limits_read_temporary_or_stored_values_during_soft_start_and_a_save_stores_what_they_read() -> None:
    temporary, stored = [1, 30, -30, 30, -30], [0, 300, -300, 100, -100]
    for desk, shown in zip(both("soft_start_shows", rom={}, angle_deg=150.0), (temporary, stored), strict=True):
        limits = dict(zip(("0x25", "0x3A", "0x3B", "0x3C", "0x3D"), shown, strict=True))
        follow(desk, {"soft_starting": True, **limits}, 0.3)
        assert 20 <= abs(desk.value("0x09")) <= 31
        follow(desk, Desk.save, ("0x20", 0, 0), {"soft_starting": False, **limits})


@pytest.mark.states("B75")
@pytest.mark.switch("cascade_without_switch")
def test_firmware_without_0x25_obeys_speed_and_torque_or_ignores_them() -> None:
    for desk, obeys in zip(both("cascade_without_switch", firmware="1.010"), (True, False), strict=True):
        assert desk.read("0x25") == 0
        desk.run("0x01", 50, 1.0)
        assert desk.read("0x09") == near(50 if obeys else 0, 1)
        desk.run("0x02", 30, 1.0)
        assert (desk.value("0x09") > 10) is obeys
        follow(desk, go(0), {"0x08": near(0)})


@pytest.mark.parametrize("delay_s", [0.0, 0.004, 0.25])
def test_the_response_time_of_getset_is_a_condition_of_the_bench(delay_s: float) -> None:
    desk = Desk().under(response_delay_s=delay_s)
    sent = desk.now
    transfers = desk.send(GetSetRequest(0, EMPTY, "0x50")) or desk.wait(0.5)
    responses = [each for each in transfers if each.type_id == 11]
    assert [response.at - sent for response in responses] == pytest.approx([delay_s])


@pytest.mark.parametrize("name", [each.name for each in fields(Behaviour)])
def test_a_switch_can_be_set_at_any_time(name: str) -> None:
    desk = Desk(rom=FREE)
    for setting in (*settings_of(name), *reversed(settings_of(name))):
        desk.servo.behaviour = replace(desk.servo.behaviour, **{name: setting})
        follow(desk, go(300), {"0x08": near(300)})

"""The maker's position unit holds from the first contact, is checked on every servo, and may be forced."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import pytest

from behaviour.rig import CATALOG, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.app.settings import Settings
from hornbill.domain.servo import PositionUnit
from hornbill.servo.device.position_unit import to_degrees, to_position
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.runtime.hub import Sampled
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid
from hornbill.wire.port import CanPort

UNITS: tuple[PositionUnit, ...] = get_args(PositionUnit.__value__)
LOOSE = {"soft_start": 0, "torque_mode": 1}
"""The horn stays where it is at a start, and may be turned by hand."""


def speaking(
    unit: PositionUnit, angle_deg: float = 40.0, *, number: int = 1, firmware: str = "1.300", serial: int = 7
) -> Recipe:
    return Recipe(
        firmware=firmware, servo_id=number, node_id=10 + number, rom=LOOSE, angle_deg=angle_deg, serial=serial,
        behaviour=Behaviour(position_unit=unit), uid=bytes([number]) * 16,
    )  # fmt: skip


def four(*angles: float) -> list[Recipe]:
    return [speaking(unit, angle, number=at) for at, (unit, angle) in enumerate(zip(UNITS, angles, strict=True), 1)]


def uid(number: int = 1) -> Uid:
    return Uid(bytes([number]).hex() * 16)


async def settled(servos: list[Servo], within_s: float) -> None:
    async with asyncio.timeout(within_s):
        while not all(servo.position_unit.measured for servo in servos):
            await asyncio.sleep(0.05)


def by_number(servos: list[Servo]) -> list[Servo]:
    return sorted(servos, key=lambda servo: servo.uid)


def looks(rig: Rig, since: int = 0) -> int:
    """How often 0x08 was asked for."""
    asked = [one for one in rig.transfers("host")[since:] if one.payload.endswith(b"0x08")]
    return len(asked)


@pytest.mark.parametrize("angles", [(40.0, 40.0, 40.0, 40.0), (2.1, -2.1, 2.1, -2.1), (-170.0, 90.0, -15.5, 179.9)])
@scene(lambda angles: four(*angles))
async def test_servos_of_all_four_units_are_detected_on_one_bus_within_two_seconds_and_without_a_write(
    rig: Rig,
    angles: tuple[float, ...],
) -> None:
    servos = by_number(await rig.ready(4))
    await settled(servos, 2.0)
    assert [servo.position_unit.unit for servo in servos] == list(UNITS)
    await asyncio.sleep(0.3)
    for servo, angle in zip(servos, angles, strict=True):
        assert servo.angle_deg == pytest.approx(angle, abs=0.15)
        shown = json(await rig.call("GET", f"/servos/{servo.uid}"))
        unit = servo.position_unit.unit
        state = "confirmed" if unit == "hundred_degrees" else "conflict"
        assert (shown["position_unit"]["unit"], shown["position_unit"]["state"]) == (unit, state)
        assert servo.position_unit.sure is (state == "confirmed")
        assert "5 times" in shown["position_unit"]["evidence"]
        assert to_degrees(servo, to_position(servo, angle)) == pytest.approx(angle)
    assert rig.writes() == []
    assert rig.array_commands() == []
    told = [event.text for event in rig.events("position_unit") if event.level == "warning"]
    assert len(told) == 3, "the maker's unit is no news"
    assert {word for word in ("radians", "degrees", "tenths") for text in told if word in text}


@scene(*four(40.0, 40.0, 40.0, 40.0))
async def test_no_angle_is_ever_shown_or_sampled_by_a_wrong_unit(rig: Rig) -> None:
    servos = await rig.ready(4)
    await settled(servos, 2.0)
    seen = [one.value for one in rig.changes if isinstance(one, Sampled) and one.key == "current_angle"]
    assert len(seen) > 20
    assert all(value is not None and abs(value - 40) < 0.2 for value in seen), seen


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@scene(*four(40.0, -20.0, 80.0, 10.0))
async def test_with_a_fifth_of_all_frames_lost_all_four_are_detected_within_twenty_seconds(rig: Rig, seed: int) -> None:
    rig.bus.loss(20, seed=seed)
    servos = by_number(await rig.ready(4, within_s=120))
    await settled(servos, 20.0)
    assert [servo.position_unit.unit for servo in servos] == list(UNITS)
    assert rig.writes() == []


@pytest.mark.parametrize("unit", UNITS)
@scene(lambda unit: speaking(unit, 0.0))
async def test_at_zero_it_stays_assumed_without_asking_and_is_detected_when_the_horn_was_turned(
    rig: Rig, unit: PositionUnit
) -> None:
    (servo,) = await rig.ready()
    before = len(rig.transfers("host"))
    await asyncio.sleep(20)
    assert looks(rig, before) == 0
    assert servo.position_unit.sure
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/position-unit"))
    assert (shown["state"], shown["unit"]) == ("assumed", "hundred_degrees")
    now = asyncio.get_running_loop().time()
    assert rig.sim(servo).turn_manually(55.0, now)
    await settled([servo], 3.0)
    assert servo.position_unit.unit == unit
    assert servo.angle_deg == pytest.approx(55.0, abs=0.2)
    assert rig.writes() == []


@scene(speaking("radian", 40.0, number=1), speaking("degree", 1.0, number=2))
async def test_it_is_asked_seldom_where_it_cannot_be_measured_and_never_once_it_was(rig: Rig) -> None:
    await rig.ready(2)
    await asyncio.sleep(60)
    before = len(rig.transfers("host"))
    await asyncio.sleep(60)
    assert 9 <= looks(rig, before) <= 30
    measured = by_number(rig.host.fleet.all())[0]
    assert measured.position_unit.measured
    asked = [one for one in rig.transfers("host")[before:] if one.payload.endswith(b"0x08")]
    assert all(one.destination != measured.node_id for one in asked)


def test_a_unit_can_be_forced_and_measured_again_and_the_audit_says_who() -> None:
    async def scene(rig: Rig) -> None:
        (servo,) = await rig.ready()
        path = f"/servos/{servo.uid}/position-unit"
        shown = json(await rig.call("PUT", path, {"unit": "degree"}))
        assert (shown["unit"], shown["state"]) == ("degree", "forced")
        assert "this servo" in shown["evidence"]
        assert servo.position_unit.sure
        assert json(await rig.call("GET", path)) == shown
        assert json(await rig.call("GET", f"/servos/{servo.uid}"))["position_unit"] == shown
        shown = json(await rig.call("PUT", path, {"unit": None}))
        assert (shown["unit"], shown["state"]) == ("hundred_degrees", "assumed")
        await settled([servo], 2.0)
        assert servo.position_unit.unit == "radian"
        entries = json(await rig.call("GET", "/audit?action=position_unit"))
        assert [(one["before"], one["requested"]) for one in entries] == [("degree", None), ("radian", "degree")]
        problem(await rig.call("PUT", path, {"unit": "grad"}), "invalid_value", 422)
        lease = await rig.lease()
        problem(await rig.call("PUT", path, {"unit": "degree"}), "lease_held", 409)
        assert json(await rig.call("PUT", path, {"unit": "degree"}, lease=lease))["unit"] == "degree"

    async def measured_first(rig: Rig) -> None:
        await settled(await rig.ready(), 2.0)
        await scene(rig)

    play(measured_first, speaking("radian"))


@scene(speaking("radian"))
async def test_a_unit_is_not_changed_under_a_servo_that_is_commanded(rig: Rig) -> None:
    (servo,) = await rig.ready()
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    answer = await rig.call("PUT", f"/servos/{servo.uid}/position-unit", {"unit": "degree"}, lease=lease)
    problem(answer, "busy", 409)
    assert servo.position_unit.forced is None


@pytest.mark.parametrize("firmware", ["1.300", "1.010"])
def test_what_was_measured_is_kept_over_a_start_of_the_server_unless_the_firmware_changed(
    tmp_path: Path, firmware: str
) -> None:
    store = f"sqlite:///{tmp_path / 'kept.db'}"

    async def measure(rig: Rig) -> None:
        await settled(await rig.ready(), 2.0)

    async def again(rig: Rig) -> tuple[str, str, str]:
        (servo,) = await rig.ready()
        await asyncio.sleep(1)
        return servo.position_unit.state, servo.position_unit.unit, servo.position_unit.evidence.text

    play(measure, speaking("radian"), store=store)
    state, unit, evidence = play(again, speaking("radian", 0.0, firmware=firmware), store=store)
    if firmware == "1.300":
        assert (state, unit) == ("conflict", "radian")
        assert "5 times" in evidence
    else:
        assert (state, unit) == ("assumed", "hundred_degrees")
        assert play(again, speaking("radian", 0.0), store=store)[0] == "assumed", "void for good"


@scene(speaking("radian"), connect=False)
async def test_a_store_that_fails_keeps_nobody_from_measuring(rig: Rig) -> None:
    def fail(*_: object) -> None:
        raise OSError("disk full")

    rig.host.store.settings.get = rig.host.store.settings.put = fail  # pyright: ignore[reportAttributeAccessIssue]
    await rig.host.connect("memory:host", 1_000_000)
    await settled(await rig.ready(), 2.0)
    assert rig.events("store_failed")


def test_what_was_forced_is_kept_over_a_start_of_the_server_and_forgotten_with_the_servo(tmp_path: Path) -> None:
    store = f"sqlite:///{tmp_path / 'kept.db'}"

    async def force(rig: Rig) -> None:
        (servo,) = await rig.ready()
        json(await rig.call("PUT", f"/servos/{servo.uid}/position-unit", {"unit": "tenth_degree"}))

    async def forget(rig: Rig) -> None:
        (servo,) = await rig.ready()
        assert (servo.position_unit.unit, servo.position_unit.state) == ("tenth_degree", "forced")
        rig.bench.power(servo.uid, False)
        await asyncio.sleep(4)
        gone = await rig.call("DELETE", f"/inventory/{servo.uid}")
        assert gone.status_code == 204, gone.text
        assert rig.host.store.settings.get(f"position_unit.forced.{servo.uid}") is None

    play(force, speaking("radian", 0.0), store=store)
    play(forget, speaking("radian", 0.0), store=store)


@scene(speaking("degree"))
async def test_a_servo_that_restarts_keeps_its_unit(rig: Rig) -> None:
    (servo,) = await rig.ready()
    await settled([servo], 2.0)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(1)
    await rig.ready()
    assert (servo.position_unit.unit, servo.position_unit.state) == ("degree", "conflict")
    await asyncio.sleep(0.3)
    assert servo.angle_deg == pytest.approx(40.0, abs=0.2)


@scene(speaking("radian"))
async def test_a_servo_that_begins_to_speak_another_unit_is_in_conflict_and_only_0x08_tells_its_angle(rig: Rig) -> None:
    (servo,) = await rig.ready()
    await settled([servo], 2.0)
    rig.sim(servo).position_unit = "degree"
    row = servo.registers["current_angle"].parameter
    for _ in range(10):  # somebody watches the angle; hornbill asks no more by itself
        await rig.host.requests.read(servo, row)
        await asyncio.sleep(0.2)
    assert servo.position_unit.state == "conflict"
    assert not servo.position_unit.sure
    event = [one for one in rig.events("position_unit") if one.level == "warning"][-1]
    assert "as radians, now as degrees" in event.text
    await asyncio.sleep(3)
    now: dict[str, Any] = json(await rig.call("GET", f"/servos/{servo.uid}"))
    assert now["angle_deg"] == pytest.approx(40.0, abs=0.1)
    assert now["age_s"] < 7
    assert rig.writes() == []
    json(await rig.call("PUT", f"/servos/{servo.uid}/position-unit", {"unit": None}))
    await settled([servo], 2.0)
    assert servo.position_unit.unit == "degree"


@scene(*four(0.0, 0.0, 0.0, 0.0))
async def test_a_horn_that_is_driven_about_is_measured_as_what_it_is(rig: Rig) -> None:
    servos = by_number(await rig.ready(4))
    lease = await rig.lease()
    for servo in servos:
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    for angle in (30, -60, 90, 10, -90, 45, 3, -20):
        for servo in servos:
            body = {"type": "angle", "value": angle}
            await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease)
            assert servo.position_unit.measured in (None, rig.sim(servo).position_unit)
        await asyncio.sleep(0.45)
    await asyncio.sleep(3)
    assert [servo.position_unit.unit for servo in servos] == list(UNITS)
    assert all(servo.position_unit.measured for servo in servos)


@pytest.mark.parametrize("unit", UNITS)
def test_soft_start_is_seen_to_end_when_the_horn_is_at_zero_whatever_the_unit(unit: PositionUnit) -> None:
    async def scene(rig: Rig) -> None:
        async with asyncio.timeout(10):
            while not (found := rig.host.fleet.all()) or not found[0].soft_starting:
                await asyncio.sleep(0.02)
            while found[0].soft_starting:
                await asyncio.sleep(0.02)
        assert abs(rig.sim(found[0]).angle_deg) < 2
        assert not rig.sim(found[0]).soft_starting

    recipe = speaking(unit, 150.0)
    play(scene, replace(recipe, rom={"soft_start": 1, "torque_mode": 0}))


def test_the_setting_forces_a_unit_on_all_but_those_that_were_given_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HORNBILL_POSITION_UNIT", "tenth_degree")

    async def scene(rig: Rig) -> None:
        async def open_port(address: str, bitrate: int) -> CanPort:
            port = rig.cable.port(address, bitrate)
            await port.open()
            return port

        one, _ = await rig.ready(2)
        json(await rig.call("PUT", f"/servos/{one.uid}/position-unit", {"unit": "radian"}))
        await rig.host.disconnect()
        own = Settings().position_unit
        host = Host(CATALOG, rig.host.store, open_port, HostSettings(126, bytes(16), (0, 1), position_unit=own))
        await host.connect("memory:second", 1_000_000)
        await asyncio.sleep(5)
        shown = {
            servo.uid: (
                servo.position_unit.unit,
                servo.position_unit.state,
                host.position_units.evidence(servo).text[:21],
            )
            for servo in host.fleet.all()
        }
        await host.close()
        assert shown.pop(one.uid) == ("radian", "forced", "Forced for this servo")
        assert list(shown.values()) == [("tenth_degree", "forced", "Forced for all servos")]

    play(scene, speaking("degree", 0.0, number=1), speaking("degree", 0.0, number=2))


@pytest.mark.parametrize("degrees", [0.0, 0.1, 0.3, -0.3, 0.35, -0.4, 1.9])
@scene(lambda degrees: speaking("hundred_degrees", degrees))
async def test_a_horn_at_rest_anywhere_near_zero_is_never_shown_old(rig: Rig, degrees: float) -> None:
    (servo,) = await rig.ready()
    await asyncio.sleep(0.5)
    oldest = 0.0
    for _ in range(400):
        await asyncio.sleep(0.05)
        assert servo.angle_at is not None
        oldest = max(oldest, rig.host.base.now() - servo.angle_at)
    assert oldest < 0.25
    assert servo.angle_deg == pytest.approx(degrees, abs=0.06)

"""The unit of positions in Status: assumed as the maker's, measured on every servo, and forced on request."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import pytest

from behaviour.actions import move, power_cycle, torque
from behaviour.rig import CATALOG, Rig, json, play, problem, until
from behaviour.scene import scene
from hornbill.app.settings import Settings
from hornbill.domain.servo import PositionUnit
from hornbill.servo.device.position_unit import to_degrees, to_position
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.runtime.hub import Sampled
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.port import CanPort
from hornbill.wire.transfer import Transfer

UNITS: tuple[PositionUnit, ...] = get_args(PositionUnit.__value__)
LOOSE = {"soft_start": 0, "torque_mode": 1}
"""The horn stays where it is at a start, and can be turned manually."""


def speaking(
    unit: PositionUnit, angle_deg: float = 40.0, *, number: int = 1, firmware: str = "1.300", serial: int = 7
) -> Recipe:
    return Recipe(
        firmware=firmware, servo_id=number, node_id=10 + number, rom=LOOSE, angle_deg=angle_deg, serial=serial,
        behaviour=Behaviour(position_unit=unit), uid=bytes([number]) * 16,
    )  # fmt: skip


def four(*angles: float) -> list[Recipe]:
    return [speaking(unit, angle, number=at) for at, (unit, angle) in enumerate(zip(UNITS, angles, strict=True), 1)]


async def measured(*servos: Servo, within_s: float = 2.0) -> None:
    """Wait until the units of these servos are measured."""
    await until(lambda: all(servo.position_unit.measured for servo in servos), within_s, every_s=0.05)


async def ready(rig: Rig, count: int = 1, within_s: float = 30.0) -> list[Servo]:
    """The servos in the order of their numbers."""
    return sorted(await rig.ready(count, within_s=within_s), key=lambda servo: servo.uid)


def state(servo: Servo) -> tuple[str, str]:
    return servo.position_unit.unit, servo.position_unit.state


def reads_of_0x08(rig: Rig, since: int) -> list[Transfer]:
    return [one for one in rig.transfers("host")[since:] if one.payload.endswith(b"0x08")]


async def force(rig: Rig, servo: Servo, unit: str | None, lease: str | None = None) -> dict[str, Any]:
    return json(await rig.call("PUT", f"/servos/{servo.uid}/position-unit", {"unit": unit}, lease=lease))


@pytest.mark.parametrize("angles", [(40.0, 40.0, 40.0, 40.0), (2.1, -2.1, 2.1, -2.1), (-170.0, 90.0, -15.5, 179.9)])
@scene(lambda angles: four(*angles))
async def test_all_four_units_are_measured_in_two_seconds(
    rig: Rig, servos: list[Servo], angles: tuple[float, ...]
) -> None:
    await measured(*servos)
    assert [servo.position_unit.unit for servo in servos] == list(UNITS)
    await asyncio.sleep(0.3)
    for servo, angle in zip(servos, angles, strict=True):
        assert servo.angle_deg == pytest.approx(angle, abs=0.15)
        unit = servo.position_unit.unit
        expected = "confirmed" if unit == "hundred_degrees" else "conflict"
        shown = json(await rig.call("GET", f"/servos/{servo.uid}"))["position_unit"]
        assert (shown["unit"], shown["state"]) == (unit, expected)
        assert servo.position_unit.sure is (expected == "confirmed")
        assert "5 times" in shown["evidence"]
        assert to_degrees(servo, to_position(servo, angle)) == pytest.approx(angle)
    assert rig.writes() == []
    assert rig.array_commands() == []
    warnings = [event.text for event in rig.events("position_unit") if event.level == "warning"]
    assert len(warnings) == 3, "none for the maker's unit"
    assert {word for word in ("radians", "degrees", "tenths") for text in warnings if word in text}
    seen = [one.value for one in rig.changes if isinstance(one, Sampled) and one.key == "current_angle"]
    assert len(seen) > 20
    if set(angles) == {40.0}:
        assert all(value is not None and abs(value - 40) < 0.2 for value in seen), "none in a wrong unit"


@pytest.mark.parametrize("seed", [1, 2])
@scene(*four(40.0, -20.0, 80.0, 10.0))
async def test_with_20_percent_frame_loss_all_four_are_measured_within_twenty_seconds(rig: Rig, seed: int) -> None:
    rig.bus.loss(20, seed=seed)
    servos = await ready(rig, 4, within_s=120)
    await measured(*servos, within_s=20.0)
    assert [servo.position_unit.unit for servo in servos] == list(UNITS)
    assert rig.writes() == []


@scene(*four(0.0, 0.0, 0.0, 0.0))
async def test_at_zero_the_unit_is_assumed_without_reads_until_the_horn_is_turned(
    rig: Rig, servos: list[Servo]
) -> None:
    before = len(rig.transfers("host"))
    await asyncio.sleep(20)
    assert reads_of_0x08(rig, before) == []
    now = asyncio.get_running_loop().time()
    for servo in servos:
        assert servo.position_unit.sure
        shown = json(await rig.call("GET", f"/servos/{servo.uid}/position-unit"))
        assert (shown["state"], shown["unit"]) == ("assumed", "hundred_degrees")
        assert rig.sim(servo).turn_manually(55.0, now)
    await measured(*servos, within_s=3.0)
    assert [servo.position_unit.unit for servo in servos] == list(UNITS)
    assert [servo.angle_deg for servo in servos] == pytest.approx([55.0] * 4, abs=0.2)
    assert rig.writes() == []


@scene(speaking("radian", 40.0, number=1), speaking("degree", 1.0, number=2))
async def test_0x08_is_read_rarely_where_the_unit_cannot_be_measured_and_never_once_it_is(rig: Rig) -> None:
    settled, _ = await ready(rig, 2)
    await asyncio.sleep(60)
    before = len(rig.transfers("host"))
    await asyncio.sleep(60)
    reads = reads_of_0x08(rig, before)
    assert 9 <= len(reads) <= 30
    assert settled.position_unit.measured
    assert all(one.destination != settled.node_id for one in reads)


@scene(speaking("radian"))
async def test_a_unit_can_be_forced_and_measured_again_with_audit_rows(rig: Rig, servo: Servo) -> None:
    await measured(servo)
    shown = await force(rig, servo, "degree")
    assert (shown["unit"], shown["state"]) == ("degree", "forced")
    assert "this servo" in shown["evidence"]
    assert servo.position_unit.sure
    path = f"/servos/{servo.uid}/position-unit"
    assert json(await rig.call("GET", path)) == shown
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["position_unit"] == shown
    shown = await force(rig, servo, None)
    assert (shown["unit"], shown["state"]) == ("hundred_degrees", "assumed")
    await measured(servo)
    assert servo.position_unit.unit == "radian"
    entries = json(await rig.call("GET", "/audit?action=position_unit"))
    assert [(one["before"], one["requested"]) for one in entries] == [("degree", None), ("radian", "degree")]
    problem(await rig.call("PUT", path, {"unit": "grad"}), "invalid_value", 422)
    lease = await rig.lease()
    problem(await rig.call("PUT", path, {"unit": "degree"}), "lease_held", 409)
    assert (await force(rig, servo, "degree", lease))["unit"] == "degree"
    await force(rig, servo, None, lease)
    await torque(rig, servo, "on", lease)
    problem(await rig.call("PUT", path, {"unit": "degree"}, lease=lease), "busy", 409)
    assert servo.position_unit.forced is None


@pytest.mark.parametrize("firmware", ["1.300", "1.010"])
def test_a_measured_unit_is_stored_until_the_firmware_changes(tmp_path: Path, firmware: str) -> None:
    store = f"sqlite:///{tmp_path / 'store.db'}"

    async def measure(rig: Rig) -> None:
        await measured(*await rig.ready())

    async def again(rig: Rig) -> tuple[tuple[str, str], str]:
        (servo,) = await rig.ready()
        await asyncio.sleep(1)
        return state(servo), servo.position_unit.evidence.text

    play(measure, speaking("radian"), store=store)
    found, evidence = play(again, speaking("radian", 0.0, firmware=firmware), store=store)
    if firmware == "1.300":
        assert found == ("radian", "conflict")
        assert "5 times" in evidence
    else:
        assert found == ("hundred_degrees", "assumed")
        assert play(again, speaking("radian", 0.0), store=store)[0][1] == "assumed", "discarded for good"


@scene(speaking("radian"), connect=False)
async def test_a_failing_store_does_not_prevent_measuring(rig: Rig) -> None:
    def fail(*_: object) -> None:
        raise OSError("disk full")

    rig.host.store.settings.get = rig.host.store.settings.put = fail  # pyright: ignore[reportAttributeAccessIssue]
    await rig.host.connect("memory:host", 1_000_000)
    await measured(*await rig.ready())
    assert rig.events("store_failed")


def test_a_forced_unit_is_stored_until_the_servo_is_removed(tmp_path: Path) -> None:
    async def first(rig: Rig) -> None:
        await force(rig, (await rig.ready())[0], "tenth_degree")

    async def second(rig: Rig) -> None:
        (servo,) = await rig.ready()
        assert state(servo) == ("tenth_degree", "forced")
        rig.bench.power(servo.uid, False)
        await asyncio.sleep(4)
        assert (await rig.call("DELETE", f"/inventory/{servo.uid}")).status_code == 204
        assert rig.host.store.settings.get(f"position_unit.forced.{servo.uid}") is None

    store = f"sqlite:///{tmp_path / 'store.db'}"
    play(first, speaking("radian", 0.0), store=store)
    play(second, speaking("radian", 0.0), store=store)


@scene(speaking("degree"))
async def test_a_servo_keeps_its_unit_over_a_restart(rig: Rig, servo: Servo) -> None:
    await measured(servo)
    await power_cycle(rig, servo.uid, 4)
    await asyncio.sleep(1)
    await rig.ready()
    assert state(servo) == ("degree", "conflict")
    await asyncio.sleep(0.3)
    assert servo.angle_deg == pytest.approx(40.0, abs=0.2)


@scene(speaking("radian"))
async def test_after_a_change_of_unit_only_0x08_gives_the_angle(rig: Rig, servo: Servo) -> None:
    await measured(servo)
    rig.sim(servo).position_unit = "degree"
    for _ in range(10):  # a client reads the angle; hornbill no longer does
        await rig.host.requests.read(servo, servo.registers["current_angle"].parameter)
        await asyncio.sleep(0.2)
    assert servo.position_unit.state == "conflict"
    assert not servo.position_unit.sure
    event = [one for one in rig.events("position_unit") if one.level == "warning"][-1]
    assert "as radians, now as degrees" in event.text
    await asyncio.sleep(3)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))
    assert shown["angle_deg"] == pytest.approx(40.0, abs=0.1)
    assert shown["age_s"] < 7
    assert rig.writes() == []
    await force(rig, servo, None)
    await measured(servo)
    assert servo.position_unit.unit == "degree"


@scene(*four(0.0, 0.0, 0.0, 0.0))
async def test_a_moving_horn_is_measured_correctly(rig: Rig, servos: list[Servo], lease: str) -> None:
    for servo in servos:
        await torque(rig, servo, "on", lease)
    for angle in (30, -60, 90, 10, -90, 45, 3, -20):
        for servo in servos:
            await move(rig, servo, lease, angle)
            assert servo.position_unit.measured in (None, rig.sim(servo).position_unit)
        await asyncio.sleep(0.45)
    await asyncio.sleep(3)
    assert [servo.position_unit.unit for servo in servos] == list(UNITS)
    assert all(servo.position_unit.measured for servo in servos)


@scene(*(replace(recipe, rom={"soft_start": 1, "torque_mode": 0}) for recipe in four(150.0, 150.0, 150.0, 150.0)))
async def test_the_end_of_soft_start_is_detected_in_any_unit(rig: Rig) -> None:
    seen: set[str] = set()
    ended: set[str] = set()
    async with asyncio.timeout(10):
        while len(ended) < 4:
            for servo in rig.host.fleet.all():
                if servo.soft_starting:
                    seen.add(servo.uid)
                elif servo.uid in seen - ended:
                    ended.add(servo.uid)
                    assert abs(rig.sim(servo).angle_deg) < 2
                    assert not rig.sim(servo).soft_starting
            await asyncio.sleep(0.02)


@scene(speaking("degree", 0.0, number=1), speaking("degree", 0.0, number=2))
async def test_the_setting_forces_a_unit_on_all_servos_without_their_own(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HORNBILL_POSITION_UNIT", "tenth_degree")

    async def open_port(address: str, bitrate: int) -> CanPort:
        port = rig.cable.port(address, bitrate)
        await port.open()
        return port

    one, other = await ready(rig, 2)
    await force(rig, one, "radian")
    await rig.host.disconnect()
    unit = Settings().position_unit
    host = Host(CATALOG, rig.host.store, open_port, HostSettings(126, bytes(16), (0, 1), position_unit=unit))
    await host.connect("memory:second", 1_000_000)
    await asyncio.sleep(5)
    shown = {servo.uid: (*state(servo), host.position_units.evidence(servo).text[:21]) for servo in host.fleet.all()}
    await host.close()
    assert shown == {
        one.uid: ("radian", "forced", "Forced for this servo"),
        other.uid: ("tenth_degree", "forced", "Forced for all servos"),
    }

"""Motion only under a lease, rejected with a reason, and kept from the servo's timeout (sections 4.1 to 4.3, 4.19)."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.actions import move, power_cycle, torque, write
from behaviour.losing import now
from behaviour.rig import PLAIN, Response, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.motion.settle import wait_settled
from hornbill.servo.runtime.hub import LogEvent
from hornbill.sim.bench.recipe import Recipe

SPEED_MODE = Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12, rom={"speed_torque_control": 1})


async def command(
    rig: Rig, servo: Servo, lease: str | None, value: float, kind: str = "angle", **more: object
) -> Response:
    return await rig.call("POST", f"/servos/{servo.uid}/command", {"type": kind, "value": value, **more}, lease=lease)


@scene(*(replace(PLAIN, servo_id=n, node_id=10 + n) for n in (1, 2, 3)))
async def test_connecting_reading_and_watching_move_nothing(rig: Rig) -> None:
    for servo in await rig.ready(3):
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true"))
        subscription = {"channels": ["current_angle", "current_speed"], "rate_hz": 20}
        json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", subscription))
    await rig.lease(ttl_s=5)
    await asyncio.sleep(10)
    assert rig.writes() == []
    assert rig.array_commands() == []


@scene()
async def test_a_command_needs_a_lease_and_the_error_names_how_to_get_one(rig: Rig, servo: Servo) -> None:
    refused = problem(await command(rig, servo, None, 10), "lease_required", 428)
    assert "POST /api/v1/leases" in refused["detail"]
    lease = await rig.lease(ttl_s=20)
    refused = problem(await command(rig, servo, None, 10), "lease_held", 409)
    assert refused["holder"] == "test"
    assert 0 < refused["expires_in_s"] <= 20
    problem(await command(rig, servo, "f" * 32, 10), "lease_held", 409)
    put = await rig.call("PUT", f"/servos/{servo.uid}/parameters/command_angle", {"value": 10})
    problem(put, "lease_held", 409)
    for kind in ("speed", "torque"):
        assert "0x25" in problem(await command(rig, servo, lease, 20, kind), "mode_off", 409)["detail"]
    assert rig.writes() == []
    await move(rig, servo, lease, 10)


@scene()
async def test_wait_settled_reports_whether_and_when_it_settled_or_what_was_missing(
    rig: Rig, servo: Servo, lease: str
) -> None:
    settled = await move(rig, servo, lease, 30, wait="settled", band_deg=0.5, dwell_s=0.2)
    assert settled["settled"] is True
    assert abs(settled["angle_deg"] - 30) <= 0.5
    assert 0.02 < settled["settle_time_s"] < 2
    assert abs(rig.sim(servo).angle_deg - 30) < 1
    far = await move(rig, servo, lease, 170, wait="settled", timeout_s=0.1)
    assert (far["settled"], far["settle_time_s"]) == (False, None)
    assert (far["unmet"], far["in_band_s"]) == ("band", 0.0)
    brief = await move(rig, servo, lease, 20, wait="settled", timeout_s=3, dwell_s=9)
    assert (brief["settled"], brief["unmet"]) == (False, "dwell")
    assert 1.5 < brief["in_band_s"] < 3
    assert abs(brief["angle_deg"] - 20) <= 0.5
    rig.sim(servo).conditions.mute = True
    found = await wait_settled(
        rig.host.requests, servo, rig.host.base, 0, band_deg=1, dwell_s=0.2, timeout_s=1, still_allowed=lambda: None
    )
    assert (found.settled, found.unmet, found.angle_deg) == (False, "samples", None)


@pytest.mark.parametrize(("ttl", "new_lease"), [(0.5, False), (2.0, False), (1.0, True)])
@scene()
async def test_torque_is_off_within_100_ms_of_expiry_despite_a_new_lease(
    rig: Rig, servo: Servo, ttl: float, new_lease: bool
) -> None:
    lease = await rig.lease(ttl_s=ttl)
    expiry = now() + ttl
    await move(rig, servo, lease)
    await asyncio.sleep(expiry - 0.01 - now())
    assert rig.sim(servo).output == 0
    await asyncio.sleep(0.0101)
    if new_lease:
        await rig.lease(ttl_s=5)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1
    assert servo.raw("torque_mode") == 1
    assert any("Torque goes off" in change.text for change in rig.changes if isinstance(change, LogEvent))
    code, status = ("lease_held", 409) if new_lease else ("lease_required", 428)
    problem(await command(rig, servo, lease, 0), code, status)


@scene()
async def test_torque_off_is_retried_until_the_servo_acknowledges(rig: Rig, servo: Servo) -> None:
    await move(rig, servo, await rig.lease(ttl_s=1))
    rig.bus.loss(100)
    await asyncio.sleep(2)
    rig.bus.loss(0)
    await asyncio.sleep(0.5)
    assert servo.raw("torque_mode") == 1


@scene(PLAIN, SPEED_MODE)
async def test_a_released_lease_turns_torque_off_only_where_it_commanded(rig: Rig) -> None:
    one, other = await rig.ready(2)
    lease = await rig.lease()
    await move(rig, one, lease)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.sim(one).output == 1
    assert other.raw("torque_mode") == 0
    assert json(await rig.call("GET", "/leases")) == []


@scene()
async def test_the_timeout_of_the_servo_does_not_expire_while_the_lease_is_renewed(rig: Rig, servo: Servo) -> None:
    """Default of 0x26 and 0x27: torque off after 1,000 ms without a command."""
    lease = await rig.lease(ttl_s=2)
    await move(rig, servo, lease)
    for _ in range(8):
        await asyncio.sleep(1)
        json(await rig.call("PUT", f"/leases/{lease}"))
        assert rig.sim(servo).output == 0
    assert abs(rig.sim(servo).angle_deg - 20) < 1


@scene(replace(PLAIN, rom={"angle_limit_cw": 450}))
async def test_an_angle_outside_the_limits_of_the_servo_is_rejected_unless_clamped(
    rig: Rig, servo: Servo, lease: str
) -> None:
    refused = problem(await command(rig, servo, lease, 60), "out_of_range", 422)
    assert (refused["maximum"], refused["unit"], refused["requested"]) == (45.0, "°", 60)
    assert rig.writes() == []
    clamped = await move(rig, servo, lease, 60, clamp=True)
    assert (clamped["clamped"], clamped["value"]) == (True, 45.0)
    assert (await move(rig, servo, lease, 10.06))["value"] == 10.1
    problem(await command(rig, servo, lease, 45.06), "out_of_range", 422)
    for huge in (1e308, -1e308):
        assert (await move(rig, servo, lease, huge, clamp=True))["clamped"] is True


@scene(SPEED_MODE)
async def test_a_speed_turns_the_horn_and_values_are_rounded_to_the_resolution_of_the_servo(
    rig: Rig, servo: Servo, lease: str
) -> None:
    json(await command(rig, servo, lease, 60, "speed"))
    await asyncio.sleep(1.5)
    assert 50 < rig.sim(servo).speed_rpm < 70
    path = f"/servos/{servo.uid}/parameters"
    reading = json(await rig.call("GET", f"{path}/command_angle"))
    assert (reading["value"], reading["raw"]) == (None, 555_555_555)
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["command_deg"] is None
    for value, kind, more, sent in (
        (8.660254, "angle", {}, 8.7),
        (-0.04, "angle", {}, 0),
        (12.34, "angle", {"clamp": True}, 12.3),
        (9.99, "angle", {"profile": {"speed_deg_s": 200.0}}, 10.0),
        (20.4, "speed", {}, 20),
        (20.6, "speed", {"hold": {"for_s": 0.5}}, 21),
    ):
        assert json(await command(rig, servo, lease, value, kind, **more))["value"] == sent
    put = await rig.call("PUT", f"{path}/command_angle", {"value": 5.5555}, lease=lease)
    assert json(put)["value"] == 5.6
    problem(await rig.call("PUT", f"{path}/origin", {"value": 0.05}, lease=lease), "invalid_value", 422)


@scene(SPEED_MODE)
async def test_a_rejection_names_the_limit_of_the_servo_or_of_its_model(rig: Rig, servo: Servo, lease: str) -> None:
    refused = problem(await command(rig, servo, lease, 400), "out_of_range", 422)
    assert "beyond the Angle limit CW of" in refused["detail"]
    assert "179.9° (0x38)" in refused["detail"]
    assert refused["limit"] == "angle_limit_cw"
    refused = problem(await command(rig, servo, lease, -5000, "speed"), "out_of_range", 422)
    assert "is below this model's limit of −" in refused["detail"]
    assert "limit" not in refused
    await write(rig, servo, lease, speed_limit_ccw=-50)
    refused = problem(await command(rig, servo, lease, -60, "speed"), "out_of_range", 422)
    assert "beyond the Speed limit CCW of" in refused["detail"]
    assert "(0x3B)" in refused["detail"]


@scene(replace(PLAIN, angle_deg=170))
async def test_a_servo_in_soft_start_or_protection_is_not_commanded(rig: Rig, lease: str) -> None:
    await until(lambda: any(one.state is State.SOFT_START for one in rig.host.fleet.all()), 5)
    servo = rig.host.fleet.all()[0]
    assert problem(await command(rig, servo, lease, 1), "busy", 409)["state"] == "soft_start"
    await rig.ready()
    rig.sim(servo).conditions.temperature_c = 95
    await until(lambda: servo.state is State.PROTECTED, 10)
    assert problem(await command(rig, servo, lease, 1), "busy", 409)["state"] == "protected"


@scene()
async def test_torque_mode_is_no_boolean_and_on_needs_a_lease_and_holds_the_horn_where_it_is(
    rig: Rig, servo: Servo, lease: str
) -> None:
    path = f"/servos/{servo.uid}/parameters"
    for wrong in (True, False, 0, 1, "ON", None):
        put = await rig.call("PUT", f"{path}/torque_mode", {"value": wrong}, lease=lease)
        problem(put, "invalid_value", 422)
        problem(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": wrong}), "invalid_value", 422)
    problem(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}), "lease_held", 409)
    assert rig.writes() == []
    json(await rig.call("PUT", f"{path}/torque_mode", {"value": "off"}, lease=lease))
    assert [write[2] for write in rig.writes() if write[1] == "0x20"] == [1]
    assert rig.bench.turn_manually(servo.uid, 40.0)
    assert (await torque(rig, servo, "on", lease))["value"] == "on"
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 0, "kept on while the lease is valid"
    assert abs(rig.sim(servo).angle_deg - 40) < 1
    json(await rig.call("DELETE", f"/leases/{lease}"))
    before = len(rig.writes())
    body = {"values": {"angle_dead_band": 1.0, "torque_mode": "on"}}
    problem(await rig.call("PATCH", path, body), "lease_required", 428)
    assert len(rig.writes()) == before
    await write(rig, servo, await rig.lease(), angle_dead_band=1.0, torque_mode="on")
    assert servo.raw("torque_mode") == 0


@scene()
async def test_a_servo_that_restarts_under_command_is_not_commanded_again(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3)
    await move(rig, servo, await rig.lease(), 90)
    await asyncio.sleep(1)
    await power_cycle(rig, servo.uid, 0.7)
    fastest = 0.0
    for _ in range(3000):
        await asyncio.sleep(0.001)
        fastest = max(fastest, abs(rig.sim(servo).speed_rpm))
    assert fastest < 40, "soft start is slow"
    assert servo.state is not State.OFFLINE


@scene()
async def test_a_wait_ends_if_the_servo_is_lost_or_gets_another_command(rig: Rig, servo: Servo, lease: str) -> None:

    async def waiting() -> asyncio.Task[Response]:
        task = asyncio.create_task(command(rig, servo, lease, 20, wait="settled", dwell_s=9, timeout_s=30))
        await asyncio.sleep(2)
        return task

    waiter = await waiting()
    rig.bus.loss(100)
    await asyncio.sleep(2)
    rig.bus.loss(0)
    assert "before it settled: " in problem(await waiter, "no_response", 504)["detail"]
    await asyncio.sleep(1)
    await torque(rig, servo, "on", lease)
    waiter = await waiting()
    await rig.host.requests.write(servo, servo.registers["command_angle"].parameter, 0)
    assert "has a different command" in problem(await waiter, "busy", 409)["detail"]


@scene()
async def test_torque_that_the_servo_turned_off_at_its_timeout_is_not_turned_on_again(rig: Rig, servo: Servo) -> None:
    await move(rig, servo, await rig.lease(), 90)
    await asyncio.sleep(1)
    rig.bus.loss(100)
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1
    rig.bus.loss(0)
    await asyncio.sleep(5)
    assert rig.sim(servo).output == 1
    assert rig.events("command_ended")


@scene()
async def test_the_old_target_is_not_sent_after_the_new_one(rig: Rig, servo: Servo, lease: str) -> None:
    await move(rig, servo, lease, 10)
    await asyncio.sleep(0.3)
    rig.sim(servo).conditions.drop_responses_pct = 100
    moving = asyncio.create_task(move(rig, servo, lease, 50))
    await asyncio.sleep(0.31)
    rig.sim(servo).conditions.drop_responses_pct = 0
    assert (await moving)["value"] == 50.0
    await asyncio.sleep(1)
    sent = [raw for _, name, raw in rig.writes() if name == "0x00"]
    assert 100 not in sent[sent.index(500) :]
    assert rig.sim(servo).output == 0


@scene()
async def test_torque_on_discards_the_earlier_command(rig: Rig, servo: Servo, lease: str) -> None:
    await move(rig, servo, lease, 60)
    await asyncio.sleep(1)
    rig.sim(servo).memory.put(0x20, 1)  # another tool turned it off
    rig.sim(servo)._device.commander.configured()  # pyright: ignore[reportPrivateUsage]
    rig.bench.turn_manually(servo.uid, 5.0)
    rig.bus.history.clear()
    rig.sim(servo).conditions.drop_responses_pct = 60
    while (await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease)).status_code != 200:
        pass
    rig.sim(servo).conditions.drop_responses_pct = 0
    await asyncio.sleep(2)
    assert abs(rig.sim(servo).angle_deg - 5) < 1
    assert 600 not in {raw for _, name, raw in rig.writes() if name == "0x00"}


@scene(PLAIN, SPEED_MODE)
async def test_torque_cannot_be_turned_on_while_the_bus_is_being_disconnected(rig: Rig) -> None:
    silent, other = await rig.ready(2)
    lease = await rig.lease()
    await torque(rig, other, "off")
    await move(rig, silent, lease, 5)
    rig.sim(silent).conditions.drop_responses_pct = 100
    leaving = asyncio.create_task(rig.call("DELETE", "/bus"))
    await asyncio.sleep(0.05)
    problem(await rig.call("POST", f"/servos/{other.uid}/torque", {"mode": "on"}, lease=lease), "bus_disconnected", 503)
    json(await leaving)
    assert rig.sim(other).output == 1
    assert any(event.uid == silent.uid for event in rig.events("no_response")), "not confirmed, and reported"


@scene()
async def test_leases_expire_after_an_error_in_the_loop_that_watches_them(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    await move(rig, servo, await rig.lease(ttl_s=1), 5)

    def fail(_now: float) -> None:
        raise RuntimeError("a defect")

    monkeypatch.setattr(rig.host.fleet, "tick", fail)
    await asyncio.sleep(0.2)
    monkeypatch.undo()
    await asyncio.sleep(1)
    assert rig.sim(servo).output == 1

"""Streams of setpoints: together, at their rate, counted, under a lease, and refused where the bus has no room."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from itertools import pairwise

import pytest

from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.bursts import Bursts, Prepared
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid
from hornbill.wire.messages import ArrayCommand

TURNED = [Recipe("BLA21-06U-A0", "1.300", servo_id=n, node_id=10 + n, angle_deg=20.0 + n) for n in range(1, 5)]
CROWD = [Recipe("BLA21-06U-A0", "1.300", servo_id=n, node_id=n, angle_deg=15.0 + n / 4) for n in range(1, 61)]
GENTLE = {"speed_deg_s": 40, "accel_deg_s2": 160}


async def with_torque(rig: Rig, count: int) -> tuple[list[Servo], str]:
    """Servos with torque on under a lease."""
    servos = await rig.ready(count, within_s=120)
    lease = await rig.lease()
    for servo in servos:
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    return servos, lease


async def begun(rig: Rig, servos: list[Servo], lease: str, rate_hz: float = 50.0) -> str:
    body = {"uids": [servo.uid for servo in servos], "rate_hz": rate_hz}
    return str(json(await rig.call("POST", "/streams", body, lease=lease), 201)["id"])


def bursts(rig: Rig) -> list[tuple[float, list[tuple[int, float]]]]:
    """Every ArrayCommand on the bus: its time, and the values by servo ID."""
    found: list[tuple[float, list[tuple[int, float]]]] = []
    for transfer in rig.array_commands():
        message = ArrayCommand.decode(transfer.payload)
        assert message is not None
        found.append((transfer.at, [(one.actuator_id, one.command_value) for one in message.commands]))
    return found


@scene(*TURNED)
async def test_a_stream_holds_until_values_arrive_and_then_all_servos_follow_together(rig: Rig) -> None:
    servos, lease = await with_torque(rig, 4)
    before = {servo.uid: rig.sim(servo).angle_deg for servo in servos}
    stream = await begun(rig, servos, lease)
    await asyncio.sleep(1)
    for servo in servos:
        assert abs(rig.sim(servo).angle_deg - before[servo.uid]) < 0.6
    for step in range(1, 51):
        values = {servo.uid: before[servo.uid] + 0.4 * step for servo in servos}
        json(await rig.call("PUT", f"/streams/{stream}", {"values": values}, lease=lease))
        await asyncio.sleep(0.02)
    await asyncio.sleep(0.5)
    for servo in servos:
        assert abs(rig.sim(servo).angle_deg - before[servo.uid] - 20) < 1
    shown = json(await rig.call("GET", f"/streams/{stream}"))
    assert shown["misses"] == 0
    assert 120 < shown["sent"] < 135
    sent = bursts(rig)
    assert all(len(commands) == 4 for _, commands in sent)
    gaps = [later - earlier for (earlier, _), (later, _) in pairwise(sent)]
    assert max(gaps) < 0.03
    now = rig.host.base.now
    rig.host.base.now = lambda: now() + 0.2  # the clock goes on, and no task runs
    await asyncio.sleep(0.1)
    late = json(await rig.call("GET", f"/streams/{stream}"))
    assert late["misses"] == 10, "counted and not caught up"
    assert late["worst_late_ms"] >= 180
    assert late["sent"] - shown["sent"] <= 7
    assert late["ended"] is None


@pytest.mark.release
@scene(*CROWD)
async def test_sixty_servos_at_50_hz_start_within_5_ms_and_a_rate_beyond_the_bus_is_refused(rig: Rig) -> None:
    servos, lease = await with_torque(rig, 60)
    body = {"uids": [servo.uid for servo in servos], "rate_hz": 150}
    refused = problem(await rig.call("POST", "/streams", body, lease=lease), "bus_budget", 409)
    assert rig.array_commands() == []
    assert refused["bus_share"] > refused["left"]
    possible = refused["possible_hz"]
    assert f"{possible} Hz" in refused["detail"]
    fastest = await begun(rig, servos, lease, possible)
    await rig.call("DELETE", f"/streams/{fastest}", lease=lease)
    stream = await begun(rig, servos, lease)
    await asyncio.sleep(2)
    shown = json(await rig.call("GET", f"/streams/{stream}"))
    assert shown["misses"] == 0
    assert shown["sent"] >= 99
    assert 0.15 < shown["bus_share"] < 0.40
    assert 0 < shown["worst_skew_ms"] < 5
    by_burst = bursts(rig)[-4:]
    assert [len(commands) for _, commands in by_burst] == [15, 15, 15, 15]
    assert {number for _, commands in by_burst for number, _ in commands} == set(range(1, 61))


@scene(*TURNED)
async def test_a_stream_needs_a_lease_and_servos_that_are_in_no_other_stream(rig: Rig) -> None:
    servos, lease = await with_torque(rig, 4)
    uids = [servo.uid for servo in servos]
    problem(await rig.call("POST", "/streams", {"uids": uids}), "lease_held", 409)
    stream = await begun(rig, servos[:2], lease)
    problem(await rig.call("POST", "/streams", {"uids": uids[1:]}, lease=lease), "busy", 409)
    other = {"values": {uids[3]: 25.0}}
    problem(await rig.call("PUT", f"/streams/{stream}", other, lease=lease), "invalid_value", 422)
    far = {"values": {uids[0]: 5.0, uids[1]: 9000.0}}
    problem(await rig.call("PUT", f"/streams/{stream}", far, lease=lease), "out_of_range", 422)
    await asyncio.sleep(0.5)
    assert abs(rig.sim(servos[0]).angle_deg) < 1.5  # all or nothing
    path = f"/servos/{uids[0]}/command"
    refused = problem(await rig.call("POST", path, {"type": "angle", "value": 0}, lease=lease), "busy", 409)
    assert "stream" in refused["detail"]
    problem(await rig.call("GET", "/streams/nothing"), "unknown_stream", 404)


async def release(rig: Rig, lease: str, _page: Socket) -> None:
    json(await rig.call("DELETE", f"/leases/{lease}"))


async def press_stop(rig: Rig, _lease: str, _page: Socket) -> None:
    rig.host.stop.now("off", "test", "")


async def close_page(_rig: Rig, _lease: str, page: Socket) -> None:
    await page.close()


@pytest.mark.parametrize("end", [release, press_stop, close_page])
@scene(*TURNED)
async def test_the_lease_stop_and_a_closed_page_end_a_stream_and_turn_torque_off(
    rig: Rig, end: Callable[[Rig, str, Socket], Awaitable[None]]
) -> None:
    servos, lease = await with_torque(rig, 4)
    page = Socket(rig.app)
    page.send(type="heartbeat", lease=lease)
    stream = await begun(rig, servos, lease)
    values = {servo.uid: 90.0 for servo in servos}
    page.send(type="stream", lease=lease, id=stream, values=values, profile=GENTLE)
    await asyncio.sleep(0.51)
    assert json(await rig.call("GET", f"/streams/{stream}"))["moving"] is True
    await end(rig, lease, page)
    at = asyncio.get_running_loop().time()
    await asyncio.sleep(1)
    assert [one for one, _ in bursts(rig) if one > at + 0.002] == [], "it ends before the next burst"
    assert [rig.sim(servo).output for servo in servos] == [1, 1, 1, 1]
    shown = json(await rig.call("GET", f"/streams/{stream}"))
    assert shown["ended"]
    assert shown["ended_code"] == "problem"
    assert shown["moving"] is False
    if end is not press_stop:
        refused = await rig.call("PUT", f"/streams/{stream}", {"values": {servos[0].uid: 1.0}}, lease=await rig.lease())
        problem(refused, "busy", 409)


@scene(*TURNED)
async def test_a_restarted_servo_ends_the_stream_and_is_named(rig: Rig) -> None:
    servos, lease = await with_torque(rig, 4)
    stream = await begun(rig, servos, lease)
    await asyncio.sleep(4)
    uid = servos[2].uid
    json(await rig.call("PATCH", f"/sim/servos/{uid}", {"power": "off"}))
    await asyncio.sleep(0.5)
    json(await rig.call("PATCH", f"/sim/servos/{uid}", {"power": "on"}))
    await asyncio.sleep(4)
    shown = json(await rig.call("GET", f"/streams/{stream}"))
    assert servos[2].title in shown["ended"]
    assert shown["ended_params"]["servo"] == servos[2].title
    assert rig.events("stream_ended")


@scene(*TURNED)
async def test_with_a_profile_all_servos_keep_the_speed_limit_and_arrive_together(rig: Rig) -> None:
    servos, lease = await with_torque(rig, 4)
    stream = await begun(rig, servos, lease)
    goals = {servo.uid: 10.0 * (n + 1) + 21 for n, servo in enumerate(servos)}
    body = {"values": goals, "profile": GENTLE}
    assert json(await rig.call("PUT", f"/streams/{stream}", body, lease=lease))["moving"] is True
    fastest = 0.0
    there: dict[str, float] = {}
    loop = asyncio.get_running_loop()
    began = loop.time()
    while json(await rig.call("GET", f"/streams/{stream}"))["moving"]:
        for servo in servos:
            sim = rig.sim(servo)
            fastest = max(fastest, abs(sim.speed_rpm) * 6)
            if abs(sim.angle_deg - goals[servo.uid]) > 2:
                there[servo.uid] = loop.time()
        await asyncio.sleep(0.01)
    assert 1.6 < loop.time() - began < 2.1  # 61° at 40 °/s after a soft start at 0°
    assert fastest < 40 * 1.6
    assert max(there.values()) - min(there.values()) < 0.35
    await asyncio.sleep(0.2)
    for servo in servos:
        assert abs(rig.sim(servo).angle_deg - goals[servo.uid]) < 0.6
    sent = [value for _, commands in bursts(rig) for number, value in commands if number == 4]
    assert max(abs(b - a) for a, b in pairwise(sent)) < 0.012  # hundreds of degrees: 0.8° a slot and rounding


@scene(*TURNED)
async def test_a_profile_renews_only_moving_servos_once_a_slot(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    renewed: list[int] = []
    plain = Bursts.renewed

    def counted(bursts: Bursts, prepared: Prepared, values: Mapping[Uid, float], *, clamp: bool = False) -> Prepared:
        renewed.append(len(values))
        return plain(bursts, prepared, values, clamp=clamp)

    servos, lease = await with_torque(rig, 4)
    stream = await begun(rig, servos, lease)
    goals = {servo.uid: 40.0 for servo in servos[:3]}
    body = {"values": goals, "profile": {"speed_deg_s": 30, "accel_deg_s2": 200}}
    json(await rig.call("PUT", f"/streams/{stream}", body, lease=lease))
    monkeypatch.setattr(Bursts, "renewed", counted)
    before = json(await rig.call("GET", f"/streams/{stream}"))["sent"]
    await asyncio.sleep(0.4)
    slots = json(await rig.call("GET", f"/streams/{stream}"))["sent"] - before
    assert 15 < slots < 25
    assert abs(len(renewed) - slots) <= 1
    assert set(renewed) == {3}
    await asyncio.sleep(2)
    renewed.clear()
    await asyncio.sleep(0.4)
    assert renewed == [], "all have arrived"


@scene(*TURNED[:2])
async def test_a_goal_beyond_one_limit_moves_no_servo_and_a_value_ends_a_profile(rig: Rig) -> None:
    servos, lease = await with_torque(rig, 2)
    first, second = servos
    json(await rig.call("PUT", f"/servos/{second.uid}/parameters/angle_limit_cw", {"value": 30}, lease=lease))
    stream = await begun(rig, servos, lease)
    before = rig.sim(first).angle_deg
    body = {"values": {first.uid: 60, second.uid: 60}, "profile": GENTLE}
    problem(await rig.call("PUT", f"/streams/{stream}", body, lease=lease), "out_of_range", 422)
    await asyncio.sleep(0.5)
    assert abs(rig.sim(first).angle_deg - before) < 0.6
    json(await rig.call("PUT", f"/streams/{stream}", {"values": {first.uid: 80}, "profile": GENTLE}, lease=lease))
    await asyncio.sleep(0.3)
    json(await rig.call("PUT", f"/streams/{stream}", {"values": {first.uid: 25}}, lease=lease))
    await asyncio.sleep(1)
    assert abs(rig.sim(first).angle_deg - 25) < 0.6

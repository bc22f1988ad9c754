"""Motion only under a live lease, refused with a reason, kept alive while it lives (sections 4.1 to 4.3, 4.19)."""

import asyncio

import pytest
from httpx import Response

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.motion.settle import wait_settled
from hornbill.servo.runtime.hub import LogEvent
from hornbill.sim.bench.recipe import Recipe

MODE_ON = Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12, rom={"speed_torque_control": 1})


def command(value: float, kind: str = "angle", **more: object) -> dict[str, object]:
    return {"type": kind, "value": value, **more}


@scene(*(Recipe("BLA21-06U-A0", "1.300", servo_id=n, node_id=10 + n) for n in (1, 2, 3)))
async def test_nothing_moves_because_hornbill_connects_reads_or_watches(rig: Rig) -> None:
    servos = await rig.ready(3)
    for servo in servos:
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true"))
        wish = {"channels": ["current_angle", "current_speed"], "rate_hz": 20}
        json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", wish))
    await rig.lease(ttl_s=5)
    await asyncio.sleep(20)
    assert rig.writes() == []
    assert rig.array_commands() == []


@scene()
async def test_a_command_needs_a_lease_and_says_how_to_get_one(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/command"
    assert "POST /api/v1/leases" in problem(await rig.call("POST", path, command(10)), "lease_required", 428)["detail"]
    lease = await rig.lease(ttl_s=20)
    refused = problem(await rig.call("POST", path, command(10)), "lease_held", 409)
    assert refused["holder"] == "test"
    assert 0 < refused["expires_in_s"] <= 20
    problem(await rig.call("POST", path, command(10), lease="f" * 32), "lease_held", 409)
    put = await rig.call("PUT", f"/servos/{servo.uid}/parameters/command_angle", {"value": 10})
    problem(put, "lease_held", 409)
    assert rig.writes() == []
    json(await rig.call("POST", path, command(10), lease=lease))


@scene()
async def test_wait_settled_answers_with_the_evidence(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    body = command(30, wait="settled", band_deg=0.5, dwell_s=0.2)
    answer = json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
    assert answer["settled"] is True
    assert abs(answer["angle_deg"] - 30) <= 0.5
    assert 0.02 < answer["settle_time_s"] < 2
    assert abs(rig.sim(servo).angle_deg - 30) < 1


@scene()
async def test_wait_settled_says_so_when_it_does_not_settle(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    body = command(170, wait="settled", timeout_s=0.1)
    answer = json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
    assert (answer["settled"], answer["settle_time_s"]) == (False, None)
    assert (answer["unmet"], answer["in_band_s"]) == ("band", 0.0)
    body = command(20, wait="settled", timeout_s=3, dwell_s=9)
    answer = json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
    assert (answer["settled"], answer["unmet"]) == (False, "dwell")
    assert 1.5 < answer["in_band_s"] < 3
    assert abs(answer["angle_deg"] - 20) <= 0.5


@scene()
async def test_wait_settled_says_so_when_nobody_tells_where_the_horn_is(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.mute = True
    found = await wait_settled(
        rig.host.requests, servo, rig.host.base, 0, band_deg=1, dwell_s=0.2, timeout_s=1, still_allowed=lambda: None
    )
    assert (found.settled, found.unmet, found.angle_deg) == (False, "samples", None)


@pytest.mark.parametrize("ttl", [0.5, 2.0])
@scene()
async def test_torque_goes_off_within_100_ms_of_a_lapse(rig: Rig, servo: Servo, ttl: float) -> None:
    loop = asyncio.get_running_loop()
    lease = await rig.lease(ttl_s=ttl)
    lapses = loop.time() + ttl
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(20), lease=lease))
    await asyncio.sleep(lapses - 0.01 - loop.time())
    assert rig.sim(servo).output == 0
    await asyncio.sleep(0.11)
    assert rig.sim(servo).output == 1
    assert servo.raw("torque_mode") == 1
    assert any("Torque goes off" in change.text for change in rig.changes if isinstance(change, LogEvent))
    refused = await rig.call("POST", f"/servos/{servo.uid}/command", command(0), lease=lease)
    problem(refused, "lease_required", 428)


@scene()
async def test_a_lapse_is_written_until_the_servo_answers(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease(ttl_s=1)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(20), lease=lease))
    rig.bus.loss(100)
    await asyncio.sleep(2)
    rig.bus.loss(0)
    await asyncio.sleep(0.5)
    assert servo.raw("torque_mode") == 1


@scene(PLAIN, MODE_ON)
async def test_giving_the_lease_back_takes_torque_away_only_from_what_it_commanded(rig: Rig) -> None:
    one, other = await rig.ready(2)
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{one.uid}/command", command(20), lease=lease))
    json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.sim(one).output == 1
    assert other.raw("torque_mode") == 0
    assert json(await rig.call("GET", "/leases")) == []


@scene()
async def test_the_servos_own_time_out_does_not_drop_it_while_the_lease_is_renewed(rig: Rig, servo: Servo) -> None:
    """Default of 0x26 and 0x27: output off after 1,000 ms without a command."""

    lease = await rig.lease(ttl_s=2)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(20), lease=lease))
    for _ in range(8):
        await asyncio.sleep(1)
        json(await rig.call("PUT", f"/leases/{lease}"))
        assert rig.sim(servo).output == 0
    assert abs(rig.sim(servo).angle_deg - 20) < 1


@scene()
async def test_speed_and_torque_are_refused_while_0x25_is_off(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    for kind in ("speed", "torque"):
        answer = await rig.call("POST", f"/servos/{servo.uid}/command", command(20, kind), lease=lease)
        assert "0x25" in problem(answer, "mode_off", 409)["detail"]
    assert not [write for write in rig.writes() if write[1] in ("0x01", "0x02")]


@scene(MODE_ON)
async def test_speed_turns_the_horn_and_the_other_commands_become_inactive(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(60, "speed"), lease=lease))
    await asyncio.sleep(1.5)
    assert 50 < rig.sim(servo).speed_rpm < 70
    reading = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/command_angle"))
    assert (reading["value"], reading["raw"]) == (None, 555_555_555)
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["command_deg"] is None


def test_an_angle_outside_the_servos_limits_is_refused_before_it_is_sent_unless_clamping_is_asked_for() -> None:
    limited = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, rom={"angle_limit_cw": 450})

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        lease = await rig.lease()
        path = f"/servos/{servo.uid}/command"
        refused = problem(await rig.call("POST", path, command(60), lease=lease), "out_of_range", 422)
        assert (refused["maximum"], refused["unit"], refused["requested"]) == (45.0, "°", 60)
        assert rig.writes() == []
        answer = json(await rig.call("POST", path, command(60, clamp=True), lease=lease))
        assert (answer["clamped"], answer["value"]) == (True, 45.0)
        assert json(await rig.call("POST", path, command(10.06), lease=lease))["value"] == 10.1
        problem(await rig.call("POST", path, command(45.06), lease=lease), "out_of_range", 422)

    play(scene, limited)


@scene(MODE_ON)
async def test_every_motion_request_is_rounded_to_the_servos_step_and_answers_with_what_was_sent(
    rig: Rig, servo: Servo
) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"

    async def sent(body: dict[str, object]) -> float:
        return json(await rig.call("POST", f"{path}/command", body, lease=lease))["value"]

    assert await sent(command(8.660254)) == 8.7
    assert await sent(command(-0.04)) == 0
    assert await sent(command(12.34, clamp=True)) == 12.3
    assert await sent(command(9.99, profile={"speed_deg_s": 200.0})) == 10.0
    assert await sent(command(20.4, "speed")) == 20
    assert await sent(command(20.6, "speed", hold={"for_s": 0.5})) == 21
    put = await rig.call("PUT", f"{path}/parameters/command_angle", {"value": 5.5555}, lease=lease)
    assert json(put)["value"] == 5.6
    problem(await rig.call("PUT", f"{path}/parameters/origin", {"value": 0.05}, lease=lease), "invalid_value", 422)


def test_a_servo_in_soft_start_or_protection_is_not_commanded() -> None:
    far = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, angle_deg=170)

    async def scene(rig: Rig) -> None:
        lease = await rig.lease()
        async with asyncio.timeout(5):
            while not any(one.state is State.SOFT_START for one in rig.host.fleet.all()):
                await asyncio.sleep(0.01)
        servo = rig.host.fleet.all()[0]
        path = f"/servos/{servo.uid}/command"
        assert problem(await rig.call("POST", path, command(1), lease=lease), "busy", 409)["state"] == "soft_start"
        await rig.ready()
        rig.sim(servo).conditions.temperature_c = 95
        async with asyncio.timeout(10):
            while servo.state is not State.PROTECTED:
                await asyncio.sleep(0.05)
        assert problem(await rig.call("POST", path, command(1), lease=lease), "busy", 409)["state"] == "protected"

    play(scene, far)


@scene()
async def test_torque_on_holds_where_the_horn_stands(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}/torque"
    problem(await rig.call("POST", path, {"mode": "on"}), "lease_held", 409)
    json(await rig.call("POST", path, {"mode": "off"}))
    assert rig.bench.turn_manually(rig.sim(servo).uid.hex(), 40.0)  # pyright: ignore[reportArgumentType]
    assert json(await rig.call("POST", path, {"mode": "on"}, lease=lease))["value"] == "on"
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 0, "kept alive while the lease lives"
    assert abs(rig.sim(servo).angle_deg - 40) < 1


@scene()
async def test_torque_mode_is_never_a_boolean(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    for wrong in (True, False, 0, 1, "ON", None):
        answer = await rig.call("PUT", f"/servos/{servo.uid}/parameters/torque_mode", {"value": wrong}, lease=lease)
        problem(answer, "invalid_value", 422)
        problem(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": wrong}), "invalid_value", 422)
    assert rig.writes() == []
    json(await rig.call("PUT", f"/servos/{servo.uid}/parameters/torque_mode", {"value": "off"}, lease=lease))
    assert [write[2] for write in rig.writes() if write[1] == "0x20"] == [1]


@scene()
async def test_turning_torque_on_by_a_parameter_write_needs_a_lease_too(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    body = {"values": {"angle_dead_band": 1.0, "torque_mode": "on"}}
    problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body), "lease_required", 428)
    assert [write[1] for write in rig.writes()] == ["0x20"]
    lease = await rig.lease()
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body, lease=lease))
    assert servo.raw("torque_mode") == 0


@scene()
async def test_torque_goes_off_on_a_lapse_even_when_somebody_else_takes_the_lease_in_the_same_instant(
    rig: Rig, servo: Servo
) -> None:
    loop = asyncio.get_running_loop()
    lapses = loop.time() + 1.0
    lease = await rig.lease(ttl_s=1)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(20), lease=lease))
    await asyncio.sleep(lapses + 0.0001 - loop.time())
    await rig.lease(ttl_s=5)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@scene()
async def test_a_servo_that_restarts_under_command_is_not_commanded_again(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3)
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(90), lease=lease))
    await asyncio.sleep(1)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.7)
    rig.bench.power(servo.uid, True)
    fastest = 0.0
    for _ in range(3000):
        await asyncio.sleep(0.001)
        fastest = max(fastest, abs(rig.sim(servo).speed_rpm))
    assert fastest < 40, "soft start is slow"
    assert servo.state is not State.OFFLINE


@scene()
async def test_who_waits_for_a_servo_that_is_let_go_is_told_why(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    never = command(20, wait="settled", dwell_s=9, timeout_s=30)

    async def waiting() -> asyncio.Task[Response]:
        task = asyncio.create_task(rig.call("POST", f"/servos/{servo.uid}/command", never, lease=lease))
        await asyncio.sleep(2)
        return task

    waiter = await waiting()
    rig.bus.loss(100)
    await asyncio.sleep(2)
    rig.bus.loss(0)
    assert "before it settled: " in problem(await waiter, "no_response", 504)["detail"]
    await asyncio.sleep(1)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    waiter = await waiting()
    await rig.host.requests.write(servo, servo.registers["command_angle"].parameter, 0)
    assert "has a different command" in problem(await waiter, "busy", 409)["detail"]


@scene()
async def test_what_its_own_time_out_took_is_not_given_back_by_the_keep_alive(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(90), lease=lease))
    await asyncio.sleep(1)
    rig.bus.loss(100)
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1
    rig.bus.loss(0)
    await asyncio.sleep(5)
    assert rig.sim(servo).output == 1
    assert rig.events("command_ended")


@scene()
async def test_the_old_target_is_not_sent_after_the_new_one(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}/command"
    json(await rig.call("POST", path, command(10), lease=lease))
    await asyncio.sleep(0.3)
    rig.sim(servo).conditions.drop_responses_pct = 100
    moving = asyncio.create_task(rig.call("POST", path, command(50), lease=lease))
    await asyncio.sleep(0.31)
    rig.sim(servo).conditions.drop_responses_pct = 0
    answer = json(await moving)
    assert answer["value"] == 50.0
    await asyncio.sleep(1)
    sent = [raw for _, name, raw in rig.writes() if name == "0x00"]
    assert 100 not in sent[sent.index(500) :]
    assert rig.sim(servo).output == 0


@scene()
async def test_turning_torque_on_anew_forgets_what_was_commanded_before(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", path + "/command", command(60), lease=lease))
    await asyncio.sleep(1)
    rig.sim(servo).memory.put(0x20, 1)  # another tool turned it off
    rig.sim(servo)._device.commander.configured()  # pyright: ignore[reportPrivateUsage]
    rig.bench.turn_manually(servo.uid, 5.0)
    rig.bus.history.clear()
    rig.sim(servo).conditions.drop_responses_pct = 60
    answer = None
    while answer is None or answer.status_code != 200:
        answer = await rig.call("POST", path + "/torque", {"mode": "on"}, lease=lease)
    rig.sim(servo).conditions.drop_responses_pct = 0
    await asyncio.sleep(2)
    assert abs(rig.sim(servo).angle_deg - 5) < 1
    assert 600 not in {raw for _, name, raw in rig.writes() if name == "0x00"}


@scene(PLAIN, MODE_ON)
async def test_nothing_can_be_energised_while_the_bus_is_being_left(rig: Rig) -> None:
    deaf, other = await rig.ready(2)
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{other.uid}/torque", {"mode": "off"}))
    json(await rig.call("POST", f"/servos/{deaf.uid}/command", command(5), lease=lease))
    rig.sim(deaf).conditions.drop_responses_pct = 100
    leaving = asyncio.create_task(rig.call("DELETE", "/bus"))
    await asyncio.sleep(0.05)
    problem(await rig.call("POST", f"/servos/{other.uid}/torque", {"mode": "on"}, lease=lease), "bus_disconnected", 503)
    json(await leaving)
    assert rig.sim(other).output == 1
    assert any(event.uid == deaf.uid for event in rig.events("no_response")), "it was not confirmed, and that is said"


@pytest.mark.parametrize("value", [1e308, -1e308])
@scene()
async def test_a_huge_clamped_command_is_clamped(rig: Rig, servo: Servo, value: float) -> None:
    lease = await rig.lease()
    answer = await rig.call("POST", f"/servos/{servo.uid}/command", command(value, clamp=True), lease=lease)
    assert json(answer)["clamped"] is True


@scene()
async def test_a_failure_in_one_tick_does_not_end_the_watch_over_leases(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    lease = await rig.lease(ttl_s=1)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command(5), lease=lease))

    def fail(_now: float) -> None:
        raise RuntimeError("a defect")

    monkeypatch.setattr(rig.host.fleet, "tick", fail)
    await asyncio.sleep(0.2)
    monkeypatch.undo()
    await asyncio.sleep(1)
    assert rig.sim(servo).output == 1


@scene(MODE_ON)
async def test_a_refusal_says_whether_the_servos_own_limit_or_its_models_range_is_in_the_way(
    rig: Rig, servo: Servo
) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}/command"
    refused = problem(await rig.call("POST", path, command(400), lease=lease), "out_of_range", 422)
    assert "beyond the Angle limit CW of" in refused["detail"]
    assert "179.9° (0x38)" in refused["detail"]
    assert refused["limit"] == "angle_limit_cw"
    refused = problem(await rig.call("POST", path, command(-5000, "speed"), lease=lease), "out_of_range", 422)
    assert "is below this model's limit of −" in refused["detail"]
    assert "limit" not in refused
    limit = {"values": {"speed_limit_ccw": -50}}
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", limit, lease=lease))
    refused = problem(await rig.call("POST", path, command(-60, "speed"), lease=lease), "out_of_range", 422)
    assert "beyond the Speed limit CCW of" in refused["detail"]
    assert "(0x3B)" in refused["detail"]

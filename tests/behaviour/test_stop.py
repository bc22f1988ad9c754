"""Stop: explicit, immediate, latched, repeated until confirmed, and never delayed (section 4.13)."""

import asyncio

import pytest

from behaviour.losing import PAIR, back, commanded
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import Change, ReadingChanged, StopChanged
from hornbill.sim.bench.recipe import Recipe

THREE = [Recipe("BLA21-06U-A0", "1.300", servo_id=n, node_id=10 + n) for n in (1, 2, 3)]


@scene(*THREE)
async def test_stop_turns_torque_off_on_every_servo_within_milliseconds_and_is_latched(rig: Rig) -> None:
    servos = await rig.ready(3)
    began = asyncio.get_running_loop().time()
    state = json(await rig.call("POST", "/stop?by=Ann", {"reason": "smoke"}))
    assert state["latched"] is True
    assert [one["confirmed"] for one in state["servos"]] == [True] * 3
    assert asyncio.get_running_loop().time() - began < 0.060
    for servo in servos:
        assert rig.sim(servo).output == 1
        assert (servo.output_state.reason, servo.output_state.by) == ("stop", "Ann")
    assert json(await rig.call("GET", "/stop"))["latched"] is True
    json(await rig.call("DELETE", "/stop?by=Ben"))
    assert rig.logged("stopped") == [("failure", None, {"by": "Ann", "mode": "off", "bus_lost": False})]
    assert rig.logged("stop_cleared") == [("notice", None, {"by": "Ben", "unconfirmed": []})]
    assert rig.host.stop.response_times.total_s < 3 * 0.060
    await asyncio.sleep(0.1)
    cleared, pressed = json(await rig.call("GET", "/audit"))
    for entry, by, outcome, requested, note in (
        (pressed, "Ann", "pressed", "off", {"text": "smoke.", "code": "stop_reason", "params": {"reason": "smoke"}}),
        (cleared, "Ben", "cleared", None, {"text": "Stop of Ann cleared.", "code": "stop_of", "params": {"by": "Ann"}}),
    ):
        assert (entry["by"], entry["action"], entry["outcome"]) == (by, "stop", outcome)
        assert (entry["requested"], entry["notes"][0]) == (requested, note)
        took = entry["notes"][1]["params"].pop("within_ms")
        assert entry["notes"][1] == {
            "text": f"3 of 3 acknowledged within {took:.0f} ms.",
            "code": "stop_confirmed",
            "params": {"confirmed": 3, "of": 3},
        }


@scene()
async def test_stop_refuses_motion_until_cleared_and_clearing_turns_no_torque_on(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    await rig.call("POST", "/stop?by=Ann")
    path = f"/servos/{servo.uid}"
    refused = await rig.call("POST", path + "/command", {"type": "angle", "value": 5}, lease=lease)
    found = problem(refused, "stopped", 423)
    assert (found["cause"], found["mode"], found["by"]) == ("stopped", "off", "Ann")
    problem(await rig.call("POST", path + "/torque", {"mode": "on"}, lease=lease), "stopped", 423)
    problem(await rig.call("PUT", path + "/parameters/torque_mode", {"value": "on"}, lease=lease), "stopped", 423)
    problem(await rig.call("POST", path + "/save"), "stopped", 423)
    problem(await rig.call("POST", path + "/restart"), "stopped", 423)
    json(await rig.call("DELETE", "/stop"))
    await asyncio.sleep(1)
    assert rig.sim(servo).output == 1
    refused = await rig.call("POST", path + "/command", {"type": "angle", "value": 5}, lease=lease)
    assert problem(refused, "torque_off", 409)["detail"].startswith("Torque is off")
    json(await rig.call("POST", path + "/torque", {"mode": "on"}, lease=lease))
    json(await rig.call("POST", path + "/command", {"type": "angle", "value": 5}, lease=lease))


@scene()
async def test_stop_applies_the_brake_if_requested(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", "/stop", {"mode": "brake"}))
    assert rig.sim(servo).output == 2
    assert servo.raw("torque_mode") == 2


@scene(*THREE)
async def test_stop_is_repeated_to_a_servo_that_does_not_respond_until_it_does(rig: Rig) -> None:
    quiet, other, _ = await rig.ready(3)
    rig.sim(quiet).conditions.drop_responses_pct = 100
    state = json(await rig.call("POST", "/stop"))
    shown = {one["uid"]: one for one in state["servos"]}
    assert shown[quiet.uid]["confirmed"] is False
    assert shown[other.uid]["confirmed"] is True
    sent = sum(node == quiet.node_id and name == "0x20" for node, name, _ in rig.writes())
    assert sent >= 5
    rig.sim(quiet).conditions.drop_responses_pct = 0
    await asyncio.sleep(1)
    state = json(await rig.call("GET", "/stop"))
    assert all(one["confirmed"] for one in state["servos"])
    sent = len(rig.writes())
    await asyncio.sleep(2)
    assert len(rig.writes()) == sent, "nothing more is sent once it has responded"


@scene()
async def test_a_moving_servo_coasts_and_stays_where_it_comes_to_rest(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    command = {"type": "angle", "value": 150}
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command, lease=lease))
    await asyncio.sleep(0.15)
    assert rig.sim(servo).speed_rpm > 20
    await rig.call("POST", "/stop")
    assert rig.sim(servo).output == 1
    await asyncio.sleep(2)
    where = rig.sim(servo).angle_deg
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1
    assert abs(rig.sim(servo).angle_deg - where) < 0.5


@scene()
async def test_a_pending_torque_on_is_not_sent_after_stop(rig: Rig, servo: Servo) -> None:
    """Torque on is repeated to a servo that receives nothing, then Stop is pressed."""
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    rig.bus.loss(100)
    waiting = asyncio.create_task(rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    await asyncio.sleep(0.03)
    await rig.call("POST", "/stop")
    rig.bus.loss(0)
    problem(await waiting, "stopped", 423)
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 1
    assert servo.raw("torque_mode") == 1


@scene(*THREE)
async def test_stop_overtakes_a_full_read_of_every_servo(rig: Rig) -> None:
    servos = await rig.ready(3)
    reading = [asyncio.create_task(rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true")) for servo in servos]
    await asyncio.sleep(0.01)
    began = asyncio.get_running_loop().time()
    state = json(await rig.call("POST", "/stop"))
    assert all(one["confirmed"] for one in state["servos"])
    assert asyncio.get_running_loop().time() - began < 0.020
    for task in reading:
        json(await task)


@scene()
async def test_a_servo_that_restarts_while_stopped_is_stopped_again(rig: Rig, servo: Servo) -> None:
    await rig.call("POST", "/stop")
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.5)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(6)
    sim = rig.sim(servo)
    assert (sim.starts, sim.output) == (2, 1), "it started with torque on"
    assert json(await rig.call("GET", "/stop"))["servos"][0]["confirmed"] is True
    assert sim.memory.stored(0x20) == 0
    assert servo.registers["torque_mode"].rom in (0, None), "torque off is not taken for the value in ROM"


@scene(connect=False)
async def test_stop_needs_no_bus_no_body_and_no_lease(rig: Rig) -> None:
    state = json(await rig.call("POST", "/stop"))
    assert (state["latched"], state["servos"]) == (True, [])


@scene(PLAIN)
async def test_torque_off_and_brake_require_no_lease_even_while_another_client_has_one(rig: Rig, servo: Servo) -> None:
    await rig.lease()
    for mode, output in (("off", 1), ("brake", 2)):
        reading = json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": mode}))
        assert reading["value"] == mode
        assert rig.sim(servo).output == output
        assert (servo.output_state.reason, servo.output_state.by) == ("command", "no lease")
    assert servo.state is State.READY


@scene()
async def test_one_press_that_arrives_twice_is_one_stop(rig: Rig) -> None:
    await rig.ready()
    first = json(await rig.call("POST", "/stop?by=Page 1"))
    second = json(await rig.call("POST", "/stop?by=Page 1"))
    assert (first["at"], first["servos"]) == (second["at"], second["servos"])
    assert len(rig.events("stopped")) == 1
    await asyncio.sleep(2)
    third = json(await rig.call("POST", "/stop?by=Page 1"))
    assert third["at"] > first["at"]
    assert all(one["confirmed"] for one in third["servos"])


@pytest.mark.parametrize("verb", ["restart", "save"])
@scene(Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, rom={"soft_start": 0}, angle_deg=20))
async def test_a_waiting_restart_or_save_job_is_ended_by_stop(rig: Rig, servo: Servo, verb: str) -> None:
    job = json(await rig.call("POST", f"/servos/{servo.uid}/{verb}"), 202)
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(8)
    assert rig.sim(servo).starts == 1
    assert json(await rig.call("GET", f"/jobs/{job['id']}"))["error"]["code"] == "stopped"
    assert rig.sim(servo).output == 1
    assert rig.sim(servo).memory.stored(0x20) == 0


@scene()
async def test_a_servo_that_appears_after_stop_is_stopped(rig: Rig) -> None:
    await rig.ready()
    await rig.call("POST", "/stop")
    sim = rig.bench.add(Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12))
    await asyncio.sleep(6)
    assert sim.output == 1
    state = json(await rig.call("GET", "/stop"))
    assert [one["confirmed"] for one in state["servos"]] == [True, True]


@scene()
async def test_a_servo_whose_rows_cannot_be_read_is_stopped(rig: Rig) -> None:
    """It responds to GetNodeInfo; then its responses are lost."""
    await rig.ready()
    await rig.call("POST", "/stop")
    sim = rig.bench.add(Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12))
    await until(lambda: len(rig.host.fleet.all()) == 2, 10, 0.0005)
    sim.conditions.drop_responses_pct = 100
    await asyncio.sleep(0.3)
    assert sim.output == 1


def turn_on(rig: Rig, servo: Servo) -> None:
    """Turn torque on as another tool would."""
    rig.sim(servo).memory.put(0x20, 0)
    rig.sim(servo)._device.commander.configured()  # pyright: ignore[reportPrivateUsage]


@scene()
async def test_a_servo_turned_on_by_another_tool_is_unconfirmed_and_stopped_again(rig: Rig, servo: Servo) -> None:
    await rig.call("POST", "/stop")
    seen: list[bool] = []

    def watch(change: Change) -> None:
        if isinstance(change, StopChanged) and rig.host.stop.latch is not None:
            seen.append(rig.host.stop.latch.servos[servo.uid].confirmed)

    rig.host.hub.subscribe(watch)
    turn_on(rig, servo)
    await asyncio.sleep(3)
    assert seen == [False, True]
    assert rig.sim(servo).output == 1


@scene()
async def test_a_second_stop_is_sent_to_every_servo_again(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", "/stop"))
    turn_on(rig, servo)
    assert rig.sim(servo).output == 0
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(0.01)
    assert rig.sim(servo).output == 1


@scene()
async def test_stop_is_repeated_after_an_internal_error(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, failed = rig.host.requests.write, 0

    async def fail_once(*args: object) -> int:
        nonlocal failed
        failed += 1
        if failed == 1:
            raise RuntimeError("a defect")
        return await write(*args)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(rig.host.requests, "write", fail_once)
    json(await rig.call("POST", "/stop"))
    assert rig.sim(servo).output == 1


@scene()
async def test_clearing_stop_still_turns_torque_off_on_a_servo_that_has_not_responded(rig: Rig, servo: Servo) -> None:
    rig.bus.loss(100)
    json(await rig.call("POST", "/stop"))
    json(await rig.call("DELETE", "/stop?by=Ben"))
    assert rig.logged("stop_cleared") == [("warning", None, {"by": "Ben", "unconfirmed": [servo.title]})]
    assert f"Not acknowledged: {servo.title}." in rig.events("stop_cleared")[0].text
    rig.bus.loss(0)
    await asyncio.sleep(1)
    assert rig.sim(servo).output == 1


@scene()
async def test_a_pending_torque_off_does_not_release_the_brake_of_stop(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease(ttl_s=1)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 20}, lease=lease))
    rig.bus.loss(100)
    await asyncio.sleep(1.5)
    json(await rig.call("POST", "/stop", {"mode": "brake"}))
    rig.bus.loss(0)
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 2


@scene()
async def test_stop_at_the_moment_of_a_response_leaves_no_command_repeating(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    path, done = f"/servos/{servo.uid}", False

    def press(change: Change) -> None:
        nonlocal done
        if isinstance(change, ReadingChanged) and change.key == "command_angle" and not done:
            done = True
            asyncio.get_running_loop().call_soon(rig.host.stop.now, "off", "test", "")

    rig.host.hub.subscribe(press)
    problem(await rig.call("POST", path + "/command", {"type": "angle", "value": 90}, lease=lease), "stopped", 423)
    assert done
    await asyncio.sleep(1)
    assert rig.writes()[-1][1:] == ("0x20", 1)
    json(await rig.call("DELETE", "/stop"))
    rig.bench.turn_manually(servo.uid, 10.0)
    json(await rig.call("POST", path + "/torque", {"mode": "on"}, lease=lease))
    await asyncio.sleep(2)
    assert abs(rig.sim(servo).angle_deg - 10) < 1
    assert (
        not rig.host.motion.is_commanded(servo.uid)
        or len({raw for _, name, raw in rig.writes() if name == "0x00"}) == 2
    )


async def reconnect(rig: Rig) -> None:
    """Connect again, without frame loss."""
    rig.bus.loss(0)
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await rig.ready(2)
    await asyncio.sleep(2)


@scene(*PAIR)
async def test_a_stop_cleared_without_a_bus_still_reaches_a_servo_that_never_responded(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    rig.bus.loss(100)
    json(await rig.call("POST", "/stop", {"mode": "off"}, By="one"))
    json(await rig.call("DELETE", "/bus"))
    stop = json(await rig.call("POST", "/stop", {"mode": "off"}, By="another"))
    assert {one["uid"] for one in stop["servos"]} >= {servo.uid}, "it has not confirmed torque off"
    json(await rig.call("DELETE", "/stop"))
    assert servo.title in rig.events("stop_cleared")[0].text
    assert rig.sim(servo).output == 0
    await reconnect(rig)
    assert rig.sim(servo).output == 1


@pytest.mark.parametrize("cleared", [False, True])
@scene(*PAIR)
async def test_a_torque_off_pending_on_a_lost_bus_does_not_release_the_brake_of_stop(rig: Rig, cleared: bool) -> None:
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    rig.bus.loss(100)
    json(await rig.call("DELETE", "/bus"))
    assert rig.host.torque_off.pending(servo.uid)
    stop = json(await rig.call("POST", "/stop", {"mode": "brake"}, By="one"))
    assert [one["confirmed"] for one in stop["servos"] if one["uid"] == servo.uid] == [False]
    if cleared:
        json(await rig.call("DELETE", "/stop"))
    await reconnect(rig)
    assert rig.sim(servo).output == 2


@pytest.mark.parametrize("end", ["disconnect", "close"])
@scene(*PAIR)
async def test_an_unconfirmed_stop_is_repeated_before_the_bus_is_disconnected(rig: Rig, end: str) -> None:
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    rig.bus.loss(100)
    rig.host.stop.now("off", "test", "")
    await asyncio.sleep(0.01)
    leaving = asyncio.create_task(getattr(rig.host, end)())
    await asyncio.sleep(0.05)
    rig.bus.loss(0)
    await leaving
    assert rig.sim(servo).output == 1


@scene(*PAIR)
async def test_an_expired_lease_turns_torque_off_if_the_bus_check_fails(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise RuntimeError("unexpected error of a driver")

    servo = (await rig.ready(2))[0]
    lease = await rig.lease(ttl_s=2)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 20}, lease=lease))
    monkeypatch.setattr(rig.host.watch, "check", fail)
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 1


@scene(*PAIR)
async def test_another_servo_on_the_same_node_id_does_not_confirm_the_stop_of_a_lost_one(rig: Rig) -> None:
    servo = next(one for one in await rig.ready(2) if one.node_id == 11)
    await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(5)
    json(await rig.call("POST", "/stop?by=Ann", {"mode": "off"}))
    assert rig.logged("stopped") == [("failure", None, {"by": "Ann", "mode": "off", "bus_lost": True})]
    lost = rig.sim(servo)
    rig.bench.power(servo.uid, False)
    rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=7, node_id=11))
    await asyncio.sleep(5)
    await back(rig)
    await asyncio.sleep(5)
    stop = json(await rig.call("GET", "/stop"))
    assert [one["confirmed"] for one in stop["servos"] if one["uid"] == servo.uid] == [False]
    assert not lost.powered


@scene(*PAIR)
async def test_a_short_bus_off_between_two_checks_ends_commands(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    rig.cable.bus_off()
    await asyncio.sleep(0.001)
    rig.bus.recover(rig.cable.inner)
    await asyncio.sleep(0.5)
    assert not rig.host.motion.is_commanded(servo.uid)
    assert rig.sim(servo).output == 1
    assert rig.events("bus_lost")


@pytest.mark.parametrize("modes", [("brake",), ("off", "brake")], ids=" then ".join)
@scene(*PAIR)
async def test_an_unacknowledged_brake_is_repeated_as_the_brake(rig: Rig, modes: tuple[str, ...]) -> None:
    """Torque off instead would let a load drop that the brake holds."""
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    rig.bus.loss(100)
    for mode in modes:
        problem(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": mode}), "no_response", 504)
    await asyncio.sleep(9.9)
    assert not rig.events("no_response")
    await asyncio.sleep(0.2)
    assert rig.logged("no_response") == [("failure", servo.uid, {"servos": [servo.title], "mode": "brake"})]
    assert rig.sim(servo).output == 0
    rig.bus.loss(0)
    await asyncio.sleep(1.1)
    assert rig.sim(servo).output == 2
    assert rig.logged("torque_off") == [("notice", servo.uid, {"servo": servo.title, "mode": "brake"})]
    await asyncio.sleep(5)
    assert rig.sim(servo).output == 2


@scene(*PAIR)
async def test_torque_on_ends_the_retries_of_an_unacknowledged_torque_off(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await commanded(rig, servo)
    rig.bus.loss(100)
    problem(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}), "no_response", 504)
    assert rig.host.torque_off.pending(servo.uid)
    rig.bus.loss(0)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    assert not rig.host.torque_off.pending(servo.uid)
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 0

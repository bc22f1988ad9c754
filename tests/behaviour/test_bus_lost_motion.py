"""A bus that is lost while servos are under command: it ends, torque off is owed, and nothing resumes by itself."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.losing import ASKING, PAIR, THREE, Way, back, commanded, now, unplugged, ways
from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.errors import BusDisconnected

# Under command.


@ways
@scene(*PAIR)
async def test_commands_end_and_torque_off_is_the_first_thing_written_when_the_bus_is_back(rig: Rig, lose: Way) -> None:
    servo = (await rig.ready(2))[0]
    lease = await commanded(rig, servo)
    await lose(rig)
    await asyncio.sleep(0.1)
    assert not rig.host.motion.is_commanded(servo.uid)
    assert servo.title in rig.events("bus_lost")[0].text
    written = len(rig.writes())
    await back(rig)
    back_at = now()
    while rig.sim(servo).output == 0:
        await asyncio.sleep(0.001)
        assert now() - back_at < 0.1
    await asyncio.sleep(5)
    assert {write[1:] for write in rig.writes()[written:]} == {("0x20", 1)}, "and nothing else, by itself"
    assert rig.host.torque_off.servos() == []
    json(await rig.call("PUT", f"/leases/{lease}"))


@pytest.mark.parametrize("away_s", [0.5, 30.0, 300.0])
@scene(*PAIR)
async def test_torque_off_is_owed_for_as_long_as_the_bus_is_away(rig: Rig, away_s: float) -> None:
    servo, other = await rig.ready(2)
    await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(away_s)
    assert rig.sim(servo).output == 0
    assert len(rig.events("no_response")) == (away_s > 10), "named once"
    await back(rig)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1
    assert rig.sim(other).output == 0, "it was under nobody's command"
    await asyncio.sleep(10)
    written = len(rig.writes())
    await asyncio.sleep(10)
    assert len(rig.writes()) == written
    assert rig.host.torque_off.servos() == []
    assert len(rig.events("torque_off")) == (away_s > 10)


@scene(*PAIR)
async def test_a_lease_that_ran_out_meanwhile_owes_it_too(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await rig.lease(ttl_s=2)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 20}, lease=lease))
    await rig.cable.unplug()
    await asyncio.sleep(20)
    await back(rig)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@scene(*PAIR)
async def test_a_torque_off_that_was_under_way_when_the_lease_ended_goes_on_through_a_lost_bus(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await commanded(rig, servo)
    rig.bus.loss(100)
    await rig.call("DELETE", f"/leases/{lease}")
    await rig.cable.unplug()
    await asyncio.sleep(60)
    rig.bus.loss(0)
    await back(rig)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@scene(*PAIR)
async def test_a_servo_that_was_switched_off_gets_it_when_it_answers(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    await rig.cable.unplug()
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    await back(rig)
    await asyncio.sleep(300)
    assert len(rig.events("no_response")) == 1
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(8)
    assert rig.sim(servo).output == 1
    assert rig.host.torque_off.servos() == []


@scene(*PAIR)
async def test_it_is_owed_over_a_disconnect_and_paid_on_the_bus_that_is_connected_next(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(5)
    json(await rig.call("DELETE", "/bus"))
    assert servo.title in rig.events("no_response")[0].text
    await asyncio.sleep(5)
    rig.cable.plug_in()
    json(await rig.call("PUT", "/bus", {"address": "memory:other", "bitrate": 1_000_000}))
    await rig.ready()
    assert rig.sim(servo).output == 1


@scene(ASKING, THREE[1])
async def test_another_servo_on_its_node_id_cannot_answer_instead_of_it(rig: Rig) -> None:
    servo = next(one for one in await rig.ready(2) if one.servo_id == 9)
    node = servo.node_id
    assert node is not None
    await commanded(rig, servo)
    await rig.cable.unplug()
    rig.bench.power(servo.uid, False)
    rig.bench.add(replace(PLAIN, node_id=node))
    await asyncio.sleep(10)
    await back(rig)
    await asyncio.sleep(10)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(15)
    assert servo.node_id not in (None, node)
    assert rig.sim(servo).output == 1


@scene(*PAIR)
async def test_commanding_the_servo_again_under_a_lease_ends_what_is_owed(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(1)
    rig.sim(servo).conditions.refuse_keys.add("torque_mode")
    await back(rig)
    await asyncio.sleep(2)
    assert rig.host.torque_off.servos() == [servo]
    tried = len(rig.writes())
    while len(rig.writes()) == tried:  # the next try is a quarter of a second away now
        await asyncio.sleep(0.001)
    await asyncio.sleep(0.02)
    rig.sim(servo).conditions.refuse_keys.clear()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": -20}, lease=lease))
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 0
    assert rig.sim(servo).angle_deg == pytest.approx(-20, abs=1)
    assert rig.host.torque_off.servos() == []


@scene(*PAIR)
async def test_what_was_asked_for_just_before_is_not_done_afterwards(rig: Rig) -> None:
    """Commands of every kind are under way in the instant of the loss, and again while it lasts."""

    servo = (await rig.ready(2))[0]
    path = f"/servos/{servo.uid}"
    lease = await commanded(rig, servo, 5)
    json(await rig.call("POST", path + "/torque", {"mode": "off"}))
    await asyncio.sleep(1)
    where = rig.sim(servo).angle_deg

    def ask() -> list[asyncio.Task[object]]:
        return [
            asyncio.create_task(rig.call("POST", path + "/torque", {"mode": "on"}, lease=lease)),
            asyncio.create_task(rig.call("POST", path + "/command", {"type": "angle", "value": 90}, lease=lease)),
            asyncio.create_task(rig.call("POST", path + "/restart", lease=lease)),
        ]

    rig.bus.loss(100)
    asked = ask()
    await asyncio.sleep(0.01)
    await rig.cable.unplug()
    asked += ask()
    await asyncio.sleep(0.1)
    asked += ask()
    rig.bus.loss(0)
    await asyncio.gather(*asked)
    await back(rig)
    await asyncio.sleep(10)
    assert rig.sim(servo).output == 1
    assert rig.sim(servo).starts == 1
    assert rig.sim(servo).angle_deg == pytest.approx(where, abs=0.5)


@pytest.mark.parametrize("after_s", [0.001, 0.01, 0.03, 0.06])
@scene(*PAIR)
async def test_a_command_under_way_is_answered_with_what_really_happened(rig: Rig, after_s: float) -> None:
    servo = (await rig.ready(2))[0]
    lease = await commanded(rig, servo)
    rig.bus.loss(100)
    body = {"type": "angle", "value": 90}
    waiting = asyncio.create_task(rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
    await asyncio.sleep(after_s)
    await rig.cable.unplug()
    problem(await waiting, "bus_disconnected", 503)


@scene(*PAIR)
async def test_a_command_that_comes_while_it_is_lost_forgives_nothing(rig: Rig) -> None:
    """All that must be fresh for a command still is: nothing would have to be asked of the servo first."""

    servo = (await rig.ready(2))[0]
    lease = await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(0.05)
    with pytest.raises(BusDisconnected, match="The bus is lost"):
        await rig.host.motion.command(servo, lease, "angle", 5, clamp=False)
    assert rig.host.torque_off.pending(servo.uid)
    assert not rig.host.motion.is_commanded(servo.uid)
    await back(rig)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@scene(*PAIR)
async def test_a_torque_off_that_could_not_be_sent_is_owed(rig: Rig) -> None:
    """The operator lets go in the very instant of the loss, before anybody has noticed it."""

    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    rig.bus.loss(100)
    pressed = asyncio.create_task(rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await asyncio.sleep(0.001)
    await rig.cable.unplug()
    problem(await pressed, "bus_disconnected", 503)
    rig.bus.loss(0)
    await asyncio.sleep(2)
    await back(rig)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@scene(*PAIR)
async def test_a_bus_back_before_anybody_looked_was_lost_all_the_same(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The event loop was held up for longer than the bus was away."""

    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    look = rig.host.watch.check
    monkeypatch.setattr(rig.host.watch, "check", lambda: None)
    await rig.cable.unplug()
    rig.cable.plug_in()
    await asyncio.sleep(1)
    monkeypatch.setattr(rig.host.watch, "check", look)
    await asyncio.sleep(0.2)
    assert rig.sim(servo).output == 1
    assert len(rig.events("bus_lost")) == len(rig.events("bus_back")) == 1


# Stop.


@ways
@pytest.mark.parametrize(("mode", "output"), [("off", 1), ("brake", 2)])
@scene(*THREE)
async def test_a_stop_pressed_while_it_is_lost_arrives_when_it_is_back(
    rig: Rig, lose: Way, mode: str, output: int
) -> None:
    servos = await rig.ready(3)
    await commanded(rig, servos[0])
    await lose(rig)
    await asyncio.sleep(0.5)
    state = json(await rig.call("POST", "/stop", {"mode": mode}))
    assert [one["confirmed"] for one in state["servos"]] == [False] * 3
    assert "the bus is lost" in rig.events("stopped")[0].text
    if lose is unplugged:
        await asyncio.sleep(40)
    await back(rig)
    await asyncio.sleep(0.1)
    assert [rig.sim(servo).output for servo in servos] == [output] * 3
    await asyncio.sleep(1.1)  # who is there is known from its next NodeStatus, and only then it counts as confirmed
    assert all(one["confirmed"] for one in json(await rig.call("GET", "/stop"))["servos"])
    await asyncio.sleep(10)
    assert [rig.sim(servo).output for servo in servos] == [output] * 3


@scene(*PAIR)
async def test_a_stop_that_was_cleared_while_it_was_lost_still_arrives(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(1)
    json(await rig.call("POST", "/stop"))
    json(await rig.call("DELETE", "/stop"))
    await asyncio.sleep(30)
    await back(rig)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1

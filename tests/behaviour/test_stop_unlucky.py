"""Stop and torque off in unlucky instants: while a bus is changed, and while it is being left."""

import asyncio

import pytest

from behaviour.losing import PAIR, back, commanded
from behaviour.rig import Rig, json, play, problem
from hornbill.sim.bench.recipe import Recipe


async def _again(rig: Rig) -> None:
    """Connect anew, with a cable that carries everything."""
    rig.bus.loss(0)
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await rig.ready(2)
    await asyncio.sleep(2)


def test_a_servo_that_never_answered_is_stopped_although_stop_was_pressed_anew_and_cleared_without_a_bus() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready(2))[0]
        await commanded(rig, servo)
        rig.bus.loss(100)
        json(await rig.call("POST", "/stop", {"mode": "off"}, By="one"))
        json(await rig.call("DELETE", "/bus"))
        stop = json(await rig.call("POST", "/stop", {"mode": "off"}, By="another"))
        assert {one["uid"] for one in stop["servos"]} >= {servo.uid}, "it has not said that its torque is off"
        json(await rig.call("DELETE", "/stop"))
        assert servo.title in rig.events("stop_cleared")[0].text
        assert rig.sim(servo).output == 0
        await _again(rig)
        assert rig.sim(servo).output == 1

    play(scene, *PAIR)


@pytest.mark.parametrize("cleared", [False, True])
def test_an_owed_torque_off_does_not_follow_the_brake_of_a_stop(cleared: bool) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready(2))[0]
        await commanded(rig, servo)
        rig.bus.loss(100)
        json(await rig.call("DELETE", "/bus"))
        assert rig.host.torque_off.pending(servo.uid)
        stop = json(await rig.call("POST", "/stop", {"mode": "brake"}, By="one"))
        assert [one["confirmed"] for one in stop["servos"] if one["uid"] == servo.uid] == [False]
        if cleared:
            json(await rig.call("DELETE", "/stop"))
        await _again(rig)
        assert rig.sim(servo).output == 2

    play(scene, *PAIR)


@pytest.mark.parametrize("end", ["disconnect", "close"])
def test_a_stop_that_has_not_been_answered_is_repeated_before_the_bus_is_left(end: str) -> None:
    async def scene(rig: Rig) -> None:
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

    play(scene, *PAIR)


def test_a_lease_that_lapses_is_noticed_although_looking_at_the_bus_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise RuntimeError("a driver's surprise")

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready(2))[0]
        lease = await rig.lease(ttl_s=2)
        json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 20}, lease=lease))
        monkeypatch.setattr(rig.host.watch, "look", fail)
        await asyncio.sleep(3)
        assert rig.sim(servo).output == 1

    play(scene, *PAIR)


def test_an_impostor_on_its_node_id_confirms_no_stop_of_a_servo_that_was_away() -> None:
    async def scene(rig: Rig) -> None:
        servo = next(one for one in await rig.ready(2) if one.node_id == 11)
        await commanded(rig, servo)
        await rig.cable.unplug()
        await asyncio.sleep(5)
        json(await rig.call("POST", "/stop", {"mode": "off"}))
        lost = rig.sim(servo)
        rig.bench.power(servo.uid, False)
        rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=7, node_id=11))
        await asyncio.sleep(5)
        await back(rig)
        await asyncio.sleep(5)
        stop = json(await rig.call("GET", "/stop"))
        assert [one["confirmed"] for one in stop["servos"] if one["uid"] == servo.uid] == [False]
        assert not lost.powered

    play(scene, *PAIR)


def test_a_controller_that_was_off_the_bus_between_two_looks_ends_commands_too() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready(2))[0]
        await commanded(rig, servo)
        rig.cable.bus_off()
        await asyncio.sleep(0.001)
        rig.bus.recover(rig.cable.inner)
        await asyncio.sleep(0.5)
        assert not rig.host.motion.driven(servo.uid)
        assert rig.sim(servo).output == 1
        assert rig.events("bus_lost")

    play(scene, *PAIR)


def test_a_brake_that_was_asked_for_and_not_answered_is_owed_as_the_brake() -> None:
    """Off in its place would let a load drop that the brake holds."""

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready(2))[0]
        await commanded(rig, servo)
        rig.bus.loss(100)
        problem(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "brake"}), "no_answer", 504)
        assert rig.sim(servo).output == 0
        rig.bus.loss(0)
        await asyncio.sleep(0.3)
        assert rig.sim(servo).output == 2
        await asyncio.sleep(5)
        assert rig.sim(servo).output == 2

    play(scene, *PAIR)

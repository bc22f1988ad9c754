"""Stop: explicit, immediate, latched, repeated until answered, and never behind anything (section 4.13)."""

import asyncio

from behaviour.rig import PLAIN, Rig, json, play, problem
from hornbill.servo.servo import State
from hornbill.sim.recipe import Recipe

THREE = [Recipe("BLA21-06U-A0", "1.300", servo_id=n, node_id=10 + n) for n in (1, 2, 3)]


def test_torque_goes_off_on_every_servo_within_milliseconds_and_the_latch_holds() -> None:
    async def scene(rig: Rig) -> None:
        servos = await rig.ready(3)
        began = asyncio.get_running_loop().time()
        state = json(await rig.call("POST", "/stop"))
        assert state["latched"] is True
        assert [one["confirmed"] for one in state["servos"]] == [True] * 3
        assert asyncio.get_running_loop().time() - began < 0.060
        for servo in servos:
            assert rig.sim(servo).output == 1
        assert json(await rig.call("GET", "/stop"))["latched"] is True

    play(scene, *THREE)


def test_motion_is_refused_until_it_is_cleared_and_clearing_turns_nothing_on() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        lease = await rig.lease()
        await rig.call("POST", "/stop")
        path = f"/servos/{servo.uid}"
        problem(await rig.call("POST", path + "/command", {"type": "angle", "value": 5}, lease=lease), "stopped", 423)
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

    play(scene)


def test_brake_is_asked_for_by_name() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        json(await rig.call("POST", "/stop", {"mode": "brake"}))
        assert rig.sim(servo).output == 2
        assert servo.raw("torque_mode") == 2

    play(scene)


def test_a_servo_that_does_not_answer_is_named_and_asked_until_it_does() -> None:
    async def scene(rig: Rig) -> None:
        quiet, other, _ = await rig.ready(3)
        rig.sim(quiet).conditions.drop_responses_pct = 100
        state = json(await rig.call("POST", "/stop"))
        told = {one["uid"]: one for one in state["servos"]}
        assert told[quiet.uid]["confirmed"] is False
        assert told[other.uid]["confirmed"] is True
        asked = sum(node == quiet.node_id and name == "0x20" for node, name, _ in rig.writes())
        assert asked >= 5
        rig.sim(quiet).conditions.drop_responses_pct = 0
        await asyncio.sleep(1)
        state = json(await rig.call("GET", "/stop"))
        assert all(one["confirmed"] for one in state["servos"])
        asked = len(rig.writes())
        await asyncio.sleep(2)
        assert len(rig.writes()) == asked, "once answered, nothing more is sent"

    play(scene, *THREE)


def test_a_servo_that_is_moving_coasts_out_and_stays_where_it_came_to_rest() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
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

    play(scene)


def test_a_command_that_waits_for_an_answer_is_not_carried_out_after_the_stop() -> None:
    """Torque on and commands are under way to a deaf servo; then stop; nothing may energise it when it hears again."""

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
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

    play(scene)


def test_stop_overtakes_a_full_read_of_every_servo() -> None:
    async def scene(rig: Rig) -> None:
        servos = await rig.ready(3)
        reading = [
            asyncio.create_task(rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true")) for servo in servos
        ]
        await asyncio.sleep(0.01)
        began = asyncio.get_running_loop().time()
        state = json(await rig.call("POST", "/stop"))
        assert all(one["confirmed"] for one in state["servos"])
        assert asyncio.get_running_loop().time() - began < 0.020
        for task in reading:
            json(await task)

    play(scene, *THREE)


def test_a_servo_that_restarts_while_stopped_is_stopped_again() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await rig.call("POST", "/stop")
        sim = rig.sim(servo)
        rig.bench.power(servo.uid, False)
        await asyncio.sleep(0.5)
        rig.bench.power(servo.uid, True)
        await asyncio.sleep(4)
        assert sim.starts == 2
        assert sim.output == 1, "it came up with torque on and must not stay so"
        assert json(await rig.call("GET", "/stop"))["servos"][0]["confirmed"] is True

    play(scene)


def test_stop_needs_no_bus_no_body_and_no_lease() -> None:
    async def scene(rig: Rig) -> None:
        state = json(await rig.call("POST", "/stop"))
        assert (state["latched"], state["servos"]) == (True, [])

    play(scene, connect=False)


def test_torque_off_and_brake_never_need_a_lease_even_while_somebody_holds_one() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await rig.lease()
        for mode, output in (("off", 1), ("brake", 2)):
            reading = json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": mode}))
            assert reading["value"] == mode
            assert rig.sim(servo).output == output
        assert servo.state is State.READY

    play(scene, PLAIN)


def test_one_press_that_arrives_by_two_roads_is_one_stop() -> None:
    async def scene(rig: Rig) -> None:
        await rig.ready()
        first = json(await rig.call("POST", "/stop?by=Page 1"))
        second = json(await rig.call("POST", "/stop?by=Page 1"))
        assert (first["at"], first["servos"]) == (second["at"], second["servos"])
        assert len(rig.events("stopped")) == 1
        await asyncio.sleep(2)
        third = json(await rig.call("POST", "/stop?by=Page 1"))
        assert third["at"] > first["at"]
        assert all(one["confirmed"] for one in third["servos"])

    play(scene)

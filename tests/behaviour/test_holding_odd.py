"""Odd ends of a held button: its page closes, its run was taken over, its lease is somebody else's by now."""

import asyncio

import pytest

from behaviour.rig import Rig, Socket, json, play, problem
from behaviour.test_holding import FOR_S, SPEEDY, held, ready, turns
from hornbill.sim.bench.recipe import Recipe


def plain(value: float) -> dict[str, object]:
    return {"type": "speed", "value": value}


@pytest.mark.parametrize("later_s", [0.0, 0.0002])
@pytest.mark.parametrize("hold", [True, False])
def test_a_page_that_closes_as_the_button_is_let_go_still_brakes(hold: bool, later_s: float) -> None:
    async def scene(rig: Rig) -> None:
        servo, lease = await ready(rig)  # renewed by nobody for a minute, and by no socket: it outlives the page
        page = Socket(rig.app)
        run = held if hold else plain
        page.say(type="command", lease=lease, commands=[{"uid": servo.uid, **run(30)}])
        await asyncio.sleep(FOR_S * 0.7)
        assert turns(rig, servo)
        for key in ("torque_mode", "angle_limit_cw", "angle_limit_ccw"):
            servo.forget(key)  # so that the brake has to look first
        page.say(type="command", lease=lease, commands=[{"uid": servo.uid, **run(0)}])
        await asyncio.sleep(later_s)
        await page.close()
        await asyncio.sleep(0.3)
        assert not turns(rig, servo)
        assert rig.host.leases.current(rig.host.base.now()) is not None

    play(scene, SPEEDY)


def test_what_only_goes_on_begins_nothing_after_another_command() -> None:
    async def scene(rig: Rig) -> None:
        servo, lease = await ready(rig)
        path = f"/servos/{servo.uid}/command"
        json(await rig.call("POST", path, held(30), lease=lease))
        await asyncio.sleep(0.1)
        json(await rig.call("POST", path, plain(12), lease=lease))
        problem(await rig.call("POST", path, held(40, renew=True), lease=lease), "busy", 409)
        assert ("0x01", 40) not in [(row, raw) for _, row, raw in rig.writes()]

    play(scene, SPEEDY)


def test_the_end_of_a_run_brakes_no_run_that_somebody_else_began_since() -> None:
    async def scene(rig: Rig) -> None:
        servo, lease = await ready(rig)
        path = f"/servos/{servo.uid}"
        json(await rig.call("POST", f"{path}/command", held(30), lease=lease))
        json(await rig.call("DELETE", f"/leases/{lease}"))
        other = await rig.lease()
        json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=other))
        json(await rig.call("POST", f"{path}/command", plain(30), lease=other))
        await asyncio.sleep(FOR_S + 0.2)
        assert rig.host.motion.driven(servo.uid)
        assert turns(rig, servo)

    play(scene, SPEEDY)


def test_a_stop_ends_a_run_and_what_goes_on_with_it() -> None:
    async def scene(rig: Rig) -> None:
        servo, lease = await ready(rig)
        path = f"/servos/{servo.uid}/command"
        json(await rig.call("POST", path, held(30), lease=lease))
        json(await rig.call("POST", "/stop"))
        problem(await rig.call("POST", path, held(30, renew=True), lease=lease), "stopped", 423)
        json(await rig.call("DELETE", "/stop"))
        for value in (30, 40):
            again = await rig.call("POST", path, held(value, renew=True), lease=lease)
            assert again.status_code == 409
        await asyncio.sleep(0.5)
        assert not turns(rig, servo)

    play(scene, SPEEDY, Recipe("BLA21-12U-A0", "1.300", servo_id=3, node_id=13))

"""Speed and torque while a button is held: however the release is lost, the servo brakes or torque goes off."""

import asyncio

import pytest

from behaviour.actions import move, torque, write
from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

SPEEDY = Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12, rom={"speed_torque_control": 1, "timeout_action": 0})
"""With 0x26 hold it keeps its last command indefinitely: only hornbill ends a run."""

FOR_S = 0.4


async def ready(rig: Rig) -> tuple[Servo, str]:
    servo, lease = (await rig.ready())[0], await rig.lease()
    await torque(rig, servo, "on", lease)
    return servo, lease


def path(servo: Servo) -> str:
    return f"/servos/{servo.uid}/command"


def held(value: float, kind: str = "speed", *, renew: bool = False) -> dict[str, object]:
    return {"type": kind, "value": value, "hold": {"for_s": FOR_S, "renew": renew}}


def send(socket: Socket, servo: Servo, lease: str, value: float, *, renew: bool = False) -> None:
    socket.send(type="command", lease=lease, commands=[{"uid": servo.uid, **held(value, renew=renew)}])


def turns(rig: Rig, servo: Servo) -> bool:
    return abs(rig.sim(servo).speed_rpm) > 5


def plain(value: float) -> dict[str, object]:
    return {"type": "speed", "value": value}


@pytest.mark.parametrize(("kind", "row"), [("speed", "0x01"), ("torque", "0x02")])
@scene(SPEEDY)
async def test_a_run_that_is_not_renewed_is_braked(rig: Rig, kind: str, row: str) -> None:
    servo, lease = await ready(rig)
    response = json(await rig.call("POST", path(servo), held(20, kind), lease=lease))
    assert "rotates continuously" in response["warnings"][0]
    await asyncio.sleep(FOR_S * 0.8)
    assert turns(rig, servo)
    await asyncio.sleep(FOR_S * 0.2 + 0.02)
    assert rig.writes()[-1] == (12, row, 0)
    await asyncio.sleep(0.3)
    assert not turns(rig, servo)
    assert "not renewed in time" in rig.events("hold_ended")[0].text
    assert json(await rig.call("GET", "/leases")) != [], "only the run ended"


@scene(SPEEDY)
async def test_a_run_lasts_as_long_as_it_is_renewed_in_time(rig: Rig) -> None:
    servo, lease = await ready(rig)
    page = Socket(rig.app)
    page.send(type="heartbeat", lease=lease)
    send(page, servo, lease, 30)
    for _ in range(30):
        await asyncio.sleep(0.1)
        assert turns(rig, servo) or rig.sim(servo).angle_deg < 5
        send(page, servo, lease, 30, renew=True)
    starts = [one for one in rig.writes() if one[1] == "0x01"]
    assert {raw for _, _, raw in starts} == {30}
    # the page hangs: its socket and lease stay, and no renewal comes
    await asyncio.sleep(FOR_S + 0.3)
    assert not turns(rig, servo)
    send(page, servo, lease, 30, renew=True)
    assert (await page.receive("error"))["code"] == "busy"
    problem(await rig.call("POST", path(servo), held(30, renew=True), lease=lease), "busy", 409)
    await asyncio.sleep(0.3)
    assert not turns(rig, servo), "a late renewal does not restart a run"


@scene(SPEEDY)
async def test_a_renewal_that_arrives_together_with_the_start_does_not_replace_it(rig: Rig) -> None:
    servo, lease = await ready(rig)
    page = Socket(rig.app)
    page.send(type="heartbeat", lease=lease)
    send(page, servo, lease, 30)
    send(page, servo, lease, 30, renew=True)  # together, as after a delay of the network or the server
    await asyncio.sleep(0.2)
    assert turns(rig, servo)
    await asyncio.sleep(FOR_S + 0.1)
    assert not turns(rig, servo)
    send(page, servo, lease, 30)
    send(page, servo, lease, 0)
    send(page, servo, lease, 30, renew=True)  # out of order: the release stays
    await asyncio.sleep(0.1)
    assert rig.writes()[-1] == (12, "0x01", 0)
    assert not turns(rig, servo)


@scene(SPEEDY)
async def test_a_release_brakes_immediately_and_a_later_angle_is_not_braked(rig: Rig) -> None:
    servo, lease = await ready(rig)
    page = Socket(rig.app)
    send(page, servo, lease, 30)
    await asyncio.sleep(0.2)
    send(page, servo, lease, 0)
    await asyncio.sleep(0.02)
    assert rig.writes()[-1] == (12, "0x01", 0)
    await asyncio.sleep(FOR_S)
    assert rig.events("hold_ended") == []
    before = len(rig.writes())
    json(await rig.call("POST", path(servo), held(10), lease=lease))
    await asyncio.sleep(0.1)
    await move(rig, servo, lease)
    await asyncio.sleep(FOR_S + 1)
    assert abs(rig.sim(servo).angle_deg - 20) < 1
    assert not [one for one in rig.writes()[before:] if one[1:] == ("0x01", 0)]


@scene(SPEEDY)
async def test_a_release_does_not_wait_for_an_acknowledgement_and_without_one_becomes_torque_off(rig: Rig) -> None:
    servo, lease = await ready(rig)
    page = Socket(rig.app)
    send(page, servo, lease, 30)
    await asyncio.sleep(0.2)
    rig.sim(servo).conditions.mute = True
    send(page, servo, lease, 40, renew=True)  # received, and never acknowledged
    await asyncio.sleep(0.02)
    send(page, servo, lease, 0)
    send(page, servo, lease, 0)
    await asyncio.sleep(0.02)
    assert rig.writes()[-1] == (12, "0x01", 0)
    await asyncio.sleep(0.45)
    assert rig.writes()[-1] == (12, "0x20", 1), "an unacknowledged brake becomes torque off"
    assert rig.sim(servo).output == 1
    await asyncio.sleep(0.7)
    after = [one for one in rig.writes() if one[1] == "0x20"]
    assert len(after) > 5, "it is repeated"
    assert set(after[1:]) == {(12, "0x20", 1)}
    rig.sim(servo).conditions.mute = False
    await asyncio.sleep(1.2)
    assert rig.sim(servo).output == 1
    assert not turns(rig, servo)


@pytest.mark.parametrize("released", [True, False])
@scene(SPEEDY)
async def test_a_brake_after_a_long_run_does_not_wait_for_reads(rig: Rig, released: bool) -> None:
    servo, lease = await ready(rig)
    page = Socket(rig.app)
    page.send(type="heartbeat", lease=lease)
    send(page, servo, lease, 30)
    for _ in range(15):  # until the readings that permitted it are too old for a new command
        await asyncio.sleep(0.1)
        send(page, servo, lease, 30, renew=True)
    await asyncio.sleep(0.01)
    rig.sim(servo).conditions.mute = True  # so that a read would take until torque goes off
    if released:
        send(page, servo, lease, 0)
    else:
        await asyncio.sleep(FOR_S - 0.01)
    await asyncio.sleep(0.005)
    assert rig.writes()[-1] == (12, "0x01", 0)
    await asyncio.sleep(0.3)
    assert not turns(rig, servo)
    assert rig.sim(servo).output == 0, "braked, before torque goes off"


@pytest.mark.parametrize("end", ["socket", "lease", "stop"])
@scene(SPEEDY)
async def test_every_end_of_motion_control_ends_a_run_with_torque_off(rig: Rig, end: str) -> None:
    servo, lease = await ready(rig)
    page = Socket(rig.app)
    page.send(type="heartbeat", lease=lease)
    send(page, servo, lease, 30)
    await asyncio.sleep(0.3)
    if end == "socket":
        await page.close()
    elif end == "lease":
        json(await rig.call("DELETE", f"/leases/{lease}"))
    else:
        page.send(type="stop")
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1
    written = len(rig.writes())
    await asyncio.sleep(FOR_S + 0.5)
    assert {name for _, name, _ in rig.writes()[written:]} <= {"0x20"}, "no command follows"
    if end != "socket":
        await page.close()


@scene(SPEEDY)
async def test_a_move_in_progress_ends_when_a_run_begins(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    servo, lease = await ready(rig)
    freshen = rig.host.motion.freshen

    async def slowly(servo: Servo, kind: str, max_age_s: float = 1.0) -> None:
        """Reads before an angle take longer than those before a speed."""
        await freshen(servo, kind, max_age_s)
        if kind == "angle":
            await asyncio.sleep(0.1)

    monkeypatch.setattr(rig.host.motion, "freshen", slowly)
    await move(rig, servo, lease, 90, profile={"speed_deg_s": 20, "accel_deg_s2": 80})
    page = Socket(rig.app)
    await asyncio.sleep(0.35)  # in the middle of an angle
    send(page, servo, lease, -30)
    await asyncio.sleep(0.05)
    written = len(rig.writes())
    await asyncio.sleep(0.25)
    assert {row for _, row, _ in rig.writes()[written:]} <= {"0x01"}
    assert turns(rig, servo)
    send(page, servo, lease, 0)
    await asyncio.sleep(0.3)
    assert not turns(rig, servo)


@scene(SPEEDY)
async def test_a_run_that_cannot_be_held_is_rejected(rig: Rig) -> None:
    servo, lease = await ready(rig)

    async def refused(body: dict[str, object], code: str, status: int) -> None:
        problem(await rig.call("POST", path(servo), body, lease=lease), code, status)

    await refused(held(1000), "out_of_range", 422)
    await refused(held(10, "angle"), "invalid_value", 422)
    await asyncio.sleep(FOR_S + 0.2)
    assert rig.events("hold_ended") == [], "nothing ran"
    assert rig.sim(servo).output == 0, "a rejection leaves torque on"
    json(await rig.call("POST", path(servo), held(30), lease=lease))
    await asyncio.sleep(0.1)
    json(await rig.call("POST", path(servo), plain(12), lease=lease))
    await refused(held(40, renew=True), "busy", 409)  # another command came since
    assert ("0x01", 40) not in [(row, raw) for _, row, raw in rig.writes()]
    await write(rig, servo, lease, speed_torque_control=False)
    await refused(held(10), "mode_off", 409)


@pytest.mark.parametrize("later_s", [0.0, 0.0002])
@pytest.mark.parametrize("hold", [True, False])
@scene(SPEEDY)
async def test_a_page_that_closes_on_release_still_brakes(rig: Rig, hold: bool, later_s: float) -> None:
    servo, lease = await ready(rig)  # not tied to the socket: it outlives the page
    page = Socket(rig.app)
    run = held if hold else plain
    page.send(type="command", lease=lease, commands=[{"uid": servo.uid, **run(30)}])
    await asyncio.sleep(FOR_S * 0.7)
    assert turns(rig, servo)
    for key in ("torque_mode", "angle_limit_cw", "angle_limit_ccw"):
        servo.forget(key)  # so that the brake must read them first
    page.send(type="command", lease=lease, commands=[{"uid": servo.uid, **run(0)}])
    await asyncio.sleep(later_s)
    await page.close()
    await asyncio.sleep(0.3)
    assert not turns(rig, servo)
    assert rig.host.leases.current(rig.host.base.now()) is not None


@scene(SPEEDY)
async def test_the_end_of_a_run_does_not_brake_a_later_one(rig: Rig) -> None:
    servo, lease = await ready(rig)
    json(await rig.call("POST", path(servo), held(30), lease=lease))
    json(await rig.call("DELETE", f"/leases/{lease}"))
    servo, other = await ready(rig)
    json(await rig.call("POST", path(servo), plain(30), lease=other))
    await asyncio.sleep(FOR_S + 0.2)
    assert rig.host.motion.is_commanded(servo.uid)
    assert turns(rig, servo)


@scene(SPEEDY, Recipe("BLA21-12U-A0", "1.300", servo_id=3, node_id=13))
async def test_a_stop_ends_a_run_and_its_renewals(rig: Rig) -> None:
    servo, lease = await ready(rig)
    json(await rig.call("POST", path(servo), held(30), lease=lease))
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", path(servo), held(30, renew=True), lease=lease), "stopped", 423)
    json(await rig.call("DELETE", "/stop"))
    for value in (30, 40):
        again = await rig.call("POST", path(servo), held(value, renew=True), lease=lease)
        assert again.status_code == 409
    await asyncio.sleep(0.5)
    assert not turns(rig, servo)

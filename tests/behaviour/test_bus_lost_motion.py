"""A bus lost while servos are commanded: commands end, torque off is pending, and nothing resumes automatically."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest

from behaviour.actions import move, torque
from behaviour.losing import PAIR, THREE, WITHOUT_ID, Loss, back, commanded, each_loss, unplugged
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.errors import BusDisconnected
from hornbill.servo.device.servo import Servo


async def started(rig: Rig) -> tuple[Servo, str]:
    """A commanded servo of two, and its lease."""
    servo = (await rig.ready(2))[0]
    return servo, await commanded(rig, servo)


async def back_without_torque(rig: Rig, servo: Servo) -> None:
    """Restore the bus; 0.1 s later torque must be off."""
    await back(rig)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@each_loss
@scene(*PAIR)
async def test_commands_end_and_torque_off_is_the_first_write_afterwards(rig: Rig, lose: Loss) -> None:
    servo, lease = await started(rig)
    await lose(rig)
    await asyncio.sleep(0.1)
    assert not rig.host.motion.is_commanded(servo.uid)
    assert servo.title in rig.events("bus_lost")[0].text
    written = len(rig.writes())
    await back(rig)
    await until(lambda: rig.sim(servo).output, 0.1, 0.001)
    await asyncio.sleep(5)
    assert {write[1:] for write in rig.writes()[written:]} == {("0x20", 1)}, "nothing else automatically"
    assert rig.host.torque_off.servos() == []
    json(await rig.call("PUT", f"/leases/{lease}"))


@pytest.mark.parametrize("away_s", [0.5, 60.0])
@scene(*PAIR)
async def test_torque_off_is_pending_while_the_bus_is_lost(rig: Rig, away_s: float) -> None:
    servo, other = await rig.ready(2)
    await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(away_s)
    assert rig.sim(servo).output == 0
    assert len(rig.events("no_response")) == (away_s > 10), "reported once"
    await back_without_torque(rig, servo)
    assert rig.sim(other).output == 0, "it was not commanded"
    await asyncio.sleep(10)
    written = len(rig.writes())
    await asyncio.sleep(10)
    assert len(rig.writes()) == written
    assert rig.host.torque_off.servos() == []
    assert len(rig.events("torque_off")) == (away_s > 10)


Case = Callable[[Rig, Servo, str], Awaitable[None]]


async def lease_expires(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("DELETE", f"/leases/{lease}"))
    other = await rig.lease(ttl_s=2)
    await torque(rig, servo, "on", other)
    await move(rig, servo, other)
    await rig.cable.unplug()
    await asyncio.sleep(20)


async def lease_was_released_just_before(rig: Rig, _servo: Servo, lease: str) -> None:
    rig.bus.loss(100)
    await rig.call("DELETE", f"/leases/{lease}")
    await rig.cable.unplug()
    await asyncio.sleep(60)


async def command_during_the_loss(rig: Rig, servo: Servo, lease: str) -> None:
    """The servo need not be read before it, as all values are recent."""
    await rig.cable.unplug()
    await asyncio.sleep(0.05)
    with pytest.raises(BusDisconnected, match="The bus is lost"):
        await rig.host.motion.command(servo, lease, "angle", 5, clamp=False)
    assert rig.host.torque_off.pending(servo.uid)
    assert not rig.host.motion.is_commanded(servo.uid)


async def torque_off_before_the_loss_is_noticed(rig: Rig, servo: Servo, _lease: str) -> None:
    rig.bus.loss(100)
    pressed = asyncio.create_task(rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await asyncio.sleep(0.001)
    await rig.cable.unplug()
    problem(await pressed, "bus_disconnected", 503)
    await asyncio.sleep(2)


async def stop_is_pressed_and_cleared(rig: Rig, _servo: Servo, _lease: str) -> None:
    await rig.cable.unplug()
    await asyncio.sleep(1)
    json(await rig.call("POST", "/stop"))
    json(await rig.call("DELETE", "/stop"))
    await asyncio.sleep(30)


@pytest.mark.parametrize(
    "case",
    [
        lease_expires, lease_was_released_just_before, command_during_the_loss, torque_off_before_the_loss_is_noticed,
        stop_is_pressed_and_cleared,
    ],
)  # fmt: skip
@scene(*PAIR)
async def test_nothing_cancels_a_pending_torque_off(rig: Rig, case: Case) -> None:
    servo, lease = await started(rig)
    await case(rig, servo, lease)
    rig.bus.loss(0)
    await back_without_torque(rig, servo)


@scene(*PAIR)
async def test_a_loss_shorter_than_a_stall_of_the_server_counts(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    servo, _ = await started(rig)
    check = rig.host.watch.check
    monkeypatch.setattr(rig.host.watch, "check", lambda: None)
    await rig.cable.unplug()
    rig.cable.plug_in()
    await asyncio.sleep(1)
    monkeypatch.setattr(rig.host.watch, "check", check)
    await asyncio.sleep(0.2)
    assert rig.sim(servo).output == 1
    assert len(rig.events("bus_lost")) == len(rig.events("bus_back")) == 1


@scene(*PAIR)
async def test_torque_off_waits_for_a_servo_that_is_switched_off(rig: Rig) -> None:
    servo, _ = await started(rig)
    await rig.cable.unplug()
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    await back(rig)
    await asyncio.sleep(60)
    assert len(rig.events("no_response")) == 1
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(8)
    assert rig.sim(servo).output == 1
    assert rig.host.torque_off.servos() == []


@scene(*PAIR)
async def test_torque_off_stays_pending_over_a_disconnect(rig: Rig) -> None:
    servo, _ = await started(rig)
    await rig.cable.unplug()
    await asyncio.sleep(5)
    json(await rig.call("DELETE", "/bus"))
    assert servo.title in rig.events("no_response")[0].text
    await asyncio.sleep(5)
    rig.cable.plug_in()
    json(await rig.call("PUT", "/bus", {"address": "memory:other", "bitrate": 1_000_000}))
    await rig.ready()
    assert rig.sim(servo).output == 1


@scene(WITHOUT_ID, THREE[1])
async def test_another_servo_on_its_node_id_does_not_acknowledge_for_it(rig: Rig) -> None:
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
async def test_a_new_command_under_a_lease_ends_a_pending_torque_off(rig: Rig) -> None:
    servo, lease = await started(rig)
    await rig.cable.unplug()
    await asyncio.sleep(1)
    rig.sim(servo).conditions.refuse_keys.add("torque_mode")
    await back(rig)
    await asyncio.sleep(2)
    assert rig.host.torque_off.servos() == [servo]
    tried = len(rig.writes())
    await until(lambda: len(rig.writes()) != tried, every_s=0.001)  # the next attempt is 0.25 s later
    await asyncio.sleep(0.02)
    rig.sim(servo).conditions.refuse_keys.clear()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": -20}, lease=lease))
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 0
    assert rig.sim(servo).angle_deg == pytest.approx(-20, abs=1)
    assert rig.host.torque_off.servos() == []


@scene(*PAIR)
async def test_requests_around_a_loss_are_not_performed_later(rig: Rig) -> None:
    """Commands of every kind are in progress at the moment of the loss, and requested again during it."""
    servo = (await rig.ready(2))[0]
    path = f"/servos/{servo.uid}"
    lease = await commanded(rig, servo, 5)
    await torque(rig, servo, "off")
    await asyncio.sleep(1)
    where = rig.sim(servo).angle_deg
    tasks: list[asyncio.Task[object]] = []

    def request() -> None:
        for end, body in (("torque", {"mode": "on"}), ("command", {"type": "angle", "value": 90}), ("restart", None)):
            tasks.append(asyncio.create_task(rig.call("POST", f"{path}/{end}", body, lease=lease)))

    rig.bus.loss(100)
    request()
    await asyncio.sleep(0.01)
    await rig.cable.unplug()
    request()
    await asyncio.sleep(0.1)
    request()
    rig.bus.loss(0)
    await asyncio.gather(*tasks)
    await back(rig)
    await asyncio.sleep(10)
    assert rig.sim(servo).output == 1
    assert rig.sim(servo).starts == 1
    assert rig.sim(servo).angle_deg == pytest.approx(where, abs=0.5)


@pytest.mark.parametrize("after_s", [0.001, 0.01, 0.03, 0.06])
@scene(*PAIR)
async def test_a_command_in_progress_fails_with_the_loss(rig: Rig, after_s: float) -> None:
    servo, lease = await started(rig)
    rig.bus.loss(100)
    body = {"type": "angle", "value": 90}
    waiting = asyncio.create_task(rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
    await asyncio.sleep(after_s)
    await rig.cable.unplug()
    problem(await waiting, "bus_disconnected", 503)


@each_loss
@pytest.mark.parametrize(("mode", "output"), [("off", 1), ("brake", 2)])
@scene(*THREE)
async def test_a_stop_during_the_loss_is_sent_afterwards(rig: Rig, lose: Loss, mode: str, output: int) -> None:
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
    await asyncio.sleep(1.1)  # its next NodeStatus shows which servo it is, and only then it counts as confirmed
    assert all(one["confirmed"] for one in json(await rig.call("GET", "/stop"))["servos"])
    await asyncio.sleep(10)
    assert [rig.sim(servo).output for servo in servos] == [output] * 3

"""A computer that was suspended, or whose clock was set: times agree, and a ROM that may have changed is unknown."""

import asyncio

import pytest

from behaviour.rig import Rig, Socket, json
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State

HOUR = 3600.0


def suspend(rig: Rig, seconds: float) -> None:
    """Suspend the computer: the wall clock goes on, the monotonic clock does not."""
    rig.walls.wrong_s += seconds


def run_for(rig: Rig, servo: Servo, seconds: float) -> None:
    """Let the servo run for that much longer than the monotonic clock shows."""
    rig.sim(servo)._device.started_at -= seconds  # pyright: ignore[reportPrivateUsage]


def saved_by_another_tool(rig: Rig, servo: Servo) -> None:
    memory = rig.sim(servo).memory
    memory._rom[0x2C] = 77  # pyright: ignore[reportPrivateUsage]
    memory.put(0x2C, 77)


async def read_again(rig: Rig) -> Servo:
    """The servo, once its rows have been read again."""
    async with asyncio.timeout(20):
        while True:
            servo = rig.host.fleet.all()[0]
            row = servo.registers.get("angle_p_gain")
            if servo.state is State.READY and row is not None and row.raw is not None and row.at is not None:
                return servo
            await asyncio.sleep(0.1)


@pytest.mark.parametrize("step_s", [8 * HOUR, -400 * 24 * HOUR, 0.1])
@scene()
async def test_times_after_a_step_of_the_clock_agree(rig: Rig, servo: Servo, step_s: float) -> None:
    before = rig.host.base.utc(rig.host.base.now())
    at = rig.host.base.now()
    await asyncio.sleep(1)
    suspend(rig, step_s)
    await asyncio.sleep(1)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    row = json(await rig.call("GET", "/audit"))[0]
    reading = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/torque_mode"))
    job = json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    tolerance = 0.25 if abs(step_s) < 0.25 else 0.1
    assert row["at"] == pytest.approx(rig.walls(), abs=15)
    assert reading["at"] == pytest.approx(row["at"], abs=1 + tolerance)
    assert job["created_at"] == pytest.approx(row["at"], abs=5)
    assert rig.host.base.utc(at) == before, "an earlier time is unchanged"


@scene()
async def test_a_servo_saved_by_another_tool_during_a_suspend_has_an_unknown_rom(rig: Rig, servo: Servo) -> None:
    """Last seen at 9:00, suspended from 9:01 to 17:01, saved and restarted at 12:00, seen again at 17:02."""
    await asyncio.sleep(60)
    assert servo.rom()["angle_p_gain"] == 40
    rig.sim(servo).conditions.mute = True
    await asyncio.sleep(60)
    suspend(rig, 8 * HOUR)
    saved_by_another_tool(rig, servo)
    rig.bench.power(servo.uid, False)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(60)
    run_for(rig, servo, 5 * HOUR)
    rig.sim(servo).conditions.mute = False
    await asyncio.sleep(2)
    servo = await read_again(rig)
    assert servo.raw("angle_p_gain") == 77
    assert servo.rom().get("angle_p_gain") is None
    assert servo.differs_from_rom("angle_p_gain") is None


@pytest.mark.parametrize("restarted", [True, False])
@scene()
async def test_a_restart_during_a_suspend_is_detected(rig: Rig, servo: Servo, restarted: bool) -> None:
    await asyncio.sleep(60)
    boot_count = servo.boot_count
    suspend(rig, 8 * HOUR)
    run_for(rig, servo, 5 * HOUR if restarted else 8 * HOUR)
    if restarted:
        saved_by_another_tool(rig, servo)
    await asyncio.sleep(3)
    servo = await read_again(rig)
    assert servo.boot_count == boot_count + restarted
    assert servo.rom().get("angle_p_gain") == (None if restarted else 40)


@scene()
async def test_setting_the_clock_is_no_restart(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 20}, lease=lease))
    for step in (400 * 24 * HOUR, -8 * HOUR, 2.0):
        suspend(rig, step)
        await asyncio.sleep(5)
    assert (servo.boot_count, rig.events("restarted"), rig.events("command_ended")) == (0, [], [])
    assert servo.rom()["angle_p_gain"] == 40
    assert rig.sim(servo).output == 0


@scene()
async def test_a_page_receives_the_new_offset_of_telemetry_times(rig: Rig) -> None:
    await rig.ready()
    socket = Socket(rig.app)
    before = (await socket.receive("hello"))["utc_offset"]
    socket.send(type="subscribe", topics=["servos", "telemetry"])
    await asyncio.sleep(3)
    assert [one for one in socket.received() if one["type"] == "hello"] == []
    suspend(rig, 8 * HOUR)
    again = await socket.receive("hello")
    assert again["utc_offset"] - before == pytest.approx(8 * HOUR, abs=0.01)
    await socket.close()

"""The Python client against a host with simulated servos."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import httpx
import pytest

from behaviour.rig import Rig, play
from behaviour.test_changes import EIGHT, once_written
from hornbill import errors
from hornbill.client import AsyncHornbill, AsyncServo
from hornbill.units import Uid


def with_client(act: Callable[[Rig, AsyncHornbill, AsyncServo], Awaitable[None]]) -> Callable[[], None]:
    """Decorate a coroutine function: a test that plays it with one plain servo and a client of its host."""

    async def scene(rig: Rig) -> None:
        transport = httpx.ASGITransport(rig.app, raise_app_exceptions=True)
        await rig.ready()
        async with AsyncHornbill("http://127.0.0.1", transport=transport, by="rig") as hornbill:
            await act(rig, hornbill, await hornbill.find(servo_id=1))

    return lambda: play(scene)


@with_client
async def test_a_lease_lasts_as_long_as_its_block(rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo) -> None:
    async with hornbill.lease("rig"):
        await servo.torque("on")
        moved = await servo.move(30, timeout_s=3)
        assert moved["settled"]
        assert await servo.read("current_angle") == pytest.approx(30, abs=0.5)
    assert await servo.read("torque_mode") == "off"
    async with hornbill.lease("rig", ttl_s=0.5):
        await servo.torque("on")
        await servo.move(10)
        await asyncio.sleep(20)
        assert await servo.read("torque_mode") == "on"
    assert await hornbill.request("GET", "/leases") == []

    async def ends(*, heartbeat: bool) -> None:
        async with hornbill.lease("rig", ttl_s=1.0, heartbeat=heartbeat):
            await servo.torque("on")
            await servo.move(10)
            if heartbeat:
                _ = 1 / 0
            await asyncio.sleep(3)
            assert await servo.read("torque_mode") == "off", "without heartbeats"

    for heartbeat, error in ((True, ZeroDivisionError), (False, errors.LeaseRequired)):
        with pytest.raises(error):
            await ends(heartbeat=heartbeat)
        assert await servo.read("torque_mode") == "off"


@with_client
async def test_a_horn_that_did_not_arrive_or_stay_raises_did_not_move(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo
) -> None:
    conditions = rig.bench.servo(Uid(servo.uid)).conditions
    free, conditions.load_inertia = conditions.load_inertia, 1e7
    async with hornbill.lease("rig"):
        await servo.torque("on")
        with pytest.raises(errors.DidNotMove) as caught:
            await servo.move(40, timeout_s=1)
        assert (caught.value.facts["target_deg"], caught.value.facts["unmet"]) == (40, "band")
        assert abs(float(str(caught.value.facts["angle_deg"]))) < 5
        assert "is not within 0.5° of 40° but at " in caught.value.detail
        conditions.load_inertia = free
        with pytest.raises(errors.DidNotMove) as caught:
            await servo.move(10, timeout_s=2, dwell_s=5)
    assert caught.value.facts["unmet"] == "dwell"
    assert "is within 0.5° of 10°, but" in caught.value.detail
    assert "of 5 s" in caught.value.detail


@with_client
async def test_each_failure_has_its_own_error(rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo) -> None:
    with pytest.raises(errors.Unknown, match=f"label 'rear'.*Known servos: {servo.title}"):
        await hornbill.find(label="rear", within_s=0.0)
    with pytest.raises(errors.OutOfRange) as outside:
        await servo.write("overcurrent_limit", 500)
    assert outside.value.status == 422
    assert outside.value.facts["unit"] == "A"
    await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"refuse_keys": ["angle_boost"]})
    with pytest.raises(errors.Refused):
        await servo.read("angle_boost")
    await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"mute": True})
    with pytest.raises(errors.NoResponse):
        await servo.read("angle_p_gain")
    with pytest.raises(errors.NoResponse) as caught:
        await servo.save()
    job: Any = caught.value.facts["job"]
    assert (job["kind"], job["state"]) == ("save", "failed")


@with_client
async def test_values_are_written_and_saved_with_progress(rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo) -> None:
    before = await servo.read_all()
    planned = await servo.write_many({"angle_p_gain": 42}, dry_run=True)
    assert planned["outcome"] == "planned"
    assert await servo.read("angle_p_gain") != 42
    seen: list[float] = []
    wanted = {"angle_p_gain": 42, "smoothing": False}
    await servo.write_many(
        wanted, save=True, if_match=before["revision"], on_progress=lambda job: seen.append(job["progress"])
    )
    assert (await servo.reading("angle_p_gain"))["rom"] == 42
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    with pytest.raises(errors.StaleRevision):
        await servo.write_many({"angle_p_gain": 43}, if_match=before["revision"])


@with_client
async def test_a_rolled_back_change_raises_an_error(rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo) -> None:
    refused = rig.bench.servo(Uid(servo.uid)).conditions.refuse_keys
    once_written(rig, "timeout_time", lambda: refused.add("angle_p_gain"))
    with pytest.raises(errors.Refused) as caught:
        await servo.write_many(EIGHT)
    assert caught.value.facts["outcome"] == "rolled_back"
    assert await servo.read("timeout_time") != EIGHT["timeout_time"]


@with_client
async def test_stop_latches_and_is_cleared(rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo) -> None:
    async with hornbill.lease("rig"):
        await servo.torque("on")
        state = await hornbill.stop(reason="smoke")
        assert (state["by"], state["reason"]) == ("rig", "smoke")
        assert [one["confirmed"] for one in state["servos"]] == [True]
        with pytest.raises(errors.Stopped):
            await servo.move(10)
        await hornbill.clear_stop()
        assert await servo.read("torque_mode") == "off"


@with_client
async def test_a_simulated_servo_is_added_changed_compared_and_removed(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo
) -> None:
    changed = await hornbill.sim.set(servo, load_pct=20.0, voltage_v=10.5, behaviour={"erase_rom": True})
    assert (changed["load_pct"], changed["voltage_v"]) == (20.0, 10.5)
    assert rig.bench.servo(Uid(servo.uid)).conditions.load_pct == 20.0
    with pytest.raises(errors.InvalidValue, match="erase_rom"):
        await hornbill.sim.set(servo, behaviour={"unknown": True})  # pyright: ignore[reportArgumentType]
    added = await hornbill.sim.add(model="BLA21-06U-A0", servo_id=7)
    assert [one["uid"] for one in await hornbill.sim.servos()] == [servo.uid, added["uid"]]
    assert (await hornbill.sim.truth(added["uid"]))["horn_deg"] == pytest.approx(0, abs=1)
    await hornbill.sim.remove(added["uid"])
    with pytest.raises(errors.Unknown):
        await hornbill.sim.servo(added["uid"])
    with pytest.raises(errors.Unknown, match="no simulated autopilot"):
        await hornbill.sim.autopilot()
    assert (await hornbill.sim.add_autopilot("px4"))["armed"] is False
    assert (await hornbill.sim.set_autopilot(armed=True))["armed"] is True
    await hornbill.sim.remove_autopilot()

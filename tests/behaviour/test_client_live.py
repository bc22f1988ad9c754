"""Live events and samples of the Python client: resumed after a lost connection, with every loss reported."""

import asyncio
import itertools
from collections.abc import Awaitable, Callable
from contextlib import aclosing
from typing import Any

import pytest

from behaviour.rig import Rig, play
from behaviour.streaming import StreamingTransport
from hornbill.client import AsyncHornbill, AsyncServo, Gap, Sample, ServerUnreachable
from hornbill.client.aio import live as aio
from hornbill.units import Uid

TTL_S = 3.0
"""Lifetime of a subscription without renewal, for these tests."""

Act = Callable[[Rig, AsyncHornbill, AsyncServo, StreamingTransport], Awaitable[None]]


def live(act: Act) -> Callable[[], None]:
    """Decorate a coroutine function: a test that plays it with one plain servo, a client, and its connection."""

    async def scene(rig: Rig) -> None:
        transport = StreamingTransport(rig.app)
        await rig.ready()
        async with AsyncHornbill("http://127.0.0.1", transport=transport, by="rig") as hornbill:
            servo = await hornbill.find(servo_id=1)
            async with asyncio.timeout(600.0):
                await act(rig, hornbill, servo, transport)

    def test() -> None:
        play(scene)

    return test


@pytest.fixture
def renewed_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aio, "TTL_S", TTL_S)
    monkeypatch.setattr(aio, "RENEW_S", TTL_S / 3)


@pytest.mark.usefixtures("renewed_often")
@live
async def test_samples_arrive_at_the_rate_and_the_subscription_ends_with_the_block(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo, transport: StreamingTransport
) -> None:
    found: list[Sample] = []
    async with aclosing(hornbill.telemetry([servo], ["current_angle", "current_torque"], rate_hz=20)) as samples:
        async for sample in samples:
            assert isinstance(sample, Sample)
            found.append(sample)
            if len(found) == 1:
                granted = (await servo.telemetry_state())["subscriptions"]
                assert [(one["channels"], one["requested_hz"]) for one in granted] == [
                    (["current_angle", "current_torque"], 20)
                ]
            if sample.t - found[0].t > 2 * TTL_S:
                break
    torques = [one for one in found if one.key == "current_torque"]
    assert {one.uid for one in found} == {servo.uid}
    assert len(torques) == pytest.approx(20 * 2 * TTL_S, rel=0.2)
    assert max(after.t - before.t for before, after in itertools.pairwise(torques)) < 0.5
    assert found[-1].t == pytest.approx(rig.host.base.utc_now(), abs=1)
    assert (await servo.telemetry_state())["subscriptions"] == []


@live
async def test_a_lost_connection_is_resumed_without_a_loss(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo, transport: StreamingTransport
) -> None:
    times: list[float] = []
    async with aclosing(hornbill.telemetry([servo], ["current_torque"], rate_hz=20)) as samples:
        async for sample in samples:
            assert isinstance(sample, Sample), sample
            times.append(sample.t)
            if len(times) == 20:
                transport.cut(down=True)
                asyncio.get_running_loop().call_later(3.0, setattr, transport, "down", False)
            if len(times) == 120:
                break
    assert transport.connections == 2
    assert max(after - before for before, after in itertools.pairwise(times)) < 0.5
    assert times == sorted(set(times))


@live
async def test_events_are_resumed_and_past_ones_come_only_if_wanted(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo, transport: StreamingTransport
) -> None:
    async with aclosing(hornbill.events(past=True)) as past:
        assert (first := await anext(past))
        assert not isinstance(first, Gap)
        assert first["at"] < rig.host.base.utc_now()
    async with aclosing(hornbill.events([servo])) as events:
        waiting = asyncio.ensure_future(anext(events))
        await asyncio.sleep(1)
        assert not waiting.done()
        transport.cut(down=True)
        rig.bench.servo(Uid(servo.uid)).conditions.mute = True
        await asyncio.sleep(10)
        transport.down = False
        event = await waiting
        assert not isinstance(event, Gap)
        assert (event["uid"], event["code"]) == (servo.uid, "offline")
        assert event["at"] < rig.host.base.utc_now() - 2


@live
async def test_what_is_lost_is_a_gap(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo, transport: StreamingTransport
) -> None:
    found: list[Sample | Gap] = []
    async with aclosing(hornbill.telemetry([servo], ["current_torque"], rate_hz=20, reconnect_s=None)) as samples:
        async for one in samples:
            found.append(one)
            if len(found) == 10:
                transport.cut(down=True)
                asyncio.get_running_loop().call_later(200.0, setattr, transport, "down", False)
            if len(found) == 20:
                break
    gaps = [one for one in found if isinstance(one, Gap)]
    assert [(one.cause, one.lost, one.uid) for one in gaps] == [("lost", None, None)]
    assert found[10] == gaps[0]
    assert found[11].t - found[9].t == pytest.approx(200, abs=5)


@live
async def test_a_servo_that_does_not_respond_is_a_gap_in_its_channels(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo, transport: StreamingTransport
) -> None:
    async with aclosing(hornbill.telemetry([servo], ["current_torque"], rate_hz=20)) as samples:
        await anext(samples)
        rig.bench.servo(Uid(servo.uid)).conditions.mute = True
        async for one in samples:
            if isinstance(one, Gap):
                assert (one.cause, one.uid, one.key) == ("no_value", servo.uid, "current_torque")
                break


@live
async def test_a_server_that_does_not_return_raises(
    rig: Rig, hornbill: AsyncHornbill, servo: AsyncServo, transport: StreamingTransport
) -> None:
    async with aclosing(hornbill.events(past=True, reconnect_s=0.0)) as events:
        await anext(events)
        transport.cut(down=True)
        with pytest.raises(ServerUnreachable, match="did not return within 0 s"):
            await _until_the_end(events)
    with pytest.raises(ServerUnreachable, match="No hornbill server responds"):
        await anext(hornbill.events())


async def _until_the_end(events: Any) -> None:
    async for _ in events:
        pass

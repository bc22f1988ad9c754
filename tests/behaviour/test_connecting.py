"""Internal errors while connecting and disconnecting: no port stays open, and motion stays possible."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from behaviour.actions import move, torque
from behaviour.rig import Rig, json, until
from behaviour.scene import scene
from hornbill.bus.reopening import ReopeningPort
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import BusChanged
from hornbill.wire.port import PortState

HERE, THERE = "memory:host", "memory:other"


def ports(rig: Rig) -> list[ReopeningPort]:
    """The ports that the host opens from now on."""
    opened: list[ReopeningPort] = []
    plain = rig.host._open_port  # pyright: ignore[reportPrivateUsage]

    async def open_port(address: str, bitrate: int) -> Any:
        opened.append(port := await plain(address, bitrate))  # pyright: ignore[reportArgumentType]
        return port

    rig.host._open_port = open_port  # pyright: ignore[reportPrivateUsage]
    return opened


def failing(*_: object, **__: object) -> Any:
    raise RuntimeError("an internal error")


async def failing_later(*_: object) -> None:
    failing()


PARTS: dict[str, Callable[[Rig], tuple[object, str, Callable[..., Any]]]] = {
    "fleet": lambda rig: (rig.host.fleet, "attach", failing),
    "allocator": lambda rig: (rig.host.allocating, "join", failing),
    "doctor": lambda rig: (rig.host.doctor, "follow", failing),
    "watch": lambda rig: (rig.host.watch, "begin", failing),
    "before": lambda rig: (rig.host, "_before_join", failing_later),
}


@pytest.mark.parametrize("part", PARTS)
@scene()
async def test_a_port_that_cannot_be_joined_is_closed_and_the_next_one_works(
    rig: Rig, part: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    await rig.ready()
    opened = ports(rig)

    async def join(attached: bool) -> None:
        if attached:
            await rig.host.attach(await rig.host._open_port(THERE, 1_000_000))  # pyright: ignore[reportPrivateUsage]
        else:
            await rig.host.connect(THERE, 1_000_000)

    for attached in (False,) if part == "before" else (False, True):
        opened.clear()
        with monkeypatch.context() as broken:
            broken.setattr(*PARTS[part](rig))
            with pytest.raises(RuntimeError, match="an internal error"):
                await join(attached)
        assert [port.state for port in opened] == [PortState.DISCONNECTED]
        assert rig.host.connection is None
        assert rig.host.requests.participant is None
        await rig.host.connect(HERE, 1_000_000)
        servo = (await rig.ready())[0]
        lease = await rig.lease()
        await torque(rig, servo, "on", lease)
        await move(rig, servo, lease)
        json(await rig.call("DELETE", f"/leases/{lease}"))


@pytest.mark.parametrize("how", ["raises", "cancelled"])
@scene()
async def test_a_failed_disconnect_does_not_block_motion(
    rig: Rig, servo: Servo, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = ports(rig)
    with monkeypatch.context() as broken:
        if how == "raises":
            broken.setattr(rig.host.motion, "leave", failing_later)
            with pytest.raises(RuntimeError, match="an internal error"):
                await rig.host.connect(THERE, 1_000_000)
        else:
            broken.setattr(rig.host.motion, "leave", lambda: asyncio.sleep(5))
            connecting = asyncio.create_task(rig.host.connect(THERE, 1_000_000))
            await asyncio.sleep(0.1)
            connecting.cancel()
            await asyncio.wait([connecting])
    assert [port.state for port in opened] == [PortState.DISCONNECTED]
    assert rig.host.motion.leaving is False
    await move(rig, servo, await rig.lease())


@scene()
async def test_the_rates_of_a_new_connection_are_its_own(rig: Rig) -> None:
    await rig.ready()
    await asyncio.sleep(20)
    known = len(rig.changes)
    await until(lambda: any(isinstance(change, BusChanged) for change in rig.changes[known:]))
    await asyncio.sleep(0.5)  # between two counts
    await rig.host.connect(HERE, 1_000_000)
    await asyncio.sleep(1.1)
    connection = rig.host.connection
    assert connection is not None
    for _ in range(20):
        assert connection.rx_fps > 5
        assert 0 < connection.load_pct < 20
        await asyncio.sleep(0.1)


@scene()
async def test_polling_survives_an_internal_error(rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as broken:
        broken.setattr(rig.host.polling, "_read", failing_later)
        await asyncio.sleep(5)
    await asyncio.sleep(3)
    read_at = servo.registers["current_temperature"].at
    assert read_at is not None
    assert asyncio.get_running_loop().time() - read_at < 2.5

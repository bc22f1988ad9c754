"""Odd things on the wire: whatever a node says, no answer of the API breaks, and who watches sees on."""

import asyncio
import math
import random

import pytest

from behaviour.losing import PAIR
from behaviour.rig import Rig, Socket, json, play
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, NodeHealth, NodeStatus
from hornbill.wire.transfer import Transfer, split

PATHS = ("/servos", "/nodes", "/allocations", "/bus", "/bus/doctor?all=true", "/health", "/stop")


def status(source: int, uptime: int, mode: int) -> list[Frame]:
    payload = NodeStatus(uptime, NodeHealth.OK, mode, 0, 0).encode()
    return split(Transfer(Kind.MESSAGE, NodeStatus.TYPE.id, source, 0, 24, uptime % 32, payload), NodeStatus.TYPE)


@pytest.mark.parametrize("source", [11, 60])
@pytest.mark.parametrize("mode", range(8))
def test_a_node_in_any_mode_reserved_ones_too_is_listed(source: int, mode: int) -> None:
    async def scene(rig: Rig) -> None:
        servo = next(one for one in await rig.ready(2) if one.node_id == 11)
        page = Socket(rig.app)
        page.say(type="subscribe", topics=["servos"])
        await asyncio.sleep(0.1)
        at = 0 if servo.status is None else servo.status.uptime_sec
        rig.bus.port("odd").send(status(source, at, mode))
        await asyncio.sleep(0.1)
        [node] = [one for one in json(await rig.call("GET", "/nodes")) if one["node_id"] == source]
        assert node["mode"]
        assert len(json(await rig.call("GET", "/servos"))) == 2
        if mode in (4, 5, 6):
            assert node["mode"] == f"reserved_{mode}"
        await page.close()

    play(scene, *PAIR)


@pytest.mark.parametrize("seed", range(3))
def test_noise_in_the_form_of_transfers_breaks_no_answer(seed: int) -> None:
    dice = random.Random(seed)

    def noise() -> Frame:
        source, destination = dice.choice([0, 11, 12, 60, dice.randrange(128)]), dice.choice([11, 12, 127])
        message = dice.choice([1, 341, 1010, 1011, 20000]) << 8 | source
        service = dice.choice([1, 5, 10, 11]) << 16 | dice.randrange(2) << 15 | destination << 8 | 0x80 | source
        identifier = dice.choice([message, service, dice.getrandbits(24)]) | dice.randrange(32) << 24
        data = dice.randbytes(dice.randrange(8))
        return Frame(identifier, data + bytes([0xC0 | dice.randrange(32)]) if dice.random() < 0.8 else data)

    async def scene(rig: Rig) -> None:
        await rig.ready(2)
        pages = [Socket(rig.app) for _ in range(3)]
        pages[0].say(type="subscribe", topics=["frames", "servos"])
        pages[1].say(type="subscribe", topics=["frames"], frames={"view": "raw", "problems_only": True})
        pages[2].say(type="subscribe", topics=["frames"], frames={"text": "\0(([*\\", "type": "", "node_id": 0})
        port = rig.bus.port("odd")
        for value in (math.nan, math.inf, -math.inf, 65504.0):
            payload = ActuatorStatus(1, value, value, value, 0).encode()
            port.send(split(Transfer(Kind.MESSAGE, ActuatorStatus.TYPE.id, 11, 0, 16, 0, payload), ActuatorStatus.TYPE))
        for _ in range(60):
            port.send([noise() for _ in range(50)])
            await asyncio.sleep(0.02)
        await asyncio.sleep(1)
        for path in PATHS:
            answer = await rig.call("GET", path)
            assert answer.status_code == 200
            assert b"NaN" not in answer.content
            assert b"Infinity" not in answer.content
        for page in pages[:2]:
            assert sum(len(one.get("transfers", [])) + len(one.get("frames", [])) for one in page.heard()) > 100
        for page in pages:
            await page.close()

    play(scene, *PAIR)

"""The bus doctor on a healthy bus: silent at every instant, whatever goes on there."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest

import jumping_clock as clock
from behaviour.patient import Every
from behaviour.rig import CATALOG, PLAIN, Rig, json, play
from behaviour.scene import scene
from hornbill.servo.device.identification import read_rows
from hornbill.sim.bench.bench import demo_fleet
from hornbill.sim.bench.recipe import Recipe

OFTEN_S = 0.0171
"""Between two ticks of the host, and in step with nothing on the bus."""

COLD = [Recipe("BLA21-06U-A0", "1.300", servo_id=1 + n, uid=bytes([n] * 16)) for n in range(16)]
SIXTEEN = [replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(16)]


NEW = "servos_without_id"
"""What is told of the demo: some of its servos are new, and so without a servo id."""


def watched(scene: Callable[[Rig], Awaitable[None]], known: str | None = None) -> Callable[[Rig], Awaitable[None]]:
    """Play a scene while the doctor looks again and again, and must find nothing but what is known."""

    async def play_it(rig: Rig) -> None:
        found: list[object] = []
        loop = asyncio.get_running_loop()

        def look(_number: int) -> None:
            wrong = [one for one in rig.host.doctor.findings() if one.code != known]
            if wrong:
                found.append((round(loop.time() - clock.START, 3), wrong))

        looking = Every(OFTEN_S, look)
        await scene(rig)
        await looking.stop()
        assert found == []

    return play_it


@pytest.mark.parametrize("seed", [1, 2])
def test_the_demo_from_cold_with_saves_restarts_and_a_stop(seed: int) -> None:
    async def scene(rig: Rig) -> None:
        servos = await rig.ready(6)
        for servo in servos[:3]:
            job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
            assert job["state"] == "succeeded", job
        jobs = [rig.call("POST", f"/servos/{servo.uid}/restart?wait=true") for servo in servos[3:]]
        assert [json(await job)["state"] for job in jobs] == ["succeeded"] * 3
        json(await rig.call("POST", "/stop", {}))
        await asyncio.sleep(12)

    play(watched(scene, known=NEW), *demo_fleet(CATALOG, 6, seed), seed=seed)


def test_sixteen_servos_that_all_ask_for_a_node_id() -> None:
    async def scene(rig: Rig) -> None:
        await rig.ready(16, within_s=60)
        for servo in rig.host.fleet.all():
            rig.bench.power(servo.uid, False)
            rig.bench.power(servo.uid, True)
        await asyncio.sleep(22)
        assert [sim.starts for sim in rig.bench.servos.values()] == [2] * 16
        await rig.ready(16)

    play(watched(scene), *COLD)


def test_sixteen_servos_read_over_and_over() -> None:
    async def scene(rig: Rig) -> None:
        servos = await rig.ready(16)
        for _ in range(10):
            await asyncio.gather(*(read_rows(rig.host.requests, servo) for servo in servos))
        assert rig.bus.load() > 0.5

    play(watched(scene), *SIXTEEN)


def test_all_saved_at_once_and_one_of_them_the_only_one_on_the_bus() -> None:
    async def together(rig: Rig) -> None:
        servos = await rig.ready(6)
        await asyncio.sleep(3)
        jobs = await asyncio.gather(*(rig.call("POST", f"/servos/{one.uid}/save?wait=true") for one in servos))
        assert [json(job)["state"] for job in jobs] == ["succeeded"] * 6
        await asyncio.sleep(5)

    async def alone(rig: Rig) -> None:
        (servo,) = await rig.ready()
        rig.sim(servo).conditions.restart_delay_s = 3.0
        job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
        assert job["state"] == "succeeded", job
        await asyncio.sleep(5)

    play(watched(together), *COLD[:6])
    play(watched(alone), PLAIN)


def test_a_servo_that_moves_to_another_node_id_and_two_that_swap_their_servo_ids() -> None:
    async def scene(rig: Rig) -> None:
        one, other = await rig.ready(2)
        json(await rig.call("PATCH", f"/servos/{one.uid}/parameters", {"values": {"node_id": 42}}))
        json(await rig.call("POST", f"/servos/{one.uid}/save?wait=true"))
        assert one.node_id == 42
        swapped = {one.uid: {"servo_id": other.servo_id}, other.uid: {"servo_id": one.servo_id}}
        answer = json(await rig.call("PATCH", "/parameters", {"servos": swapped}))
        assert [each["outcome"] for each in answer["servos"]] == ["applied", "applied"]
        await asyncio.sleep(5)

    play(watched(scene), *SIXTEEN[:2])


def test_a_bus_that_is_connected_again_and_one_with_a_foreign_node() -> None:
    async def scene(rig: Rig) -> None:
        await rig.ready(2)
        for _ in range(3):
            json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
            await asyncio.sleep(3.3)

    play(watched(scene), *SIXTEEN[:2])


@scene(*demo_fleet(CATALOG, 6, 1))
async def test_everything_looked_at_is_told_when_asked_for_and_looking_sends_nothing(rig: Rig) -> None:
    await rig.ready(6)
    await asyncio.sleep(3)
    await rig.host.polling.close()
    await asyncio.sleep(0.2)
    before = rig.bus.history.copy()
    found = json(await rig.call("GET", "/bus/doctor?all=true"))
    assert rig.bus.history == before
    assert {one["code"]: one["severity"] for one in found if one["severity"] != "ok"} == {NEW: "notice"}
    assert {one["code"] for one in found} >= {
        "adapter", "bit_rate", "no_traffic", "bus_off", "errors_rising", "frames_dropped", "load_over_budget",
        "duplicate_node_id", "duplicate_servo_id", "second_allocator", "allocation_stuck", "silent_node",
        "responses_lost", "responses_slow", "servo_offline", "foreign_frames", "own_node_id", "other_commands",
    }  # fmt: skip
    assert len({one["code"] for one in found}) == len(found)
    said = {one["code"]: one["evidence"] for one in found}
    assert said["second_allocator"].startswith("This server, node 127.")
    assert said["responses_slow"].startswith("Median 0.")
    assert "6 nodes" in said["duplicate_node_id"]
    assert [one["code"] for one in json(await rig.call("GET", "/bus/doctor"))] == [NEW]

"""The bus doctor on a healthy bus: it reports nothing at any instant."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace

import jumping_clock as clock
from behaviour.diagnosis import Every
from behaviour.rig import CATALOG, PLAIN, Rig, json, play
from behaviour.scene import scene
from hornbill.servo.device.identification import read_rows
from hornbill.sim.bench.bench import demo_fleet
from hornbill.sim.bench.recipe import Recipe

CHECK_S = 0.0971
"""Between two ticks of the host, and in step with nothing on the bus."""

COLD = [Recipe("BLA21-06U-A0", "1.300", servo_id=1 + n, uid=bytes([n] * 16)) for n in range(5)]
SIX = [replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(6)]
DEMO = demo_fleet(CATALOG, 6, 1)
NEW = "servos_without_id"
"""The one finding of the demo: some of its servos are new, and so without a servo ID."""


def watched(
    *recipes: Recipe, known: str | None = None
) -> Callable[[Callable[[Rig], Awaitable[None]]], Callable[[], None]]:
    """Decorate a scene: a test that plays it while the doctor is checked repeatedly and must report only `known`."""

    def make(act: Callable[[Rig], Awaitable[None]]) -> Callable[[], None]:
        async def checked(rig: Rig) -> None:
            found: list[object] = []
            loop = asyncio.get_running_loop()

            def check(_number: int) -> None:
                wrong = [one for one in rig.host.doctor.findings() if one.code != known]
                if wrong:
                    found.append((round(loop.time() - clock.START, 3), wrong))

            checking = Every(CHECK_S, check)
            await act(rig)
            await checking.stop()
            assert found == []

        return lambda: play(checked, *recipes)

    return make


@watched(*DEMO, known=NEW)
async def test_the_demo_with_saves_restarts_and_a_stop(rig: Rig) -> None:
    servos = await rig.ready(6)
    for servo in servos[:3]:
        job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
        assert job["state"] == "succeeded", job
    jobs = [rig.call("POST", f"/servos/{servo.uid}/restart?wait=true") for servo in servos[3:]]
    assert [json(await job)["state"] for job in jobs] == ["succeeded"] * 3
    json(await rig.call("POST", "/stop", {}))
    await asyncio.sleep(12)


@watched(*COLD)
async def test_all_servos_request_a_node_id_and_are_saved_at_once(rig: Rig) -> None:
    servos = await rig.ready(5, within_s=60)
    for servo in rig.host.fleet.all():
        rig.bench.power(servo.uid, False)
        rig.bench.power(servo.uid, True)
    await asyncio.sleep(16)
    assert [sim.starts for sim in rig.bench.servos.values()] == [2] * 5
    await rig.ready(5)
    jobs = await asyncio.gather(*(rig.call("POST", f"/servos/{one.uid}/save?wait=true") for one in servos))
    assert [json(job)["state"] for job in jobs] == ["succeeded"] * 5
    await asyncio.sleep(5)


@watched(*SIX)
async def test_servos_are_read_repeatedly_and_reconnected(rig: Rig) -> None:
    servos = await rig.ready(6)
    for _ in range(4):
        await asyncio.gather(*(read_rows(rig.host.requests, servo) for servo in servos))
    assert rig.bus.load() > 0.3
    for _ in range(3):
        json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
        await asyncio.sleep(3.3)


@watched(PLAIN)
async def test_the_only_servo_on_the_bus_is_saved(rig: Rig) -> None:
    (servo,) = await rig.ready()
    rig.sim(servo).conditions.restart_delay_s = 3.0
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    assert job["state"] == "succeeded", job
    await asyncio.sleep(5)


@watched(*SIX[:2])
async def test_a_node_id_changes_and_two_servo_ids_are_swapped(rig: Rig) -> None:
    one, other = await rig.ready(2)
    json(await rig.call("PATCH", f"/servos/{one.uid}/parameters", {"values": {"node_id": 42}}))
    json(await rig.call("POST", f"/servos/{one.uid}/save?wait=true"))
    assert one.node_id == 42
    swapped = {one.uid: {"servo_id": other.servo_id}, other.uid: {"servo_id": one.servo_id}}
    response = json(await rig.call("PATCH", "/parameters", {"servos": swapped}))
    assert [each["outcome"] for each in response["servos"]] == ["applied", "applied"]
    await asyncio.sleep(5)


@scene(*DEMO)
async def test_all_checks_are_listed_on_request_and_send_nothing(rig: Rig) -> None:
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
        "database", "computer_busy",
    }  # fmt: skip
    assert len({one["code"] for one in found}) == len(found)
    said = {one["code"]: one["evidence"] for one in found}
    assert said["second_allocator"].startswith("This server, node 127.")
    assert said["responses_slow"].startswith("Median 0.")
    assert "6 nodes" in said["duplicate_node_id"]
    assert [one["code"] for one in json(await rig.call("GET", "/bus/doctor"))] == [NEW]

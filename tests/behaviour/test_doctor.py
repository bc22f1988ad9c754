"""The bus doctor on the wire: each condition is injected, named by its cause alone, and gone when it has ended."""

import asyncio
from dataclasses import replace

from behaviour.patient import Every, codes, finds, stays, well
from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.wire.frame import Frame

SIX = [replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(6)]
TWO = SIX[:2]


@scene(*TWO)
async def test_without_a_bus_it_says_so_and_what_the_last_attempt_failed_with(rig: Rig) -> None:
    await rig.ready(2)
    assert codes(rig) == []
    json(await rig.call("DELETE", "/bus"))
    found = await finds(rig, "no_bus", within_s=1)
    assert "PUT /api/v1/bus" in str(found["remedy"])
    problem(await rig.call("PUT", "/bus", {"address": "memory:broken"}), "bus_open_failed", 502)
    found = await finds(rig, "adapter_failed", within_s=1)
    assert (found["severity"], found["evidence"]) == ("failure", "The adapter is broken. Take another.")
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await well(rig, within_s=1)
    json(await rig.call("DELETE", "/bus"))
    assert codes(rig) == ["no_bus"]  # that failure is over


@scene()
async def test_after_a_wanted_disconnect_an_attempt_that_failed_before_is_not_told(rig: Rig) -> None:
    problem(await rig.call("PUT", "/bus", {"address": "memory:broken"}), "bus_open_failed", 502)
    json(await rig.call("DELETE", "/bus"))
    assert codes(rig) == ["no_bus"]


@scene(*TWO)
async def test_an_adapter_that_is_pulled_out_is_lost_within_a_second_and_found_again(rig: Rig) -> None:
    await rig.ready(2)
    await rig.cable.unplug()
    found = await finds(rig, "adapter_lost", within_s=1)
    assert found["severity"] == "failure"
    await stays(rig, "adapter_lost", for_s=10)
    rig.cable.plug_in()
    await well(rig, within_s=8)


@scene(*TWO)
async def test_nothing_at_all_on_the_bus(rig: Rig) -> None:
    servos = await rig.ready(2)
    for servo in servos:
        rig.sim(servo).conditions.mute = True
    found = await finds(rig, "no_traffic", within_s=4)
    assert found["severity"] == "failure"
    assert "0 frames and 0 errors" in str(found["evidence"])
    assert "120 Ω" in str(found["remedy"])
    await stays(rig, "no_traffic", for_s=15)
    for servo in servos:
        rig.sim(servo).conditions.mute = False
    await well(rig, within_s=1)


@scene(*TWO)
async def test_noise_is_only_error_frames(rig: Rig) -> None:
    await rig.ready(2)
    rig.bus.noise()
    found = await finds(rig, "only_errors", "bus_off", within_s=4)
    assert found["severity"] == "failure"
    assert "0 frames" in str(found["evidence"])
    assert "1 Mbit/s" in str(found["remedy"])
    await stays(rig, "only_errors", "bus_off", for_s=10)
    rig.bus.noise(False)
    rig.bus.recover()
    await finds(rig, "bus_off", within_s=10)  # which was a moment ago
    await well(rig, within_s=31)


@scene(*SIX)
async def test_our_own_wrong_bit_rate_is_only_error_frames_and_names_the_rate(rig: Rig) -> None:
    await rig.ready(6)
    json(await rig.call("PUT", "/bus", {"address": "memory:host", "bitrate": 500_000}))
    await finds(rig, "only_errors", "bus_off", "bit_rate", within_s=10)
    await asyncio.sleep(10)
    found = await finds(rig, "only_errors", "bus_off", "bit_rate", within_s=2)
    assert "at 0.5 Mbit/s" in str(found["evidence"])
    json(await rig.call("PUT", "/bus", {"address": "memory:host", "bitrate": 1_000_000}))
    await well(rig, within_s=1)


@scene(*TWO)
async def test_disturbed_frames_that_get_through_in_the_end_make_the_error_counter_rise(rig: Rig) -> None:
    await rig.ready(2)
    rig.bus.corruption(4)
    found = await finds(rig, "errors_rising", within_s=8)
    assert found["severity"] == "warning"
    await stays(rig, "errors_rising", for_s=10)
    rig.bus.corruption(0)
    await well(rig, within_s=12)


@scene(*TWO)
async def test_alone_on_the_bus_nobody_acknowledges(rig: Rig) -> None:
    servos = await rig.ready(2)
    for servo in servos:
        await rig.bench.remove(servo.uid)
    found = await finds(rig, "unacknowledged", within_s=4)
    assert found["severity"] == "failure"
    assert "without acknowledgement and 0 frames" in str(found["evidence"])
    await stays(rig, "unacknowledged", for_s=15)
    rig.bench.add(replace(PLAIN, node_id=20, servo_id=9))
    await finds(rig, "servo_offline", "servo_offline", within_s=5)
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await well(rig, within_s=3)


@scene(*TWO)
async def test_bus_off_now_and_a_moment_ago(rig: Rig) -> None:
    await rig.ready(2)
    rig.cable.bus_off()
    found = await finds(rig, "bus_off", within_s=0.5)
    assert found["severity"] == "failure"
    assert "1 time since connecting" in str(found["evidence"])
    await asyncio.sleep(2)  # it was opened again meanwhile
    found = await finds(rig, "bus_off", within_s=1)
    assert found["severity"] == "warning"
    await well(rig, within_s=31)


@scene(*TWO)
async def test_a_foreign_node_that_fills_the_bus_is_more_than_the_budget(rig: Rig) -> None:
    await rig.ready(2)
    stranger = rig.bus.port("stranger")
    frames = [Frame(0x1F00_1155, bytes(8))] * 4
    flood = Every(0.001, lambda _: stranger.send(frames))
    found = await finds(rig, "load_over_budget", within_s=7)
    assert found["severity"] == "warning"
    assert "limit 40 %" in str(found["evidence"])
    await stays(rig, "load_over_budget", for_s=10)
    await flood.stop()
    await well(rig, within_s=5)


@scene(*TWO)
async def test_frames_that_hornbill_cannot_take_are_dropped(rig: Rig) -> None:
    await rig.ready(2)
    rig.cable.deafen(5)
    found = await finds(rig, "frames_dropped", within_s=5)
    assert "% of the received frames" in str(found["evidence"])
    await stays(rig, "frames_dropped", for_s=10)
    rig.cable.deafen(0)
    await well(rig, within_s=12)

"""A lasting stop: over a restart of the server, the timeout of a servo, and servos that do not respond."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from behaviour.losing import PAIR, commanded, now
from behaviour.rig import PLAIN, Rig, json, play, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import StopChanged
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.store.database import Database
from hornbill.wire.datatype import Kind
from hornbill.wire.services import GetSetRequest


def at(folder: Path) -> str:
    return f"sqlite:///{folder / 'store.sqlite'}"


async def press(rig: Rig, mode: str = "off", reason: str = "smoke") -> dict[str, Any]:
    found: dict[str, Any] = json(await rig.call("POST", "/stop?by=Ann", {"mode": mode, "reason": reason}))
    return found


def writes(rig: Rig, node: int | None) -> int:
    """The number of writes of 0x20 to a node."""
    return sum(where == node and name == "0x20" for where, name, _ in rig.writes())


def killed(rig: Rig) -> None:
    """Let the host store nothing more."""
    rig.host.stored_torque_off._store_latch = lambda: asyncio.sleep(0)  # pyright: ignore[reportPrivateUsage]


@pytest.mark.parametrize(("mode", "output"), [("brake", 2), ("off", 1)])
def test_a_restarted_server_stops_the_servos_it_finds(tmp_path: Path, mode: str, output: int) -> None:
    async def before(rig: Rig) -> float:
        await rig.ready()
        state = await press(rig, mode)
        await asyncio.sleep(0.3)
        killed(rig)
        return float(state["at"])

    pressed_at = play(before, store=at(tmp_path))

    async def after(rig: Rig) -> None:
        assert rig.host.stop.latched
        assert not rig.transfers("host")
        state = json(await rig.call("GET", "/stop"))
        assert (state["latched"], state["mode"], state["by"]) == (True, mode, "Ann")
        assert state["reason"] == "smoke. Pressed before the server restarted."
        assert state["at"] == pytest.approx(pressed_at, abs=1)
        rig.host.stored_torque_off.restore_stop()  # once more: the first event precedes the rig
        assert rig.logged("stopped") == [("warning", None, {"by": "Ann", "mode": mode, "before_start": True})]
        await rig.host.connect("memory:host", 1_000_000)
        servo = (await rig.ready())[0]
        assert rig.sim(servo).output == output, "it started with torque on"
        assert all(raw == output for _, name, raw in rig.writes() if name == "0x20")
        state = json(await rig.call("GET", "/stop"))
        assert [one["confirmed"] for one in state["servos"]] == [True]

    play(after, store=at(tmp_path), connect=False)
    play(after, store=at(tmp_path), connect=False)  # the reason is not extended a second time


def test_a_stop_is_stored_within_a_quarter_of_a_second_even_if_a_servo_does_not_respond(tmp_path: Path) -> None:
    async def before(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        rig.sim(servo).conditions.drop_responses_pct = 100
        rig.host.stop.now("off", "Ann", "")
        await asyncio.sleep(0.26)
        killed(rig)

    play(before, store=at(tmp_path))

    async def after(rig: Rig) -> None:
        assert json(await rig.call("GET", "/stop"))["reason"] == "Pressed before the server restarted."

    play(after, store=at(tmp_path), connect=False)


def test_a_cleared_stop_is_not_restored(tmp_path: Path) -> None:
    async def before(rig: Rig) -> None:
        await rig.ready()
        await press(rig)
        await asyncio.sleep(1)
        json(await rig.call("DELETE", "/stop"))
        await asyncio.sleep(0.3)
        killed(rig)

    play(before, store=at(tmp_path))

    async def after(rig: Rig) -> None:
        assert not rig.host.stop.latched

    play(after, store=at(tmp_path), connect=False)


@scene(*PAIR)
async def test_every_frame_of_a_stop_precedes_the_store(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    servos = await rig.ready(2)
    await commanded(rig, servos[0])
    outputs: list[set[int]] = []
    transaction = Database.transaction

    def watched(self: Database) -> Any:
        outputs.append({rig.sim(servo).output for servo in servos})
        return transaction(self)

    monkeypatch.setattr(Database, "transaction", watched)
    rig.host.stop.now("off", "test", "")
    await asyncio.sleep(0.5)
    assert outputs
    assert all(one == {1} for one in outputs)


@scene()
async def test_a_failing_store_does_not_prevent_a_stop(rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(rig.host.store.settings, "put", fail)
    await press(rig)
    await asyncio.sleep(0.5)
    assert rig.sim(servo).output == 1
    assert rig.logged("store_failed") == [("warning", None, {"what": "stop"})]


TIMES_OUT = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11)


@pytest.mark.parametrize("timeout_ms", [100, 1000, 5000])
@scene(lambda timeout_ms: replace(TIMES_OUT, rom={"timeout_time": timeout_ms}))
async def test_the_timeout_of_a_servo_does_not_release_the_brake(rig: Rig, servo: Servo, timeout_ms: int) -> None:
    """On a servo whose timeout (0x26 off, 0x27) releases the brake, too: 4.19 names no exception."""
    sim = rig.sim(servo)
    _any_output(sim)
    await press(rig, "brake")
    for _ in range(400):
        await asyncio.sleep(0.05)
        assert sim.output == 2
    before, began = writes(rig, servo.node_id), now()
    await asyncio.sleep(10)
    rate = (writes(rig, servo.node_id) - before) / (now() - began)
    assert rate <= 3.5 * 1000 / timeout_ms, "a third of the timeout, and no more often"
    json(await rig.call("DELETE", "/stop"))
    written = writes(rig, servo.node_id)
    await asyncio.sleep(10)
    assert writes(rig, servo.node_id) == written, "only while it is latched"
    assert sim.output == 1, "the behaviour of this servo"


def _any_output(sim: SimulatedServo) -> None:
    sim.behaviour = replace(sim.behaviour, timeout_changes="any_output")


@scene(*(replace(TIMES_OUT, servo_id=n, node_id=10 + n) for n in (1, 2)))
async def test_a_brake_that_a_client_releases_is_not_applied_again(rig: Rig) -> None:
    servo, other = await rig.ready(2)
    await press(rig, "brake")
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await asyncio.sleep(3)
    assert (rig.sim(servo).output, rig.sim(other).output) == (1, 2)


@pytest.mark.parametrize(("mode", "timeout_action"), [("off", 1), ("brake", 0)])
@scene(lambda timeout_action: replace(PLAIN, rom={"timeout_action": timeout_action}))
async def test_a_stop_that_a_timeout_cannot_change_is_written_once(
    rig: Rig, servo: Servo, mode: str, timeout_action: int
) -> None:
    await press(rig, mode)
    written = writes(rig, servo.node_id)
    await asyncio.sleep(5)
    assert writes(rig, servo.node_id) == written


@scene(*PAIR)
async def test_a_servo_that_does_not_respond_is_reported_and_again_when_it_does(rig: Rig) -> None:
    servo, other = await rig.ready(2)
    rig.sim(servo).conditions.drop_responses_pct = 100
    state = await press(rig)
    assert {one["label"]: one["confirmed"] for one in state["servos"]} == {servo.title: False, other.title: True}
    await asyncio.sleep(0.7)
    rig.host.torque_off.report_pending()
    assert not rig.events("no_response"), "a stop is reported after a second, by itself"
    await asyncio.sleep(2)
    assert rig.logged("no_response") == [("failure", servo.uid, {"servos": [servo.title], "stop": True})]
    assert rig.events("no_response")[0].text.startswith(f"Stop not acknowledged by {servo.title}. ")
    rig.sim(servo).conditions.drop_responses_pct = 0
    await asyncio.sleep(0.5)
    assert rig.logged("stopped_late") == [("notice", servo.uid, {"servo": servo.title, "mode": "off"})]


@scene(*(replace(PLAIN, servo_id=n, node_id=10 + n) for n in range(1, 7)))
async def test_all_servos_behind_a_lost_bus_are_in_one_event(rig: Rig) -> None:
    servos = await rig.ready(6)
    rig.bus.loss(100)
    rig.host.stop.now("off", "test", "")
    await asyncio.sleep(1.5)
    titles = {servo.title for servo in servos}
    ((level, uid, params),) = rig.logged("no_response")
    assert (level, uid, set(cast("list[str]", params["servos"]))) == ("failure", None, titles)
    rig.bus.loss(0)


@scene(*PAIR)
async def test_torque_off_to_an_offline_servo_is_repeated_once_a_second(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    sim, node = rig.sim(servo), servo.node_id
    rig.bench.power(servo.uid, False)
    await press(rig)
    json(await rig.call("DELETE", "/stop"))
    await asyncio.sleep(10)
    assert servo.state is State.OFFLINE
    before = writes(rig, node)
    await asyncio.sleep(60)
    assert 55 <= writes(rig, node) - before <= 61
    rig.bench.power(servo.uid, True)
    await until(lambda: sim.powered and servo.online, 10, 0.005)
    await asyncio.sleep(0.05)
    assert sim.output == 1
    settled = writes(rig, node)
    await asyncio.sleep(5)
    assert writes(rig, node) == settled


@scene()
async def test_torque_off_to_an_online_servo_is_repeated_four_times_a_second(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.drop_responses_pct = 100
    await press(rig)
    await asyncio.sleep(3)
    before = writes(rig, servo.node_id)
    await asyncio.sleep(10)
    assert 33 <= writes(rig, servo.node_id) - before <= 41


@scene()
@pytest.mark.parametrize("delay_s", [0.03, 0.3, 0.9])
async def test_a_late_response_acknowledges_a_stop(rig: Rig, servo: Servo, delay_s: float) -> None:
    """The latency of an adapter may exceed the timeout of a try."""
    rig.sim(servo).conditions.response_delay_s = delay_s
    await press(rig)
    await asyncio.sleep(2)
    (stopped,) = json(await rig.call("GET", "/stop"))["servos"]
    at_most = delay_s * 1000 + (20 if delay_s < 0.4 else 1000)
    assert (stopped["confirmed"], delay_s * 1000 <= stopped["ms"] <= at_most) == (True, True), stopped
    written = writes(rig, servo.node_id)
    await asyncio.sleep(2)
    assert writes(rig, servo.node_id) == written, "nothing more is sent once it has responded"


@scene()
async def test_a_late_response_acknowledges_the_stop_of_a_node_that_may_be_a_servo(rig: Rig) -> None:
    await rig.ready()
    await press(rig)
    sim = rig.bench.add(Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12))
    _any_output(sim)
    sim.conditions.drop_responses_pct = 100
    await asyncio.sleep(6)
    assert [node["confirmed"] for node in json(await rig.call("GET", "/stop"))["nodes"]] == [False]
    sim.conditions.response_delay_s, sim.conditions.drop_responses_pct = 0.2, 0
    await asyncio.sleep(1)
    assert rig.logged("stopped_late") == [("notice", None, {"servo": "node 12", "mode": "off"})]


@scene()
async def test_the_brake_is_applied_to_a_node_that_may_be_a_servo(rig: Rig) -> None:
    """It cannot be identified while it responds to writes only."""
    await rig.ready()
    await press(rig, "brake")
    sim = rig.bench.add(Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12))
    _any_output(sim)
    sim.conditions.drop_responses_pct = 100
    await asyncio.sleep(6)
    assert sim.output == 2
    assert rig.logged("no_response") == [("failure", None, {"servos": ["node 12"], "stop": True})]
    node = {"node_id": 12, "confirmed": False, "ms": None}
    assert json(await rig.call("GET", "/stop"))["nodes"] == [node]
    sim.conditions.drop_responses_pct = 0
    await asyncio.sleep(1)
    assert rig.logged("stopped_late") == [("notice", None, {"servo": "node 12", "mode": "brake"})]
    (stopped,) = json(await rig.call("GET", "/stop"))["nodes"]
    assert stopped == {**node, "confirmed": True, "ms": pytest.approx(6250, abs=250)}
    twice: list[bool] = []

    def listen(_change: StopChanged) -> None:
        assert rig.host.stop.latch is not None
        twice.append(12 in rig.host.stop.latch.nodes and len(rig.host.stop.latch.servos) == 2)

    rig.host.hub.subscribe(listen, StopChanged)
    await asyncio.sleep(6)
    assert (True in twice, sim.output) == (False, 2)
    assert twice, "a stop of the servo replaces that of the node"
    state = json(await rig.call("GET", "/stop"))
    assert (len(state["servos"]), state["nodes"]) == (2, []), "it is identified by now"


def first_write(rig: Rig) -> float:
    for transfer in rig.transfers("host"):
        if transfer.kind is Kind.REQUEST and transfer.type_id == GetSetRequest.TYPE.id:
            request = GetSetRequest.decode(transfer.payload)
            assert request is not None
            if request.name == "0x20":
                return transfer.at
    raise AssertionError("0x20 was never written")


@scene()
async def test_the_first_frame_of_a_stop_is_sent_before_anything_is_stored(rig: Rig) -> None:
    await rig.ready()
    pressed = now()
    rig.host.stop.now("off", "test", "")
    await asyncio.sleep(0.1)
    assert first_write(rig) - pressed < 0.001

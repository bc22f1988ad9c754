"""The frame monitor: what a page sees of the bus, what its filter hides, and no cost while it is closed."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import Any

from behaviour.actions import write
from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.api.live.frames import ROWS_QUEUED
from hornbill.api.live.messages import FramesMessage
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.frame import Frame
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, integer
from unit.wire.structures import frames

Row = dict[str, Any]
SHORT_STATUS = Frame(0x1001_554D, b"\x00\xc0")
"""A NodeStatus of one byte."""


class Viewer:
    """A page that shows the bus, and everything that was sent to it."""

    def __init__(self, rig: Rig, **wanted: object) -> None:
        self.page = Socket(rig.app)
        self._messages: list[Row] = []
        self.subscribe(**wanted)

    def subscribe(self, **wanted: object) -> None:
        """Subscribe with this filter."""
        self.page.send(type="subscribe", topics=["frames"], frames=wanted or None)

    @property
    def messages(self) -> list[Row]:
        """All messages of the topic, each valid by the API's document."""
        new = [message for message in self.page.received() if message["type"] == "frames"]
        for message in new:
            FramesMessage.model_validate(message)
        self._messages += new
        return self._messages

    @property
    def transfers(self) -> list[Row]:
        return [row for message in self.messages for row in message["transfers"]]

    @property
    def frames(self) -> list[Row]:
        return [row for message in self.messages for row in message["frames"]]

    @property
    def counts(self) -> tuple[int, int, int]:
        """Received, shown, dropped."""
        last = self.messages[-1]
        return last["received"], last["shown"], last["dropped"]


@asynccontextmanager
async def viewing(rig: Rig, **wanted: object) -> AsyncGenerator[Viewer]:
    await rig.ready()
    viewer = Viewer(rig, **wanted)
    await asyncio.sleep(0.2)
    yield viewer
    await viewer.page.close()


@scene()
async def test_every_transfer_is_shown_with_a_summary_in_the_order_of_the_bus(rig: Rig, servo: Servo) -> None:
    async with viewing(rig) as viewer:
        since = len(rig.transfers())
        await write(rig, servo, angle_limit_cw=60)
        await asyncio.sleep(1.2)
        texts = [row["summary"] for row in viewer.transfers]
        request = texts.index("GetSet request write 0x38 angle_limit_cw = 600, 60.0°")
        expected = "GetSet response 0x38 = 600, 60.0°, as requested. "
        response = next(n for n, text in enumerate(texts) if text.startswith(expected))
        assert request < response
        assert [viewer.transfers[n]["sent"] for n in (request, response)] == [True, False]
        assert "Status servo 1, 0.0°" in texts
        assert any(text.startswith("NodeStatus OK, operational, up ") for text in texts)
        times = [row["timestamp"] for row in viewer.transfers]
        assert times == sorted(times)
        assert abs(times[-1] - rig.host.base.utc_now()) < 0.5
        assert len(times) >= len(rig.transfers()) - since
        assert viewer.frames == []
        assert viewer.counts == (len(times), len(times), 0)


@scene()
async def test_the_raw_view_shows_each_frame_of_the_bus(rig: Rig) -> None:
    async with viewing(rig, view="raw", node_id=11) as viewer:
        before = len(rig.bus.history)
        await asyncio.sleep(1.2)
        on_bus = [(f"{frame.id:08x}", frame.data.hex()) for _, frame in list(rig.bus.history)[before:]]
        await asyncio.sleep(0.2)
        seen = [(row["can_id"], row["data"]) for row in viewer.frames]
        of_servo = [one for one in on_bus if int(one[0], 16) & 0x7F == 11]
        assert len(of_servo) > 20
        assert [one for one in of_servo if one in seen] == of_servo
        assert viewer.transfers == []
        assert {row["problem"] for row in viewer.frames} == {None}


@scene()
async def test_frames_between_other_nodes_are_shown_and_invalid_ones_with_their_problem_in_both_views(rig: Rig) -> None:
    async with viewing(rig) as decoded, viewing(rig, view="raw", problems_only=True) as raw:
        foreign = rig.bus.port("foreign")
        foreign.send(frames(GetSetRequest(0, integer(1), "0x20"), source=77, destination=78))
        one, two, three = frames(GetSetResponse(integer(5), EMPTY, EMPTY, EMPTY, "0x2C"), source=77, destination=78)
        foreign.send([one, two._replace(data=two.data[:-1] + bytes((two.data[-1] ^ 0x20,)))])
        await asyncio.sleep(0.1)
        foreign.send([one, two, three._replace(data=bytes((three.data[0] ^ 1,)) + three.data[1:])])
        foreign.send([SHORT_STATUS])
        await asyncio.sleep(0.3)
        problems = [(row["can_id"], row["problem"]) for row in decoded.frames]
        assert problems == [(f"{one.id:08x}", "toggle bit error"), (f"{one.id:08x}", "CRC error")]
        assert [(row["can_id"], row["problem"]) for row in raw.frames] == problems
        assert "NodeStatus not decoded: invalid payload of 1 byte" in [row["summary"] for row in decoded.transfers]
        (seen,) = [row for row in decoded.transfers if row["source"] == 77 and row["kind"] == "request"]
        assert (seen["destination"], seen["summary"]) == (78, "GetSet request write 0x20 torque_mode = 1, Off")
        assert (seen["frames"], seen["sent"]) == (3, False)
        received, shown, dropped = decoded.counts
        assert received == shown == len(decoded.transfers) + 2
        assert dropped == 0


REQUESTS_TO_11 = {"type": "GetSet", "node_id": 11, "kind": "request"}
FILTERS: list[tuple[Row, Callable[[Row], bool]]] = [
    ({"node_id": 12}, lambda row: 12 in (row["source"], row["destination"])),
    ({"type": "nodestatus"}, lambda row: row["type"] == "uavcan.protocol.NodeStatus"),
    ({"kind": "response"}, lambda row: row["kind"] == "response"),
    ({"text": "CURRENT_ANGLE"}, lambda row: "current_angle" in row["summary"]),
    ({"text": "-12.5"}, lambda row: "−12.5" in row["summary"]),
    (REQUESTS_TO_11, lambda row: "GetSet request" in row["summary"] and row["destination"] == 11),
    ({"node_id": 0}, lambda row: row["source"] == 0),
    ({"problems_only": True}, lambda row: row["fields"] is None),
]


@scene(PLAIN, Recipe("BLA15-06U-A0", "1.300", node_id=12))
async def test_the_server_filters_and_counts_what_it_hides(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    everything, *viewers = [Viewer(rig), *(Viewer(rig, **wanted) for wanted, _ in FILTERS)]
    await asyncio.sleep(0.2)
    foreign = rig.bus.port("foreign")
    foreign.send([SHORT_STATUS])
    foreign.send(frames(NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL), source=12))
    foreign.send(frames(GetSetRequest(0, integer(-125), "0x44"), source=12, destination=11))
    foreign.send([Frame(0x1001_0100, bytes((1, 1, 2, 3, 4, 5, 6, 0xC0)))])  # an anonymous Allocation
    json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))
    await asyncio.sleep(2.5)
    a_second_ago = rig.host.base.utc_now() - 1.1  # the counts alone are sent once a second
    for viewer, (wanted, passes) in zip(viewers, FILTERS, strict=True):
        shown = [row["payload"] for row in viewer.transfers]
        expected = [row["payload"] for row in everything.transfers if passes(row)]
        assert shown, wanted
        assert all(passes(row) for row in viewer.transfers), wanted
        common = min(len(shown), len(expected))  # pages are not sent to in the same instant
        assert shown[:common] == expected[:common], wanted
        assert abs(len(shown) - len(expected)) <= 4
        received, count, dropped = viewer.counts
        assert (count, dropped) == (len(shown), 0)
        assert received > count
        assert received >= sum(row["timestamp"] < a_second_ago for row in everything.transfers)
    for viewer in (everything, *viewers):
        await viewer.page.close()


@scene()
async def test_a_new_filter_resets_the_counts_and_messages_are_few_and_end_when_unsubscribed(rig: Rig) -> None:
    async with viewing(rig) as viewer:
        foreign = rig.bus.port("foreign")
        before = len(viewer.messages)
        for n in range(200):
            foreign.send(frames(NodeStatus(n, NodeHealth.OK, Mode.OPERATIONAL), source=77, transfer_id=n % 32))
            await asyncio.sleep(0.005)
        assert len(viewer.messages) - before <= 31, "at most 30 a second"
        await asyncio.sleep(0.2)
        assert sum(row["source"] == 77 for row in viewer.transfers) == 200
        viewer.subscribe(kind="response", text="in no summary")
        await asyncio.sleep(1.5)
        received, shown, _ = viewer.counts
        assert (received < 100, shown) == (True, 0), "fewer than the 200 before"
        viewer.page.send(type="unsubscribe", topics=["frames"])
        await asyncio.sleep(0.5)
        before = len(viewer.messages)
        await asyncio.sleep(2)
        assert len(viewer.messages) == before


@scene()
async def test_two_pages_share_one_decoder_that_ends_with_the_last(rig: Rig) -> None:
    listeners = rig.host.connected().participant.on_frames
    before = list(listeners)
    async with viewing(rig):
        async with viewing(rig):
            assert len(listeners) == len(before) + 1
        assert len(listeners) == len(before) + 1
    assert list(listeners) == before
    assert not rig.host.monitor.watched


@scene()
async def test_the_view_resumes_after_a_reconnection(rig: Rig) -> None:
    async with viewing(rig, type="NodeStatus", node_id=127) as viewer:
        await asyncio.sleep(1.5)
        json(await rig.call("DELETE", "/bus"))
        before = len(viewer.transfers)
        assert before
        await asyncio.sleep(3)
        assert len(viewer.transfers) == before
        json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
        await asyncio.sleep(3)
        assert len(viewer.transfers) >= before + 3


@scene()
async def test_a_slow_page_gets_the_newest_rows_and_the_number_dropped(rig: Rig) -> None:
    await rig.ready()
    await rig.bench.close()
    async with viewing(rig, view="raw", text="cafe") as viewer:
        # more in one turn of the loop than the queue takes: nothing is sent between them
        now = asyncio.get_running_loop().time()
        burst = [Frame(0x1E12_3401, n.to_bytes(3, "big") + b"\xca\xfe\x00", now) for n in range(ROWS_QUEUED + 50)]
        assert rig.host.connection is not None
        rig.host.connection.participant.on_frames.notify(burst, False)
        await asyncio.sleep(1)
        received, shown, dropped = viewer.counts
        assert (shown, dropped) == (ROWS_QUEUED, 50)
        assert received >= ROWS_QUEUED + 50
        assert int(viewer.frames[-1]["data"][:6], 16) == ROWS_QUEUED + 49

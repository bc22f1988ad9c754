"""The frame monitor: what a page sees of the bus, what its filter hides, and that nobody pays who does not look."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

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


class Viewer:
    """A page that looks at the bus, and everything it was sent."""

    def __init__(self, rig: Rig, **wanted: object) -> None:
        self.page = Socket(rig.app)
        self.messages: list[dict[str, Any]] = []
        self.look(**wanted)

    def look(self, **wanted: object) -> None:
        """Subscribe, with this filter."""
        self.page.say(type="subscribe", topics=["frames"], frames=wanted or None)

    @property
    def heard(self) -> list[dict[str, Any]]:
        """Every message of the topic, each of the form the document promises."""
        new = [message for message in self.page.heard() if message["type"] == "frames"]
        for message in new:
            FramesMessage.model_validate(message)
        self.messages += new
        return self.messages

    @property
    def transfers(self) -> list[dict[str, Any]]:
        return [row for message in self.heard for row in message["transfers"]]

    @property
    def frames(self) -> list[dict[str, Any]]:
        return [row for message in self.heard for row in message["frames"]]

    @property
    def told(self) -> list[str]:
        return [row["summary"] for row in self.transfers]

    @property
    def counts(self) -> tuple[int, int, int]:
        """Received, shown, dropped."""
        last = self.heard[-1]
        return last["received"], last["shown"], last["dropped"]


@scene()
async def test_every_transfer_is_seen_with_a_sentence_sent_ones_included_in_the_order_of_the_bus(
    rig: Rig, servo: Servo
) -> None:
    viewer = Viewer(rig)
    await asyncio.sleep(0.2)
    since = len(rig.transfers())
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_limit_cw": 60}}))
    await asyncio.sleep(1.2)
    told = viewer.told
    asked = told.index("GetSet request write 0x38 angle_limit_cw = 600, 60.0°")
    answered = next(
        n for n, one in enumerate(told) if one.startswith("GetSet response 0x38 = 600, 60.0°, as requested. ")
    )
    assert asked < answered
    assert [viewer.transfers[n]["sent"] for n in (asked, answered)] == [True, False]
    assert "Status servo 1, 0.0°" in told
    assert any(one.startswith("NodeStatus OK, operational, up ") for one in told)
    times = [row["timestamp"] for row in viewer.transfers]
    assert times == sorted(times)
    assert abs(times[-1] - rig.host.base.utc_now()) < 0.5
    assert len(times) >= len(rig.transfers()) - since
    assert viewer.frames == []
    assert viewer.counts == (len(times), len(times), 0)
    await viewer.page.close()


@scene()
async def test_the_raw_view_shows_each_frame_as_it_was(rig: Rig) -> None:
    await rig.ready()
    viewer = Viewer(rig, view="raw", node_id=11)
    await asyncio.sleep(0.05)
    before = len(rig.bus.history)
    await asyncio.sleep(1.0)
    await asyncio.sleep(0.2)
    on_bus = [(f"{frame.id:08x}", frame.data.hex()) for _, frame in list(rig.bus.history)[before:]]
    seen = [(row["can_id"], row["data"]) for row in viewer.frames]
    of_servo = [one for one in on_bus if int(one[0], 16) & 0x7F == 11]
    assert len(of_servo) > 20
    assert [one for one in of_servo if one in seen] == of_servo
    assert viewer.transfers == []
    assert {row["problem"] for row in viewer.frames} == {None}
    await viewer.page.close()


@scene()
async def test_a_bad_frame_is_shown_with_the_reason_in_both_views(rig: Rig) -> None:
    await rig.ready()
    decoded, raw = Viewer(rig), Viewer(rig, view="raw", problems_only=True)
    await asyncio.sleep(0.2)
    stranger = rig.bus.port("stranger")
    one, two, three = frames(GetSetResponse(integer(5), EMPTY, EMPTY, EMPTY, "0x2C"), source=77, destination=78)
    stranger.send([one, two._replace(data=two.data[:-1] + bytes((two.data[-1] ^ 0x20,)))])
    await asyncio.sleep(0.1)
    stranger.send([one, two, three._replace(data=bytes((three.data[0] ^ 1,)) + three.data[1:])])
    stranger.send([Frame(0x1001_554D, b"\x00\xc0")])
    await asyncio.sleep(0.3)
    problems = [(row["can_id"], row["problem"]) for row in decoded.frames]
    assert problems == [(f"{one.id:08x}", "toggle bit error"), (f"{one.id:08x}", "CRC error")]
    assert [(row["can_id"], row["problem"]) for row in raw.frames] == problems
    assert "NodeStatus not decoded: invalid payload of 1 byte" in decoded.told
    received, shown, dropped = decoded.counts
    assert (received, dropped) == (len(decoded.transfers) + 2, 0)
    assert shown == received
    await decoded.page.close()
    await raw.page.close()


@scene()
async def test_services_between_other_nodes_are_seen(rig: Rig) -> None:
    await rig.ready()
    viewer = Viewer(rig, kind="request")
    await asyncio.sleep(0.05)
    rig.bus.port("stranger").send(frames(GetSetRequest(0, integer(1), "0x20"), source=77, destination=78))
    await asyncio.sleep(0.2)
    (seen,) = [row for row in viewer.transfers if row["source"] == 77]
    assert (seen["destination"], seen["summary"]) == (78, "GetSet request write 0x20 torque_mode = 1, Off")
    assert (seen["frames"], seen["sent"], seen["kind"]) == (3, False, "request")
    await viewer.page.close()


Row = dict[str, Any]

FILTERS: list[tuple[Row, Callable[[Row], bool]]] = [
    ({"node_id": 12}, lambda row: 12 in (row["source"], row["destination"])),
    ({"type": "nodestatus"}, lambda row: row["type"] == "uavcan.protocol.NodeStatus"),
    ({"kind": "response"}, lambda row: row["kind"] == "response"),
    ({"text": "CURRENT_ANGLE"}, lambda row: "current_angle" in row["summary"]),
    ({"text": "-12.5"}, lambda row: "−12.5" in row["summary"]),
    (
        {"type": "GetSet", "node_id": 11, "kind": "request"},
        lambda row: "GetSet request" in row["summary"] and row["destination"] == 11,
    ),
    ({"node_id": 0}, lambda row: row["source"] == 0),
    ({"problems_only": True}, lambda row: row["fields"] is None),
]


@pytest.mark.parametrize(("wanted", "passes"), FILTERS)
@scene(PLAIN, Recipe("BLA15-06U-A0", "1.300", node_id=12))
async def test_the_server_filters_and_counts_what_it_hides(
    rig: Rig, wanted: Row, passes: Callable[[Row], bool]
) -> None:
    servo = (await rig.ready(2))[0]
    everything, some = Viewer(rig), Viewer(rig, **wanted)
    await asyncio.sleep(0.2)
    stranger = rig.bus.port("stranger")
    stranger.send([Frame(0x1001_554D, b"\x00\xc0")])  # a NodeStatus of one byte
    stranger.send(frames(NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL), source=12))
    stranger.send(frames(GetSetRequest(0, integer(-125), "0x44"), source=12, destination=11))
    stranger.send([Frame(0x1001_0100, bytes((1, 1, 2, 3, 4, 5, 6, 0xC0)))])  # an anonymous Allocation
    json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))
    await asyncio.sleep(2.5)
    shown = [row["payload"] for row in some.transfers]
    expected = [row["payload"] for row in everything.transfers if passes(row)]
    assert shown
    assert all(passes(row) for row in some.transfers)
    together = min(len(shown), len(expected))  # the two pages are not written to in the same instant
    assert shown[:together] == expected[:together]
    assert abs(len(shown) - len(expected)) <= 4
    received, told, dropped = some.counts
    assert (told, dropped) == (len(shown), 0)
    a_second_ago = rig.host.base.utc_now() - 1.1  # counts alone are told once a second
    assert received > told
    assert received >= sum(row["timestamp"] < a_second_ago for row in everything.transfers)
    await everything.page.close()
    await some.page.close()


@scene()
async def test_a_new_filter_begins_to_count_anew_and_unsubscribing_ends_it(rig: Rig) -> None:
    await rig.ready()
    viewer = Viewer(rig)
    await asyncio.sleep(2)
    assert viewer.counts[0] > 20
    viewer.look(kind="response", text="nobody says this")
    await asyncio.sleep(1.5)
    received, shown, _ = viewer.counts
    assert (received < 30, shown) == (True, 0)
    viewer.page.say(type="unsubscribe", topics=["frames"])
    await asyncio.sleep(0.5)
    before = len(viewer.heard)
    await asyncio.sleep(2)
    assert len(viewer.heard) == before
    await viewer.page.close()


@scene()
async def test_nothing_is_hooked_to_the_bus_while_nobody_looks(rig: Rig) -> None:
    await rig.ready()
    assert rig.host.connection is not None
    hooked = rig.host.connection.participant.on_frames
    before = list(hooked)
    one, other = Viewer(rig), Viewer(rig)
    await asyncio.sleep(0.1)
    assert len(hooked) == len(before) + 1, "two pages share one decoder"
    await one.page.close()
    assert len(hooked) == len(before) + 1
    await other.page.close()
    assert list(hooked) == before
    assert not rig.host.monitor.watched


@scene()
async def test_the_view_goes_on_when_the_bus_was_left_and_joined_again(rig: Rig) -> None:
    await rig.ready()
    viewer = Viewer(rig, type="NodeStatus", node_id=127)
    await asyncio.sleep(1.5)
    json(await rig.call("DELETE", "/bus"))
    gone = len(viewer.transfers)
    assert gone
    await asyncio.sleep(3)
    assert len(viewer.transfers) == gone
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await asyncio.sleep(3)
    assert len(viewer.transfers) >= gone + 3
    await viewer.page.close()


@scene()
async def test_a_page_that_does_not_keep_up_is_told_how_much_it_missed_and_gets_the_newest(rig: Rig) -> None:
    await rig.ready()
    await rig.bench.close()
    viewer = Viewer(rig, view="raw", text="cafe")
    await asyncio.sleep(0.1)
    stranger = rig.bus.port("stranger")
    # more in one turn of the loop than is kept: nothing is sent between them
    loop = asyncio.get_running_loop()
    burst = [Frame(0x1E12_3401, n.to_bytes(3, "big") + b"\xca\xfe\x00") for n in range(ROWS_QUEUED + 50)]
    assert rig.host.connection is not None
    rig.host.connection.participant.on_frames.notify([one._replace(at=loop.time()) for one in burst], False)
    await asyncio.sleep(1)
    received, shown, dropped = viewer.counts
    assert (shown, dropped) == (ROWS_QUEUED, 50)
    assert received >= ROWS_QUEUED + 50
    assert int(viewer.frames[-1]["data"][:6], 16) == ROWS_QUEUED + 49
    await stranger.close()
    await viewer.page.close()


@scene()
async def test_messages_come_at_most_thirty_times_a_second(rig: Rig) -> None:
    await rig.ready()
    viewer = Viewer(rig)
    stranger = rig.bus.port("stranger")
    await asyncio.sleep(0.2)
    before = len(viewer.heard)
    for n in range(200):
        stranger.send(frames(NodeStatus(n, NodeHealth.OK, Mode.OPERATIONAL), source=77, transfer_id=n % 32))
        await asyncio.sleep(0.005)
    assert len(viewer.heard) - before <= 31
    await asyncio.sleep(0.2)
    assert sum(row["source"] == 77 for row in viewer.transfers) == 200
    await viewer.page.close()

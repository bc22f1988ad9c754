"""Leases: how motion control passes between clients, and how soon torque is off without its holder (section 4.13)."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any, cast

import pytest

from behaviour.actions import move, torque
from behaviour.losing import HOLDING, now
from behaviour.rig import PLAIN, Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import LeaseChanged
from hornbill.wire.datatype import Kind
from hornbill.wire.services import GetSetRequest, ValueKind
from jumping_clock import stall

TWENTY = [replace(HOLDING, servo_id=n, node_id=10 + n) for n in range(1, 21)]
TWO = TWENTY[:2]
REQUEST = {"holder": "Bob", "ttl_s": 2.0, "reason": "my turn", "timeout_s": 10.0}
FORCE = {"holder": "Bob", "ttl_s": 9.0, "force": True, "reason": "now"}


def torque_off_times(rig: Rig) -> dict[int, float]:
    """When the first torque off was on the bus, by node ID."""
    found: dict[int, float] = {}
    for transfer in rig.transfers("host"):
        if transfer.kind is Kind.REQUEST and transfer.type_id == GetSetRequest.TYPE.id:
            request = GetSetRequest.decode(transfer.payload)
            assert request is not None
            if request.name == "0x20" and request.value.kind is ValueKind.INTEGER and request.value.value == 1:
                found.setdefault(transfer.destination, transfer.at)
    return found


async def request(rig: Rig, **more: object) -> dict[str, Any]:
    """Request motion control; the request as its client sees it."""
    return json(await rig.call("POST", "/leases/requests", {**REQUEST, **more}), 202)


async def poll(rig: Rig, request: dict[str, Any], for_s: float = 0.0) -> dict[str, Any]:
    """Poll a request once a second, as its client does, until it is decided or the time is over."""
    until = now() + for_s
    while True:
        found: dict[str, Any] = json(await rig.call("GET", f"/leases/requests/{request['id']}"))
        if found["state"] != "waiting" or now() >= until:
            return found
        await asyncio.sleep(min(1.0, until - now()))


async def state(rig: Rig, request: dict[str, Any]) -> str:
    return (await poll(rig, request))["state"]


async def current(rig: Rig) -> dict[str, Any]:
    """The lease."""
    return json(await rig.call("GET", "/leases"))[0]


async def holder(rig: Rig) -> str | None:
    found = json(await rig.call("GET", "/leases"))
    return found[0]["holder"] if found else None


async def audit(rig: Rig, outcome: str) -> tuple[object, ...]:
    """Who, before, after and detail of the newest audit row with this outcome."""
    await asyncio.sleep(1)
    rows = json(await rig.http.get("/audit", params={"action": "lease"}))
    row = next(row for row in rows if row["outcome"] == outcome)
    return row["by"], row["before"], row["after"], row["detail"]


async def read_forever(rig: Rig, servo: Servo) -> None:
    while True:
        await rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true")


@pytest.mark.parametrize("cause", ["expiry", "expiry in a stall of the event loop", "closed socket"])
@scene(*TWENTY)
async def test_torque_is_off_on_twenty_servos_under_load_within_100_ms(rig: Rig, cause: str) -> None:
    servos = await rig.ready(20)
    by_socket = cause == "closed socket"
    lease = await rig.lease(ttl_s=30 if by_socket else 1)
    page = Socket(rig.app) if by_socket else None
    if page is not None:
        page.send(type="heartbeat", lease=lease)
    await asyncio.gather(*(move(rig, servo, lease) for servo in servos))
    load = [asyncio.create_task(read_forever(rig, servo)) for servo in servos]
    await asyncio.sleep(0.1)
    assert torque_off_times(rig) == {}
    due = now() + (await current(rig))["expires_in_s"]
    if page is not None:
        due = now()
        await page.close()
    elif "stall" in cause:
        asyncio.get_running_loop().call_at(due - 0.001, stall, 0.2)
        due += 0.2 - 0.001
    await asyncio.sleep(due - now() + 0.2)
    for task in load:
        task.cancel()
    late = [at - due for at in torque_off_times(rig).values()]
    assert len(late) == 20
    assert min(late) >= -0.001, "not before it expired"
    assert max(late) <= 0.1
    assert {rig.sim(servo).output for servo in servos} == {1}
    assert await holder(rig) is None
    ((level, _, ended),) = rig.logged("lease_ended")
    assert (level, ended["holder"], ended["why"]) == ("notice", "test", "page_closed" if by_socket else "expired")
    assert set(cast("list[str]", ended["servos"])) == {servo.title for servo in servos}
    outcome, text = ("released", "The page of test closed.") if by_socket else ("expired", "The lease of test expired.")
    assert await audit(rig, outcome) == ("test", None, None, text)
    text = f"Motion control expires {30 if by_socket else 1} s after the last heartbeat."
    assert await audit(rig, "taken") == ("test", None, None, text)


@scene(HOLDING)
async def test_a_lease_that_expired_in_a_stall_cannot_be_renewed(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease(ttl_s=1)
    await move(rig, servo, lease)
    stall(1.2)
    problem(await rig.call("PUT", f"/leases/{lease}"), "unknown_lease", 404)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@pytest.mark.parametrize("by_socket", [True, False])
@scene(HOLDING)
async def test_a_heartbeat_renews_the_lease_and_without_one_it_expires(rig: Rig, servo: Servo, by_socket: bool) -> None:
    lease = await rig.lease(ttl_s=1)
    page = Socket(rig.app)
    await move(rig, servo, lease)
    for _ in range(8):
        await asyncio.sleep(0.6)
        if by_socket:
            page.send(type="heartbeat", lease=lease)
        else:
            json(await rig.call("PUT", f"/leases/{lease}"))
    assert rig.sim(servo).output == 0
    await asyncio.sleep(1.1)
    assert rig.sim(servo).output == 1
    await page.close()


@scene(PLAIN)
async def test_the_timeout_of_the_servo_disables_torque_once_the_server_is_silent(rig: Rig, servo: Servo) -> None:
    """As after a crash of the server."""
    await move(rig, servo, await rig.lease(), 90.0)
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 0
    await rig.cable.unplug()
    await asyncio.sleep(1.02)
    assert rig.sim(servo).output == 1


@scene(connect=False)
async def test_a_request_and_its_countdown_are_published(rig: Rig) -> None:
    lease = await rig.lease()
    page = Socket(rig.app)
    await page.receive("lease")
    pending = await request(rig)
    assert (pending["state"], pending["by"], pending["lease_id"]) == ("waiting", "Bob", None)
    assert pending["holder"]["holder"] == "test"
    assert lease.startswith(pending["holder"]["shown_id"])
    assert lease not in str(pending)
    published = (await page.receive("lease"))["lease"]
    shown = published["request"]
    assert (published["holder"], shown["by"], shown["reason"]) == ("test", "Bob", "my turn")
    assert 9.9 < shown["expires_in_s"] <= 10
    assert "Bob requests motion control from test: my turn." in rig.events("lease_requested")[0].text
    values = {"by": "Bob", "holder": "test", "reason": "my turn", "timeout_s": 10.0}
    assert rig.logged("lease_requested") == [("notice", None, values)]
    await asyncio.sleep(2)
    renewed = json(await rig.call("PUT", f"/leases/{lease}"))
    assert 7.9 < renewed["request"]["expires_in_s"] <= 8, "a holder without a socket sees it in the renewal"
    assert pending["id"] not in str(published), "only the client that requested it gets the ID that leads to the lease"
    await page.close()


@scene(*TWO)
async def test_a_released_lease_passes_at_once_after_torque_is_off(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await rig.lease()
    await move(rig, servo, lease)
    pending = await request(rig)
    await asyncio.sleep(0.5)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.sim(servo).output == 1
    found = await poll(rig, pending)
    assert found["state"] == "granted"
    await torque(rig, servo, "on", found["lease_id"])
    assert await holder(rig) == "Bob"


@scene(*TWO)
async def test_without_a_refusal_it_passes_after_the_countdown_once_torque_is_off(rig: Rig) -> None:
    servos = await rig.ready(2)
    lease = await rig.lease()
    for servo in servos:
        await move(rig, servo, lease)
    began = now()
    pending = await request(rig)
    outputs: list[set[int]] = []
    hand_over = rig.host.leases.hand_over

    def watched(*given: Any, **named: Any) -> Any:
        outputs.append({rig.sim(servo).output for servo in servos})
        return hand_over(*given, **named)

    rig.host.leases.hand_over = watched
    assert (await poll(rig, pending, 9.5))["state"] == "waiting"
    assert {rig.sim(servo).output for servo in servos} == {0}
    json(await rig.call("PUT", f"/leases/{lease}"))
    await asyncio.sleep(began + 10.1 - now())
    assert outputs == [{1}], "the lease was granted when both had torque off"
    assert await state(rig, pending) == "granted"
    problem(await rig.call("PUT", f"/leases/{lease}"), "unknown_lease", 404)
    body = {"type": "angle", "value": 0.0}
    problem(await rig.call("POST", f"/servos/{servos[0].uid}/command", body, lease=lease), "lease_held", 409)
    assert rig.events("lease_passed")[0].text == "Bob took over motion control from test: my turn."
    assert rig.logged("lease_passed") == [("notice", None, {"by": "Bob", "holder": "test", "reason": "my turn"})]
    assert await audit(rig, "passed") == ("Bob", "test", "Bob", "my turn")


@scene(*TWO)
async def test_a_silent_servo_does_not_delay_the_lease_and_its_torque_off_is_retried(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await move(rig, servo, await rig.lease())
    rig.sim(servo).conditions.drop_responses_pct = 100
    began = now()
    json(await rig.call("POST", "/leases", FORCE), 201)
    assert now() - began < 0.3
    assert servo.node_id in torque_off_times(rig), "it was written before the lease passed"
    assert rig.host.torque_off.pending(servo.uid)
    again = asyncio.create_task(rig.call("POST", "/leases", FORCE))
    await asyncio.sleep(0.01)
    await rig.host.motion_control.close()  # as at the end of the server
    with pytest.raises(asyncio.CancelledError):
        await again


@scene(connect=False)
async def test_only_the_holder_can_refuse_a_request(rig: Rig) -> None:
    lease = await rig.lease()
    pending = await request(rig)
    path = f"/leases/requests/{(await current(rig))['request']['id']}/refuse"
    problem(await rig.call("POST", path), "lease_held", 409)
    problem(await rig.call("POST", "/leases/requests/0/refuse", lease=lease), "unknown_lease", 404)
    assert (await rig.call("POST", path, lease=lease)).status_code == 204
    assert await state(rig, pending) == "refused"
    assert (await current(rig))["request"] is None
    await asyncio.sleep(11)
    assert await holder(rig) == "test"
    assert rig.logged("lease_refused") == [("notice", None, {"by": "Bob", "holder": "test"})]


@scene(connect=False)
async def test_a_request_is_withdrawn_on_request_or_if_its_client_stops_polling(rig: Rig) -> None:
    await rig.lease()
    pending = await request(rig)
    assert json(await rig.call("DELETE", f"/leases/requests/{pending['id']}"))["state"] == "withdrawn"
    pending = await request(rig, timeout_s=3)
    await asyncio.sleep(3.1)  # never polled
    assert await state(rig, pending) == "withdrawn"
    pending = await request(rig)
    await poll(rig, pending, 4)  # polled for a while
    await asyncio.sleep(7)
    assert await state(rig, pending) == "withdrawn"
    assert await holder(rig) == "test"
    gone = ("notice", None, {"by": "Bob", "gone": True})
    assert rig.logged("lease_withdrawn") == [("notice", None, {"by": "Bob"}), gone, gone]
    missing = problem(await rig.call("GET", "/leases/requests/none"), "unknown_lease", 404)
    assert missing["cause"] == "control_request_not_found"
    for _ in range(15):
        latest = await request(rig)
        json(await rig.call("DELETE", f"/leases/requests/{latest['id']}"))
    assert await state(rig, pending) == "withdrawn"
    await request(rig)
    problem(await rig.call("GET", f"/leases/requests/{pending['id']}"), "unknown_lease", 404)


@scene(connect=False)
async def test_a_granted_lease_lasts_until_its_client_sees_it_and_then_its_ttl(rig: Rig) -> None:
    pending = await request(rig, ttl_s=0.5)
    assert pending["state"] == "granted", "no client has it"
    await asyncio.sleep(4.5)
    assert json(await rig.call("PUT", f"/leases/{pending['lease_id']}"))["expires_in_s"] == 0.5
    count = len(rig.changes)
    await asyncio.sleep(0.6)
    assert await holder(rig) is None
    assert [one for one in rig.changes[count:] if isinstance(one, LeaseChanged)] == [LeaseChanged()]
    assert json(await rig.call("GET", f"/leases/requests/{pending['id']}"))["lease_id"] is None
    await request(rig, ttl_s=0.5)  # its client never takes it up
    await asyncio.sleep(5.1)
    assert await holder(rig) is None
    await rig.lease()


@scene(connect=False)
async def test_a_second_request_is_busy_and_a_free_lease_goes_to_the_first(rig: Rig) -> None:
    await rig.lease(ttl_s=1)
    pending = await request(rig)
    refused = problem(await rig.call("POST", "/leases/requests", {**REQUEST, "holder": "Cem"}), "busy", 409)
    assert (refused["cause"], refused["by"]) == ("already_requested", "Bob")
    stall(1.0)  # the lease expires
    problem(await rig.call("POST", "/leases", {"holder": "Cem"}), "busy", 409)
    await asyncio.sleep(0.1)
    assert await state(rig, pending) == "granted"


@scene(*TWO)
async def test_force_needs_a_reason_turns_torque_off_first_and_records_both_names(rig: Rig) -> None:
    servo, other = await rig.ready(2)
    lease = await rig.lease()
    await move(rig, servo, lease)
    writes = len(rig.writes())
    for reason in ("", "  "):
        refused = problem(await rig.call("POST", "/leases", {**FORCE, "reason": reason}), "invalid_value", 422)
        assert refused["cause"] == "force_without_reason"
    assert await holder(rig) == "test"
    assert rig.sim(servo).output == 0
    assert not [one for one in rig.writes()[writes:] if one[1] == "0x20"]
    taken = json(await rig.call("POST", "/leases", {**FORCE, "reason": "he went home"}), 201)
    assert rig.sim(servo).output == 1
    assert rig.sim(other).output == 0, "it was not under command"
    problem(await rig.call("PUT", f"/leases/{lease}"), "unknown_lease", 404)
    json(await rig.call("PUT", f"/leases/{taken['id']}"))
    assert rig.events("lease_forced")[0].text == "Bob took motion control by force from test: he went home."
    assert rig.logged("lease_forced") == [("warning", None, {"by": "Bob", "holder": "test", "reason": "he went home"})]
    assert await audit(rig, "forced") == ("Bob", "test", "Bob", "he went home")


@scene(*TWO)
async def test_force_ends_a_waiting_request_and_two_at_once_leave_one_holder(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await move(rig, servo, await rig.lease())
    pending = await request(rig)
    body = {**FORCE, "ttl_s": 20.0}
    both = await asyncio.gather(*(rig.call("POST", "/leases", {**body, "holder": name}) for name in ("Cem", "Dan")))
    assert sorted(one.status_code for one in both) == [201, 409]
    assert [one.json()["cause"] for one in both if one.status_code == 409] == ["control_transfer_in_progress"]
    winner = next(one.json()["holder"] for one in both if one.status_code == 201)
    assert await state(rig, pending) == "refused"
    assert rig.logged("lease_refused") == [("notice", None, {"by": "Bob", "holder": winner, "forced": True})]
    assert rig.events("lease_refused")[0].text == f"{winner} took motion control by force."
    await asyncio.sleep(12)
    assert await holder(rig) == winner


async def waiting(rig: Rig) -> None:
    await request(rig)


async def passing(rig: Rig) -> None:
    asyncio.get_running_loop().create_task(rig.call("POST", "/leases", FORCE))
    await asyncio.sleep(0.01)


@pytest.mark.parametrize("begin", [waiting, passing])
@scene(*TWO)
async def test_a_request_or_a_passing_lease_does_not_delay_stop(
    rig: Rig, begin: Callable[[Rig], Awaitable[None]]
) -> None:
    servo, other = await rig.ready(2)
    lease = await rig.lease()
    await move(rig, servo, lease)
    await move(rig, other, lease)
    rig.sim(other).conditions.drop_responses_pct = 100
    await begin(rig)
    began = now()
    rig.host.stop.now("brake", "test", "")
    await asyncio.sleep(0.02)
    assert rig.sim(servo).output == 2, "the brake of the stop, not the torque off of the passing lease"
    assert now() - began < 0.03
    assert rig.host.stop.latched


@scene(*TWO)
async def test_a_command_in_progress_does_not_move_the_horn_after_the_lease_was_taken(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await rig.lease()
    await move(rig, servo, lease)
    rig.bus.loss(100)
    path = f"/servos/{servo.uid}/command"
    late = asyncio.create_task(rig.call("POST", path, {"type": "angle", "value": 90.0}, lease=lease))
    await asyncio.sleep(0.01)
    forcing = asyncio.create_task(rig.call("POST", "/leases", FORCE))
    await asyncio.sleep(0.01)
    rig.bus.loss(0)
    json(await forcing, 201)
    problem(await late, "lease_required", 428)
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1
    assert rig.sim(servo).angle_deg < 30

"""One writer: how motion control passes, and how soon torque is off when whoever had it is lost (section 4.13)."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any, cast

import pytest

from behaviour.losing import HOLDING, now
from behaviour.rig import PLAIN, Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.wire.datatype import Kind
from hornbill.wire.services import GetSetRequest, ValueKind
from jumping_clock import JumpingLoop

TWENTY = [replace(HOLDING, servo_id=n, node_id=10 + n) for n in range(1, 21)]
TWO = TWENTY[:2]
ASK = {"holder": "Bob", "ttl_s": 2.0, "reason": "my turn", "timeout_s": 10.0}


async def move(rig: Rig, servo: Servo, lease: str, angle: float = 20.0) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": angle}, lease=lease))


def offs(rig: Rig) -> dict[int, float]:
    """When the first torque off was on the bus, by node id."""
    found: dict[int, float] = {}
    for transfer in rig.transfers("host"):
        if transfer.kind is Kind.REQUEST and transfer.type_id == GetSetRequest.TYPE.id:
            request = GetSetRequest.decode(transfer.payload)
            assert request is not None
            if request.name == "0x20" and request.value.kind is ValueKind.INTEGER and request.value.value == 1:
                found.setdefault(transfer.destination, transfer.at)
    return found


async def poll(rig: Rig, asked: dict[str, Any], for_s: float = 0.0, state: str = "waiting") -> dict[str, Any]:
    """Look once a second, as whoever asks does, until it is decided or the time is over."""
    until = now() + for_s
    while True:
        found: dict[str, Any] = json(await rig.call("GET", f"/leases/requests/{asked['id']}"))
        if found["state"] != state or now() >= until:
            return found
        await asyncio.sleep(min(1.0, until - now()))


async def holder(rig: Rig) -> str | None:
    found = json(await rig.call("GET", "/leases"))
    return found[0]["holder"] if found else None


async def busy_bus(rig: Rig, servos: list[Servo]) -> list[asyncio.Task[Any]]:
    """Full reads of every servo, for ever."""

    async def read(servo: Servo) -> None:
        while True:
            await rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true")

    return [asyncio.create_task(read(servo)) for servo in servos]


async def command_all(rig: Rig, servos: list[Servo], lease: str) -> list[asyncio.Task[Any]]:
    """All of them under command, and load on the bus."""
    await asyncio.gather(*(move(rig, servo, lease) for servo in servos))
    load = await busy_bus(rig, servos)
    await asyncio.sleep(0.1)
    return load


def end(tasks: list[asyncio.Task[Any]]) -> None:
    for task in tasks:
        task.cancel()


@scene(*TWENTY)
async def test_when_a_lease_lapses_torque_off_is_on_the_bus_for_twenty_servos_under_load_within_100_ms(
    rig: Rig,
) -> None:
    servos = await rig.ready(20)
    lease = await rig.lease(ttl_s=2)
    load = await command_all(rig, servos, lease)
    lapses = now() + json(await rig.call("GET", "/leases"))[0]["expires_in_s"]
    await asyncio.sleep(lapses - now() + 0.2)
    end(load)
    late = [at - lapses for at in offs(rig).values()]
    assert len(late) == 20
    assert min(late) >= -0.001, "not before it lapsed"
    assert max(late) <= 0.1
    assert {rig.sim(servo).output for servo in servos} == {1}


@scene(*TWENTY)
async def test_after_a_stall_of_the_event_loop_torque_is_off_within_100_ms_of_its_end(rig: Rig) -> None:
    servos = await rig.ready(20)
    lease = await rig.lease(ttl_s=2)
    load = await command_all(rig, servos, lease)
    lapses = now() + json(await rig.call("GET", "/leases"))[0]["expires_in_s"]
    loop = cast("JumpingLoop", asyncio.get_running_loop())
    loop.call_at(lapses - 0.001, loop.stall, 0.2)
    await asyncio.sleep(lapses - now() + 0.4)
    end(load)
    late = [at - (lapses - 0.001 + 0.2) for at in offs(rig).values()]
    assert len(late) == 20
    assert max(late) <= 0.1


@scene(HOLDING)
async def test_a_stall_does_not_bring_a_lapsed_lease_back_to_life(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease(ttl_s=1)
    await move(rig, servo, lease)
    cast("JumpingLoop", asyncio.get_running_loop()).stall(1.2)
    problem(await rig.call("PUT", f"/leases/{lease}"), "unknown_lease", 404)
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1


@scene(*TWENTY)
async def test_when_the_socket_of_the_holder_closes_torque_goes_off_on_all_twenty_within_100_ms(rig: Rig) -> None:
    servos = await rig.ready(20)
    lease = await rig.lease(ttl_s=30)
    page = Socket(rig.app)
    page.say(type="heartbeat", lease=lease)
    load = await command_all(rig, servos, lease)
    closed = now()
    await page.close()
    await asyncio.sleep(0.2)
    end(load)
    assert len(offs(rig)) == 20
    assert max(offs(rig).values()) - closed <= 0.1
    assert await holder(rig) is None


@pytest.mark.parametrize("road", ["socket", "rest"])
@scene(HOLDING)
async def test_a_heart_beat_keeps_the_lease_and_without_one_it_lapses(rig: Rig, servo: Servo, road: str) -> None:
    lease = await rig.lease(ttl_s=1)
    page = Socket(rig.app)
    await move(rig, servo, lease)
    for _ in range(8):
        await asyncio.sleep(0.6)
        if road == "socket":
            page.say(type="heartbeat", lease=lease)
        else:
            json(await rig.call("PUT", f"/leases/{lease}"))
    assert rig.sim(servo).output == 0
    await asyncio.sleep(1.1)
    assert rig.sim(servo).output == 1
    await page.close()


@scene(PLAIN)
async def test_when_the_server_is_killed_the_servos_own_time_out_takes_disable_torque(rig: Rig, servo: Servo) -> None:
    """From the bus, a killed server is one that says nothing any more."""

    lease = await rig.lease()
    await move(rig, servo, lease, 90.0)
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 0
    await rig.cable.unplug()
    await asyncio.sleep(1.02)
    assert rig.sim(servo).output == 1


@scene(connect=False)
async def test_everybody_sees_who_asks_and_the_countdown_and_the_log_says_it(rig: Rig) -> None:
    lease = await rig.lease()
    page = Socket(rig.app)
    await page.hear("lease")
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    assert (asked["state"], asked["by"], asked["lease_id"]) == ("waiting", "Bob", None)
    assert asked["holder"]["holder"] == "test"
    assert lease.startswith(asked["holder"]["shown_id"])
    assert lease not in str(asked)
    told = (await page.hear("lease"))["lease"]
    assert (told["holder"], told["request"]["by"], told["request"]["reason"]) == ("test", "Bob", "my turn")
    assert 9.9 < told["request"]["expires_in_s"] <= 10
    assert "Bob requests motion control from test: my turn." in rig.events("lease_requested")[0].text
    await asyncio.sleep(2)
    beat = json(await rig.call("PUT", f"/leases/{lease}"))
    assert 7.9 < beat["request"]["expires_in_s"] <= 8, "a holder without a socket learns it from a heart-beat"
    assert asked["id"] not in str(told), "the way to the lease is known to whoever asked, alone"
    await page.close()


@scene(*TWO)
async def test_the_holder_gives_it_back_and_it_passes_at_once_after_torque_is_off(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await rig.lease()
    await move(rig, servo, lease)
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    await asyncio.sleep(0.5)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.sim(servo).output == 1
    found = await poll(rig, asked)
    assert found["state"] == "granted"
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=found["lease_id"]))
    assert await holder(rig) == "Bob"


@scene(*TWO)
async def test_without_a_refusal_it_passes_when_the_countdown_ends_and_torque_is_off_before_it_is_granted(
    rig: Rig,
) -> None:
    servos = await rig.ready(2)
    lease = await rig.lease()
    for servo in servos:
        await move(rig, servo, lease)
    began = now()
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    outputs: list[set[int]] = []
    hand_over = rig.host.leases.hand_over

    def watched(*told: Any, **named: Any) -> Any:
        outputs.append({rig.sim(servo).output for servo in servos})
        return hand_over(*told, **named)

    rig.host.leases.hand_over = watched
    assert (await poll(rig, asked, 9.5))["state"] == "waiting"
    assert {rig.sim(servo).output for servo in servos} == {0}
    json(await rig.call("PUT", f"/leases/{lease}"))
    await asyncio.sleep(began + 10.1 - now())
    assert outputs == [{1}], "the lease was granted when both had torque off"
    found = await poll(rig, asked)
    assert found["state"] == "granted"
    problem(await rig.call("PUT", f"/leases/{lease}"), "unknown_lease", 404)
    body = {"type": "angle", "value": 0.0}
    problem(await rig.call("POST", f"/servos/{servos[0].uid}/command", body, lease=lease), "lease_held", 409)
    assert rig.events("lease_passed")[0].text == "Bob took over motion control from test: my turn."
    await asyncio.sleep(1)
    kept = json(await rig.http.get("/audit", params={"action": "lease"}))[0]
    assert (kept["by"], kept["outcome"], kept["before"], kept["detail"]) == ("Bob", "passed", "test", "my turn")


@scene(*TWO)
async def test_a_deaf_servo_does_not_keep_the_lease_from_passing_and_its_torque_off_stays_owed(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await rig.lease()
    await move(rig, servo, lease)
    rig.sim(servo).conditions.drop_responses_pct = 100
    began = now()
    json(await rig.call("POST", "/leases", {"holder": "Bob", "force": True, "reason": "hurry"}), 201)
    assert now() - began < 0.3
    assert servo.node_id in offs(rig), "it was written before the lease passed"
    assert rig.host.torque_off.pending(servo.uid)


@scene(connect=False)
async def test_the_holder_refuses_and_keeps_it_and_others_cannot_refuse_for_them(rig: Rig) -> None:
    lease = await rig.lease()
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    shown = json(await rig.call("GET", "/leases"))[0]["request"]["id"]
    problem(await rig.call("POST", f"/leases/requests/{shown}/refuse"), "lease_held", 409)
    problem(await rig.call("POST", "/leases/requests/0/refuse", lease=lease), "unknown_lease", 404)
    assert (await rig.call("POST", f"/leases/requests/{shown}/refuse", lease=lease)).status_code == 204
    assert (await poll(rig, asked))["state"] == "refused"
    assert json(await rig.call("GET", "/leases"))[0]["request"] is None
    await asyncio.sleep(11)
    assert await holder(rig) == "test"
    assert rig.events("lease_refused")


@scene(connect=False)
async def test_whoever_withdraws_or_vanishes_gets_nothing_and_the_holder_keeps_it(rig: Rig) -> None:
    await rig.lease()
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    assert json(await rig.call("DELETE", f"/leases/requests/{asked['id']}"))["state"] == "withdrawn"
    asked = json(await rig.call("POST", "/leases/requests", {**ASK, "timeout_s": 3}), 202)
    await asyncio.sleep(3.1)  # it never looked
    assert (await poll(rig, asked))["state"] == "withdrawn"
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    await poll(rig, asked, 4)  # it looked, and then no more
    await asyncio.sleep(7)
    assert (await poll(rig, asked))["state"] == "withdrawn"
    assert await holder(rig) == "test"
    problem(await rig.call("GET", "/leases/requests/none"), "unknown_lease", 404)


@scene(connect=False)
async def test_what_was_asked_for_lasts_long_enough_to_be_heard_of_and_then_as_long_as_was_asked(rig: Rig) -> None:
    asked = json(await rig.call("POST", "/leases/requests", {**ASK, "ttl_s": 0.5}), 202)
    assert asked["state"] == "granted", "nobody has it"
    await asyncio.sleep(4.5)
    assert json(await rig.call("PUT", f"/leases/{asked['lease_id']}"))["expires_in_s"] == 0.5
    await asyncio.sleep(0.6)
    assert await holder(rig) is None
    assert json(await rig.call("GET", f"/leases/requests/{asked['id']}"))["lease_id"] is None


@scene(connect=False)
async def test_a_grant_that_nobody_takes_up_lapses(rig: Rig) -> None:
    json(await rig.call("POST", "/leases/requests", {**ASK, "ttl_s": 0.5}), 202)
    await asyncio.sleep(5.1)
    assert await holder(rig) is None
    await rig.lease()


@scene(connect=False)
async def test_a_second_request_is_busy_and_while_one_waits_a_free_lease_goes_to_whoever_asked(rig: Rig) -> None:
    await rig.lease(ttl_s=1)
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    refused = problem(await rig.call("POST", "/leases/requests", {**ASK, "holder": "Cem"}), "busy", 409)
    assert "Bob" in refused["detail"]
    lapses = 1.0
    cast("JumpingLoop", asyncio.get_running_loop()).stall(lapses)
    problem(await rig.call("POST", "/leases", {"holder": "Cem"}), "busy", 409)
    await asyncio.sleep(0.1)
    assert (await poll(rig, asked))["state"] == "granted"


@scene(*TWO)
async def test_force_needs_a_reason_takes_torque_away_first_and_is_kept_with_both_names(rig: Rig) -> None:
    servo, other = await rig.ready(2)
    lease = await rig.lease()
    await move(rig, servo, lease)
    writes = len(rig.writes())
    for reason in ("", "  "):
        body = {"holder": "Bob", "ttl_s": 2.0, "force": True, "reason": reason}
        assert "reason" in problem(await rig.call("POST", "/leases", body), "invalid_value", 422)["detail"]
    assert await holder(rig) == "test"
    assert rig.sim(servo).output == 0
    assert not [one for one in rig.writes()[writes:] if one[1] == "0x20"]
    taken = json(await rig.call("POST", "/leases", {**body, "reason": "he went home"}), 201)
    assert rig.sim(servo).output == 1
    assert rig.sim(other).output == 0, "it was not under command"
    problem(await rig.call("PUT", f"/leases/{lease}"), "unknown_lease", 404)
    json(await rig.call("PUT", f"/leases/{taken['id']}"))
    said = rig.events("lease_forced")[0]
    assert (said.level, said.text) == ("warning", "Bob took motion control by force from test: he went home.")
    await asyncio.sleep(1)
    kept = json(await rig.http.get("/audit", params={"action": "lease"}))
    forced = next(row for row in kept if row["outcome"] == "forced")
    assert (forced["by"], forced["before"], forced["detail"]) == ("Bob", "test", "he went home")


@scene(*TWO)
async def test_force_ends_a_request_that_waits_and_two_at_once_leave_one_holder(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await move(rig, servo, await rig.lease())
    asked = json(await rig.call("POST", "/leases/requests", ASK), 202)
    body = {"ttl_s": 20.0, "force": True, "reason": "now"}
    both = await asyncio.gather(
        rig.call("POST", "/leases", {**body, "holder": "Cem"}),
        rig.call("POST", "/leases", {**body, "holder": "Dan"}),
    )
    assert sorted(answer.status_code for answer in both) == [201, 409]
    assert (await poll(rig, asked))["state"] == "refused"
    await asyncio.sleep(12)
    assert await holder(rig) == next(answer.json()["holder"] for answer in both if answer.status_code == 201)


async def _waiting(rig: Rig, lease: str) -> None:
    json(await rig.call("POST", "/leases/requests", ASK), 202)


async def _passing(rig: Rig, lease: str) -> None:
    body = {"holder": "Bob", "force": True, "reason": "now"}
    asyncio.get_running_loop().create_task(rig.call("POST", "/leases", body))
    await asyncio.sleep(0.01)


@pytest.mark.parametrize("state", [_waiting, _passing])
@scene(*TWO)
async def test_neither_a_request_nor_a_passing_lease_is_in_the_way_of_stop(
    rig: Rig, state: Callable[[Rig, str], Awaitable[None]]
) -> None:
    servo, other = await rig.ready(2)
    lease = await rig.lease()
    await move(rig, servo, lease)
    await move(rig, other, lease)
    rig.sim(other).conditions.drop_responses_pct = 100
    await state(rig, lease)
    began = now()
    rig.host.stop.now("brake", "test", "")
    await asyncio.sleep(0.02)
    assert rig.sim(servo).output == 2, "the brake of the stop, not the off of the passing lease"
    assert now() - began < 0.03
    assert rig.host.stop.latched


@scene(*TWO)
async def test_a_command_under_way_when_the_lease_is_taken_does_not_move_the_horn_afterwards(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await rig.lease()
    await move(rig, servo, lease)
    rig.bus.loss(100)
    path = f"/servos/{servo.uid}/command"
    late = asyncio.create_task(rig.call("POST", path, {"type": "angle", "value": 90.0}, lease=lease))
    await asyncio.sleep(0.01)
    force = {"holder": "Bob", "ttl_s": 9.0, "force": True, "reason": "now"}
    forcing = asyncio.create_task(rig.call("POST", "/leases", force))
    await asyncio.sleep(0.01)
    rig.bus.loss(0)
    json(await forcing, 201)
    problem(await late, "lease_required", 428)
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1
    assert rig.sim(servo).angle_deg < 30

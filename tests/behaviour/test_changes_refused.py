"""What a change is refused for before anything is sent: state, limits, ids of others, lost settings (B56, B92, B93)."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.neighbour import Neighbour
from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.test_changes import EIGHT, asked, patching
from hornbill.servo.device.servo import State
from hornbill.servo.runtime.hub import Change, Sampled
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import NodeId, Uid

SECOND = Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12)


@pytest.mark.parametrize("doing", ["soft start", "software update", "saving"])
def test_while_a_servo_is_doing_something_else_nothing_at_all_is_sent(doing: str) -> None:
    async def scene(rig: Rig) -> None:
        if doing == "soft start":
            async with asyncio.timeout(20):
                while not any(one.state is State.SOFT_START for one in rig.host.fleet.all()):
                    await asyncio.sleep(0.01)
        servo = rig.host.fleet.all()[0] if doing == "soft start" else (await rig.ready())[0]
        if doing == "software update":
            rig.sim(servo).conditions.software_update = True
            await asyncio.sleep(2)
        if doing == "saving":
            await rig.call("POST", f"/servos/{servo.uid}/save")
        count = asked(rig, "0x2C"), asked(rig, "0x0C")
        answers = [
            await patching(rig, servo, {"angle_p_gain": 41}),
            await patching(rig, servo, {"angle_p_gain": 41}, dry_run=True),
            await rig.call("PUT", f"/servos/{servo.uid}/parameters/angle_p_gain", {"value": 41}),
        ]
        for answer in answers:
            problem(answer, "busy", 409)
        assert (asked(rig, "0x2C"), rig.writes()) == (count[0], [])
        assert rig.host.store.snapshots.of(servo.uid) == []

    play(scene, replace(PLAIN, angle_deg=90.0))


@pytest.mark.parametrize(
    ("limits", "value", "word"), [("voltage_limit", 7.4, "supply"), ("temperature_limit", 20, "temperature")]
)
def test_a_lower_limit_may_equal_its_upper_one_once_it_is_confirmed(limits: str, value: float, word: str) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        values = {f"{limits}_lower": value, f"{limits}_upper": value}
        asks = problem(await patching(rig, servo, values), "needs_confirmation", 409)
        assert asks["confirm"] == word
        assert rig.writes() == []
        assert json(await patching(rig, servo, values, confirm=[word]))["outcome"] == "applied"

    play(scene)


def test_limits_that_would_switch_output_off_at_the_present_supply_need_to_be_confirmed() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        path = f"/servos/{servo.uid}/parameters/voltage_limit_upper"
        rig.sim(servo).conditions.voltage_v = 8.0
        await asyncio.sleep(0.2)
        for key, value in (("voltage_limit_upper", 8.3), ("voltage_limit_upper", 7.6)):
            asks = problem(await patching(rig, servo, {key: value}, dry_run=True), "needs_confirmation", 409)
            assert (asks["confirm"], asks["key"], asks["margin"]) == ("supply", key, 0.5)
            assert "8.0 V" in asks["detail"] or "7.9 V" in asks["detail"] or "8.1 V" in asks["detail"]
            assert "±0.5 V" in asks["detail"]
        problem(await rig.call("PUT", path, {"value": 8.3}), "needs_confirmation", 409)
        assert rig.writes() == []
        assert json(await patching(rig, servo, {"voltage_limit_upper": 8.8}))["outcome"] == "applied"
        assert json(await rig.call("PUT", path, {"value": 7.6, "confirm": ["supply"]}))["value"] == 7.6
        await asyncio.sleep(5)
        assert servo.state is State.PROTECTED
        assert json(await patching(rig, servo, {"voltage_limit_upper": 7.8}))["outcome"] == "applied", "no worse"
        rig.sim(servo).conditions.voltage_v = 5.0
        await asyncio.sleep(0.2)
        asks = problem(await patching(rig, servo, {"voltage_limit_lower": 4.8}), "needs_confirmation", 409)
        assert (asks["key"], asks["unit"]) == ("voltage_limit_lower", "V")

    play(scene)


def test_limits_that_would_switch_output_off_at_the_present_temperature_need_to_be_confirmed() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        asks = problem(await patching(rig, servo, {"temperature_limit_upper": 42}), "needs_confirmation", 409)
        assert (asks["confirm"], asks["margin"], asks["unit"]) == ("temperature", 5, "°C")
        problem(
            await patching(rig, servo, {"temperature_limit_upper": 42}, confirm=["supply"]), "needs_confirmation", 409
        )
        answer = json(await patching(rig, servo, {"temperature_limit_upper": 42}, confirm=["temperature"]))
        assert answer["outcome"] == "applied"

    play(scene, replace(PLAIN, room_c=40.0))


def test_a_servo_id_of_a_servo_on_the_bus_is_refused_with_its_owner_and_a_free_one() -> None:
    async def scene(rig: Rig) -> None:
        first, second = sorted(await rig.ready(2), key=lambda one: one.servo_id or 0)
        taken = problem(await patching(rig, first, {"servo_id": 2}), "conflict", 409)
        assert (taken["key"], taken["requested"], taken["owner"], taken["free"]) == ("servo_id", 2, second.uid, 1)
        assert taken["owner_title"] == second.title
        assert rig.writes() == []
        json(await patching(rig, first, {"servo_id": 1}))  # its own
        json(await patching(rig, second, {"servo_id": 7}))
        kept = problem(await patching(rig, first, {"servo_id": 2}), "conflict", 409)
        assert "ROM" in kept["detail"], "a restart brings it back"
        for one in (first, second):  # unprovisioned may be shared
            json(await patching(rig, one, {"servo_id": 0, "node_id": 0}))

    play(scene, PLAIN, SECOND)


def test_a_servo_id_of_one_that_is_only_remembered_is_refused_too() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        rig.host.store.servos.keep_rom(Uid("ab" * 16), {"servo_id": 9, "node_id": 44})
        rig.host.store.servos.label(Uid("ab" * 16), "elbow")
        for key, number in (("servo_id", 9), ("node_id", 44)):
            taken = problem(await patching(rig, servo, {key: number}), "conflict", 409)
            assert (taken["owner"], taken["owner_title"]) == ("ab" * 16, "elbow")
        planned = rig.host.changes.plan(servo, {"servo_id": 9, "node_id": 44}, leaving=[Uid("ab" * 16)])
        assert planned == {"servo_id": 9, "node_id": 44}

    play(scene)


def test_an_id_that_is_being_written_to_one_servo_is_refused_to_the_other() -> None:
    async def scene(rig: Rig) -> None:
        first, second = sorted(await rig.ready(2), key=lambda one: one.servo_id or 0)
        conditions = rig.sim(first).conditions

        def mute(change: Change) -> None:
            if isinstance(change, Sampled) and (change.uid, change.key) == (first.uid, "servo_id"):
                conditions.mute = True

        forget = rig.host.hub.listen(mute)
        writing = asyncio.create_task(patching(rig, first, {"servo_id": 7}))
        await asyncio.sleep(0.5)
        refused = problem(await patching(rig, second, {"servo_id": 7}), "conflict", 409)
        assert (refused["owner"], writing.done()) == (first.uid, False)
        forget()
        conditions.mute = False
        assert json(await writing)["outcome"] == "applied"
        assert [rig.sim(one).memory.get(0x45) for one in (first, second)] == [7, 2]

    play(scene, PLAIN, SECOND)


def test_a_node_id_of_anybody_is_refused_and_the_own_one_is_not() -> None:
    async def scene(rig: Rig) -> None:
        servo = next(one for one in await rig.ready(2) if one.node_id == 11)
        Neighbour(rig.bus.port("gps"), 60).speak()
        rig.host.store.allocations.record(Uid("cd" * 16), NodeId(33))
        await asyncio.sleep(2)
        for node, words in ((12, "on the bus"), (60, "node 60"), (33, "allocation table"), (127, "hornbill itself")):
            taken = problem(await patching(rig, servo, {"node_id": node}), "conflict", 409)
            assert words in taken["detail"], taken["detail"]
        assert rig.writes() == []
        for node in (11, 0, 34):
            assert json(await patching(rig, servo, {"node_id": node}))["outcome"] == "applied"

    play(scene, PLAIN, SECOND)


def test_a_servo_that_lost_its_settings_is_not_moved_until_it_is_saved() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        lease = await rig.lease()
        moves = [("command", {"type": "angle", "value": 5}), ("torque", {"mode": "on"})]
        for path, body in moves:
            barred = problem(
                await rig.call("POST", f"/servos/{servo.uid}/{path}", body, lease=lease), "configuration_lost", 409
            )
            assert "defaults" in barred["detail"]
            assert "snapshot" in barred["detail"]
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
        answer = await rig.call("PUT", f"/servos/{servo.uid}/parameters/torque_mode", {"value": "on"}, lease=lease)
        problem(answer, "configuration_lost", 409)
        assert [name for _, name, _ in rig.writes()] == ["0x20"]
        json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 41}}, lease=lease))
        path, body = f"/servos/{servo.uid}/save?wait=true", {"confirm": ["torque_off_in_rom"]}
        assert json(await rig.call("POST", path, body, lease=lease))["state"] == "succeeded"
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
        json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 5}, lease=lease))

    play(scene, replace(PLAIN, rom_sound=False))


@pytest.mark.parametrize("way", ["PUT", "PATCH", "POST"])
def test_taking_torque_away_waits_for_no_change_and_needs_no_lease(way: str) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        lease = await rig.lease()
        json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 1}, lease=lease))
        body = {"values": EIGHT}
        changing = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", body, lease=lease))
        while not any(name == "0x2C" for _, name, _ in rig.writes()):
            await asyncio.sleep(0.0002)
        off = {
            "PUT": (f"/servos/{servo.uid}/parameters/torque_mode", {"value": "off"}),
            "PATCH": (f"/servos/{servo.uid}/parameters", {"values": {"torque_mode": "off"}}),
            "POST": (f"/servos/{servo.uid}/torque", {"mode": "off"}),
        }[way]
        json(await rig.call(way, *off))
        assert not changing.done()
        assert rig.sim(servo).memory.get(0x20) == 1
        assert not rig.host.motion.driven(servo.uid)
        assert json(await changing)["outcome"] == "applied"
        assert rig.sim(servo).memory.get(0x20) == 1

    play(scene)


def test_a_row_that_refuses_to_be_read_before_it_is_written_says_so() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        rig.sim(servo).conditions.refuse_keys.add("angle_d_gain")
        answer = await patching(rig, servo, {"angle_p_gain": 41, "angle_d_gain": 31})
        refused = problem(answer, "refused_by_servo", 502)
        assert "refused to read angle_d_gain (0x2D) before it was written; nothing was written" in refused["detail"]
        assert rig.writes() == []

    play(scene)


@pytest.mark.parametrize("form", ['"{}"', "{}", 'W/"{}"', "*"])
def test_if_match_takes_a_revision_quoted_or_bare_and_a_star_for_any(form: str) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        path = f"/servos/{servo.uid}/parameters"
        header = {"If-Match": form.format(servo.revision)}
        for value in (41, 42):
            answer = await rig.call("PATCH", path, {"values": {"angle_p_gain": value}}, **header)
            if value == 41 or form == "*":
                assert json(answer)["outcome"] == "applied"
            else:
                problem(answer, "stale_revision", 412)

    play(scene)


def test_an_angle_limit_of_several_turns_is_asked_about_and_written_once_it_is_confirmed() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        path = f"/servos/{servo.uid}/parameters"
        body: dict[str, object] = {"values": {"angle_limit_cw": 999}}
        asked_back = problem(await rig.call("PATCH", path, body), "needs_confirmation", 409)
        assert (asked_back["confirm"], asked_back["turns"]) == ("multi_turn", 2.8)
        assert rig.writes() == []
        done = json(await rig.call("PATCH", path, {**body, "confirm": ["multi_turn"]}))
        assert done["changes"][0]["after"] == 999.0
        json(await rig.call("PATCH", path, {"values": {"angle_limit_cw": 500}}))

    play(scene, PLAIN)

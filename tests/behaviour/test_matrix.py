"""Parameters × servos as one: each accepts or rejects for itself, and ids are passed round without a clash."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Change, ReadingChanged
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid

MODELS = ["BLA21-06U-A0"] * 4 + ["BLA21-28U-AB"] * 3 + ["BLA15-12U-A0"] * 3
TEN = [Recipe(model, "1.300", servo_id=n, node_id=10 + n) for n, model in enumerate(MODELS, 1)]
THREE = [replace(PLAIN, servo_id=n, node_id=10 + n) for n in (1, 2, 3)]


async def patch(rig: Rig, servos: dict[str, dict[str, Any]], **more: Any) -> list[Any]:
    return json(await rig.call("PATCH", "/parameters", {"servos": servos, **more}))["servos"]


async def ready(rig: Rig, count: int) -> list[Servo]:
    return sorted(await rig.ready(count), key=lambda one: one.servo_id or 0)


def ids(rig: Rig, servos: list[Servo], key: str = "servo_id") -> list[int]:
    at = 0x45 if key == "servo_id" else 0x46
    return [rig.sim(one).memory.get(at) for one in servos]


class Clash:
    """Watches that no two servos ever hold the same id but 0, by what the servos themselves hold."""

    def __init__(self, rig: Rig, servos: list[Servo]) -> None:
        self._rig = rig
        self._servos = servos
        self.seen = 0
        rig.host.hub.subscribe(self._look)

    def _look(self, change: Change) -> None:
        if isinstance(change, ReadingChanged) and change.key in ("servo_id", "node_id"):
            self.seen += 1
            for key in ("servo_id", "node_id"):
                held = [number for number in ids(self._rig, self._servos, key) if number]
                assert len(held) == len(set(held)), (key, held)


@scene(*TEN)
async def test_one_value_over_ten_servos_of_three_models_is_accepted_and_rejected_by_exactly_the_right_ones(
    rig: Rig,
) -> None:
    servos = await ready(rig, 10)
    for key, value in (
        ("voltage_limit_upper", 30.0), ("pwm_mode", "speed"), ("overcurrent_limit", 9.0), ("angle_p_gain", 55),
    ):  # fmt: skip
        right: set[str] = set()
        for one in servos:
            register = one.registers.get(key)
            row = None if register is None else register.parameter
            if row is not None and (row.maximum is None or not isinstance(value, float) or
                                    value * row.per_unit <= row.maximum):  # fmt: skip
                right.add(one.uid)
        answer = await patch(rig, {one.uid: {key: value} for one in servos}, confirm=["supply"])
        assert [one["uid"] for one in answer] == [one.uid for one in servos]
        assert {one["uid"] for one in answer if one["outcome"] == "applied"} == right, (key, answer)
        for one in answer:
            if one["outcome"] != "applied":
                code = one["problem"]["code"]
                assert (one["outcome"], code in ("out_of_range", "not_in_this_model")) == ("rejected", True), one
        for one in servos:
            row = one.registers[key].parameter if key in one.registers else None
            if row is not None and not isinstance(value, str):
                assert (rig.sim(one).memory.get(row.address) == value * row.per_unit) is (one.uid in right)
        rejected = 10 - len(right)
        assert (key, rejected > 0) == (key, key != "angle_p_gain"), "the case must tell models apart"


@scene(*THREE)
async def test_all_or_none_writes_nowhere_when_one_rejects(rig: Rig) -> None:
    servos = await ready(rig, 3)
    values: dict[str, dict[str, Any]] = {one.uid: {"angle_p_gain": 55} for one in servos}
    values[servos[1].uid] = {"angle_p_gain": 5000}
    answer = await patch(rig, values, all_or_none=True)
    assert [one["outcome"] for one in answer] == ["not_tried", "rejected", "not_tried"]
    assert rig.writes() == []
    answer = await patch(rig, values)
    assert [one["outcome"] for one in answer] == ["applied", "rejected", "applied"]


@scene(*THREE)
async def test_a_dry_run_plans_and_sends_nothing_and_unknown_servos_do_not_disturb(rig: Rig) -> None:
    servos = await ready(rig, 3)
    values: dict[str, dict[str, Any]] = {one.uid: {"angle_p_gain": 55} for one in servos}
    answer = await patch(rig, {**values, "0" * 32: {"angle_p_gain": 1}}, dry_run=True)
    assert [one["outcome"] for one in answer] == ["planned"] * 3 + ["rejected"]
    assert answer[3]["problem"]["code"] == "unknown_servo"
    assert answer[0]["changes"][0]["verdict"] == "planned"
    assert rig.writes() == []


@scene(*THREE[:2])
async def test_a_stale_revision_rejects_that_servo_alone(rig: Rig) -> None:
    servos = await ready(rig, 2)
    stale = {servos[0].uid: "abc-1", servos[1].uid: servos[1].revision}
    answer = await patch(rig, {one.uid: {"angle_p_gain": 55} for one in servos}, revisions=stale)
    assert [one["outcome"] for one in answer] == ["rejected", "applied"]
    assert answer[0]["problem"]["code"] == "stale_revision"


@pytest.mark.parametrize("key", ["servo_id", "node_id"])
@scene(*THREE)
async def test_ids_are_swapped_and_passed_round_without_a_clash(rig: Rig, key: str) -> None:
    servos = await ready(rig, 3)
    first = ids(rig, servos, key)
    clash = Clash(rig, servos)
    turned = [first[1], first[2], first[0]]
    wanted: dict[str, dict[str, Any]] = {
        one.uid: {key: number, "angle_p_gain": 50 + number} for one, number in zip(servos, turned, strict=True)
    }
    answer = await patch(rig, wanted)
    assert [one["outcome"] for one in answer] == ["applied"] * 3, answer
    assert ids(rig, servos, key) == turned
    assert [rig.sim(one).memory.get(0x2C) for one in servos] == [50 + number for number in turned]
    shown = [next(change for change in one["changes"] if change["key"] == key) for one in answer]
    assert [(one["before"], one["after"], one["verdict"]) for one in shown] == [
        (before, after, "applied") for before, after in zip(first, turned, strict=True)
    ]
    assert clash.seen == 4, "three moves and one to open the ring"


@scene(*(replace(PLAIN, servo_id=n, node_id=10 + n) for n in (0, 1, 2)))
async def test_a_chain_takes_no_detour_and_new_servos_get_theirs_with_the_rest(rig: Rig) -> None:
    servos = await ready(rig, 3)
    clash = Clash(rig, servos)
    new, one, two = servos
    answer = await patch(rig, {new.uid: {"servo_id": 1}, one.uid: {"servo_id": 2}, two.uid: {"servo_id": 3}})
    assert [one["outcome"] for one in answer] == ["applied"] * 3, answer
    assert ids(rig, servos) == [1, 2, 3]
    assert clash.seen == 3


@scene(*THREE)
async def test_the_same_id_twice_or_one_that_stays_with_another_is_a_conflict_of_those_who_want_it(rig: Rig) -> None:
    one, two, three = await ready(rig, 3)
    answer = await patch(rig, {one.uid: {"servo_id": 9}, two.uid: {"servo_id": 9}, three.uid: {"servo_id": 8}})
    assert [one["outcome"] for one in answer] == ["rejected", "rejected", "applied"]
    assert {one["problem"]["code"] for one in answer[:2]} == {"conflict"}
    # two does not leave its id, because what else it wants is illegal: so nobody may have it
    answer = await patch(rig, {one.uid: {"servo_id": 2}, two.uid: {"servo_id": 1, "angle_p_gain": 5000}})
    assert [one["outcome"] for one in answer] == ["rejected", "rejected"]
    assert [one["problem"]["code"] for one in answer] == ["conflict", "out_of_range"]
    assert ids(rig, [one, two]) == [1, 2]


@pytest.mark.parametrize("refuses", [0, 1, 2])
@scene(*THREE)
async def test_a_failure_in_the_middle_of_a_swap_puts_every_id_and_every_row_back(rig: Rig, refuses: int) -> None:
    servos = await ready(rig, 3)
    first, gains = ids(rig, servos), [rig.sim(one).memory.get(0x2C) for one in servos]
    clash = Clash(rig, servos)
    broken = rig.sim(servos[refuses])
    turned = [first[1], first[2], first[0]]

    def spoil(change: Change) -> None:
        # from the first move on it refuses; what it was to give back it gives
        if isinstance(change, ReadingChanged) and change.key == "servo_id":
            broken.conditions.refuse_keys.add("servo_id")
            asyncio.get_running_loop().call_later(0.4, broken.conditions.refuse_keys.clear)

    forget = rig.host.hub.subscribe(spoil)
    wanted: dict[str, dict[str, Any]] = {
        one.uid: {"servo_id": number, "angle_p_gain": 77} for one, number in zip(servos, turned, strict=True)
    }
    answer = await patch(rig, wanted)
    forget()
    assert clash.seen > 0
    assert [one["outcome"] for one in answer] == ["rolled_back"] * 3, answer
    assert all("The exchange of IDs among" in one["problem"]["detail"] for one in answer)
    assert ids(rig, servos) == first
    assert not any("IDs not restored:" in event.text for event in rig.events("not_rolled_back"))
    assert [rig.sim(one).memory.get(0x2C) for one in servos] == gains
    for one in answer:
        assert {change["verdict"] for change in one["changes"]} <= {"rolled_back"}
        assert all(change["after"] == change["before"] for change in one["changes"])


@scene(*THREE[:2])
async def test_an_id_that_cannot_be_put_back_is_named_and_nobody_is_given_it_meanwhile(rig: Rig) -> None:
    one, two = servos = await ready(rig, 2)
    clash = Clash(rig, servos)

    def spoil(change: Change) -> None:
        if isinstance(change, ReadingChanged) and change.key == "servo_id" and change.uid == two.uid:
            rig.bench.power(two.uid, False)  # after it took the number of the one that is parked

    rig.host.hub.subscribe(spoil)
    answer = await patch(rig, {one.uid: {"servo_id": 2}, two.uid: {"servo_id": 1}})
    assert [one["outcome"] for one in answer] == ["rolled_back"] * 2
    assert clash.seen > 0
    assert rig.sim(one).memory.get(0x45) == 0, "the other may have 1 now"
    (event,) = [event for event in rig.events("not_rolled_back") if "IDs not restored:" in event.text]
    assert two.title in event.text
    assert one.title in event.text


@scene(*TEN)
async def test_reading_answers_what_each_has_and_the_problem_of_who_is_silent(rig: Rig) -> None:
    servos = await ready(rig, 10)
    silent = servos[4]
    rig.sim(silent).memory.put(0x2C, 99)
    rig.sim(servos[0]).memory.put(0x2C, 98)
    known = json(await rig.call("GET", "/parameters?keys=angle_p_gain,pwm_mode"))["servos"]
    assert list(known) == [one.uid for one in rig.host.fleet.all()]
    assert known[servos[0].uid]["parameters"]["angle_p_gain"]["value"] != 98
    for one in servos:
        assert set(known[one.uid]["parameters"]) == {"angle_p_gain", "pwm_mode"} & set(one.registers)
    assert any("pwm_mode" not in one.registers for one in servos)
    rig.sim(silent).conditions.drop_responses_pct = 100
    listed = ",".join([servos[0].uid, silent.uid, "0" * 32])
    fresh = json(await rig.call("GET", f"/parameters?uids={listed}&keys=angle_p_gain&refresh=true"))["servos"]
    assert fresh[servos[0].uid]["parameters"]["angle_p_gain"]["value"] == 98
    assert fresh[silent.uid]["problem"]["code"] == "no_response"
    assert fresh[silent.uid]["parameters"] == {}
    assert fresh["0" * 32]["problem"]["code"] == "unknown_servo"
    problem(await rig.call("GET", "/parameters?keys=nonsense"), "unknown_parameter", 404)


@scene(*THREE)
async def test_reading_keeps_the_order_asked_and_tells_of_servos_that_are_away_or_not_identified_yet(rig: Rig) -> None:
    one, away, last = await ready(rig, 3)
    rig.sim(away).conditions.mute = True
    async with asyncio.timeout(30):
        while away.online:
            await asyncio.sleep(0.1)
    made = json(await rig.call("POST", "/sim/servos", {"model": PLAIN.model, "servo_id": 4, "node_id": 14}), 201)["uid"]
    async with asyncio.timeout(30):
        while not rig.host.fleet.knows(Uid(made)):
            await asyncio.sleep(0.001)
    rig.bench.servo(Uid(made)).conditions.drop_responses_pct = 100
    listed = [last.uid, "0" * 32, made, away.uid, one.uid]
    answer = await rig.call("GET", f"/parameters?uids={','.join([*listed, last.uid])}")
    known = json(answer)["servos"]
    assert list(known) == listed, "as asked, each once"
    assert known["0" * 32]["problem"]["code"] == "unknown_servo"
    for silent in (away.uid, made):
        assert known[silent]["problem"] is None
    gains = {uid: known[uid]["parameters"].get("angle_p_gain") for uid in listed}
    assert [gains[uid]["stale"] for uid in (last.uid, away.uid, one.uid)] == [False, True, False]
    assert gains[away.uid]["value"] == 40, "what was known of it last"
    unread = known[made]["parameters"]["angle_p_gain"]
    assert (unread["value"], unread["rom"], unread["age_s"], unread["stale"]) == (None, None, None, True)
    assert rig.writes() == []
    default = json(await rig.call("GET", "/parameters"))["servos"]
    assert away.uid not in default


@scene(*THREE)
async def test_save_starts_a_job_for_each_that_was_changed(rig: Rig) -> None:
    servos = await ready(rig, 3)
    await asyncio.sleep(3)
    values: dict[str, dict[str, Any]] = {one.uid: {"angle_p_gain": 55} for one in servos}
    values[servos[2].uid] = {"angle_p_gain": 5000}
    answer = await patch(rig, values, save=True)
    assert [one["job"] is not None for one in answer] == [True, True, False]
    for one in answer[:2]:
        job = rig.host.jobs.get(one["job"])
        await rig.host.jobs.wait(job)
        assert job.state == "succeeded", job
    assert [rig.sim(one).memory.stored(0x2C) for one in servos] == [55, 55, 40]

"""Parameters × servos: each servo accepts or rejects its own values, and IDs are exchanged without a clash."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.actions import by_servo_id
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Change, ReadingChanged
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid

MODELS = ["BLA21-06U-A0"] * 2 + ["BLA21-28U-AB"] * 2 + ["BLA15-12U-A0"] * 2
SIX = [Recipe(model, "1.300", servo_id=n, node_id=10 + n) for n, model in enumerate(MODELS, 1)]
THREE = [replace(PLAIN, servo_id=n, node_id=10 + n) for n in (1, 2, 3)]
Values = dict[str, Any]


async def patch(rig: Rig, values: list[tuple[Servo, Values]], **more: Any) -> list[Any]:
    servos = {servo.uid: given for servo, given in values}
    return json(await rig.call("PATCH", "/parameters", {"servos": servos, **more}))["servos"]


async def ready(rig: Rig, count: int) -> list[Servo]:
    return by_servo_id(await rig.ready(count))


def outcomes(response: list[Any]) -> list[str]:
    return [one["outcome"] for one in response]


def ids(rig: Rig, servos: list[Servo], key: str = "servo_id") -> list[int]:
    address = 0x45 if key == "servo_id" else 0x46
    return [rig.sim(one).memory.get(address) for one in servos]


def gains(rig: Rig, servos: list[Servo]) -> list[int]:
    return [rig.sim(one).memory.get(0x2C) for one in servos]


class Clash:
    """Asserts that no two servos ever have the same ID other than 0, by the memory of the servos themselves."""

    def __init__(self, rig: Rig, servos: list[Servo]) -> None:
        self._rig = rig
        self._servos = servos
        self.moves = 0
        rig.host.hub.subscribe(self._check)

    def _check(self, change: Change) -> None:
        if isinstance(change, ReadingChanged) and change.key in ("servo_id", "node_id"):
            self.moves += 1
            for key in ("servo_id", "node_id"):
                used = [number for number in ids(self._rig, self._servos, key) if number]
                assert len(used) == len(set(used)), (key, used)


@scene(*SIX)
async def test_a_value_is_rejected_by_the_servos_whose_model_does_not_allow_it(rig: Rig, servos: list[Servo]) -> None:
    for key, value in (
        ("voltage_limit_upper", 30.0), ("pwm_mode", "speed"), ("overcurrent_limit", 9.0), ("angle_p_gain", 55),
    ):  # fmt: skip
        right: set[str] = set()
        for one in servos:
            row = one.registers[key].parameter if key in one.registers else None
            if row is not None and (
                row.maximum is None or not isinstance(value, float) or value * row.per_unit <= row.maximum
            ):
                right.add(one.uid)
        response = await patch(rig, [(one, {key: value}) for one in servos], confirm=["supply"])
        assert [one["uid"] for one in response] == [one.uid for one in servos]
        assert {one["uid"] for one in response if one["outcome"] == "applied"} == right, (key, response)
        for one in response:
            if one["outcome"] != "applied":
                assert one["outcome"] == "rejected"
                assert one["problem"]["code"] in ("out_of_range", "not_in_this_model"), one
        for one in servos:
            row = one.registers[key].parameter if key in one.registers else None
            if row is not None and not isinstance(value, str):
                assert (rig.sim(one).memory.get(row.address) == value * row.per_unit) is (one.uid in right)
        assert (len(right) < 6) is (key != "angle_p_gain"), "the case must distinguish models"


@scene(*THREE)
async def test_all_or_none_dry_run_stale_revisions_and_unknown_servos(rig: Rig) -> None:
    one, two, three = await ready(rig, 3)
    good: Values = {"angle_p_gain": 55}
    mixed = [(one, good), (two, {"angle_p_gain": 5000}), (three, good)]
    assert outcomes(await patch(rig, mixed, all_or_none=True)) == ["not_tried", "rejected", "not_tried"]
    body = {"servos": {one.uid: good, three.uid: good, "0" * 32: good}, "dry_run": True}
    response = json(await rig.call("PATCH", "/parameters", body))["servos"]
    assert outcomes(response) == ["planned", "planned", "rejected"]
    assert response[2]["problem"]["code"] == "unknown_servo"
    assert response[0]["changes"][0]["verdict"] == "planned"
    assert rig.writes() == []
    assert outcomes(await patch(rig, mixed)) == ["applied", "rejected", "applied"]
    revisions = {one.uid: "abc-1", two.uid: two.revision}
    response = await patch(rig, [(one, good), (two, good)], revisions=revisions)
    assert outcomes(response) == ["rejected", "applied"]
    assert response[0]["problem"]["code"] == "stale_revision"


@pytest.mark.parametrize("key", ["servo_id", "node_id"])
@scene(*THREE)
async def test_ids_are_rotated_without_a_clash(rig: Rig, servos: list[Servo], key: str) -> None:
    first = ids(rig, servos, key)
    clash = Clash(rig, servos)
    turned = [first[1], first[2], first[0]]
    wanted = [(one, {key: number, "angle_p_gain": 50 + number}) for one, number in zip(servos, turned, strict=True)]
    response = await patch(rig, wanted)
    assert outcomes(response) == ["applied"] * 3, response
    assert ids(rig, servos, key) == turned
    assert gains(rig, servos) == [50 + number for number in turned]
    shown = [next(change for change in one["changes"] if change["key"] == key) for one in response]
    assert [(one["before"], one["after"], one["verdict"]) for one in shown] == [
        (before, after, "applied") for before, after in zip(first, turned, strict=True)
    ]
    assert clash.moves == 4, "three moves and one to open the ring"


@scene(*(replace(PLAIN, servo_id=n, node_id=10 + n) for n in (0, 1, 2)))
async def test_a_chain_of_ids_takes_no_detour_and_includes_new_servos(rig: Rig, servos: list[Servo]) -> None:
    clash = Clash(rig, servos)
    response = await patch(rig, [(one, {"servo_id": at}) for at, one in enumerate(servos, 1)])
    assert outcomes(response) == ["applied"] * 3, response
    assert ids(rig, servos) == [1, 2, 3]
    assert clash.moves == 3


@scene(*THREE)
async def test_an_id_requested_twice_or_used_by_another_servo_is_a_conflict(rig: Rig) -> None:
    one, two, three = await ready(rig, 3)
    response = await patch(rig, [(one, {"servo_id": 9}), (two, {"servo_id": 9}), (three, {"servo_id": 8})])
    assert outcomes(response) == ["rejected", "rejected", "applied"]
    assert {one["problem"]["code"] for one in response[:2]} == {"conflict"}
    # `two` keeps its ID because its other value is invalid, so `one` cannot have it
    response = await patch(rig, [(one, {"servo_id": 2}), (two, {"servo_id": 1, "angle_p_gain": 5000})])
    assert outcomes(response) == ["rejected", "rejected"]
    assert [one["problem"]["code"] for one in response] == ["conflict", "out_of_range"]
    assert ids(rig, [one, two]) == [1, 2]


@pytest.mark.parametrize("refusing", [0, 1, 2])
@scene(*THREE)
async def test_a_failed_exchange_restores_every_id_and_every_row(rig: Rig, servos: list[Servo], refusing: int) -> None:
    first, before = ids(rig, servos), gains(rig, servos)
    clash = Clash(rig, servos)
    refused = rig.sim(servos[refusing]).conditions.refuse_keys

    def refuse(change: Change) -> None:
        # from the first move on it refuses its servo ID for 0.4 s, so that it can be restored
        if isinstance(change, ReadingChanged) and change.key == "servo_id":
            refused.add("servo_id")
            asyncio.get_running_loop().call_later(0.4, refused.clear)

    unsubscribe = rig.host.hub.subscribe(refuse)
    turned = [first[1], first[2], first[0]]
    wanted = [(one, {"servo_id": number, "angle_p_gain": 77}) for one, number in zip(servos, turned, strict=True)]
    response = await patch(rig, wanted)
    unsubscribe()
    assert clash.moves > 0
    assert outcomes(response) == ["rolled_back"] * 3, response
    assert all("The exchange of IDs among" in one["problem"]["detail"] for one in response)
    assert ids(rig, servos) == first
    assert not any("IDs not restored:" in event.text for event in rig.events("not_rolled_back"))
    assert gains(rig, servos) == before
    for one in response:
        assert {change["verdict"] for change in one["changes"]} <= {"rolled_back"}
        assert all(change["after"] == change["before"] for change in one["changes"])


@scene(*THREE[:2])
async def test_an_id_that_cannot_be_restored_is_named_and_not_given_to_another_servo(rig: Rig) -> None:
    one, two = servos = await ready(rig, 2)
    clash = Clash(rig, servos)

    def cut(change: Change) -> None:
        if isinstance(change, ReadingChanged) and change.key == "servo_id" and change.uid == two.uid:
            rig.bench.power(two.uid, False)  # after it took the number of the servo that is parked

    rig.host.hub.subscribe(cut)
    response = await patch(rig, [(one, {"servo_id": 2}), (two, {"servo_id": 1})])
    assert outcomes(response) == ["rolled_back"] * 2
    assert clash.moves > 0
    assert rig.sim(one).memory.get(0x45) == 0, "the other may have 1 now"
    (event,) = [event for event in rig.events("not_rolled_back") if "IDs not restored:" in event.text]
    assert two.title in event.text
    assert one.title in event.text


async def read(rig: Rig, uids: list[str] | None = None, **query: str) -> dict[str, Any]:
    params = query if uids is None else {"uids": ",".join(uids), **query}
    return json(await rig.http.get("/parameters", params=params))["servos"]


@scene(*SIX[1:4])
async def test_reading_returns_the_rows_of_each_servo_or_its_problem(rig: Rig) -> None:
    servos = one, silent, _ = await ready(rig, 3)
    rig.sim(silent).memory.put(0x2C, 99)
    rig.sim(one).memory.put(0x2C, 98)
    known = await read(rig, keys="angle_p_gain,pwm_mode")
    assert list(known) == [each.uid for each in rig.host.fleet.all()]
    assert known[one.uid]["parameters"]["angle_p_gain"]["value"] != 98
    for each in servos:
        assert set(known[each.uid]["parameters"]) == {"angle_p_gain", "pwm_mode"} & set(each.registers)
    assert any("pwm_mode" not in each.registers for each in servos)
    rig.sim(silent).conditions.drop_responses_pct = 100
    fresh = await read(rig, [one.uid, silent.uid, "0" * 32], keys="angle_p_gain", refresh="true")
    assert fresh[one.uid]["parameters"]["angle_p_gain"]["value"] == 98
    assert fresh[silent.uid]["problem"]["code"] == "no_response"
    assert fresh[silent.uid]["parameters"] == {}
    assert fresh["0" * 32]["problem"]["code"] == "unknown_servo"
    problem(await rig.call("GET", "/parameters?keys=nonsense"), "unknown_parameter", 404)


@scene(*THREE)
async def test_reading_keeps_the_order_and_includes_servos_that_are_offline_or_not_identified(rig: Rig) -> None:
    one, away, last = await ready(rig, 3)
    rig.sim(away).conditions.mute = True
    await until(lambda: not away.online, every_s=0.1)
    made = json(await rig.call("POST", "/sim/servos", {"model": PLAIN.model, "servo_id": 4, "node_id": 14}), 201)["uid"]
    await until(lambda: rig.host.fleet.knows(Uid(made)), every_s=0.001)
    rig.bench.servo(Uid(made)).conditions.drop_responses_pct = 100
    listed = [last.uid, "0" * 32, made, away.uid, one.uid]
    known = await read(rig, [*listed, last.uid])
    assert list(known) == listed, "each once"
    assert known["0" * 32]["problem"]["code"] == "unknown_servo"
    for silent in (away.uid, made):
        assert known[silent]["problem"] is None
    shown = {uid: known[uid]["parameters"].get("angle_p_gain") for uid in listed}
    assert [shown[uid]["stale"] for uid in (last.uid, away.uid, one.uid)] == [False, True, False]
    assert shown[away.uid]["value"] == 40, "its last known value"
    unread = shown[made]
    assert (unread["value"], unread["rom"], unread["age_s"], unread["stale"]) == (None, None, None, True)
    assert rig.writes() == []
    assert away.uid not in await read(rig)


@scene(*THREE)
async def test_save_starts_a_job_for_each_changed_servo(rig: Rig, servos: list[Servo]) -> None:
    await asyncio.sleep(3)
    response = await patch(
        rig, [(one, {"angle_p_gain": value}) for one, value in zip(servos, (55, 55, 5000), strict=True)], save=True
    )
    assert [one["job"] is not None for one in response] == [True, True, False]
    for one in response[:2]:
        job = rig.host.jobs.get(one["job"])
        await rig.host.jobs.wait(job)
        assert job.state == "succeeded", job
    assert [rig.sim(one).memory.stored(0x2C) for one in servos] == [55, 55, 40]

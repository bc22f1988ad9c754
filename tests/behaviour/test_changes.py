"""A change of several rows: checked, kept, written, proved, and undone when anything fails (features B56, B92, B93)."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from hornbill.servo.configuration.writing import WriteOptions
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Change, Happened, Sampled
from hornbill.sim.behaviour import Behaviour
from hornbill.store.snapshots import StoredSnapshot
from hornbill.wire.services import GetSetRequest

EIGHT: dict[str, Any] = {
    "soft_start": False, "smoothing": False, "timeout_action": "brake", "timeout_time": 500, "angle_p_gain": 50,
    "angle_d_gain": 30, "angle_dead_band": 0.5, "angle_boost": 3.0,
}  # fmt: skip


def patching(rig: Rig, servo: Servo, values: dict[str, Any], **more: Any) -> Any:
    return rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values, **more})


def held(rig: Rig, servo: Servo, keys: dict[str, Any]) -> dict[str, int]:
    """What the servo itself holds in RAM."""
    memory = rig.sim(servo).memory
    return {key: memory.get(servo.registers[key].parameter.address) for key in keys}


def verdicts(answer: Any) -> dict[str, str]:
    return {change["key"]: change["verdict"] for change in answer["changes"]}


def once_written(rig: Rig, key: str, act: Callable[[], None]) -> None:
    """Do something as soon as the write of a row was answered; the first reading of it is that before the write."""
    heard: list[Change] = []

    def listen(change: Change) -> None:
        if isinstance(change, Sampled) and change.key == key:
            heard.append(change)
            if len(heard) == 2:
                act()

    rig.host.hub.listen(listen)


def asked(rig: Rig, name: str) -> int:
    """How often a row was asked for or written."""
    found = 0
    for transfer in rig.transfers("host"):
        if transfer.type_id == GetSetRequest.TYPE.id:
            request = GetSetRequest.decode(transfer.payload)
            found += request is not None and request.name == name
    return found


def test_when_a_servo_refuses_the_fifth_of_eight_writes_all_eight_registers_hold_what_they_held() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        before = held(rig, servo, EIGHT)
        once_written(rig, "timeout_time", lambda: rig.sim(servo).conditions.refuse_keys.add("angle_p_gain"))
        answer = json(await patching(rig, servo, EIGHT))
        assert answer["outcome"] == "rolled_back"
        assert answer["problem"]["code"] == "refused_by_servo"
        assert answer["problem"]["detail"] == answer["failure"]
        assert verdicts(answer) == dict.fromkeys(list(EIGHT)[:4], "rolled_back") | {"angle_p_gain": "refused"}
        assert all(change["after"] == change["before"] for change in answer["changes"])
        assert held(rig, servo, EIGHT) == before
        assert not rig.events("not_rolled_back")

    play(scene)


def test_a_change_works_and_is_undone_with_a_fifth_of_all_frames_lost() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        before = held(rig, servo, EIGHT)
        rig.bus.loss(20, seed=5)
        rig.host.hub.listen(
            lambda change: (
                rig.sim(servo).conditions.refuse_keys.add("angle_boost")
                if isinstance(change, Sampled) and (change.key, change.value) == ("angle_dead_band", 0.5)
                else None
            )
        )
        answer = json(await patching(rig, servo, EIGHT))
        assert answer["outcome"] == "rolled_back"
        assert set(verdicts(answer).values()) == {"rolled_back", "refused"}
        assert held(rig, servo, EIGHT) == before
        rig.sim(servo).conditions.refuse_keys.clear()
        values = {key: value for key, value in EIGHT.items() if key != "angle_dead_band"}
        answer = json(await patching(rig, servo, values))
        assert set(verdicts(answer).values()) == {"applied"}, answer

    play(scene)


def test_a_servo_that_falls_mute_half_way_and_stays_so_has_rows_that_nobody_knows_and_that_is_told() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]

        def mute() -> None:
            rig.sim(servo).conditions.mute = True

        once_written(rig, "timeout_time", mute)
        answer = json(await patching(rig, servo, EIGHT))
        assert answer["outcome"] == "rolled_back"
        assert answer["problem"]["code"] == "no_answer"
        assert verdicts(answer) == dict.fromkeys(list(EIGHT)[:5], "no_answer")
        assert {change["after"] for change in answer["changes"]} == {None}
        (told,) = rig.events("not_rolled_back")
        assert all(servo.registers[key].parameter.label in told.text for key in list(EIGHT)[:5])
        assert {row.entry.outcome for row in rig.host.store.audit.rows(uid=servo.uid)} == {"no_answer"}

    play(scene)


def test_a_servo_that_is_mute_for_a_while_half_way_is_put_back_as_soon_as_it_is_heard_again() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        before = held(rig, servo, EIGHT)

        def mute() -> None:
            conditions = rig.sim(servo).conditions
            conditions.mute = True
            asyncio.get_running_loop().call_later(5, lambda: setattr(conditions, "mute", False))

        once_written(rig, "timeout_time", mute)
        answer = json(await patching(rig, servo, EIGHT))
        assert answer["outcome"] == "rolled_back"
        assert set(verdicts(answer).values()) == {"rolled_back"}
        assert held(rig, servo, EIGHT) == before
        assert not rig.events("not_rolled_back")

    play(scene)


@pytest.mark.parametrize("back_after_s", [0.1, 1.0, None], ids=["at once", "after 1 s", "not before it is too late"])
def test_when_power_is_cut_half_way_what_was_in_ram_is_put_back_or_said_to_be_lost(back_after_s: float | None) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        json(await patching(rig, servo, {"angle_p_gain": 33}))
        before = held(rig, servo, EIGHT)
        assert before["angle_p_gain"] == 33, "only in RAM"
        await asyncio.sleep(4)
        values = {"angle_p_gain": 50, **EIGHT}

        def cut() -> None:
            rig.bench.power(servo.uid, False)
            if back_after_s is not None:
                asyncio.get_running_loop().call_later(back_after_s, lambda: rig.bench.power(servo.uid, True))

        once_written(rig, "angle_p_gain", cut)
        count = len(rig.writes())
        answer = json(await patching(rig, servo, values))
        assert answer["outcome"] == "rolled_back"
        if back_after_s is None:
            assert set(verdicts(answer).values()) == {"no_answer"}
            assert rig.events("not_rolled_back")
            return
        assert set(verdicts(answer).values()) == {"rolled_back"}
        assert held(rig, servo, EIGHT) == before
        assert servo.registers["angle_p_gain"].rom == 40, "what was put back is not taken for what ROM holds"
        assert {raw for _, name, raw in rig.writes()[count:] if name == "0x2C"} == {50, 33}

    play(scene, replace(PLAIN, rom={"angle_p_gain": 40}))


def test_a_row_that_holds_something_else_than_it_answered_undoes_the_whole_change() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        before = held(rig, servo, EIGHT)
        once_written(rig, "angle_boost", lambda: rig.sim(servo).memory.put(0x2C, 99))
        answer = json(await patching(rig, servo, EIGHT))
        assert answer["outcome"] == "rolled_back"
        assert answer["problem"]["code"] == "not_as_wanted"
        assert answer["problem"]["differences"] == [{"key": "angle_p_gain", "wanted": 50, "found": 99}]
        assert held(rig, servo, EIGHT) == before

    play(scene)


def test_a_servo_that_may_have_restarted_is_put_back_only_once_its_status_was_heard() -> None:
    """Or what is written would be taken for what ROM held when the restart is noticed."""

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        spoiled_at: list[float] = []
        heard_at: list[float] = []

        def spoil() -> None:
            rig.sim(servo).memory.put(0x2C, 99)
            spoiled_at.append(rig.host.base.now())

        def put_back(change: Change) -> None:
            if isinstance(change, Sampled) and (change.key, change.value) == ("angle_p_gain", 40) and spoiled_at:
                heard_at.append(servo.status_at or 0.0)

        once_written(rig, "angle_boost", spoil)
        rig.host.hub.listen(put_back)
        assert json(await patching(rig, servo, EIGHT))["problem"]["code"] == "not_as_wanted"
        assert heard_at[0] > spoiled_at[0]

    play(scene)


def test_every_row_written_is_read_back_after_the_last_write() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        names = {key: servo.registers[key].parameter.name for key in EIGHT}
        counts = {key: asked(rig, name) for key, name in names.items()}
        assert json(await patching(rig, servo, EIGHT))["outcome"] == "applied"
        grown = {key: asked(rig, name) - counts[key] for key, name in names.items()}
        assert verdicts(json(await patching(rig, servo, EIGHT))) == dict.fromkeys(EIGHT, "unchanged")
        assert grown == dict.fromkeys(EIGHT, 3), "read, written, read back: one each, nothing twice"

    play(scene)


def test_a_snapshot_is_kept_before_the_first_write_and_only_then() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        snapshots = rig.host.store.snapshots
        json(await patching(rig, servo, EIGHT, dry_run=True))
        json(await patching(rig, servo, {"angle_p_gain": 40}))
        assert snapshots.of(servo.uid) == [], "neither writes anything"
        json(await patching(rig, servo, {"angle_p_gain": 41, "angle_d_gain": 31, "smoothing": True}))
        (kept,) = snapshots.of(servo.uid)
        assert (kept.reason, kept.by, kept.automatic) == (
            "before a change of angle_p_gain and 1 more",
            "no lease",
            True,
        )
        assert kept.ram["angle_p_gain"] == 40

    play(scene)


def test_a_change_of_which_no_snapshot_can_be_kept_is_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]

        def full(*_: object, **__: object) -> StoredSnapshot:
            raise OSError("disk full")

        monkeypatch.setattr(rig.host.store.snapshots, "add", full)
        problem(await patching(rig, servo, {"angle_p_gain": 41}), "store_failed", 500)
        assert rig.writes() == []

    play(scene)


def test_every_row_written_is_in_the_audit_with_who_what_before_and_after() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        json(await patching(rig, servo, {"angle_p_gain": 41, "angle_limit_cw": 60, "smoothing": True}))
        lease = await rig.lease()
        body = {"values": {"torque_mode": "on", "angle_d_gain": 31}}
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
        json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body, lease=lease))
        json(await rig.call("PUT", f"/servos/{servo.uid}/parameters/torque_mode", {"value": "brake"}, lease=lease))
        rows = [one.entry for one in reversed(rig.host.store.audit.rows(uid=servo.uid))]
        shown = [(one.by, one.action, one.key, one.before, one.requested, one.after, one.outcome) for one in rows]
        assert shown == [
            ("no lease", "write", "angle_p_gain", 40, 41, 41, "applied"),
            ("no lease", "write", "angle_limit_cw", 179.9, 60.0, 60.0, "applied"),
            ("no lease", "torque", "torque_mode", "on", "off", "off", "applied"),
            ("test", "write", "angle_d_gain", 30, 31, 31, "applied"),
            ("test", "torque", "torque_mode", "off", "on", "on", "applied"),
            ("test", "torque", "torque_mode", "on", "brake", "brake", "applied"),
        ]

    play(scene, replace(PLAIN, rom={"angle_d_gain": 30}))


def test_a_change_that_is_cancelled_half_way_is_carried_to_its_end() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        cancelled: list[bool] = []
        task = asyncio.create_task(rig.host.changes.apply(servo, EIGHT, WriteOptions(by="a job", job="7")))
        once_written(rig, "timeout_time", lambda: cancelled.append(task.cancel()))
        with pytest.raises(asyncio.CancelledError):
            await task
        assert cancelled == [True]
        assert held(rig, servo, EIGHT)["angle_boost"] == 30
        assert {one.entry.job for one in rig.host.store.audit.rows(uid=servo.uid)} == {"7"}

    play(scene)


def test_torque_that_a_failed_change_turned_on_is_taken_away_again_and_never_the_other_way() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        lease = await rig.lease()
        path = f"/servos/{servo.uid}/parameters"

        def spoil(change: Change) -> None:
            if isinstance(change, Sampled) and (change.key, change.value) == ("angle_p_gain", 41):
                asyncio.get_running_loop().call_soon(rig.sim(servo).memory.put, 0x2C, 99)

        rig.host.hub.listen(spoil)
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
        body = {"values": {"torque_mode": "on", "angle_p_gain": 41}}
        answer = json(await rig.call("PATCH", path, body, lease=lease))
        assert verdicts(answer) == {"angle_p_gain": "rolled_back", "torque_mode": "rolled_back"}
        assert not rig.host.motion.driven(servo.uid)
        assert held(rig, servo, {"torque_mode": 1, "angle_p_gain": 40}) == {"torque_mode": 1, "angle_p_gain": 40}
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
        body = {"values": {"torque_mode": "off", "angle_p_gain": 41}}
        answer = json(await rig.call("PATCH", path, body, lease=lease))
        assert verdicts(answer) == {"angle_p_gain": "rolled_back", "torque_mode": "applied"}
        assert rig.sim(servo).memory.get(0x20) == 1

    play(scene)


def test_a_value_the_servo_clamps_stays_beside_what_was_applied() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        row = servo.registers["timeout_time"].parameter
        servo.registers["timeout_time"].parameter = row.model_copy(update={"maximum": 90_000})
        answer = json(await patching(rig, servo, {"timeout_time": 80_000, "angle_p_gain": 41}))
        assert answer["outcome"] == "applied"
        assert verdicts(answer) == {"timeout_time": "clamped", "angle_p_gain": "applied"}
        assert not [one for one in rig.changes if isinstance(one, Happened) and one.level == "failure"]

    play(scene, replace(PLAIN, behaviour=Behaviour(out_of_range="clamp")))

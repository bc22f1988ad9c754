"""Changes of several rows: checked, stored, written, verified, rolled back on failure (features B56, B92, B93)."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from behaviour.neighbour import Neighbour
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.servo.configuration.writing import WriteOptions
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import Change, LogEvent, Sampled
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.snapshots import StoredSnapshot
from hornbill.units import NodeId, Uid
from hornbill.wire.services import GetSetRequest

EIGHT: dict[str, Any] = {
    "soft_start": False, "smoothing": False, "timeout_action": "brake", "timeout_time": 500, "angle_p_gain": 50,
    "angle_d_gain": 30, "angle_dead_band": 0.5, "angle_boost": 3.0,
}  # fmt: skip


def patching(rig: Rig, servo: Servo, values: dict[str, Any], **more: Any) -> Any:
    return rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values, **more})


async def rolled_back(rig: Rig, servo: Servo, values: dict[str, Any]) -> Any:
    """The response to a change, which must have been rolled back."""
    response = json(await patching(rig, servo, values))
    assert response["outcome"] == "rolled_back"
    return response


def ram(rig: Rig, servo: Servo, keys: dict[str, Any]) -> dict[str, int]:
    """The raw values in the servo's RAM."""
    memory = rig.sim(servo).memory
    return {key: memory.get(servo.registers[key].parameter.address) for key in keys}


def verdicts(response: Any) -> dict[str, str]:
    return {change["key"]: change["verdict"] for change in response["changes"]}


def once_written(rig: Rig, key: str, act: Callable[[], None]) -> None:
    """Call `act` as soon as the write of a row was acknowledged. Its first sample is the read before the write."""
    samples: list[Change] = []

    def listen(change: Change) -> None:
        if isinstance(change, Sampled) and change.key == key:
            samples.append(change)
            if len(samples) == 2:
                act()

    rig.host.hub.subscribe(listen)


def requests(rig: Rig, name: str) -> int:
    """How often a row was read or written."""
    found = 0
    for transfer in rig.transfers("host"):
        if transfer.type_id == GetSetRequest.TYPE.id:
            request = GetSetRequest.decode(transfer.payload)
            found += request is not None and request.name == name
    return found


@scene()
async def test_a_rejected_fifth_write_rolls_back_all_eight(rig: Rig, servo: Servo) -> None:
    before = ram(rig, servo, EIGHT)
    once_written(rig, "timeout_time", lambda: rig.sim(servo).conditions.refuse_keys.add("angle_p_gain"))
    response = await rolled_back(rig, servo, EIGHT)
    assert response["problem"]["code"] == "refused_by_servo"
    assert response["problem"]["detail"] == response["failure"]
    entries = [one.entry for one in reversed(rig.host.store.audit.rows(uid=servo.uid))]
    assert [(one.action, one.key, one.outcome) for one in entries] == [
        ("write", key, verdict) for key, verdict in verdicts(response).items()
    ]
    for entry, change in zip(entries, response["changes"], strict=True):
        assert (entry.before, entry.requested, entry.after) == (change["before"], change["requested"], change["after"])
        assert [(note.code, note.params["problem"]) for note in entry.notes] == [("problem", "refused_by_servo")]
        assert entry.notes[0].text == response["failure"]
    assert verdicts(response) == dict.fromkeys(list(EIGHT)[:4], "rolled_back") | {"angle_p_gain": "refused"}
    assert all(change["after"] == change["before"] for change in response["changes"])
    assert ram(rig, servo, EIGHT) == before
    assert not rig.events("not_rolled_back")


@scene()
async def test_changes_and_rollbacks_work_with_20_pct_loss(rig: Rig, servo: Servo) -> None:
    before = ram(rig, servo, EIGHT)
    rig.bus.loss(20, seed=5)
    rig.host.hub.subscribe(
        lambda change: (
            rig.sim(servo).conditions.refuse_keys.add("angle_boost")
            if isinstance(change, Sampled) and (change.key, change.value) == ("angle_dead_band", 0.5)
            else None
        )
    )
    response = await rolled_back(rig, servo, EIGHT)
    assert set(verdicts(response).values()) == {"rolled_back", "refused"}
    assert ram(rig, servo, EIGHT) == before
    rig.sim(servo).conditions.refuse_keys.clear()
    values = {key: value for key, value in EIGHT.items() if key != "angle_dead_band"}
    response = json(await patching(rig, servo, values))
    assert set(verdicts(response).values()) == {"applied"}, response


@scene()
async def test_rows_of_a_servo_that_stays_mute_are_reported_unknown(rig: Rig, servo: Servo) -> None:

    def mute() -> None:
        rig.sim(servo).conditions.mute = True

    once_written(rig, "timeout_time", mute)
    response = await rolled_back(rig, servo, EIGHT)
    assert response["problem"]["code"] == "no_response"
    assert verdicts(response) == dict.fromkeys(list(EIGHT)[:5], "no_response")
    assert {change["after"] for change in response["changes"]} == {None}
    (event,) = rig.events("not_rolled_back")
    lost = ", ".join(servo.registers[key].parameter.label for key in list(EIGHT)[:5])
    assert f"{servo.title} could be restored: {lost}." in event.text
    facts = {"servo": servo.title, "keys": list(EIGHT)[:5]}
    assert rig.logged("not_rolled_back") == [("failure", servo.uid, facts)]
    assert {row.entry.outcome for row in rig.host.store.audit.rows(uid=servo.uid)} == {"no_response"}


@pytest.mark.parametrize("how", ["mute", "bus loss"])
@scene()
async def test_a_servo_mute_for_a_while_is_rolled_back_when_it_responds(rig: Rig, servo: Servo, how: str) -> None:
    before = ram(rig, servo, EIGHT)

    def mute() -> None:
        conditions, later = rig.sim(servo).conditions, asyncio.get_running_loop().call_later
        if how == "mute":
            conditions.mute = True
            later(5, lambda: setattr(conditions, "mute", False))
        else:
            rig.bus.loss(100)
            later(3.5, lambda: rig.bus.loss(0))

    once_written(rig, "timeout_time", mute)
    response = await rolled_back(rig, servo, EIGHT)
    assert set(verdicts(response).values()) == {"rolled_back"}
    assert ram(rig, servo, EIGHT) == before
    assert not rig.events("not_rolled_back")


@pytest.mark.parametrize("back_after_s", [0.1, 1.0, None], ids=["at once", "after 1 s", "not before it is too late"])
@scene(replace(PLAIN, rom={"angle_p_gain": 40}))
async def test_after_a_power_cut_ram_is_restored_or_lost(rig: Rig, servo: Servo, back_after_s: float | None) -> None:
    json(await patching(rig, servo, {"angle_p_gain": 33}))
    before = ram(rig, servo, EIGHT)
    assert before["angle_p_gain"] == 33, "only in RAM"
    await asyncio.sleep(4)
    values = {"angle_p_gain": 50, **EIGHT}

    def cut() -> None:
        rig.bench.power(servo.uid, False)
        if back_after_s is not None:
            asyncio.get_running_loop().call_later(back_after_s, lambda: rig.bench.power(servo.uid, True))

    once_written(rig, "angle_p_gain", cut)
    count = len(rig.writes())
    response = await rolled_back(rig, servo, values)
    if back_after_s is None:
        assert set(verdicts(response).values()) == {"no_response"}
        assert rig.events("not_rolled_back")
        return
    assert set(verdicts(response).values()) == {"rolled_back"}
    assert ram(rig, servo, EIGHT) == before
    assert servo.registers["angle_p_gain"].rom == 40, "a restored value is not taken for the one in ROM"
    assert {raw for _, name, raw in rig.writes()[count:] if name == "0x2C"} == {50, 33}


@scene()
async def test_a_failed_read_back_rolls_back_the_change(rig: Rig, servo: Servo) -> None:
    before = ram(rig, servo, EIGHT)
    once_written(rig, "angle_boost", lambda: rig.sim(servo).memory.put(0x2C, 99))
    response = await rolled_back(rig, servo, {**EIGHT, "angle_limit_cw": 179.9})
    same = {"key": "angle_limit_cw", "before": 179.9, "requested": 179.9, "after": 179.9, "verdict": "unchanged"}
    assert [one for one in response["changes"] if one["verdict"] != "rolled_back"] == [same]
    assert response["problem"]["code"] == "unexpected_result"
    assert response["problem"]["params"] == {
        "servo": servo.title,
        "cause": "values_not_retained",
        "keys": ["angle_p_gain"],
    }
    assert "Angle P gain is 99 instead of 50. It may" in response["failure"]
    assert response["problem"]["differences"] == [{"key": "angle_p_gain", "wanted": 50, "found": 99}]
    assert ram(rig, servo, EIGHT) == before


@scene()
async def test_rollback_waits_for_a_status_that_rules_out_a_restart(rig: Rig, servo: Servo) -> None:
    """Otherwise the values written would be taken for those in ROM once the restart is noticed."""
    changed_at: list[float] = []
    status_at: list[float] = []

    def change_row() -> None:
        rig.sim(servo).memory.put(0x2C, 99)
        changed_at.append(rig.host.base.now())

    def put_back(change: Change) -> None:
        if isinstance(change, Sampled) and (change.key, change.value) == ("angle_p_gain", 40) and changed_at:
            status_at.append(servo.status_at or 0.0)

    once_written(rig, "angle_boost", change_row)
    rig.host.hub.subscribe(put_back)
    assert json(await patching(rig, servo, EIGHT))["problem"]["code"] == "unexpected_result"
    assert status_at[0] > changed_at[0]


@scene()
async def test_every_row_is_read_written_and_read_back_once(rig: Rig, servo: Servo) -> None:
    names = {key: servo.registers[key].parameter.name for key in EIGHT}
    counts = {key: requests(rig, name) for key, name in names.items()}
    assert json(await patching(rig, servo, EIGHT))["outcome"] == "applied"
    grown = {key: requests(rig, name) - counts[key] for key, name in names.items()}
    again = json(await patching(rig, servo, EIGHT))
    assert verdicts(again) == dict.fromkeys(EIGHT, "unchanged")
    assert {one["key"]: (one["before"], one["requested"], one["after"]) for one in again["changes"]} == {
        key: (value, value, value) for key, value in EIGHT.items()
    }
    assert grown == dict.fromkeys(EIGHT, 3), "read, written, read back: one each, nothing twice"


@scene()
async def test_no_change_without_a_stored_snapshot(rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch) -> None:

    def full(*_: object, **__: object) -> StoredSnapshot:
        raise OSError("disk full")

    monkeypatch.setattr(rig.host.store.snapshots, "add", full)
    problem(await patching(rig, servo, {"angle_p_gain": 41}), "store_failed", 500)
    assert rig.writes() == []


@scene(replace(PLAIN, rom={"angle_d_gain": 30}))
async def test_every_write_is_in_the_audit(rig: Rig, servo: Servo) -> None:
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


@scene()
async def test_a_cancelled_change_is_completed(rig: Rig, servo: Servo) -> None:
    cancelled: list[bool] = []
    task = asyncio.create_task(rig.host.changes.apply(servo, EIGHT, WriteOptions(by="a job", job="7")))
    once_written(rig, "timeout_time", lambda: cancelled.append(task.cancel()))
    with pytest.raises(asyncio.CancelledError):
        await task
    assert cancelled == [True]
    assert ram(rig, servo, EIGHT)["angle_boost"] == 30
    assert {one.entry.job for one in rig.host.store.audit.rows(uid=servo.uid)} == {"7"}


@scene()
async def test_rollback_turns_torque_off_and_never_on(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}/parameters"

    def interfere(change: Change) -> None:
        if isinstance(change, Sampled) and (change.key, change.value) == ("angle_p_gain", 41):
            asyncio.get_running_loop().call_soon(rig.sim(servo).memory.put, 0x2C, 99)

    rig.host.hub.subscribe(interfere)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    body = {"values": {"torque_mode": "on", "angle_p_gain": 41}}
    response = json(await rig.call("PATCH", path, body, lease=lease))
    assert verdicts(response) == {"angle_p_gain": "rolled_back", "torque_mode": "rolled_back"}
    assert not rig.host.motion.is_commanded(servo.uid)
    assert ram(rig, servo, {"torque_mode": 1, "angle_p_gain": 40}) == {"torque_mode": 1, "angle_p_gain": 40}
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    body = {"values": {"torque_mode": "off", "angle_p_gain": 41}}
    response = json(await rig.call("PATCH", path, body, lease=lease))
    assert verdicts(response) == {"angle_p_gain": "rolled_back", "torque_mode": "applied"}
    assert rig.sim(servo).memory.get(0x20) == 1

    def brake(change: Change) -> None:
        if isinstance(change, Sampled) and (change.key, change.value) == ("angle_p_gain", 99):
            rig.sim(servo).memory.put(0x20, 2)  # as another tool would

    rig.host.hub.subscribe(brake)
    response = json(await rig.call("PATCH", path, {"values": {"torque_mode": "on", "angle_p_gain": 41}}, lease=lease))
    assert verdicts(response) == {"angle_p_gain": "rolled_back", "torque_mode": "rolled_back"}
    assert ram(rig, servo, {"torque_mode": 2, "angle_p_gain": 40}) == {"torque_mode": 2, "angle_p_gain": 40}


@scene(replace(PLAIN, behaviour=Behaviour(out_of_range="clamp")))
async def test_a_clamped_value_is_reported_beside_applied_ones(rig: Rig, servo: Servo) -> None:
    row = servo.registers["timeout_time"].parameter
    servo.registers["timeout_time"].parameter = row.model_copy(update={"maximum": 90_000})
    values = {"timeout_time": 80_000, "angle_p_gain": 41, "angle_limit_cw": 179.9}
    response = json(await patching(rig, servo, values))
    assert response["outcome"] == "applied"
    assert verdicts(response) == {"timeout_time": "clamped", "angle_p_gain": "applied", "angle_limit_cw": "unchanged"}
    assert {one["key"]: one["after"] for one in response["changes"]}["angle_limit_cw"] == 179.9
    clamped = next(change for change in response["changes"] if change["key"] == "timeout_time")
    assert (clamped["requested"], clamped["after"]) == (80_000, 60_000)
    assert not [one for one in rig.changes if isinstance(one, LogEvent) and one.level == "failure"]


SECOND = Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12)


@pytest.mark.parametrize("doing", ["soft start", "software update", "saving"])
@scene(replace(PLAIN, angle_deg=90.0))
async def test_nothing_is_sent_while_a_servo_is_busy(rig: Rig, doing: str) -> None:
    if doing == "soft start":
        await until(lambda: any(one.state is State.SOFT_START for one in rig.host.fleet.all()), 20)
    servo = rig.host.fleet.all()[0] if doing == "soft start" else (await rig.ready())[0]
    if doing == "software update":
        rig.sim(servo).conditions.software_update = True
        await asyncio.sleep(2)
    if doing == "saving":
        await rig.call("POST", f"/servos/{servo.uid}/save")
    count = requests(rig, "0x2C"), requests(rig, "0x0C")
    responses = [
        await patching(rig, servo, {"angle_p_gain": 41}),
        await patching(rig, servo, {"angle_p_gain": 41}, dry_run=True),
        await rig.call("PUT", f"/servos/{servo.uid}/parameters/angle_p_gain", {"value": 41}),
    ]
    if doing == "saving":
        command = {"type": "angle", "value": 1}
        responses.append(await rig.call("POST", f"/servos/{servo.uid}/command", command, lease=await rig.lease()))
    for response in responses:
        problem(response, "busy", 409)
    assert (requests(rig, "0x2C"), rig.writes()) == (count[0], [])
    assert rig.host.store.snapshots.of(servo.uid) == []


@pytest.mark.parametrize(
    ("limits", "value", "word"), [("voltage_limit", 7.4, "supply"), ("temperature_limit", 20, "temperature")]
)
@scene()
async def test_a_lower_limit_may_equal_the_upper_one_when_confirmed(
    rig: Rig, servo: Servo, limits: str, value: float, word: str
) -> None:
    values = {f"{limits}_lower": value, f"{limits}_upper": value}
    refused = problem(await patching(rig, servo, values), "needs_confirmation", 409)
    assert refused["confirm"] == word
    assert rig.writes() == []
    assert json(await patching(rig, servo, values, confirm=[word]))["outcome"] == "applied"


@scene()
async def test_limits_beyond_the_present_supply_need_confirmation(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters/voltage_limit_upper"
    rig.sim(servo).conditions.voltage_v = 8.0
    await asyncio.sleep(0.2)
    for key, value in (("voltage_limit_upper", 8.3), ("voltage_limit_upper", 7.6)):
        refused = problem(await patching(rig, servo, {key: value}, dry_run=True), "needs_confirmation", 409)
        assert (refused["confirm"], refused["key"], refused["margin"]) == ("supply", key, 0.5)
        assert "8.0 V" in refused["detail"] or "7.9 V" in refused["detail"] or "8.1 V" in refused["detail"]
        assert "±0.5 V" in refused["detail"]
    problem(await rig.call("PUT", path, {"value": 8.3}), "needs_confirmation", 409)
    assert rig.writes() == []
    assert json(await patching(rig, servo, {"voltage_limit_upper": 8.8}))["outcome"] == "applied"
    assert json(await rig.call("PUT", path, {"value": 7.6, "confirm": ["supply"]}))["value"] == 7.6
    await asyncio.sleep(5)
    assert servo.state is State.PROTECTED
    assert json(await patching(rig, servo, {"voltage_limit_upper": 7.8}))["outcome"] == "applied", "no worse"
    rig.sim(servo).conditions.voltage_v = 5.0
    await asyncio.sleep(0.2)
    refused = problem(await patching(rig, servo, {"voltage_limit_lower": 4.8}), "needs_confirmation", 409)
    assert (refused["key"], refused["unit"]) == ("voltage_limit_lower", "V")


@scene(replace(PLAIN, room_c=40.0))
async def test_limits_beyond_the_present_temperature_need_confirmation(rig: Rig, servo: Servo) -> None:
    refused = problem(await patching(rig, servo, {"temperature_limit_upper": 42}), "needs_confirmation", 409)
    assert (refused["confirm"], refused["margin"], refused["unit"]) == ("temperature", 5, "°C")
    problem(await patching(rig, servo, {"temperature_limit_upper": 42}, confirm=["supply"]), "needs_confirmation", 409)
    response = json(await patching(rig, servo, {"temperature_limit_upper": 42}, confirm=["temperature"]))
    assert response["outcome"] == "applied"


@scene(PLAIN, SECOND)
async def test_a_servo_id_in_use_is_rejected_with_its_owner_and_a_free_one(rig: Rig) -> None:
    first, second = sorted(await rig.ready(2), key=lambda one: one.servo_id or 0)
    taken = problem(await patching(rig, first, {"servo_id": 2}), "conflict", 409)
    assert (taken["key"], taken["requested"], taken["owner"], taken["free"]) == ("servo_id", 2, second.uid, 1)
    assert taken["owner_title"] == second.title
    assert rig.writes() == []
    json(await patching(rig, first, {"servo_id": 1}))  # its own
    json(await patching(rig, second, {"servo_id": 7}))
    stored = problem(await patching(rig, first, {"servo_id": 2}), "conflict", 409)
    assert "ROM" in stored["detail"], "a restart brings it back"
    for one in (first, second):  # unprovisioned may be shared
        json(await patching(rig, one, {"servo_id": 0, "node_id": 0}))


@scene()
async def test_ids_of_known_offline_servos_are_rejected(rig: Rig, servo: Servo) -> None:
    rig.host.store.servos.put_rom(Uid("ab" * 16), {"servo_id": 9, "node_id": 44})
    rig.host.store.servos.set_label(Uid("ab" * 16), "elbow")
    for key, number in (("servo_id", 9), ("node_id", 44)):
        taken = problem(await patching(rig, servo, {key: number}), "conflict", 409)
        assert (taken["owner"], taken["owner_title"]) == ("ab" * 16, "elbow")
    planned = rig.host.changes.plan(servo, {"servo_id": 9, "node_id": 44}, leaving=[Uid("ab" * 16)])
    assert planned == {"servo_id": 9, "node_id": 44}


@scene(PLAIN, SECOND)
async def test_an_id_being_written_to_another_servo_is_rejected(rig: Rig) -> None:
    first, second = sorted(await rig.ready(2), key=lambda one: one.servo_id or 0)
    conditions = rig.sim(first).conditions

    def mute(change: Change) -> None:
        if isinstance(change, Sampled) and (change.uid, change.key) == (first.uid, "servo_id"):
            conditions.mute = True

    unsubscribe = rig.host.hub.subscribe(mute)
    writing = asyncio.create_task(patching(rig, first, {"servo_id": 7}))
    await asyncio.sleep(0.5)
    refused = problem(await patching(rig, second, {"servo_id": 7}), "conflict", 409)
    assert (refused["owner"], writing.done()) == (first.uid, False)
    unsubscribe()
    conditions.mute = False
    assert json(await writing)["outcome"] == "applied"
    assert [rig.sim(one).memory.get(0x45) for one in (first, second)] == [7, 2]


@scene(PLAIN, SECOND)
async def test_a_node_id_in_use_is_rejected(rig: Rig) -> None:
    servo = next(one for one in await rig.ready(2) if one.node_id == 11)
    Neighbour(rig.bus.port("gps"), 60).start()
    rig.host.store.allocations.record(Uid("cd" * 16), NodeId(33))
    await asyncio.sleep(2)
    for node, words in ((12, "on the bus"), (60, "node 60"), (33, "allocation table"), (127, "this server")):
        taken = problem(await patching(rig, servo, {"node_id": node}), "conflict", 409)
        assert words in taken["detail"], taken["detail"]
    assert rig.writes() == []
    for node in (11, 0, 34):
        assert json(await patching(rig, servo, {"node_id": node}))["outcome"] == "applied"


@scene(replace(PLAIN, rom_sound=False))
async def test_a_servo_with_lost_configuration_moves_only_after_a_save(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    moves = [("command", {"type": "angle", "value": 5}), ("torque", {"mode": "on"})]
    for path, body in moves:
        barred = problem(
            await rig.call("POST", f"/servos/{servo.uid}/{path}", body, lease=lease), "configuration_lost", 409
        )
        assert "defaults" in barred["detail"]
        assert "snapshot" in barred["detail"]
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    response = await rig.call("PUT", f"/servos/{servo.uid}/parameters/torque_mode", {"value": "on"}, lease=lease)
    problem(response, "configuration_lost", 409)
    assert [name for _, name, _ in rig.writes()] == ["0x20"]
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 41}}, lease=lease))
    path, body = f"/servos/{servo.uid}/save?wait=true", {"confirm": ["torque_off_in_rom"]}
    assert json(await rig.call("POST", path, body, lease=lease))["state"] == "succeeded"
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 5}, lease=lease))


@pytest.mark.parametrize("way", ["PUT", "PATCH", "POST"])
@scene()
async def test_torque_off_waits_for_no_change_and_needs_no_lease(rig: Rig, servo: Servo, way: str) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 1}, lease=lease))
    body = {"values": EIGHT}
    changing = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", body, lease=lease))
    await until(lambda: any(name == "0x2C" for _, name, _ in rig.writes()), every_s=0.0002)
    off = {
        "PUT": (f"/servos/{servo.uid}/parameters/torque_mode", {"value": "off"}),
        "PATCH": (f"/servos/{servo.uid}/parameters", {"values": {"torque_mode": "off"}}),
        "POST": (f"/servos/{servo.uid}/torque", {"mode": "off"}),
    }[way]
    json(await rig.call(way, *off))
    assert not changing.done()
    assert rig.sim(servo).memory.get(0x20) == 1
    assert not rig.host.motion.is_commanded(servo.uid)
    assert json(await changing)["outcome"] == "applied"
    assert rig.sim(servo).memory.get(0x20) == 1


@scene()
async def test_a_rejected_read_before_the_write_fails_the_change(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.refuse_keys.add("angle_d_gain")
    response = await patching(rig, servo, {"angle_p_gain": 41, "angle_d_gain": 31})
    refused = problem(response, "refused_by_servo", 502)
    assert "refused a read of angle_d_gain (0x2D) before the write. Nothing was written" in refused["detail"]
    assert rig.writes() == []


@pytest.mark.parametrize("form", ['"{}"', "{}", 'W/"{}"', "*"])
@scene()
async def test_if_match_accepts_every_form_of_a_revision(rig: Rig, servo: Servo, form: str) -> None:
    path = f"/servos/{servo.uid}/parameters"
    header = {"If-Match": form.format(servo.revision)}
    for value in (41, 42):
        response = await rig.call("PATCH", path, {"values": {"angle_p_gain": value}}, **header)
        if value == 41 or form == "*":
            assert json(response)["outcome"] == "applied"
        else:
            stale = problem(response, "stale_revision", 412)
            current = {"If-Match": stale["revision"]}
            response = await rig.call("PATCH", path, {"values": {"angle_p_gain": value}}, **current)
            assert json(response)["outcome"] == "applied"


@scene(PLAIN)
async def test_an_angle_limit_of_several_turns_needs_confirmation(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    body: dict[str, object] = {"values": {"angle_limit_cw": 999}}
    refused = problem(await rig.call("PATCH", path, body), "needs_confirmation", 409)
    assert (refused["confirm"], refused["turns"]) == ("multi_turn", 2.8)
    assert rig.writes() == []
    done = json(await rig.call("PATCH", path, {**body, "confirm": ["multi_turn"]}))
    assert done["changes"][0]["after"] == 999.0
    json(await rig.call("PATCH", path, {"values": {"angle_limit_cw": 500}}))

"""20 % frame loss: reads complete, a lost response costs little, and no action is done twice."""

import asyncio
from dataclasses import dataclass, field, replace

import pytest

from behaviour.actions import torque
from behaviour.rig import CATALOG, PLAIN, Rig, json
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.wire.services import ExecuteOpcodeRequest, GetSetRequest, GetSetResponse, RestartNodeRequest, ValueKind

ALL_ROWS = Recipe("BLA21-06U-AB", "1.300")
"""With PWM input and the newest firmware, a servo has every row."""

SERVOS = [replace(ALL_ROWS, node_id=10 + n, servo_id=1 + n) for n in range(4)]
SLOW_TIMEOUT = {"timeout_time": 60_000}
"""A timeout of a minute, so that commands are not repeated to keep it from expiring."""


@dataclass
class Actions:
    """What one servo did, as opposed to what was sent: writes as (name, raw), opcodes and restarts."""

    writes: list[tuple[str, int]] = field(default_factory=list[tuple[str, int]])
    opcodes: list[int] = field(default_factory=list[int])
    restarts: int = 0

    @classmethod
    def of(cls, sim: SimulatedServo) -> "Actions":
        """Watch a servo from now on."""
        actions, services = cls(), sim._services  # pyright: ignore[reportPrivateUsage]
        get_set, opcode, restart = services.get_set, services.opcode, services.restart

        def watched_get_set(request: GetSetRequest, *rest: object) -> GetSetResponse | None:
            if request.value.kind is not ValueKind.EMPTY:
                assert isinstance(request.value.value, int)
                actions.writes.append((request.name, request.value.value))
            return get_set(request, *rest)  # pyright: ignore[reportArgumentType]

        def watched_opcode(request: ExecuteOpcodeRequest, *rest: object) -> object:
            actions.opcodes.append(request.opcode)
            return opcode(request, *rest)  # pyright: ignore[reportArgumentType]

        def watched_restart(request: RestartNodeRequest) -> object:
            actions.restarts += 1
            return restart(request)

        services.get_set = watched_get_set  # pyright: ignore[reportAttributeAccessIssue]
        services.opcode = watched_opcode  # pyright: ignore[reportAttributeAccessIssue]
        services.restart = watched_restart  # pyright: ignore[reportAttributeAccessIssue]
        return actions


def watch(rig: Rig) -> dict[str, Actions]:
    """What every servo does from now on, by unique ID."""
    return {uid: Actions.of(sim) for uid, sim in rig.bench.servos.items()}


def mute_for(rig: Rig, servo: Servo, seconds: float) -> None:
    """Drop all responses of a servo for a while."""
    conditions = rig.sim(servo).conditions
    conditions.drop_responses_pct = 100
    asyncio.get_running_loop().call_later(seconds, setattr, conditions, "drop_responses_pct", 0)


@scene(*SERVOS)
async def test_every_row_of_four_servos_is_read(rig: Rig) -> None:
    servos = await rig.ready(4)
    actions = watch(rig)
    rig.bus.loss(20, seed=5)
    loop = asyncio.get_running_loop()
    began = loop.time()
    paths = [f"/servos/{servo.uid}/parameters?refresh=true" for servo in servos]
    responses = await asyncio.gather(*(rig.call("GET", path) for path in paths))
    took = loop.time() - began
    assert took < 20
    for servo, response in zip(servos, responses, strict=True):
        rows = json(response)["parameters"]
        assert len(rows) == 55
        for key, reading in rows.items():
            assert reading["age_s"] <= took, key
            row = CATALOG.by_key[key]
            if row.rom:
                assert reading["raw"] == rig.sim(servo).register(row.address), key
    assert all(one == Actions() for one in actions.values()), "reading has no effect"
    assert rig.events("offline") == []


@scene(*(replace(ALL_ROWS, servo_id=1 + n) for n in range(4)))
async def test_servos_without_node_ids_get_different_ones(rig: Rig) -> None:
    rig.bus.loss(20, seed=2)
    servos = await rig.ready(4, within_s=200)
    assert len({servo.node_id for servo in servos}) == 4
    assert {servo.uid: servo.node_id for servo in servos} == rig.host.store.allocations.entries()


@scene(replace(PLAIN, rom=SLOW_TIMEOUT))
async def test_a_lost_response_costs_at_most_150_ms_and_no_second_motion(rig: Rig, servo: Servo) -> None:
    await rig.host.polling.close()
    lease = await rig.lease()
    await torque(rig, servo, "on", lease)
    loop = asyncio.get_running_loop()

    async def duration(verb: str, end: str, body: object) -> float:
        began = loop.time()
        json(await rig.call(verb, f"/servos/{servo.uid}{end}", body, lease=lease))
        return loop.time() - began

    for verb, end, body, again in (
        ("GET", "/parameters/angle_p_gain", None, None),
        ("PUT", "/parameters/angle_p_gain", {"value": 41}, {"value": 42}),
        ("POST", "/torque", {"mode": "on"}, {"mode": "on"}),
        ("POST", "/command", {"type": "angle", "value": 5}, {"type": "angle", "value": 5}),
        ("POST", "/torque", {"mode": "off"}, {"mode": "off"}),
    ):
        usually = await duration(verb, end, body)
        await asyncio.sleep(0.2)
        actions = watch(rig)[servo.uid]
        mute_for(rig, servo, 0.03)
        assert 0.03 < await duration(verb, end, again) < 0.15 + usually
        await asyncio.sleep(0.2)
        assert end != "/command" or actions.writes == [("0x00", 50)], "it is performed once"


@scene(*(replace(one, rom=SLOW_TIMEOUT) for one in SERVOS))
async def test_no_motion_command_is_performed_twice(rig: Rig) -> None:
    servos = await rig.ready(4)
    lease = await rig.lease()
    for servo in servos:
        await torque(rig, servo, "on", lease)
    await asyncio.sleep(1)
    actions = watch(rig)
    rig.bus.loss(20, seed=3)
    confirmed = dict.fromkeys((servo.uid for servo in servos), 0)

    async def drive(servo: Servo) -> None:
        for target in range(1, 21):
            command = {"type": "angle", "value": target}
            response = await rig.call("POST", f"/servos/{servo.uid}/command", command, lease=lease)
            assert response.status_code in (200, 504), response.text
            confirmed[servo.uid] += response.status_code == 200

    await asyncio.gather(*(drive(servo) for servo in servos))
    for servo in servos:
        targets = [raw for name, raw in actions[servo.uid].writes if name == "0x00"]
        assert targets == sorted(set(targets)), "each at most once, and in order"
        # Three frames carry a command, so half of them arrive.
        assert len(targets) >= confirmed[servo.uid] >= 4, "what was confirmed was done"
        assert {name for name, _ in actions[servo.uid].writes} == {"0x00"}


@pytest.mark.parametrize("action", ["save", "restart"])
@scene(*(replace(one, rom={"soft_start": 0}) for one in SERVOS))
async def test_no_opcode_or_restart_is_performed_twice(rig: Rig, action: str) -> None:
    servos = await rig.ready(4)
    actions = watch(rig)
    await asyncio.sleep(3)
    starts = {servo.uid: rig.sim(servo).starts for servo in servos}
    rig.bus.loss(20, seed=4)
    calls = (rig.call("POST", f"/servos/{servo.uid}/{action}?wait=true") for servo in servos)
    jobs = [json(response) for response in await asyncio.gather(*calls)]
    await asyncio.sleep(5)
    for servo, job in zip(servos, jobs, strict=True):
        done = actions[servo.uid]
        assert len(done.opcodes) <= (action == "save")
        assert done.restarts <= 1
        assert not {"0x10", "0x11", "0x12"} & {name for name, _ in done.writes}
        assert rig.sim(servo).starts - starts[servo.uid] <= 1
        if job["state"] == "succeeded":
            assert len(done.opcodes) + done.restarts == 1
    assert any(job["state"] == "succeeded" for job in jobs)

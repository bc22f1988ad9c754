"""The public Python stack reads, configures, saves, restarts and moves our simulated servos on a Linux CAN bus."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import pytest

from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import from_text
from hornbill.schema.parameter import DUMMY, Parameter
from hornbill.sim.bench.demo import demo_fleet
from hornbill.sim.bench.recipe import Recipe
from socketcan.peer import REFUSED, Peer, Received, read, uavcan, write
from socketcan.processes import hornbill, line

CATALOG = Catalog.load()
FIRST_NODE_ID, COUNT, SEED = 20, 5, 3
STEERING, SMALL, TURNTABLE, RUDDER, RECEIVER = range(FIRST_NODE_ID, FIRST_NODE_ID + COUNT)
"""Their node ids: the first five stories of sim.demo; RUDDER has the first firmware, RECEIVER takes pulses too."""
SAVE = uavcan.protocol.param.ExecuteOpcode.Request().OPCODE_SAVE
HUNDRED_DEGREES = 100.0
"""The simulator's unit of positions by default."""


@dataclass(frozen=True)
class Bench:
    """Five servos in another process, and the stack that judges them, which has listened since before they came."""

    peer: Peer
    printed: Mapping[int, str]
    node_status: list[Received]
    status: list[Received]

    def angles(self) -> dict[int, float]:
        """What the last Status of each servo said, in degrees."""
        return {each.source: each.message.position * HUNDRED_DEGREES for each in self.status}

    def until_at(self, wanted: Mapping[int, float]) -> None:
        """Wait until servos say that they stand at these angles (degrees), or less than 1 degree off."""
        self.status.clear()

        def there() -> bool:
            angles = self.angles()
            return all(each in angles and abs(angles[each] - angle) < 1.0 for each, angle in wanted.items())

        with self.peer.receiving_status():
            self.peer.run_until(there, f"servos at {wanted}")

    def at_rest(self) -> dict[int, float]:
        """Wait until no servo's angle changes over 0.5 s, and return the angles (degrees)."""
        before: dict[int, float] = {}
        with self.peer.receiving_status():
            while True:
                self.status.clear()
                self.peer.live(0.5)
                now = self.angles()
                if set(now) >= set(ALL) and all(abs(now[each] - before.get(each, 1e3)) < 0.5 for each in ALL):
                    return now
                before = now

    def restart_by(self, node_id: int, request: object) -> Received:
        """The response to a request that restarts a servo, once its uptime has fallen and its horn is at 0°."""

        def uptimes(since: int = 0) -> list[int]:
            return [each.message.uptime_sec for each in self.node_status[since:] if each.source == node_id]

        self.peer.run_until(lambda: uptimes()[-1] > 0, f"node {node_id} is up for a second")
        before, seen = uptimes()[-1], len(self.node_status)
        (response,) = self.peer.request((node_id, request))
        self.peer.run_until(lambda: any(uptime < before for uptime in uptimes(seen)), f"node {node_id} restarts")
        self.peer.live(0.2)
        self.until_at({node_id: 0.0})
        self.peer.live(0.2)
        return response


@lru_cache
def recipe(node_id: int) -> Recipe:
    return demo_fleet(CATALOG, COUNT, SEED)[node_id - FIRST_NODE_ID]


def rows(node_id: int) -> Mapping[str, Parameter]:
    """What the tables say this servo has, by the name GetSet knows."""
    made = recipe(node_id)
    return {row.name: row for row in CATALOG.models[made.model].rows(from_text(made.firmware)).values()}


def saved(node_id: int) -> dict[str, int]:
    """What the tables and the servo's story say its ROM and its nameplate hold."""
    made = recipe(node_id)
    model = CATALOG.models[made.model]
    said = dict(made.rom) | {
        "servo_id": made.servo_id,
        "node_id": node_id,
        "model_number": model.model_number,
        "product_number": made.serial,
        "firmware_version": from_text(made.firmware),
        "hardware_version": model.hardware_version,
    }
    return {name: said.get(row.key, row.default or 0) for name, row in rows(node_id).items() if row.rom} | {
        row.name: said[row.key] for row in rows(node_id).values() if row.key in said
    }


ALL = tuple(range(FIRST_NODE_ID, FIRST_NODE_ID + COUNT))


@pytest.fixture(scope="module")
def bench(vcan0: str) -> Iterator[Bench]:
    words = ("--servos", str(COUNT), "--node-id", str(FIRST_NODE_ID), "--seed", str(SEED))
    with Peer(100) as peer:
        node_status = peer.listen(uavcan.protocol.NodeStatus)
        status = peer.listen(uavcan.equipment.actuator.Status)
        with hornbill("sim", "--bus", vcan0, *words) as process:
            printed = {node_id: line(process) for node_id in ALL}
            made = Bench(peer, printed, node_status, status)
            made.until_at(dict.fromkeys(ALL, 0.0))  # as they do in their soft start
            peer.live(0.5)
            yield made


def test_every_servo_identifies_itself(bench: Bench) -> None:
    responses = bench.peer.request(*((node_id, uavcan.protocol.GetNodeInfo.Request()) for node_id in ALL), priority=7)
    for node_id, response in zip(ALL, responses, strict=True):
        info, made = response.message, recipe(node_id)
        assert bytes(list(info.hardware_version.unique_id)).hex() == bench.printed[node_id].split()[0]
        assert bytes(list(info.name)).decode() == f"jp.co.futaba.{made.model.lower()}"
        software = info.software_version
        assert software.major * 1000 + software.minor * 10 == from_text(made.firmware)
        assert software.optional_field_flags == 0
        assert list(info.hardware_version.certificate_of_authenticity) == []
        assert (info.status.health, info.status.mode, info.status.sub_mode) == (0, 0, 0)
        assert response.priority == 7, "a response has the priority of its request"


def test_every_parameter_reads_by_name_as_in_tables_and_rom(bench: Bench) -> None:
    requested = [(node_id, name) for node_id in ALL for name in rows(node_id)]
    responses = bench.peer.registers(*((node_id, read(name)) for node_id, name in requested))
    assert len(requested) > 4 * 50
    wrong: list[str] = []
    for (node_id, name), response in zip(requested, responses, strict=True):
        assert (response.name, response.kind) == (name, "integer_value"), (node_id, name, response)
        assert response.others == ("empty", "empty", "empty"), "a servo gives no limits (table 2-16)"
        row, known = rows(node_id)[name], saved(node_id).get(name)
        value = response.value
        assert isinstance(value, int)
        inside = (row.minimum is None or row.minimum <= value) and (row.maximum is None or value <= row.maximum)
        if not (value == known if known is not None else inside or (row.dummy and value == DUMMY)):
            wrong.append(f"{recipe(node_id).model} {name} {row.key}: {value}, not {known or row}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", ["0x03", "torque_mode", "x" * 92])
def test_an_unknown_register_is_refused_and_the_next_request_served(bench: Bench, name: str) -> None:
    refused, torque_mode = bench.peer.registers((STEERING, read(name)), (STEERING, read("0x20")), priority=28)
    assert refused == (*REFUSED, 28)
    assert torque_mode[:3] == ("0x20", "integer_value", 0)


def opcode(number: int, argument: int = 0) -> object:
    request = uavcan.protocol.param.ExecuteOpcode.Request()
    request.opcode, request.argument = number, argument
    return request


def restart(magic: int) -> object:
    request = uavcan.protocol.RestartNode.Request()
    request.magic_number = magic
    return request


def test_a_written_value_is_lost_at_a_restart_unless_saved(bench: Bench) -> None:
    def values(*requests: object) -> list[object]:
        return [each.value for each in bench.peer.registers(*((STEERING, request) for request in requests))]

    limits = read("0x38"), read("0x39")
    factory = uavcan.protocol.RestartNode.Request().MAGIC_NUMBER
    assert values(*limits) == [600, -600]
    assert values(write("0x38", 750)) == [750]
    assert bench.restart_by(STEERING, restart(factory)).message.ok
    assert values(*limits) == [600, -600]

    assert values(write("0x38", 750), write("0x39", -500)) == [750, -500]
    saved_it = bench.restart_by(STEERING, opcode(SAVE)).message
    assert (saved_it.ok, saved_it.argument) == (True, 0)
    assert values(*limits) == [750, -500]

    values(write("0x38", 600), write("0x39", -600))
    assert bench.restart_by(STEERING, opcode(SAVE)).message.ok
    assert values(*limits) == [600, -600]


def test_a_request_in_a_can_fd_frame_is_ignored(bench: Bench) -> None:
    unanswered: list[object] = []
    bench.peer.node.request(read("0x20"), STEERING, unanswered.append, timeout=0.5, canfd=True)
    bench.peer.run_until(lambda: unanswered, "the timeout")
    assert unanswered == [None]
    assert bench.peer.registers((STEERING, read("0x20")))[0].value == 0


def test_a_burst_of_commands_moves_only_the_addressed_servos(bench: Bench) -> None:
    burst = uavcan.equipment.actuator.ArrayCommand()
    wanted = {STEERING: 30.0, RUDDER: -20.0, RECEIVER: 12.5}
    for node_id, degrees in wanted.items():
        command = uavcan.equipment.actuator.Command()
        command.actuator_id = recipe(node_id).servo_id
        command.command_type = command.COMMAND_TYPE_POSITION
        command.command_value = degrees / HUNDRED_DEGREES
        burst.commands.append(command)
    stood = bench.at_rest()  # where its timeout disabled torque after power-on
    bench.peer.node.broadcast(burst, priority=4)
    bench.until_at({each: stood[each] for each in (TURNTABLE, SMALL)} | wanted)
    angles = bench.angles()
    registers = bench.peer.registers(*((node_id, read("0x08")) for node_id in wanted))
    for node_id, register in zip(wanted, registers, strict=True):
        assert isinstance(register.value, int)
        assert register.value / 10 == pytest.approx(angles[node_id], abs=1.0), "Status and 0x08 agree"


def test_periodic_messages_have_their_rates_and_rising_transfer_ids(bench: Bench) -> None:
    bench.node_status.clear()
    bench.status.clear()
    began = time.monotonic()
    with bench.peer.receiving_status():
        bench.peer.live(3.2)
    took = time.monotonic() - began
    for received, period in ((bench.node_status, 1.0), (bench.status, 0.1)):
        for node_id in ALL:
            own = [each for each in received if each.source == node_id]
            # Counted: a machine that is busy delays one and lets the next come sooner.
            assert 0.8 * took / period - 1 <= len(own) <= 1.2 * took / period + 1
            ids = [each.transfer_id for each in own]
            assert ids == [(ids[0] + step) % 32 for step in range(len(ids))]
            assert {each.priority for each in own} == {16}, "table 2-2"


def test_status_contains_servo_id_and_angle_only(bench: Bench) -> None:
    with bench.peer.receiving_status():
        bench.peer.run_until(lambda: {each.source for each in bench.status} >= set(ALL), "Status of all")
    for received in bench.status:
        said = received.message
        assert said.actuator_id == recipe(received.source).servo_id
        assert (said.force, said.speed, said.power_rating_pct) == (0.0, 0.0, 0)
    for received in bench.node_status:
        said = received.message
        assert (said.health, said.mode, said.sub_mode, said.vendor_specific_status_code) == (0, 0, 0, 0)

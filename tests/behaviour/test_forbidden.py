"""Register 0x49 (section 4.39): nothing reads or writes it, and no frame is sent."""

import asyncio
from itertools import product

import orjson
import pytest

from behaviour.rig import Rig, json, problem
from behaviour.scene import scene
from hornbill import resources
from hornbill.errors import ForbiddenParameter
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.requests import COMMAND, ONCE, READ, STOP, TORQUE, WRITE
from hornbill.servo.device.servo import Servo
from hornbill.wire.datatype import Kind
from hornbill.wire.services import EMPTY, GetSetRequest, integer
from hornbill.wire.transfer import Transfer, split

SPELLINGS = [
    "0x49", "0X49", "0x049", " 0x49", "0x49 ", "73", "49h", "boot_loader", "boot-loader", "bootloader", "Boot_Loader",
    "0x0049", "073", "%30x49",
]  # fmt: skip


async def nothing_sent(rig: Rig) -> None:
    """No GetSet request on the bus names the register, and the servo saw no write to it."""
    await asyncio.sleep(1.0)
    for transfer in rig.transfers():
        if transfer.kind is Kind.REQUEST and transfer.type_id == GetSetRequest.TYPE.id:
            request = GetSetRequest.decode(transfer.payload)
            assert request is not None
            assert request.name.strip().casefold() not in ("0x49", "73", "0x049")
            assert request.index != 0x49
    for sim in rig.bench.servos.values():
        assert sim.boot_loader_writes == []


@scene()
async def test_no_route_or_layer_reads_or_writes_it_under_any_spelling(rig: Rig, servo: Servo) -> None:
    for key in SPELLINGS:
        path = f"/servos/{servo.uid}/parameters/{key}"
        for response in (await rig.call("GET", path), await rig.call("PUT", path, {"value": 1})):
            found = response.json()
            assert response.status_code in (403, 404), (key, found)
            assert found["code"] in ("forbidden_parameter", "unknown_parameter"), (key, found)
        body = {"values": {key: 1, "angle_limit_cw": 10}}
        refused = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body)
        assert refused.status_code in (403, 404), (key, refused.text)
    for key in ("0x49", "0X49", "73", "boot_loader", "0x28", "0x13"):
        response = await rig.call("PUT", f"/servos/{servo.uid}/parameters/{key}", {"value": 1})
        problem(response, "forbidden_parameter", 403)
    row = rig.host.catalog.parameters["boot_loader"]
    for policy in (READ, WRITE, COMMAND, TORQUE, STOP, ONCE):
        with pytest.raises(ForbiddenParameter):
            await rig.host.requests.write(servo, row, 1, policy)
        with pytest.raises(ForbiddenParameter):
            await rig.host.requests.read(servo, row, policy)
    assert servo.raw("angle_limit_cw") == 1799
    await nothing_sent(rig)
    assert rig.writes() == []

    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert all(reading["address"] != 0x49 for reading in shown.values())
    rows: dict[str, Parameter] = {key: one.parameter for key, one in servo.registers.items()}
    assert all(row.address != 0x49 and not row.forbidden for row in rows.values())
    schema = json(await rig.call("GET", "/schema"))
    assert all(row["address"] != 0x49 for row in schema["parameters"])
    document = orjson.loads((resources.schemas() / "generated" / "openapi.json").read_bytes())
    assert all("boot_loader" not in path for path in document["paths"])


@scene(fast=True)
async def test_participant_and_port_reject_it_in_any_raw_form(rig: Rig, servo: Servo) -> None:
    participant = rig.host.connected().participant
    assert servo.node_id is not None
    tried = 0
    for name, index, writing in product(("0x49", "0X49", "0x49\0", " 0x49", "73", "0x4９", ""), (0, 73, 8191), (0, 1)):
        if not name and (index == 0 or (index == 8191 and not writing)):
            continue  # register 0x00; a read far beyond every register
        try:
            request = GetSetRequest(index, integer(1) if writing else EMPTY, name)
            payload = request.encode()
        except ValueError:
            continue  # a name that cannot be encoded
        tried += 1
        with pytest.raises(ForbiddenParameter):
            await participant.request(servo.node_id, request, urgent=True)
        transfer = Transfer(Kind.REQUEST, GetSetRequest.TYPE.id, 127, servo.node_id, 16, 3, payload)
        frames = split(transfer, GetSetRequest.TYPE)
        with pytest.raises(ForbiddenParameter):
            participant.port.send(frames)
        if len(frames) > 1:  # one by one: the frame that completes the request must not leave
            rejected = 0
            for frame in frames:
                try:
                    participant.port.send([frame])
                except ForbiddenParameter:
                    rejected += 1
            assert rejected >= 1, (name, index, writing)
    assert tried >= 30
    await nothing_sent(rig)

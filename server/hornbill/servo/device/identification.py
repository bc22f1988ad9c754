"""Identification: finds the servo and model on a node ID, and derives the values in ROM from RAM."""

import asyncio
import logging
from dataclasses import dataclass

from hornbill.errors import NoResponse, Refused
from hornbill.node.directory import Directory
from hornbill.schema.catalog import Catalog
from hornbill.schema.model import ServoModel
from hornbill.servo.device.foreign_nodes import ForeignNodes
from hornbill.servo.device.requests import POLL, READ, RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.units import NodeId, Raw, Uid
from hornbill.wire.services import GetNodeInfoResponse

log = logging.getLogger(__name__)

RESTS_S = 0.2
"""A horn that does not move in this time is at rest: in soft start it would turn 36°."""


@dataclass(frozen=True, slots=True)
class NodeIdentity:
    """Identity reported by a node. `model` is the model it is treated as, None for an unknown series."""

    uid: Uid
    name: str
    model_number: int
    hardware_version: int | None
    firmware: int | None
    serial_number: int | None
    production_date: str | None
    model: ServoModel | None


async def identify(
    requests: ServoRequests,
    catalog: Catalog,
    directory: Directory,
    foreign_nodes: ForeignNodes,
    node_id: NodeId,
    *,
    known: bool,
) -> NodeIdentity | None:
    """Identify the servo on a node ID. None if none is found; `foreign_nodes` then has the reason.

    `known`: a servo is already known on it. The response to GetNodeInfo is stored in `directory`. Raises
    BusDisconnected, and NoResponse if a servo stops responding.
    """
    record = directory.records[node_id]
    policy = READ if known else foreign_nodes.retry_policy(node_id)
    info = before = record.info
    try:
        if info is None:
            info = await _read_info(requests, directory, node_id, policy)
        model_number = await requests.read_from_node(node_id, catalog.by_key["model_number"], policy)
    except NoResponse as error:
        if known:
            raise
        log.info("node %d: %s", node_id, error.detail)
        (foreign_nodes.no_node_info if info is None else foreign_nodes.no_parameters)(node_id)
        return None
    if model_number is None:
        log.info("node %d has no 0x50", node_id)
        foreign_nodes.refused(node_id)
        return None
    if before is not None or record.info is not info:  # another node may have taken this ID meanwhile
        info = await _read_info(requests, directory, node_id, READ)
    return await _identify(requests, catalog, node_id, info, model_number)


async def _read_info(
    requests: ServoRequests, directory: Directory, node_id: NodeId, policy: RetryPolicy
) -> GetNodeInfoResponse:
    """Request GetNodeInfo; the directory stores it unless the node has restarted meanwhile."""
    boot_count = directory.records[node_id].boot_count
    info = await requests.node_info(node_id, policy)
    if directory.records[node_id].boot_count == boot_count:
        directory.identify(node_id, info)
    return info


async def _identify(
    requests: ServoRequests, catalog: Catalog, node_id: NodeId, info: GetNodeInfoResponse, model_number: Raw
) -> NodeIdentity:
    async def read(key: str) -> Raw | None:
        return await requests.read_from_node(node_id, catalog.by_key[key])

    hardware = await read("hardware_version")
    made = [await read(key) for key, row in catalog.parameters.items() if row.group == "production"]
    return NodeIdentity(
        uid=Uid(info.hardware_version.unique_id.hex()),
        name=info.name,
        model_number=model_number,
        hardware_version=hardware,
        firmware=await read("firmware_version"),
        serial_number=await read("product_number"),
        production_date=production_date(made),
        model=catalog.treated_as(model_number, hardware),
    )


def apply(servo: Servo, identity: NodeIdentity) -> None:
    """Apply an identity to its servo."""
    servo.name = identity.name
    servo.model_number = identity.model_number
    servo.hardware_version = identity.hardware_version
    servo.serial_number = identity.serial_number
    servo.production_date = identity.production_date
    servo.identify_as(identity.model, identity.firmware)


async def read_rows(requests: ServoRequests, servo: Servo, keys: list[str] | None = None) -> list[str]:
    """Read rows one after the other, all unless `keys` is given. Returns the keys the servo refused.

    A refused row does not exist in this firmware, which is not a fault. Raises NoResponse or BusDisconnected.
    """
    refused: list[str] = []
    for key in list(servo.registers) if keys is None else keys:
        try:
            await requests.read(servo, servo.registers[key].parameter, READ)
        except Refused:
            refused.append(key)
    return refused


def learn_rom(servo: Servo, *, soft_start: bool) -> None:
    """Take the values in RAM as those in ROM. Valid only right after a start, for rows not written since (4.11).

    During soft start, the rows it overrides say nothing about ROM (section 4.14), nor do temporary values. If ROM could
    not be loaded, RAM contains the defaults and the values in ROM are unknown (bit 15 of 0x1A, section 4.12).
    """
    if servo.rom_lost:
        forget_rom(servo)
        return
    for key, register in servo.registers.items():
        reliable = register.parameter.rom and register.at is not None and register.reflects_rom
        reliable = reliable and key not in servo.overridden
        if reliable and not (soft_start and register.parameter.soft_start is not None):
            register.rom = register.raw


async def soft_start_timed_out(requests: ServoRequests, servo: Servo) -> bool:
    """Whether the servo's timeout (0x27) ended its soft start: the horn is at rest and the rows are restored (4.14).

    Raises NoResponse, Refused, BusDisconnected.
    """
    angle = servo.registers["current_angle"].parameter
    before = await requests.read(servo, angle, POLL)
    await asyncio.sleep(RESTS_S)
    if abs(await requests.read(servo, angle, POLL) - before) > 1:
        return False
    for key, temporary in servo.soft_start_rows.items():
        if await requests.read(servo, servo.registers[key].parameter, POLL) != temporary:
            return True
    return False


async def learn_after_soft_start(requests: ServoRequests, servo: Servo, *, ended: bool = True) -> None:
    """Read the rows that soft start overrides. For rows not written since, RAM again equals ROM.

    Not `ended`: they may still be overridden, so nothing is concluded about ROM.

    Raises NoResponse or BusDisconnected.
    """
    rows = list(servo.soft_start_rows)
    learn = [key for key in rows if servo.registers[key].rom is None]
    await read_rows(requests, servo, rows)
    for key in learn if ended else ():
        if servo.registers[key].reflects_rom and not servo.rom_lost:
            servo.registers[key].rom = servo.registers[key].raw


def forget_rom(servo: Servo) -> None:
    """Mark the values in ROM as unknown: old values, new values, or nothing that can be loaded."""
    for register in servo.registers.values():
        register.rom = None


def log_text(error: NoResponse) -> str:
    """Log text for a node that stopped responding during identification."""
    return f"Identification aborted: {error.detail}"


def production_date(parts: list[int | None]) -> str | None:
    """Production date from year, month, day, hour and minute, YYYY-MM-DDTHH:MM. None if one is unknown."""
    numbers = [part for part in parts if part is not None]
    if len(numbers) < len(parts):
        return None
    year, month, day, hour, minute = numbers[:5]
    return f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}"

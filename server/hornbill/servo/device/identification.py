"""Identification: the questions that turn a node id into a servo with a model, and RAM into knowledge of ROM."""

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
"""A horn that goes no further in this time rests: in soft start it turns 36 degrees."""


@dataclass(frozen=True, slots=True)
class NodeIdentity:
    """What a node says of itself. `model` is what it is treated as, None for an unknown series."""

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
    """Which servo is on a node id that said NodeStatus; None when none is known to be, and `foreign_nodes` knows why.

    `known`: a servo is. What GetNodeInfo answers goes into `directory`. Raises BusDisconnected, and NoResponse when a
    servo falls silent.
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
    if before is not None or record.info is not info:  # somebody else may be here since it said who it is
        info = await _read_info(requests, directory, node_id, READ)
    return await _identify(requests, catalog, node_id, info, model_number)


async def _read_info(
    requests: ServoRequests, directory: Directory, node_id: NodeId, policy: RetryPolicy
) -> GetNodeInfoResponse:
    """GetNodeInfo; the directory keeps it unless the node started anew meanwhile."""
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
    date = [await read(key) for key, row in catalog.parameters.items() if row.group == "production"]
    return NodeIdentity(
        uid=Uid(info.hardware_version.unique_id.hex()),
        name=info.name,
        model_number=model_number,
        hardware_version=hardware,
        firmware=await read("firmware_version"),
        serial_number=await read("product_number"),
        production_date=_date(date),
        model=catalog.treated_as(model_number, hardware),
    )


def apply(servo: Servo, identity: NodeIdentity) -> None:
    """Write an identity into the servo it belongs to."""
    servo.name = identity.name
    servo.model_number = identity.model_number
    servo.hardware_version = identity.hardware_version
    servo.serial_number = identity.serial_number
    servo.production_date = identity.production_date
    servo.identify_as(identity.model, identity.firmware)


async def read_rows(requests: ServoRequests, servo: Servo, keys: list[str] | None = None) -> list[str]:
    """Read rows (all of them unless named), one after the other; answers the keys the servo refused.

    A refused row is one this firmware lacks, which is no fault. Raises NoResponse or BusDisconnected.
    """
    refused: list[str] = []
    for key in list(servo.registers) if keys is None else keys:
        try:
            await requests.read(servo, servo.registers[key].parameter, READ)
        except Refused:
            refused.append(key)
    return refused


def learn_rom(servo: Servo, *, soft_start: bool) -> None:
    """Take what RAM holds for what ROM holds: true only right after a start, and of no row we wrote since (4.11).

    During soft start the rows it overrides say nothing about ROM (section 4.14). When ROM could not be loaded,
    RAM holds the defaults and nobody knows what ROM holds (bit 15 of 0x1A, section 4.12).
    """
    if servo.rom_lost:
        forget_rom(servo)
        return
    for register in servo.registers.values():
        told = register.parameter.rom and register.at is not None and register.reflects_rom
        if told and not (soft_start and register.parameter.soft_start is not None):
            register.rom = register.raw


async def soft_start_timed_out(requests: ServoRequests, servo: Servo) -> bool:
    """Whether the servo's own timeout (0x27) has ended its soft start: the horn rests, and the rows are back (4.14).

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
    """Read the rows soft start held values of its own in; of those nobody wrote, RAM is what ROM holds again.

    Not `ended`: nobody knows whether it holds them still, so nothing is learned of ROM.

    Raises NoResponse or BusDisconnected.
    """
    rows = list(servo.soft_start_rows)
    learn = [key for key in rows if servo.registers[key].rom is None]
    await read_rows(requests, servo, rows)
    for key in learn if ended else ():
        if servo.registers[key].reflects_rom and not servo.rom_lost:
            servo.registers[key].rom = servo.registers[key].raw


def forget_rom(servo: Servo) -> None:
    """Nobody knows what ROM holds: the old values, new ones, or nothing that can be loaded."""
    for register in servo.registers.values():
        register.rom = None


def log_text(error: NoResponse) -> str:
    """A sentence for the log when a node went silent half-way."""
    return f"Identification broke off: {error.detail}"


def _date(parts: list[int | None]) -> str | None:
    numbers = [part for part in parts if part is not None]
    if len(numbers) < len(parts):
        return None
    year, month, day, hour, minute = numbers[:5]
    return f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}"

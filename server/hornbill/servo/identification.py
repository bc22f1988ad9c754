"""Owns identification: the questions that turn a node id into a servo with a model, and RAM into knowledge of ROM."""

import logging
from dataclasses import dataclass

from hornbill.errors import NoAnswer, Refused
from hornbill.node.directory import Directory
from hornbill.schema.catalog import Catalog
from hornbill.schema.model import ServoModel
from hornbill.servo.asking import READ, Asker, Patience
from hornbill.servo.servo import SOFT_START_ROWS, Servo
from hornbill.servo.strangers import Strangers
from hornbill.units import NodeId, Raw, Uid
from hornbill.wire.services import GetNodeInfoResponse

log = logging.getLogger(__name__)

_DATE_KEYS = (
    "production_year", "production_month", "production_day", "production_hour", "production_minute",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Identity:
    """What a node says of itself. `model` is None when the pair (0x50, 0x53) is in no table."""

    uid: Uid
    name: str
    model_number: int
    hardware_version: int | None
    firmware: int | None
    serial_number: int | None
    production_date: str | None
    model: ServoModel | None


async def who(
    asker: Asker, catalog: Catalog, directory: Directory, strangers: Strangers, node_id: NodeId, *, known: bool
) -> Identity | None:
    """Which servo is on a node id that said NodeStatus; None when none is known to be, and `strangers` knows why.

    `known`: a servo is. What GetNodeInfo answers goes into `directory`. Raises BusDisconnected, and NoAnswer when a
    servo falls silent.
    """
    record = directory.records[node_id]
    patience = READ if known else strangers.patience(node_id)
    info = before = record.info
    try:
        if info is None:
            info = await _ask_info(asker, directory, node_id, patience)
        model_number = await asker.probe(node_id, catalog.by_key["model_number"], patience)
    except NoAnswer as error:
        if known:
            raise
        log.info("node %d: %s", node_id, error.detail)
        (strangers.silent if info is None else strangers.deaf)(node_id)
        return None
    if model_number is None:
        log.info("node %d has no 0x50", node_id)
        strangers.refused(node_id)
        return None
    if before is not None or record.info is not info:  # somebody else may be here since it said who it is
        info = await _ask_info(asker, directory, node_id, READ)
    return await _identify(asker, catalog, node_id, info, model_number)


async def _ask_info(asker: Asker, directory: Directory, node_id: NodeId, patience: Patience) -> GetNodeInfoResponse:
    """GetNodeInfo; the directory keeps it unless the node started anew meanwhile."""
    life = directory.records[node_id].lives
    info = await asker.node_info(node_id, patience)
    if directory.records[node_id].lives == life:
        directory.identify(node_id, info)
    return info


async def _identify(
    asker: Asker, catalog: Catalog, node_id: NodeId, info: GetNodeInfoResponse, model_number: Raw
) -> Identity:
    async def ask(key: str) -> Raw | None:
        return await asker.probe(node_id, catalog.by_key[key])

    hardware = await ask("hardware_version")
    date = [await ask(key) for key in _DATE_KEYS]
    return Identity(
        uid=Uid(info.hardware_version.unique_id.hex()),
        name=info.name,
        model_number=model_number,
        hardware_version=hardware,
        firmware=await ask("firmware_version"),
        serial_number=await ask("product_number"),
        production_date=_date(date),
        model=None if hardware is None else catalog.model(model_number, hardware),
    )


def apply(servo: Servo, identity: Identity) -> None:
    """Write an identity into the servo it belongs to."""
    servo.name = identity.name
    servo.model_number = identity.model_number
    servo.hardware_version = identity.hardware_version
    servo.serial_number = identity.serial_number
    servo.production_date = identity.production_date
    servo.identify_as(identity.model, identity.firmware)


async def read_rows(asker: Asker, servo: Servo, keys: list[str] | None = None) -> list[str]:
    """Read rows (all of them unless named), one after the other; answers the keys the servo refused.

    A refused row is one this firmware lacks, which is no fault. Raises NoAnswer or BusDisconnected.
    """
    refused: list[str] = []
    for key in list(servo.registers) if keys is None else keys:
        try:
            await asker.read(servo, servo.registers[key].parameter, READ)
        except Refused:
            refused.append(key)
    return refused


def learn_rom(servo: Servo, *, soft_start: bool) -> None:
    """Take what RAM holds for what ROM holds: true only right after a start, and of no row we wrote since (4.11).

    During soft start the five rows it overrides say nothing about ROM (section 4.14). When ROM could not be loaded,
    RAM holds the defaults and nobody knows what ROM holds (bit 15 of 0x1A, section 4.12).
    """
    if servo.rom_lost:
        forget_rom(servo)
        return
    for key, register in servo.registers.items():
        told = register.parameter.rom and register.at is not None and register.tells_rom
        if told and not (soft_start and key in SOFT_START_ROWS):
            register.rom = register.raw


async def learn_after_soft_start(asker: Asker, servo: Servo, *, ended: bool = True) -> None:
    """Read the rows soft start held values of its own in; of those nobody wrote, RAM is what ROM holds again.

    Not `ended`: nobody knows whether it holds them still, so nothing is learned of ROM.

    Raises NoAnswer or BusDisconnected.
    """
    rows = [key for key in SOFT_START_ROWS if key in servo.registers]
    learn = [key for key in rows if servo.registers[key].rom is None]
    await read_rows(asker, servo, rows)
    for key in learn if ended else ():
        if servo.registers[key].tells_rom and not servo.rom_lost:
            servo.registers[key].rom = servo.registers[key].raw


def forget_rom(servo: Servo) -> None:
    """Nobody knows what ROM holds: the old values, new ones, or nothing that can be loaded."""
    for register in servo.registers.values():
        register.rom = None


def lost(error: NoAnswer) -> str:
    """A sentence for the log when a node went silent half-way."""
    return f"Identification broke off: {error.detail}"


def _date(parts: list[int | None]) -> str | None:
    numbers = [part for part in parts if part is not None]
    if len(numbers) < len(parts):
        return None
    year, month, day, hour, minute = numbers
    return f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}"

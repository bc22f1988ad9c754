"""Routes of the inventory: all known servos, on the bus or not."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import Annotated

from fastapi import Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api.addressing import servo_never_seen
from hornbill.api.dependencies import LeaseHeader, TheHost, UidPath
from hornbill.api.downloads import CSV, attachment
from hornbill.api.paging import Every
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.csv_text import csv_text
from hornbill.domain.fields import Model, UidField, known
from hornbill.domain.note import Note
from hornbill.errors import Busy
from hornbill.schema import scale
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import to_text
from hornbill.schema.scale import Value
from hornbill.servo.device.drift import drifted
from hornbill.servo.host import Host
from hornbill.store.audit import NewAuditEntry
from hornbill.store.servos import StoredServo
from hornbill.units import Uid

routes = Routes("inventory")


class KnownServo(Model):
    """A known servo, on the bus or not."""

    uid: UidField
    label: str = Field(description="Nickname. Empty if none.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    serial: str | None = Field(description="Serial number: model number, dash, product number. Null if unknown.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    hardware_version: int | None = Field(description="Hardware version from GetNodeInfo. Null if unknown.")
    production_date: str | None = Field(description="Production date as the servo reports it. Null if unknown.")
    node_id: int | None = Field(description="Last known node ID. Null if none.")
    servo_id: int | None = Field(description="Last known servo ID (0x45). Null if unknown.")
    first_seen: float | None = Field(description="First contact, seconds since 1970 UTC. Null if unknown.")
    last_seen: float | None = Field(description="Last contact, seconds since 1970 UTC. Null if unknown.")
    online: bool = Field(description="Received recently.")
    rom: dict[str, Value] = Field(description="Values last known to be in ROM, by key.")
    snapshots: int = Field(description="Number of stored snapshots.")
    drift: list[str] = Field(description="Keys of rows whose ROM value changed unexpectedly.")
    notes: str = Field(description="Notes of users. Empty if none.")
    bench: str | None = Field(description="Bench where it was last seen. Null if unknown.")
    bench_seen_at: float | None = Field(
        description="When it was last seen there, seconds since 1970 UTC. Null if unknown."
    )


class KnownServoPatch(Model):
    """Data that the server stores about a servo. Omitted fields stay unchanged."""

    label: str | None = Field(default=None, max_length=64, description="Nickname.")
    notes: str | None = Field(default=None, max_length=4000, description="Notes of users.")


ModelName = Annotated[str | None, Query(description="Model, such as `BLA21-06U-A0`.")]
Label = Annotated[str | None, Query(description="Nickname.")]
Serial = Annotated[str | None, Query(max_length=40, description="Part of the serial number, nickname or unique ID.")]

FACTS = (
    "uid", "label", "model", "serial", "firmware", "hardware_version", "production_date", "node_id", "servo_id",
    "first_seen", "last_seen", "online", "snapshots", "drift", "notes", "bench",
)  # fmt: skip


@routes.get("/inventory", Role.VIEW, "invalid_value")
async def list_inventory(
    host: TheHost, page: Every, model: ModelName = None, label: Label = None, q: Serial = None
) -> list[KnownServo]:
    """List all known servos, most recently seen first."""
    return page.of(await _found(host, model, label, q), lambda one: one.uid)


@routes.get(
    "/inventory.csv",
    Role.VIEW,
    "invalid_value",
    response_class=Response,
    responses={200: {"content": {"text/csv": {}}}},
)
async def download_inventory(host: TheHost, model: ModelName = None, label: Label = None, q: Serial = None) -> Response:
    """Download the inventory as CSV: one line per servo, with one column per ROM value, named with its unit."""
    found = await _found(host, model, label, q)
    return Response(csv_text(_table(host.catalog, found)), media_type=CSV, headers=attachment("inventory.csv"))


@routes.get("/inventory/{uid}", Role.VIEW, "unknown_servo", "invalid_value")
async def get_known_servo(host: TheHost, uid: UidPath) -> KnownServo:
    """Get a known servo, on the bus or not."""
    return _shown(host, _stored(host, uid), await host.store.run(host.store.snapshots.counts))


@routes.patch("/inventory/{uid}", Role.CONFIGURE, "unknown_servo", "invalid_value")
async def update_known_servo(
    host: TheHost, uid: UidPath, body: KnownServoPatch, lease: LeaseHeader = None
) -> KnownServo:
    """Change the nickname or notes of a known servo, on the bus or not."""
    stored, by = _stored(host, uid), host.leases.who(lease, host.base.now())
    servo = host.fleet.find(stored.uid)
    assert servo is not None, "the fleet contains every stored servo"
    if body.label is not None:
        await host.set_label(servo, body.label, by=by)
    if body.notes is not None:
        await host.set_notes(stored, body.notes, by=by)
    return _shown(host, _stored(host, uid), await host.store.run(host.store.snapshots.counts))


@routes.delete("/inventory/{uid}", Role.ADMIN, "unknown_servo", "busy", "invalid_value", status_code=204)
async def forget_servo(
    host: TheHost,
    uid: UidPath,
    lease: LeaseHeader = None,
    history: Annotated[
        bool, Query(description="Also delete its snapshots and fault history. Otherwise they return with the servo.")
    ] = False,
) -> None:
    """Forget a servo that is off the bus: its identity, nickname and last configuration. Audit rows are kept."""
    stored = _stored(host, uid)
    if host.jobs.running(stored.uid) is not None:
        raise Busy(
            f"A job of {stored.label or uid[:8]} is running. Cancel it, or wait until it has ended.",
            cause="job_running",
        )
    host.fleet.forget(stored.uid)
    await host.store.run(host.store.servos.forget, stored.uid)
    host.drift.forget(stored.uid)
    host.lost_values.forget(Uid(stored.uid))
    host.owed.forget(Uid(stored.uid))
    deleted = await host.store.run(host.store.snapshots.drop_all, stored.uid) if history else 0
    if history:
        await host.faults.forget(stored.uid)
    by, params = host.leases.who(lease, host.base.now()), known(model=stored.facts.model, snapshots=deleted)
    note = Note(f"{stored.facts.model}, {deleted} snapshots deleted", "servo_forgotten", params)
    host.audit.note(NewAuditEntry(by, "forget", "succeeded", stored.uid, before=stored.label, notes=(note,)))


def _stored(host: Host, uid: str) -> StoredServo:
    stored = host.store.servos.get(Uid(uid))
    if stored is None:
        raise servo_never_seen(uid)
    return stored


def _table(catalog: Catalog, servos: Sequence[KnownServo]) -> Iterator[list[object]]:
    rows = [row for row in catalog.readable.values() if row.rom]
    yield [*FACTS, *(f"{row.key} [{row.unit}]" if row.unit else row.key for row in rows)]
    for one in servos:
        facts = one.model_dump()
        facts |= {"drift": " ".join(one.drift), "first_seen": _instant(one.first_seen)}
        facts |= {"last_seen": _instant(one.last_seen)}
        yield [*(facts[name] for name in FACTS), *(one.rom.get(row.key) for row in rows)]


async def _found(host: Host, model: str | None, label: str | None, q: str | None) -> list[KnownServo]:
    counts = await host.store.run(host.store.snapshots.counts)
    shown = [_shown(host, stored, counts) for stored in host.store.servos.all()]
    found = [
        one
        for one in shown
        if (model is None or one.model == model)
        and (label is None or one.label == label)
        and (q is None or any(q.lower() in text.lower() for text in (one.serial or "", one.label, one.uid)))
    ]
    return sorted(found, key=lambda one: one.last_seen or 0.0, reverse=True)


def _shown(host: Host, stored: StoredServo, snapshots: dict[Uid, int]) -> KnownServo:
    facts, servo = stored.facts, host.fleet.find(stored.uid)
    online = servo is not None and servo.online
    seen = stored.last_seen
    if servo is not None and servo.status_at is not None:
        seen = max(seen or 0.0, host.base.utc(servo.status_at))
    return KnownServo(
        uid=stored.uid,
        label=stored.label,
        model=facts.model,
        serial=stored.serial_text,
        firmware=None if facts.firmware is None else to_text(facts.firmware),
        hardware_version=facts.hardware_version,
        production_date=facts.production_date,
        node_id=servo.node_id if servo is not None and online else facts.node_id,
        servo_id=facts.servo_id,
        first_seen=stored.first_seen,
        last_seen=seen,
        online=online,
        rom=_rom(host, stored),
        snapshots=snapshots.get(stored.uid, 0),
        drift=sorted(drifted(stored) if servo is None or servo.model_number is None else servo.drift),
        notes=stored.notes,
        bench=stored.bench,
        bench_seen_at=None if stored.bench is None else seen,
    )


def _rom(host: Host, stored: StoredServo) -> dict[str, Value]:
    """Engineering values by the servo's model; for an unknown series, by the rows common to all models."""
    model = host.catalog.models.get(stored.facts.model or "")
    rows = host.catalog.readable if model is None else model.rows(stored.facts.firmware)
    return {key: scale.to_value(row, stored.rom[key], stored.rom) for key, row in rows.items() if key in stored.rom}


def _instant(at: float | None) -> str:
    return "" if at is None else datetime.fromtimestamp(at, UTC).isoformat(timespec="seconds")

"""The current tables. Each change needs a migration.

Instants are float seconds since 1970 UTC everywhere in the database.
"""

from typing import Any, TypeAlias

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Float,
    Integer,
    LargeBinary,
    MetaData,
    String,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

_INSTANT = Float(53)
HIGHEST_ID = 2**31 - 1
"""Highest ID of a row."""
_NO_REUSE = {"sqlite_autoincrement": True}


def storable(text: str) -> str:
    """The text with characters that PostgreSQL cannot store (NUL, lone surrogates) replaced by U+FFFD."""
    return text.replace("\0", "\ufffd").encode("utf-16", "surrogatepass").decode("utf-16", "replace")


class Words(TypeDecorator[str]):
    """Text from users and servos. Characters that PostgreSQL cannot store become U+FFFD."""

    impl = String
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: object) -> str | None:
        """The value to send to the database."""
        return None if value is None else storable(value)


class Table(DeclarativeBase):
    """Base of all tables: constraint names, so that migrations find them in any database."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(column_0_label)s",
            "uq": "uq_%(table_name)s_%(column_0_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
        }
    )


class AllocationRow(Table):
    """Node ID allocated to a unique ID on a bench."""

    __tablename__ = "allocations"
    __table_args__ = (UniqueConstraint("bench", "node_id"),)

    bench: Mapped[str] = mapped_column(Words(64), primary_key=True)
    uid: Mapped[str] = mapped_column(Words(32), primary_key=True)
    node_id: Mapped[int] = mapped_column(Integer)
    pinned: Mapped[bool] = mapped_column(Boolean)
    first_seen: Mapped[float | None] = mapped_column(_INSTANT)
    last_seen: Mapped[float | None] = mapped_column(_INSTANT)


class ServoRow(Table):
    """A known servo: nickname, reported data, last known ROM values."""

    __tablename__ = "servos"

    uid: Mapped[str] = mapped_column(Words(32), primary_key=True)
    label: Mapped[str] = mapped_column(Words(200))
    name: Mapped[str | None] = mapped_column(Words(80))
    model: Mapped[str | None] = mapped_column(Words(40))
    model_number: Mapped[int | None] = mapped_column(BigInteger)
    hardware_version: Mapped[int | None] = mapped_column(BigInteger)
    firmware: Mapped[int | None] = mapped_column(BigInteger)
    serial: Mapped[int | None] = mapped_column(BigInteger)
    production_date: Mapped[str | None] = mapped_column(Words(40))
    node_id: Mapped[int | None] = mapped_column(Integer)
    servo_id: Mapped[int | None] = mapped_column(BigInteger)
    bus: Mapped[str | None] = mapped_column(Words(200))
    first_seen: Mapped[float | None] = mapped_column(_INSTANT)
    last_seen: Mapped[float | None] = mapped_column(_INSTANT)
    rom: Mapped[dict[str, int]] = mapped_column(JSON)
    drift: Mapped[dict[str, int] | None] = mapped_column(JSON(none_as_null=True))
    notes: Mapped[str | None] = mapped_column(Words())
    set_up: Mapped[dict[str, Json] | None] = mapped_column(JSON(none_as_null=True))
    bench: Mapped[str | None] = mapped_column(Words(64))


class SettingRow(Table):
    """A setting of a bench, as JSON by name."""

    __tablename__ = "settings"

    bench: Mapped[str] = mapped_column(Words(64), primary_key=True)
    key: Mapped[str] = mapped_column(Words(100), primary_key=True)
    value: Mapped[Json] = mapped_column(JSON, nullable=False)


class SnapshotRow(Table):
    """A snapshot: RAM values and known ROM values, raw by key."""

    __tablename__ = "snapshots"
    __table_args__ = _NO_REUSE  # the ID of a deleted row is not reused

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    uid: Mapped[str] = mapped_column(Words(32), index=True)
    at: Mapped[float] = mapped_column(_INSTANT)
    reason: Mapped[str] = mapped_column(Words(200))
    by: Mapped[str] = mapped_column(Words(80))
    automatic: Mapped[bool] = mapped_column(Boolean)
    model: Mapped[str | None] = mapped_column(Words(40))
    firmware: Mapped[int | None] = mapped_column(BigInteger)
    schema_revision: Mapped[str] = mapped_column(Words(20))
    ram: Mapped[dict[str, int]] = mapped_column(JSON)
    rom: Mapped[dict[str, int]] = mapped_column(JSON)
    reason_code: Mapped[str | None] = mapped_column(Words(40))
    reason_params: Mapped[dict[str, Json] | None] = mapped_column(JSON)
    bench: Mapped[str | None] = mapped_column(Words(64))


class ProfileRow(Table):
    """A profile."""

    __tablename__ = "profiles"

    name: Mapped[str] = mapped_column(Words(80), primary_key=True)
    document: Mapped[dict[str, Json]] = mapped_column(JSON)
    created_at: Mapped[float] = mapped_column(_INSTANT)
    updated_at: Mapped[float] = mapped_column(_INSTANT)
    bench: Mapped[str | None] = mapped_column(Words(64))


class AuditRecord(Table):
    """An audit entry. Rows are added, never changed."""

    __tablename__ = "audit"
    __table_args__ = _NO_REUSE  # the ID of a deleted row is not reused

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    at: Mapped[float] = mapped_column(_INSTANT, index=True)
    by: Mapped[str] = mapped_column(Words(80))
    action: Mapped[str] = mapped_column(Words(40))
    outcome: Mapped[str] = mapped_column(Words(40))
    uid: Mapped[str | None] = mapped_column(Words(32), index=True)
    key: Mapped[str | None] = mapped_column(Words(100))
    before: Mapped[Json] = mapped_column(JSON(none_as_null=True), nullable=True)
    requested: Mapped[Json] = mapped_column(JSON(none_as_null=True), nullable=True)
    after: Mapped[Json] = mapped_column(JSON(none_as_null=True), nullable=True)
    job: Mapped[str | None] = mapped_column(Words(40))
    notes: Mapped[Any] = mapped_column(JSON)
    """List of objects with `code`, `params` and `text`."""
    bench: Mapped[str | None] = mapped_column(Words(64))


class JobRow(Table):
    """A job: its request and its present state (`document`)."""

    __tablename__ = "jobs"

    id: Mapped[str] = mapped_column(Words(40), primary_key=True)
    kind: Mapped[str] = mapped_column(Words(40))
    uid: Mapped[str | None] = mapped_column(Words(32))
    state: Mapped[str] = mapped_column(Words(20))
    created_at: Mapped[float] = mapped_column(_INSTANT, index=True)
    ended_at: Mapped[float | None] = mapped_column(_INSTANT)
    request: Mapped[dict[str, Json] | None] = mapped_column(JSON(none_as_null=True))
    document: Mapped[dict[str, Json]] = mapped_column(JSON)
    bench: Mapped[str | None] = mapped_column(Words(64))


class RunRow(Table):
    """A run: what was measured, and its test conditions."""

    __tablename__ = "runs"
    __table_args__ = _NO_REUSE

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    uid: Mapped[str] = mapped_column(Words(32), index=True)
    at: Mapped[float] = mapped_column(_INSTANT)
    note: Mapped[str] = mapped_column(Words(200))
    document: Mapped[dict[str, Json]] = mapped_column(JSON)
    kind: Mapped[str] = mapped_column(Words(40), server_default="step")
    bench: Mapped[str | None] = mapped_column(Words(64))


class FaultRow(Table):
    """A fault bit that was set at least once."""

    __tablename__ = "faults"

    uid: Mapped[str] = mapped_column(Words(32), primary_key=True)
    key: Mapped[str] = mapped_column(Words(60), primary_key=True)
    first_seen: Mapped[float] = mapped_column(_INSTANT)
    last_seen: Mapped[float] = mapped_column(_INSTANT)
    count: Mapped[int] = mapped_column(Integer)
    active: Mapped[bool] = mapped_column(Boolean)
    acknowledged_at: Mapped[float | None] = mapped_column(_INSTANT)
    acknowledged_by: Mapped[str | None] = mapped_column(Words(80))
    bench: Mapped[str | None] = mapped_column(Words(64))


class TokenRow(Table):
    """An access token. Only its digest is stored."""

    __tablename__ = "tokens"

    name: Mapped[str] = mapped_column(Words(32), primary_key=True)
    role: Mapped[str] = mapped_column(Words(20))
    digest: Mapped[str] = mapped_column(Words(64), unique=True)
    created_at: Mapped[float] = mapped_column(_INSTANT)
    last_used_at: Mapped[float | None] = mapped_column(_INSTANT)
    bench: Mapped[str | None] = mapped_column(Words(64))


class ResponseRow(Table):
    """A request with an Idempotency-Key, both by digest. Without a status it has no response (yet)."""

    __tablename__ = "answers"

    bench: Mapped[str] = mapped_column(Words(64), primary_key=True)
    id: Mapped[str] = mapped_column(Words(64), primary_key=True)
    request: Mapped[str] = mapped_column(Words(64))
    process: Mapped[str] = mapped_column(Words(32))
    at: Mapped[float] = mapped_column(_INSTANT, index=True)
    status: Mapped[int | None] = mapped_column(Integer)
    headers: Mapped[dict[str, str] | None] = mapped_column(JSON(none_as_null=True))
    body: Mapped[bytes | None] = mapped_column(LargeBinary)


class BenchRow(Table):
    """A bench: its server, which holds the lock of the name while `process` is not null, and its last contact."""

    __tablename__ = "benches"

    name: Mapped[str] = mapped_column(Words(64), primary_key=True)
    process: Mapped[str | None] = mapped_column(Words(32))
    machine: Mapped[str] = mapped_column(Words(200))
    pid: Mapped[int] = mapped_column(Integer)
    host: Mapped[str] = mapped_column(Words(200))
    url: Mapped[str | None] = mapped_column(Words(500))
    version: Mapped[str] = mapped_column(Words(40))
    since: Mapped[float] = mapped_column(_INSTANT)
    contact: Mapped[float] = mapped_column(_INSTANT)
    status: Mapped[dict[str, Json]] = mapped_column(JSON)


class RevisionRow(Table):
    """Number of changes of a table that all benches share, so that each notices the changes of others."""

    __tablename__ = "revisions"

    name: Mapped[str] = mapped_column(Words(40), primary_key=True)
    revision: Mapped[int] = mapped_column(BigInteger)


SHARED = ("servos", "profiles", "faults", "tokens")
"""Tables with a row in `revisions`."""

"""The current tables. Each change needs a migration.

Instants are float seconds since 1970 UTC everywhere in the database.
"""

from typing import Any, Final, TypeAlias

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Column,
    Float,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    TypeDecorator,
    UniqueConstraint,
)

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

_INSTANT = Float(53)
HIGHEST_ID = 2**31 - 1
"""Highest ID of a row."""


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


METADATA: Final = MetaData(  # names of constraints, so that migrations find them in any database
    naming_convention={
        "ix": "ix_%(column_0_label)s",
        "uq": "uq_%(table_name)s_%(column_0_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)


def _column(name: str, kind: Any, **options: Any) -> Column[Any]:
    """A column that is never null."""
    return Column(name, kind, nullable=False, **options)


ALLOCATIONS: Final = Table(
    "allocations",
    METADATA,
    Column("bench", Words(64), primary_key=True),
    Column("uid", Words(32), primary_key=True),
    _column("node_id", Integer),
    _column("pinned", Boolean),
    Column("first_seen", _INSTANT),
    Column("last_seen", _INSTANT),
    UniqueConstraint("bench", "node_id"),
)
"""Node ID allocated to a unique ID on a bench."""

SERVOS: Final = Table(
    "servos",
    METADATA,
    Column("uid", Words(32), primary_key=True),
    _column("label", Words(200)),
    Column("name", Words(80)),
    Column("model", Words(40)),
    Column("model_number", BigInteger),
    Column("hardware_version", BigInteger),
    Column("firmware", BigInteger),
    Column("serial", BigInteger),
    Column("production_date", Words(40)),
    Column("node_id", Integer),
    Column("servo_id", BigInteger),
    Column("bus", Words(200)),
    Column("first_seen", _INSTANT),
    Column("last_seen", _INSTANT),
    _column("rom", JSON),
    Column("drift", JSON(none_as_null=True)),
    Column("notes", Words()),
    Column("set_up", JSON(none_as_null=True)),
    Column("bench", Words(64)),
)
"""A known servo: nickname, reported data, last known ROM values."""

SETTINGS: Final = Table(
    "settings",
    METADATA,
    Column("bench", Words(64), primary_key=True),
    Column("key", Words(100), primary_key=True),
    _column("value", JSON),
)
"""A setting of a bench, as JSON by name."""

SNAPSHOTS: Final = Table(
    "snapshots",
    METADATA,
    Column("id", Integer, primary_key=True, autoincrement=True),
    _column("uid", Words(32), index=True),
    _column("at", _INSTANT),
    _column("reason", Words(200)),
    _column("by", Words(80)),
    _column("automatic", Boolean),
    Column("model", Words(40)),
    Column("firmware", BigInteger),
    _column("schema_revision", Words(20)),
    _column("ram", JSON),
    _column("rom", JSON),
    Column("reason_code", Words(40)),
    Column("reason_params", JSON),
    Column("bench", Words(64)),
    sqlite_autoincrement=True,  # the ID of a deleted row is not reused
)
"""A snapshot: RAM values and known ROM values, raw by key."""

PROFILES: Final = Table(
    "profiles",
    METADATA,
    Column("name", Words(80), primary_key=True),
    _column("document", JSON),
    _column("created_at", _INSTANT),
    _column("updated_at", _INSTANT),
    Column("bench", Words(64)),
)
"""A profile."""

AUDIT: Final = Table(
    "audit",
    METADATA,
    Column("id", Integer, primary_key=True, autoincrement=True),
    _column("at", _INSTANT, index=True),
    _column("by", Words(80)),
    _column("action", Words(40)),
    _column("outcome", Words(40)),
    Column("uid", Words(32), index=True),
    Column("key", Words(100)),
    Column("before", JSON(none_as_null=True)),
    Column("requested", JSON(none_as_null=True)),
    Column("after", JSON(none_as_null=True)),
    Column("job", Words(40)),
    _column("notes", JSON),  # list of objects with `code`, `params` and `text`
    Column("bench", Words(64)),
    sqlite_autoincrement=True,  # the ID of a deleted row is not reused
)
"""An audit entry. Rows are added, never changed."""

JOBS: Final = Table(
    "jobs",
    METADATA,
    Column("id", Words(40), primary_key=True),
    _column("kind", Words(40)),
    Column("uid", Words(32)),
    _column("state", Words(20)),
    _column("created_at", _INSTANT, index=True),
    Column("ended_at", _INSTANT),
    Column("request", JSON(none_as_null=True)),
    _column("document", JSON),
    Column("bench", Words(64)),
)
"""A job: its request and its present state (`document`)."""

RUNS: Final = Table(
    "runs",
    METADATA,
    Column("id", Integer, primary_key=True, autoincrement=True),
    _column("uid", Words(32), index=True),
    _column("at", _INSTANT),
    _column("note", Words(200)),
    _column("document", JSON),
    _column("kind", Words(40), server_default="step"),
    Column("bench", Words(64)),
    sqlite_autoincrement=True,  # the ID of a deleted row is not reused
)
"""A run: what was measured, and its test conditions."""

FAULTS: Final = Table(
    "faults",
    METADATA,
    Column("uid", Words(32), primary_key=True),
    Column("key", Words(60), primary_key=True),
    _column("first_seen", _INSTANT),
    _column("last_seen", _INSTANT),
    _column("count", Integer),
    _column("active", Boolean),
    Column("acknowledged_at", _INSTANT),
    Column("acknowledged_by", Words(80)),
    Column("bench", Words(64)),
)
"""A fault bit that was set at least once."""

TOKENS: Final = Table(
    "tokens",
    METADATA,
    Column("name", Words(32), primary_key=True),
    _column("role", Words(20)),
    _column("digest", Words(64), unique=True),
    _column("created_at", _INSTANT),
    Column("last_used_at", _INSTANT),
    Column("bench", Words(64)),
)
"""An access token. Only its digest is stored."""

RESPONSES: Final = Table(
    "answers",
    METADATA,
    Column("bench", Words(64), primary_key=True),
    Column("id", Words(64), primary_key=True),
    _column("request", Words(64)),
    _column("process", Words(32)),
    _column("at", _INSTANT, index=True),
    Column("status", Integer),
    Column("headers", JSON(none_as_null=True)),
    Column("body", LargeBinary),
)
"""A request with an Idempotency-Key, both by digest. Without a status it has no response (yet)."""

BENCHES: Final = Table(
    "benches",
    METADATA,
    Column("name", Words(64), primary_key=True),
    Column("process", Words(32)),
    _column("machine", Words(200)),
    _column("pid", Integer),
    _column("host", Words(200)),
    Column("url", Words(500)),
    _column("version", Words(40)),
    _column("since", _INSTANT),
    _column("contact", _INSTANT),
    _column("status", JSON),
)
"""A bench: its server, which holds the lock of the name while `process` is not null, and its last contact."""

REVISIONS: Final = Table(
    "revisions",
    METADATA,
    Column("name", Words(40), primary_key=True),
    _column("revision", BigInteger),
)
"""Number of changes of a table that all benches share, so that each notices the changes of others."""

SHARED = ("servos", "profiles", "faults", "tokens")
"""Tables with a row in `revisions`."""

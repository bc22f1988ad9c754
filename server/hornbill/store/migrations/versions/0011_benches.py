"""Several benches in one database: what belongs to a bench, who wrote what all share, and their servers."""

import sqlalchemy as sa
from alembic import context, op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

SHARED = ("servos", "snapshots", "profiles", "audit", "runs", "faults", "tokens")
COUNTED = ("servos", "profiles", "faults", "tokens")


def upgrade() -> None:
    """From a database of one bench: everything in it is the opening bench's."""
    bench = context.config.attributes["bench"]
    for table in (*SHARED, "jobs"):
        op.add_column(table, sa.Column("bench", sa.String(64), nullable=True))
        op.execute(sa.text(f"UPDATE {table} SET bench = :bench").bindparams(bench=bench))

    _rebuild("allocations", bench, _bench(), *_allocations(), sa.UniqueConstraint("bench", "node_id", name="uq_allocations_bench"))
    _rebuild("settings", bench, _bench(), *_settings())
    _rebuild("answers", bench, _bench(), *_answers())
    op.create_index("ix_answers_at", "answers", ["at"])
    op.create_table(
        "benches",
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("process", sa.String(32), nullable=True),
        sa.Column("machine", sa.String(200), nullable=False),
        sa.Column("pid", sa.Integer(), nullable=False),
        sa.Column("host", sa.String(200), nullable=False),
        sa.Column("url", sa.String(500), nullable=True),
        sa.Column("version", sa.String(40), nullable=False),
        sa.Column("since", sa.Float(53), nullable=False),
        sa.Column("contact", sa.Float(53), nullable=False),
        sa.Column("status", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_benches"),
    )
    revisions = op.create_table(
        "revisions",
        sa.Column("name", sa.String(40), nullable=False),
        sa.Column("revision", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_revisions"),
    )
    op.bulk_insert(revisions, [{"name": one, "revision": 0} for one in COUNTED])


def downgrade() -> None:
    """Back to one bench: the rows of the opening bench stay."""
    bench = context.config.attributes["bench"]
    op.drop_table("revisions")
    op.drop_table("benches")
    _rebuild("allocations", bench, None, *_allocations(), sa.UniqueConstraint("node_id", name="uq_allocations_node_id"))
    _rebuild("settings", bench, None, *_settings())
    _rebuild("answers", bench, None, *_answers())
    op.create_index("ix_answers_at", "answers", ["at"])
    op.execute(sa.text("DELETE FROM jobs WHERE bench != :bench").bindparams(bench=bench))
    for table in (*SHARED, "jobs"):
        op.drop_column(table, "bench")


def _rebuild(table: str, bench: str, added: sa.Column[str] | None, key: str, *parts: sa.schema.SchemaItem) -> None:
    """Rebuild a table with its rows: SQLite cannot change a primary key. `added`: the column of the bench."""
    names = ", ".join(part.name for part in parts if isinstance(part, sa.Column))
    op.execute(f"CREATE TABLE previous AS SELECT * FROM {table}")
    op.drop_table(table)
    keys = [key] if added is None else ["bench", key]
    columns = [] if added is None else [added]
    op.create_table(table, *columns, *parts, sa.PrimaryKeyConstraint(*keys, name=f"pk_{table}"))
    into, found = (names, names) if added is None else (f"bench, {names}", f":bench, {names}")
    where = " WHERE bench = :bench" if added is None else ""
    op.execute(sa.text(f"INSERT INTO {table} ({into}) SELECT {found} FROM previous{where}").bindparams(bench=bench))
    op.drop_table("previous")


def _allocations() -> tuple[str, *tuple[sa.schema.SchemaItem, ...]]:
    return (
        "uid",
        sa.Column("uid", sa.String(32), nullable=False),
        sa.Column("node_id", sa.Integer(), nullable=False),
        sa.Column("pinned", sa.Boolean(), nullable=False),
        sa.Column("first_seen", sa.Float(53), nullable=True),
        sa.Column("last_seen", sa.Float(53), nullable=True),
    )


def _settings() -> tuple[str, *tuple[sa.schema.SchemaItem, ...]]:
    return "key", sa.Column("key", sa.String(100), nullable=False), sa.Column("value", sa.JSON(), nullable=False)


def _answers() -> tuple[str, *tuple[sa.schema.SchemaItem, ...]]:
    return (
        "id",
        sa.Column("id", sa.String(64), nullable=False),
        sa.Column("request", sa.String(64), nullable=False),
        sa.Column("process", sa.String(32), nullable=False),
        sa.Column("at", sa.Float(53), nullable=False),
        sa.Column("status", sa.Integer(), nullable=True),
        sa.Column("headers", sa.JSON(), nullable=True),
        sa.Column("body", sa.LargeBinary(), nullable=True),
    )


def _bench() -> sa.Column[str]:
    return sa.Column("bench", sa.String(64), nullable=False)

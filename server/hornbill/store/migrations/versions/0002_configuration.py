"""Snapshots, profiles, the audit, jobs, and what a servo's ROM held before it changed under us."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

# What a servo answers is a 64 bit integer, whatever its table says.
RAW = ("model_number", "hardware_version", "firmware", "serial", "servo_id")


def upgrade() -> None:
    """From the first tables."""
    with op.batch_alter_table("servos") as servos:
        servos.add_column(sa.Column("drift", sa.JSON(), nullable=True))
        for column in RAW:
            servos.alter_column(column, existing_type=sa.Integer(), type_=sa.BigInteger(), existing_nullable=True)
    op.create_table(
        "snapshots",
        sa.Column("id", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("uid", sa.String(32), nullable=False),
        sa.Column("at", sa.Float(53), nullable=False),
        sa.Column("reason", sa.String(200), nullable=False),
        sa.Column("by", sa.String(80), nullable=False),
        sa.Column("automatic", sa.Boolean(), nullable=False),
        sa.Column("model", sa.String(40), nullable=True),
        sa.Column("firmware", sa.BigInteger(), nullable=True),
        sa.Column("schema_revision", sa.String(20), nullable=False),
        sa.Column("ram", sa.JSON(), nullable=False),
        sa.Column("rom", sa.JSON(), nullable=False),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_snapshots_uid", "snapshots", ["uid"])
    op.create_table(
        "profiles",
        sa.Column("name", sa.String(80), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("created_at", sa.Float(53), nullable=False),
        sa.Column("updated_at", sa.Float(53), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_profiles"),
    )
    op.create_table(
        "audit",
        sa.Column("id", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("at", sa.Float(53), nullable=False),
        sa.Column("by", sa.String(80), nullable=False),
        sa.Column("action", sa.String(40), nullable=False),
        sa.Column("outcome", sa.String(40), nullable=False),
        sa.Column("uid", sa.String(32), nullable=True),
        sa.Column("key", sa.String(100), nullable=True),
        sa.Column("before", sa.JSON(), nullable=True),
        sa.Column("requested", sa.JSON(), nullable=True),
        sa.Column("after", sa.JSON(), nullable=True),
        sa.Column("detail", sa.String(), nullable=False),
        sa.Column("job", sa.String(40), nullable=True),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_audit_uid", "audit", ["uid"])
    op.create_index("ix_audit_at", "audit", ["at"])
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(40), nullable=False),
        sa.Column("kind", sa.String(40), nullable=False),
        sa.Column("uid", sa.String(32), nullable=True),
        sa.Column("state", sa.String(20), nullable=False),
        sa.Column("created_at", sa.Float(53), nullable=False),
        sa.Column("ended_at", sa.Float(53), nullable=True),
        sa.Column("request", sa.JSON(), nullable=True),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_jobs"),
    )
    op.create_index("ix_jobs_created_at", "jobs", ["created_at"])


def downgrade() -> None:
    """Back to the first tables."""
    for table in ("jobs", "audit", "profiles", "snapshots"):
        op.drop_table(table)
    with op.batch_alter_table("servos") as servos:
        servos.drop_column("drift")
        for column in RAW:
            servos.alter_column(column, existing_type=sa.BigInteger(), type_=sa.Integer(), existing_nullable=True)

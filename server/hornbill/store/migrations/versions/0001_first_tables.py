"""The first tables: allocations, servos, settings."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """From an empty database."""
    op.create_table(
        "allocations",
        sa.Column("uid", sa.String(32), nullable=False),
        sa.Column("node_id", sa.Integer(), nullable=False),
        sa.Column("pinned", sa.Boolean(), nullable=False),
        sa.Column("first_seen", sa.Float(53), nullable=True),
        sa.Column("last_seen", sa.Float(53), nullable=True),
        sa.PrimaryKeyConstraint("uid", name="pk_allocations"),
        sa.UniqueConstraint("node_id", name="uq_allocations_node_id"),
    )
    op.create_table(
        "servos",
        sa.Column("uid", sa.String(32), nullable=False),
        sa.Column("label", sa.String(200), nullable=False),
        sa.Column("name", sa.String(80), nullable=True),
        sa.Column("model", sa.String(40), nullable=True),
        sa.Column("model_number", sa.Integer(), nullable=True),
        sa.Column("hardware_version", sa.Integer(), nullable=True),
        sa.Column("firmware", sa.Integer(), nullable=True),
        sa.Column("serial", sa.Integer(), nullable=True),
        sa.Column("production_date", sa.String(40), nullable=True),
        sa.Column("node_id", sa.Integer(), nullable=True),
        sa.Column("servo_id", sa.Integer(), nullable=True),
        sa.Column("bus", sa.String(200), nullable=True),
        sa.Column("first_seen", sa.Float(53), nullable=True),
        sa.Column("last_seen", sa.Float(53), nullable=True),
        sa.Column("rom", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("uid", name="pk_servos"),
    )
    op.create_table(
        "settings",
        sa.Column("key", sa.String(100), nullable=False),
        sa.Column("value", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("key", name="pk_settings"),
    )


def downgrade() -> None:
    """Back to an empty database."""
    for table in ("settings", "servos", "allocations"):
        op.drop_table(table)

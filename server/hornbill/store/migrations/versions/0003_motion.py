"""What was measured of a servo's motion, and the history of its fault bits."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """From the tables of configuration."""
    op.create_table(
        "runs",
        sa.Column("id", sa.Integer(), primary_key=True, autoincrement=True),
        sa.Column("uid", sa.String(32), nullable=False),
        sa.Column("at", sa.Float(53), nullable=False),
        sa.Column("note", sa.String(200), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_runs_uid", "runs", ["uid"])
    op.create_table(
        "faults",
        sa.Column("uid", sa.String(32), nullable=False),
        sa.Column("key", sa.String(60), nullable=False),
        sa.Column("first_seen", sa.Float(53), nullable=False),
        sa.Column("last_seen", sa.Float(53), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("active", sa.Boolean(), nullable=False),
        sa.Column("acknowledged_at", sa.Float(53), nullable=True),
        sa.Column("acknowledged_by", sa.String(80), nullable=True),
        sa.PrimaryKeyConstraint("uid", "key", name="pk_faults"),
    )


def downgrade() -> None:
    """Back to the tables of configuration."""
    for table in ("faults", "runs"):
        op.drop_table(table)

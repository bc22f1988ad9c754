"""Set-up of a servo, and kinds of runs."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """From runs that are step tests, with a free note instead of a set-up."""
    op.add_column("servos", sa.Column("set_up", sa.JSON(), nullable=True))
    op.add_column("runs", sa.Column("kind", sa.String(length=40), nullable=False, server_default="step"))


def downgrade() -> None:
    """Back to step tests alone."""
    op.execute("DELETE FROM runs WHERE kind != 'step'")
    op.drop_column("runs", "kind")
    op.drop_column("servos", "set_up")

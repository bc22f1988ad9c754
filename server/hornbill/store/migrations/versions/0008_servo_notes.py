"""What people write down about a servo."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """From servos that have a nickname alone."""
    op.add_column("servos", sa.Column("notes", sa.String(), nullable=True))


def downgrade() -> None:
    """Back to the nickname alone."""
    op.drop_column("servos", "notes")

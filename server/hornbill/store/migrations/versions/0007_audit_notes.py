"""Details of the audit as notes, each a code with its values; those of older rows as the text they were."""

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_AUDIT = sa.table(
    "audit", sa.column("id", sa.Integer), sa.column("action", sa.String), sa.column("detail", sa.String),
    sa.column("requested", sa.JSON(none_as_null=True)), sa.column("notes", sa.JSON),
)  # fmt: skip
_BATCH = 1000
_KEPT = {"sqlite_autoincrement": True}


def upgrade() -> None:
    """From rows whose detail is text, and the reason of a snapshot a requested value."""
    op.add_column("audit", sa.Column("notes", sa.JSON(), nullable=False, server_default="[]"))
    connection = op.get_bind()
    change = (
        sa.update(_AUDIT)
        .where(_AUDIT.c.id == sa.bindparam("row"))
        .values(notes=sa.bindparam("said"), requested=sa.bindparam("wanted"))
    )
    for rows in _rows(_AUDIT.c.detail != ""):
        connection.execute(change, [_noted(*row) for row in rows])
    with op.batch_alter_table("audit", table_kwargs=_KEPT) as audit:
        audit.alter_column("notes", existing_type=sa.JSON(), existing_nullable=False, server_default=None)
        audit.drop_column("detail")


def downgrade() -> None:
    """Back to the text alone."""
    op.add_column("audit", sa.Column("detail", sa.String(), nullable=False, server_default=""))
    connection = op.get_bind()
    change = sa.update(_AUDIT).where(_AUDIT.c.id == sa.bindparam("row")).values(detail=sa.bindparam("said"))
    for rows in _rows(sa.true()):
        texts = ({"row": row[0], "said": " ".join(one["text"] for one in row[4])} for row in rows)
        connection.execute(change, list(texts))
    with op.batch_alter_table("audit", table_kwargs=_KEPT) as audit:
        audit.alter_column("detail", existing_type=sa.String(), existing_nullable=False, server_default=None)
        audit.drop_column("notes")


def _rows(where: sa.ColumnElement[bool]) -> Any:
    """Rows a batch at a time, so that a long audit does not fill the memory."""
    connection, last = op.get_bind(), 0
    while True:
        asked = sa.select(_AUDIT).where(_AUDIT.c.id > last, where).order_by(_AUDIT.c.id).limit(_BATCH)
        rows = connection.execute(asked).all()
        if not rows:
            return
        yield rows
        last = rows[-1][0]


def _noted(row: int, action: str, detail: str, requested: Any, _notes: Any) -> dict[str, Any]:
    if action == "snapshot" and isinstance(requested, dict) and "reason" in requested:
        return {"row": row, "said": [{"code": "reason", "params": requested, "text": detail}], "wanted": None}
    return {"row": row, "said": [{"code": "text", "params": {}, "text": detail}], "wanted": requested}

"""Reasons of snapshots as a code with its values; those of older snapshots from their English text."""

import json
import re

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

_FIXED = {
    "by hand": "by_hand",
    "before saving": "saving",
    "before factory reset": "factory_reset",
    "before drift is undone": "drift_undone",
    "commissioning": "commissioning",
    "matrix": "matrix",
}
_CHANGE = re.compile(r"before a change of (\w+)(?: and (\d+) more)?")
_PROFILE = re.compile(r"profile (.+)")
_RESTORE = re.compile(r"restore of snapshot (\d+)")


def upgrade() -> None:
    """From snapshots whose reason is text alone."""
    op.add_column("snapshots", sa.Column("reason_code", sa.String(40), nullable=True))
    op.add_column("snapshots", sa.Column("reason_params", sa.JSON(), nullable=True))
    connection = op.get_bind()
    change = sa.text("UPDATE snapshots SET reason_code = :code, reason_params = :params WHERE reason = :reason")
    for (reason,) in connection.execute(sa.text("SELECT DISTINCT reason FROM snapshots")).all():
        code, params = _coded(reason)
        if code is not None:
            connection.execute(change, {"code": code, "params": json.dumps(params), "reason": reason})


def downgrade() -> None:
    """Back to the text alone."""
    op.drop_column("snapshots", "reason_params")
    op.drop_column("snapshots", "reason_code")


def _coded(reason: str) -> tuple[str | None, dict[str, object]]:
    if found := _CHANGE.fullmatch(reason):
        return "change", {"key": found[1], "more": int(found[2] or 0)}
    if found := _PROFILE.fullmatch(reason):
        return "profile", {"profile": found[1]}
    if found := _RESTORE.fullmatch(reason):
        return "restore", {"side": f"snapshot {found[1]}", "snapshot": int(found[1])}
    return _FIXED.get(reason), {}

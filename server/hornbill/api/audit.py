"""Owns the routes of the audit: who did what, newest first, as JSON and as a file for a spreadsheet."""

import asyncio
import csv
import io
import json
from collections.abc import AsyncIterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import StreamingResponse

from hornbill.api import PREFIX
from hornbill.api.config_models import AuditRow
from hornbill.api.dependencies import TheHost
from hornbill.api.models import UidField
from hornbill.api.problems import declared
from hornbill.servo.configuration.comparing import HIGHEST_ID
from hornbill.servo.host import Host
from hornbill.store.audit import AuditEntry
from hornbill.units import Uid

router = APIRouter(prefix=PREFIX, tags=["audit"])

PAGE = 1000
COLUMNS = ("id", "time", "by", "action", "outcome", "uid", "key", "before", "requested", "after", "detail", "job")
_FORMULA = ("=", "+", "-", "@", "\t", "\r")

Word = Annotated[str | None, Query(max_length=100, pattern=r"^[a-z][a-z0-9_]*$")]


@dataclass(frozen=True, slots=True)
class _Filter:
    uid: Uid | None
    key: str | None
    action: str | None
    since: float | None
    before_id: int | None

    def rows(self, host: Host, limit: int, before_id: int | None) -> list[AuditEntry]:
        return host.store.audit.rows(
            uid=self.uid, key=self.key, action=self.action, since=self.since, before_id=before_id, limit=limit
        )


async def _filter(
    uid: Annotated[UidField | None, Query(description="only what was done to this servo")] = None,
    key: Word = None,
    action: Word = None,
    since: Annotated[
        float | None, Query(ge=0, le=1e12, allow_inf_nan=False, description="seconds since 1970 UTC")
    ] = None,
    before_id: Annotated[
        int | None, Query(ge=1, le=HIGHEST_ID, description="only rows before this one: the last of an earlier answer")
    ] = None,
) -> _Filter:
    return _Filter(None if uid is None else Uid(uid), key, action, since, before_id)


TheFilter = Annotated[_Filter, Depends(_filter)]


@router.get("/audit", operation_id="list_audit", responses=declared("invalid_value"))
async def list_audit(
    host: TheHost, wanted: TheFilter, limit: Annotated[int, Query(ge=1, le=PAGE)] = 200
) -> list[AuditRow]:
    """Who did what to which servo, with what came of it, newest first. Rows are added, never changed."""
    return [_row(one) for one in wanted.rows(host, limit, wanted.before_id)]


@router.get(
    "/audit.csv",
    operation_id="download_audit",
    response_class=StreamingResponse,
    responses={
        200: {"content": {"text/csv": {}}, "description": "every row, newest first"},
        **declared("invalid_value"),
    },
)
async def download_audit(host: TheHost, wanted: TheFilter) -> StreamingResponse:
    """The same as a file, with every row there is of what is asked for. Times are ISO 8601 in UTC."""
    headers = {"Content-Disposition": 'attachment; filename="hornbill-audit.csv"'}
    return StreamingResponse(_lines(host, wanted), media_type="text/csv; charset=utf-8", headers=headers)


async def _lines(host: Host, wanted: _Filter) -> AsyncIterator[str]:
    """A page of rows at a time, so that the loop does other things in between."""
    yield _csv([COLUMNS])
    before_id = wanted.before_id
    while rows := wanted.rows(host, PAGE, before_id):
        yield _csv([_cells(one) for one in rows])
        before_id = rows[-1].id
        await asyncio.sleep(0)


def _csv(rows: list[tuple[str, ...]]) -> str:
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue()


def _cells(row: AuditEntry) -> tuple[str, ...]:
    one = row.entry
    at = datetime.fromtimestamp(row.at, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    values = [_cell(value) for value in (one.before, one.requested, one.after)]
    return (
        str(row.id), at, _cell(one.by), one.action, one.outcome, one.uid or "", one.key or "", *values,
        _cell(one.detail), one.job or "",
    )  # fmt: skip


def _cell(value: object) -> str:
    """A value as text. What somebody typed must not become a formula in a spreadsheet."""
    if value is None:
        return ""
    if not isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return f"'{value}" if value.startswith(_FORMULA) else value


def _row(one: AuditEntry) -> AuditRow:
    entry = one.entry
    return AuditRow(
        id=one.id, at=one.at, by=entry.by, action=entry.action, outcome=entry.outcome, uid=entry.uid, key=entry.key,
        before=entry.before, requested=entry.requested, after=entry.after, detail=entry.detail, job=entry.job,
    )  # fmt: skip

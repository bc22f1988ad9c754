"""Routes of the audit, as JSON and as CSV."""

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Depends, Query
from pydantic import Field
from starlette.responses import StreamingResponse

from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import TheHost
from hornbill.api.downloads import CSV, attachment
from hornbill.api.paging import Page, pages
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.csv_text import csv_text
from hornbill.domain.fields import Model, Utc
from hornbill.domain.note import Note
from hornbill.servo.host import Host
from hornbill.servo.profiles.comparing import HIGHEST_ID
from hornbill.store.audit import AuditEntry
from hornbill.units import Uid

routes = Routes("audit")


class AuditRow(Model):
    """One action and its result. Values are in engineering units."""

    id: int = Field(description="ID, as used in paths.")
    at: Utc
    bench: str | None = Field(description="Bench on which it happened. Null if unknown.")
    by: str = Field(description="Client that did it.")
    action: str = Field(description="Action, such as `write` or `save`.")
    outcome: str = Field(description="Result of the action.")
    uid: str | None = Field(description="Unique ID of the servo, 32 hex digits. Null if it concerns none.")
    key: str | None = Field(description="Parameter key. Null if the action concerns no row.")
    before: Any = Field(default=None, description="Value before. Null if none.")
    requested: Any = Field(default=None, description="Requested value. Null if none.")
    after: Any = Field(default=None, description="Value afterwards. Null if none or unknown.")
    detail: str = Field(description="Notes as one text, in English.")
    notes: list[Note] = Field(description="Details, each with a code for programs.")
    job: str | None = Field(description="ID of the job that it was part of. Null if none.")


PAGE = 1000
COLUMNS = ("id", "time", "by", "action", "outcome", "uid", "key", "before", "requested", "after", "detail", "job")

WORD = r"^[a-z][a-z0-9_]*$"


@dataclass(frozen=True, slots=True)
class _Filter:
    uid: Uid | None
    key: str | None
    action: str | None
    since: float | None
    before_id: int | None

    async def rows(self, host: Host, limit: int, before_id: int | None) -> list[AuditEntry]:
        return await host.store.run(
            host.store.audit.rows, uid=self.uid, key=self.key, action=self.action, since=self.since,
            before_id=before_id, limit=limit,
        )  # fmt: skip


async def _filter(
    _host: TheHost,
    uid: Annotated[ServoRef | None, Query(description="Servo of the rows.")] = None,
    key: Annotated[str | None, Query(max_length=100, pattern=WORD, description="Parameter key.")] = None,
    action: Annotated[str | None, Query(max_length=100, pattern=WORD, description="Action of the rows.")] = None,
    since: Annotated[
        float | None, Query(ge=0, le=1e12, allow_inf_nan=False, description="Earliest time, seconds since 1970 UTC.")
    ] = None,
    before_id: Annotated[
        int | None, Query(ge=1, le=HIGHEST_ID, description="Rows before this ID, for the next page.")
    ] = None,
) -> _Filter:
    return _Filter(None if uid is None else Uid(uid), key, action, since, before_id)


TheFilter = Annotated[_Filter, Depends(_filter)]


@routes.get("/audit", Role.VIEW, "unknown_servo", "invalid_value")
async def list_audit(
    host: TheHost,
    wanted: TheFilter,
    page: Annotated[Page, pages(200, PAGE)],
) -> list[AuditRow]:
    """List audit rows, newest first. Rows are never changed."""
    before = min((one for one in (page.before_id, wanted.before_id) if one is not None), default=None)
    rows = await wanted.rows(host, page.limit + 1, before)
    return [_row(one) for one in page.cut(rows, lambda one: one.id)]


@routes.get(
    "/audit.csv",
    Role.VIEW,
    "unknown_servo",
    "invalid_value",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/csv": {}}, "description": "All matching rows, newest first."}},
)
async def download_audit(host: TheHost, wanted: TheFilter) -> StreamingResponse:
    """Download all matching audit rows as CSV. Times are ISO 8601 in UTC."""
    return StreamingResponse(_lines(host, wanted), media_type=CSV, headers=attachment("hornbill-audit.csv"))


async def _lines(host: Host, wanted: _Filter) -> AsyncIterator[str]:
    """CSV, one page of rows at a time, so that the event loop is not blocked."""
    yield csv_text([COLUMNS])
    before_id = wanted.before_id
    while rows := await wanted.rows(host, PAGE, before_id):
        yield csv_text(map(_cells, rows))
        before_id = rows[-1].id
        await asyncio.sleep(0)


def _cells(row: AuditEntry) -> tuple[object, ...]:
    one = row.entry
    at = datetime.fromtimestamp(row.at, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    values = [_value(value) for value in (one.before, one.requested, one.after)]
    return row.id, at, one.by, one.action, one.outcome, one.uid, one.key, *values, one.detail, one.job


def _value(value: object) -> object:
    """Lists and objects as JSON."""
    return json.dumps(value, ensure_ascii=False) if isinstance(value, list | dict) else value


def _row(one: AuditEntry) -> AuditRow:
    return AuditRow(id=one.id, at=one.at, bench=one.bench, detail=one.entry.detail, **asdict(one.entry))

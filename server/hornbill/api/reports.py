"""Owns the route of reports: what a job did, servo by servo, as a file or as a page to print."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query
from starlette.responses import Response

from hornbill.api import PREFIX
from hornbill.api.dependencies import TheHost
from hornbill.api.problems import declared
from hornbill.servo.configuration.report import report
from hornbill.servo.configuration.report_formats import as_csv, as_json, as_junit
from hornbill.servo.configuration.report_page import as_html

router = APIRouter(prefix=PREFIX, tags=["jobs"])

Format = Annotated[
    Literal["csv", "json", "junit", "html"],
    Query(description="csv: one row a servo; junit: one test case a servo and step; html: a page to print"),
]

HTML_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
"""The page needs nothing but its own style, so nothing else is allowed to it."""


@router.get(
    "/jobs/{job_id}/report",
    operation_id="get_report",
    response_class=Response,
    responses={
        **declared("unknown_job", "invalid_value"),
        200: {
            "description": "the report",
            "content": {"text/csv": {}, "application/json": {}, "application/xml": {}, "text/html": {}},
        },
    },
)
async def get_report(host: TheHost, job_id: str, format: Format = "json") -> Response:
    """The report of any job, under way or ended, also before the server was started or of servos that are gone."""
    made = report(host.jobs.get(job_id), host.store.servos.get, host.catalog)
    if format == "html":
        safe = {"Content-Security-Policy": HTML_POLICY, "X-Content-Type-Options": "nosniff"}
        return Response(as_html(made, host.catalog), media_type="text/html; charset=utf-8", headers=safe)
    text, kind, ending = {
        "csv": lambda: (as_csv(made, host.catalog), "text/csv; charset=utf-8", "csv"),
        "json": lambda: (as_json(made), "application/json", "json"),
        "junit": lambda: (as_junit(made), "application/xml; charset=utf-8", "xml"),
    }[format]()
    offered = {"Content-Disposition": f'attachment; filename="{made.filename}.{ending}"'}
    return Response(text.encode(errors="replace"), media_type=kind, headers=offered)

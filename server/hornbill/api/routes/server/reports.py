"""Route of job reports, as a file or a printable page."""

from typing import Annotated, Literal

from fastapi import Query
from starlette.responses import Response

from hornbill.api.dependencies import JobId, TheHost
from hornbill.api.downloads import CSV, attachment
from hornbill.api.reports.data_forms import as_csv, as_json
from hornbill.api.reports.html_form import as_html
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.servo.runs.report import report

routes = Routes("jobs")

Format = Annotated[
    Literal["csv", "json", "junit", "html"],
    Query(description="csv: one row per servo; junit: one test case per servo and step; html: printable page."),
]

HTML_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
"""The page needs only its inline style."""


@routes.get(
    "/jobs/{job_id}/report",
    Role.VIEW,
    "unknown_job",
    "invalid_value",
    response_class=Response,
    responses={
        200: {
            "description": "Report.",
            "content": {"text/csv": {}, "application/json": {}, "application/xml": {}, "text/html": {}},
        }
    },
)
async def get_report(host: TheHost, job_id: JobId, format: Format = "json") -> Response:
    """Get the report of a job, running or ended, including jobs before the server was started."""
    made = report(host.jobs.get(job_id), host.store.servos.get)
    if format == "html":
        safe = {"Content-Security-Policy": HTML_POLICY, "X-Content-Type-Options": "nosniff"}
        return Response(as_html(made, host.catalog), media_type="text/html; charset=utf-8", headers=safe)
    from hornbill.api.reports.junit_form import as_junit  # late: XML takes 5 ms, and few servers report to test systems

    text, kind, ending = {
        "csv": lambda: (as_csv(made, host.catalog), CSV, "csv"),
        "json": lambda: (as_json(made), "application/json", "json"),
        "junit": lambda: (as_junit(made), "application/xml; charset=utf-8", "xml"),
    }[format]()
    return Response(text.encode(errors="replace"), media_type=kind, headers=attachment(f"{made.filename}.{ending}"))

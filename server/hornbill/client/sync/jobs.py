"""Jobs and their reports."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection


class Jobs:
    """Jobs of the server, as `hornbill.jobs`. To wait for a job, use `hornbill.wait`."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._request = connection.request

    def all(self, *, kind: str | None = None, state: str | None = None, uid: str | None = None) -> list[responses.Job]:
        """Running and recently ended jobs, newest first."""
        return self._request("GET", "/jobs", kind=kind, state=state, uid=uid)

    def get(self, job: str) -> responses.Job:
        """One job."""
        return self._request("GET", f"/jobs/{job}")

    def cancel(self, job: str) -> responses.Job:
        """Cancel a job. Steps already carried out are not undone."""
        return self._request("DELETE", f"/jobs/{job}")

    def resume(self, job: str) -> responses.Job:
        """Resume a `resumable` job. Returns immediately."""
        return self._request("POST", f"/jobs/{job}/resume")

    def report(self, job: str, form: Literal["csv", "json", "junit", "html"] = "json") -> str:
        """Report of a job. csv: one row per servo; junit: one test case per servo and step; html: printable page."""
        return (self._connection.download(f"/jobs/{job}/report", format=form)).decode()

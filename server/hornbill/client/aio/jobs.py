"""Jobs and their reports."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.aio.connection import AsyncConnection


class AsyncJobs:
    """Jobs of the server, as `hornbill.jobs`. To wait for a job, use `hornbill.wait`."""

    def __init__(self, connection: AsyncConnection) -> None:
        self._connection = connection
        self._request = connection.request

    async def all(
        self, *, kind: str | None = None, state: str | None = None, uid: str | None = None
    ) -> list[responses.Job]:
        """Running and recently ended jobs, newest first."""
        return await self._request("GET", "/jobs", kind=kind, state=state, uid=uid)

    async def get(self, job: str) -> responses.Job:
        """One job."""
        return await self._request("GET", f"/jobs/{job}")

    async def cancel(self, job: str) -> responses.Job:
        """Cancel a job. Steps already carried out are not undone."""
        return await self._request("DELETE", f"/jobs/{job}")

    async def resume(self, job: str) -> responses.Job:
        """Resume a `resumable` job. Returns immediately."""
        return await self._request("POST", f"/jobs/{job}/resume")

    async def report(self, job: str, form: Literal["csv", "json", "junit", "html"] = "json") -> str:
        """Report of a job. csv: one row per servo; junit: one test case per servo and step; html: printable page."""
        return (await self._connection.download(f"/jobs/{job}/report", format=form)).decode()

"""What takes time, under way and done, and its report."""

from typing import TYPE_CHECKING, Literal

from hornbill.client import answers

if TYPE_CHECKING:
    from hornbill.client.aio.connection import AsyncConnection


class AsyncJobs:
    """Jobs of the server; `hornbill.jobs`. To wait for one: `hornbill.wait`."""

    def __init__(self, connection: "AsyncConnection") -> None:
        self._connection = connection
        self._ask = connection.ask

    async def all(
        self, *, kind: str | None = None, state: str | None = None, uid: str | None = None
    ) -> list[answers.Job]:
        """Jobs under way and the last ones that ended, the oldest first."""
        return await self._ask("GET", "/jobs", kind=kind, state=state, uid=uid)

    async def get(self, job: str) -> answers.Job:
        """One job by its id."""
        return await self._ask("GET", f"/jobs/{job}")

    async def cancel(self, job: str) -> answers.Job:
        """Cancel a job. What it already sent to the servo stays sent."""
        return await self._ask("DELETE", f"/jobs/{job}")

    async def resume(self, job: str) -> answers.Job:
        """Go on with a job that is `resumable`; answers at once."""
        return await self._ask("POST", f"/jobs/{job}/resume")

    async def report(self, job: str, form: Literal["csv", "json", "junit", "html"] = "json") -> str:
        """What it did, servo by servo: csv one row a servo, junit one test case a servo and step, html to print."""
        return (await self._connection.download(f"/jobs/{job}/report", format=form)).decode()

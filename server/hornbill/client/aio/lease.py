"""Motion control for the length of a block."""

from types import TracebackType
from typing import Self

from hornbill.client import answers
from hornbill.client.aio.connection import AsyncConnection
from hornbill.client.beating import AsyncBeat
from hornbill.errors import HornbillError, LeaseRequired, Unknown


class AsyncLease:
    """Motion control from the start of the block to its end, whatever ends it: then torque goes off on what was moved.

    While it lasts, everything its client asks for carries it. `lost` says why it ended early, if it did.
    """

    def __init__(
        self, connection: AsyncConnection, holder: str, ttl_s: float, *, beat: bool, force: bool, reason: str
    ) -> None:
        """`ttl_s`: the server waits so long for a sign of life, 0.2 to 60 s; `beat` gives one every third of that."""
        self._connection = connection
        self._ttl_s = ttl_s
        self._wanted = {"holder": holder, "ttl_s": ttl_s, "force": force, "reason": reason}
        self._beat = AsyncBeat(self._renewed, ttl_s / 3) if beat else None
        self.id: str | None = None
        self.lost: str | None = None

    async def __aenter__(self) -> Self:
        """Take it. Raises LeaseHeld, with `holder` and `expires_in_s`, when somebody else has it."""
        taken: answers.Lease = await self._connection.ask("POST", "/leases", self._wanted, once=True)
        self.id = self._connection.lease_id = taken["id"]
        if self._beat is not None:
            self._beat.start()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give it back. Raises LeaseRequired when it was lost on the way, unless the block failed already."""
        if self._beat is not None:
            await self._beat.stop()
        self._connection.lease_id = None
        try:
            if self.lost is None:
                await self._connection.ask("DELETE", f"/leases/{self.id}")
        except Unknown as gone:
            self.lost = gone.detail
        except HornbillError:
            if error is None:
                raise
        if self.lost is not None and error is None:
            raise LeaseRequired(f"Motion control was lost before the end of the block. {self.lost}", cause=None)

    async def renew(self) -> answers.Lease:
        """A sign of life by hand. Raises Unknown when it has ended."""
        return await self._connection.ask("PUT", f"/leases/{self.id}", timeout_s=max(1.0, self._ttl_s))

    async def _renewed(self) -> bool:
        try:
            await self.renew()
        except Unknown as gone:
            self.lost = gone.detail
            return False
        except HornbillError:
            return True  # no answer, or a server in trouble: it may be back in time
        return True

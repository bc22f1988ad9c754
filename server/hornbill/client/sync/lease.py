"""Lease (motion control) as a context manager."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self

from hornbill.client.heartbeat import Heartbeat
from hornbill.client.sync.connection import Connection
from hornbill.errors import HornbillError, LeaseRequired, Unknown

if TYPE_CHECKING:
    from hornbill.client import responses


class Lease:
    """Lease for the duration of a block. At its end, torque goes off on the servos that were moved.

    All requests of the client include the lease. `lost`: reason why it ended early, None if it did not.
    """

    def __init__(
        self,
        connection: Connection,
        holder: str,
        ttl_s: float,
        *,
        uids: Sequence[str] | None,
        heartbeat: bool,
        force: bool,
        reason: str,
    ) -> None:
        """`uids`: servos to control, None for all.

        `ttl_s`: time to live from each renewal, 0.2 to 60 s. `heartbeat`: renew it as often as the server says.
        """
        self._connection = connection
        self._ttl_s = ttl_s
        self._wanted: dict[str, object] = {"holder": holder, "ttl_s": ttl_s, "force": force, "reason": reason}
        if uids is not None:
            self._wanted["uids"] = list(uids)
        self._heartbeat = Heartbeat(self._renewed, ttl_s / 3) if heartbeat else None
        self.id: str | None = None
        self.lost: str | None = None

    def __enter__(self) -> Self:
        """Take the lease. Raises LeaseHeld, with `holder` and `expires_in_s`, if another client has it."""
        taken: responses.Lease = self._connection.request("POST", "/leases", self._wanted, once=True)
        self.id = self._connection.lease_id = taken["id"]
        if self._heartbeat is not None:
            self._heartbeat.every_s = taken.get("heartbeat_s", self._ttl_s / 3)
            self._heartbeat.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release the lease. Raises LeaseRequired if it was lost, unless the block already failed."""
        if self._heartbeat is not None:
            self._heartbeat.stop()
        self._connection.lease_id = None
        try:
            if self.lost is None:
                self._connection.request("DELETE", f"/leases/{self.id}")
        except Unknown as gone:
            self.lost = gone.detail
        except HornbillError:
            if error is None:
                raise
        if self.lost is not None and error is None:
            raise LeaseRequired(f"Motion control was lost before the end of the block. {self.lost}", cause=None)

    def renew(self, add: Sequence[str] = ()) -> responses.Lease:
        """Renew the lease, and add these servos to it. Raises Unknown if it has ended, LeaseHeld."""
        body = {"uids": list(add)} if add else None
        return self._connection.request("PUT", f"/leases/{self.id}", body, timeout_s=max(1.0, self._ttl_s))

    def _renewed(self) -> bool:
        try:
            self.renew()
        except Unknown as gone:
            self.lost = gone.detail
            return False
        except HornbillError:
            return True  # the server may respond again in time
        return True

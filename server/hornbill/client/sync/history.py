"""Snapshots and drift of one servo."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeVar

from hornbill.client.problems import raised

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection

Done = TypeVar("Done", "responses.Restored", "responses.ParametersPatched")


class History:
    """Snapshots and drift of one servo, as `servo.history`. Identity rows (0x44 to 0x46) are excluded by default."""

    def __init__(self, connection: Connection, uid: str) -> None:
        self._request = connection.request
        self._path = f"/servos/{uid}"

    def snapshots(self) -> list[responses.Snapshot]:
        """All snapshots, newest first. One is taken before every change."""
        return self._request("GET", f"{self._path}/snapshots")

    def snapshot(self, number: int) -> responses.Snapshot:
        """One snapshot."""
        return self._request("GET", f"{self._path}/snapshots/{number}")

    def take(self, reason: str = "manual") -> responses.Snapshot:
        """Take a snapshot, read from the servo (section 4.11: 0x20 to 0x46). It is stored until deleted."""
        return self._request("POST", f"{self._path}/snapshots", {"reason": reason})

    def delete(self, number: int) -> None:
        """Delete a snapshot."""
        self._request("DELETE", f"{self._path}/snapshots/{number}")

    def restore(
        self,
        number: int,
        *,
        source: Literal["ram", "rom"] = "ram",
        keys: Sequence[str] | None = None,
        identity: bool = False,
        dry_run: bool = False,
        save: bool = False,
        confirm: Sequence[str] = (),
    ) -> responses.Restored:
        """Write the values of a snapshot, all rows or `keys`, all or nothing.

        `save` starts a save job, returned as `job`. On failure the old values are restored and the error is raised.
        """
        body: dict[str, object] = {"source": source, **_rows(keys, identity, dry_run, save, confirm)}
        done: responses.Restored = self._request("POST", f"{self._path}/snapshots/{number}/restore", body)
        return _checked(done)

    def copy(
        self,
        side: str,
        *,
        keys: Sequence[str] | None = None,
        identity: bool = False,
        dry_run: bool = False,
        save: bool = False,
        confirm: Sequence[str] = (),
    ) -> responses.Restored:
        """Write values from another side: servo:UID, rom:UID, snapshot:ID, profile:NAME, default:MODEL."""
        body: dict[str, object] = {"from": side, **_rows(keys, identity, dry_run, save, confirm)}
        done: responses.Restored = self._request("POST", f"{self._path}/copy", body)
        return _checked(done)

    def drift(self) -> responses.Drift:
        """Rows that another tool changed in ROM since the servo was last seen."""
        return self._request("GET", f"{self._path}/drift")

    def restore_drift(self, *, save: bool = False, confirm: Sequence[str] = ()) -> responses.ParametersPatched:
        """Write back the previous ROM values, all or nothing, including identity rows; `save` starts a save job."""
        body = {"save": save, "confirm": list(confirm)}
        done: responses.ParametersPatched = self._request("POST", f"{self._path}/drift/restore", body)
        return _checked(done)

    def accept_drift(self) -> None:
        """Accept the changed values as intended."""
        self._request("DELETE", f"{self._path}/drift")

    def dismiss_lost(self) -> None:
        """Dismiss the RAM values that the servo lost in a restart (`servo.known["lost"]`)."""
        self._request("DELETE", f"{self._path}/lost")


def _rows(
    keys: Sequence[str] | None, identity: bool, dry_run: bool, save: bool, confirm: Sequence[str]
) -> dict[str, object]:
    return {
        "keys": None if keys is None else list(keys), "identity": identity, "dry_run": dry_run, "save": save,
        "confirm": list(confirm),
    }  # fmt: skip


def _checked(done: Done) -> Done:
    problem = done["problem"]
    if problem is not None:
        raise raised(problem["status"], {**problem, "outcome": done["outcome"], "changes": done["changes"]})
    return done

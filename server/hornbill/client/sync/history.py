"""What a servo held before, where that differs, and bringing it back."""

# Made from hornbill.client.aio by `make generate`: change it there.

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeVar

from hornbill.client import answers
from hornbill.client.problems import raised

if TYPE_CHECKING:
    from hornbill.client.sync.connection import Connection

Done = TypeVar("Done", answers.Restored, answers.ParametersPatched)


class History:
    """Snapshots and drift of one servo; `servo.history`. Identity rows (0x44 to 0x46) stay unless asked for."""

    def __init__(self, connection: "Connection", uid: str) -> None:
        self._ask = connection.ask
        self._path = f"/servos/{uid}"

    def snapshots(self) -> list[answers.Snapshot]:
        """Every snapshot, the newest first. One is taken before every change."""
        return self._ask("GET", f"{self._path}/snapshots")

    def snapshot(self, number: int) -> answers.Snapshot:
        """One of them."""
        return self._ask("GET", f"{self._path}/snapshots/{number}")

    def take(self, reason: str = "by hand") -> answers.Snapshot:
        """Keep what the servo holds now, read from it (section 4.11: 0x20 to 0x46), until somebody drops it."""
        return self._ask("POST", f"{self._path}/snapshots", {"reason": reason})

    def drop(self, number: int) -> None:
        """Forget a snapshot."""
        self._ask("DELETE", f"{self._path}/snapshots/{number}")

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
    ) -> answers.Restored:
        """Write what a snapshot holds, all or nothing: every row the servo has, or `keys`.

        `save` starts the save as a job, `job` in the answer. Raises what it failed of, with the old values back.
        """
        body: dict[str, object] = {"source": source, **_rows(keys, identity, dry_run, save, confirm)}
        done: answers.Restored = self._ask("POST", f"{self._path}/snapshots/{number}/restore", body)
        return _whole(done)

    def copy(
        self,
        side: str,
        *,
        keys: Sequence[str] | None = None,
        identity: bool = False,
        dry_run: bool = False,
        save: bool = False,
        confirm: Sequence[str] = (),
    ) -> answers.Restored:
        """The same of another side: servo:UID, rom:UID, snapshot:ID, profile:NAME, default:MODEL."""
        body: dict[str, object] = {"from": side, **_rows(keys, identity, dry_run, save, confirm)}
        done: answers.Restored = self._ask("POST", f"{self._path}/copy", body)
        return _whole(done)

    def drift(self) -> answers.Drift:
        """Rows that somebody else changed in ROM since the servo was last known."""
        return self._ask("GET", f"{self._path}/drift")

    def restore_drift(self, *, save: bool = False, confirm: Sequence[str] = ()) -> answers.ParametersPatched:
        """Write back what ROM held, all or nothing, identity rows too; with `save`, into ROM by a job."""
        body = {"save": save, "confirm": list(confirm)}
        done: answers.ParametersPatched = self._ask("POST", f"{self._path}/drift/restore", body)
        return _whole(done)

    def accept_drift(self) -> None:
        """Take what was found for what is wanted."""
        self._ask("DELETE", f"{self._path}/drift")

    def dismiss_lost(self) -> None:
        """Forget the RAM values that the servo lost in a restart (`servo["lost"]`)."""
        self._ask("DELETE", f"{self._path}/lost")


def _rows(
    keys: Sequence[str] | None, identity: bool, dry_run: bool, save: bool, confirm: Sequence[str]
) -> dict[str, object]:
    return {
        "keys": None if keys is None else list(keys), "identity": identity, "dry_run": dry_run, "save": save,
        "confirm": list(confirm),
    }  # fmt: skip


def _whole(done: Done) -> Done:
    problem = done["problem"]
    if problem is not None:
        raise raised(problem["status"], {**problem, "outcome": done["outcome"], "changes": done["changes"]})
    return done

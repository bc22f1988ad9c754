"""What the server keeps: servos ever met, the audit, measured runs, the recorder's recordings."""

# Made from hornbill.client.aio by `make generate`: change it there.

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from hornbill.client import answers

if TYPE_CHECKING:
    from hornbill.client.sync.connection import Connection


class Records:
    """Records of the server; `hornbill.records`."""

    def __init__(self, connection: "Connection") -> None:
        self._ask = connection.ask
        self._download = connection.download

    def servos(self) -> list[answers.KnownServo]:
        """Every servo ever met, on the bus or not, the one seen last first."""
        return self._ask("GET", "/inventory")

    def servo(self, uid: str) -> answers.KnownServo:
        """One of them, with what is known of its ROM."""
        return self._ask("GET", f"/inventory/{uid}")

    def servos_csv(self) -> bytes:
        """The same as a table, with ROM in a column a row."""
        return self._download("/inventory.csv")

    def label(self, uid: str, label: str) -> answers.KnownServo:
        """Give a servo a nickname (up to 64 characters), also one that is switched off."""
        return self._ask("PATCH", f"/inventory/{uid}", {"label": label})

    def write_down(self, uid: str, notes: str) -> answers.KnownServo:
        """Replace the notes on a servo (up to 4000 characters), also of one that is switched off."""
        return self._ask("PATCH", f"/inventory/{uid}", {"notes": notes})

    def forget(self, uid: str, *, history: bool = False) -> None:
        """Forget a servo that is not on the bus; with `history` its snapshots and faults, too."""
        self._ask("DELETE", f"/inventory/{uid}", history=history)

    def audit(
        self,
        *,
        limit: int = 200,
        uid: str | None = None,
        key: str | None = None,
        action: str | None = None,
        since: float | None = None,
        before_id: int | None = None,
    ) -> list[answers.AuditRow]:
        """Who did what, the newest first; `since` in seconds since 1970 UTC, `before_id` for the next page."""
        query: dict[str, Any] = {"uid": uid, "key": key, "action": action, "since": since, "before_id": before_id}
        return self._ask("GET", "/audit", limit=limit, **query)

    def audit_csv(
        self, *, uid: str | None = None, key: str | None = None, action: str | None = None, since: float | None = None
    ) -> bytes:
        """All of it as a table."""
        given = {"uid": uid, "key": key, "action": action, "since": None if since is None else str(since)}
        return self._download("/audit.csv", **{name: value for name, value in given.items() if value is not None})

    def runs(self, *, uid: str | None = None, limit: int = 50) -> list[answers.StepRun]:
        """Step tests, the newest first, without their samples."""
        return self._ask("GET", "/runs", uid=uid, limit=limit)

    def run(self, number: int) -> answers.StepRun:
        """One step test with every sample and what was measured."""
        return self._ask("GET", f"/runs/{number}")

    def run_csv(self, number: int) -> bytes:
        """Its samples as a table."""
        return self._download(f"/runs/{number}/csv")

    def overlay(self, numbers: Sequence[int]) -> answers.RunOverlay:
        """Several with their samples, and the parameters in which they differ."""
        return self._ask("GET", "/runs/overlay", ids=",".join(map(str, numbers)))

    def drop_run(self, number: int) -> None:
        """Forget a step test."""
        self._ask("DELETE", f"/runs/{number}")

    def recorder(self) -> answers.RecorderState:
        """How far the recorder reaches back."""
        return self._ask("GET", "/recorder")

    def write_recording(self, reason: str = "", *, before_s: float | None = None) -> answers.Recording:
        """Keep what the recorder holds of the last seconds; answers when the file is there."""
        body = {"reason": reason, "before_s": before_s}
        return self._ask("POST", "/recorder/recordings", body, wait=True, timeout_s=120.0)

    def recordings(self) -> list[answers.Recording]:
        """What the recorder kept, the newest first."""
        return self._ask("GET", "/recorder/recordings")

    def recording(self, name: str) -> bytes:
        """A recording, a ZIP file."""
        return self._download(f"/recorder/recordings/{quote(name, safe='')}")

    def recording_content(self, name: str) -> answers.RecordingContent:
        """What is in it, read."""
        return self._ask("GET", f"/recorder/recordings/{quote(name, safe='')}/content")

    def add_recording(self, name: str, content: bytes) -> answers.Recording:
        """Have the server keep a recording of elsewhere."""
        kind = {"Content-Type": "application/zip"}
        return self._ask("PUT", f"/recorder/recordings/{quote(name, safe='')}", content=content, headers=kind)

    def delete_recording(self, name: str) -> None:
        """Delete a recording."""
        self._ask("DELETE", f"/recorder/recordings/{quote(name, safe='')}")

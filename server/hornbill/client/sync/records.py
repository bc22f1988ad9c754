"""Records of the server: inventory, audit, step test runs and recordings."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection


class Records:
    """Records of the server, as `hornbill.records`."""

    def __init__(self, connection: Connection) -> None:
        self._request = connection.request
        self._download = connection.download

    def servos(self, *, q: str | None = None) -> list[responses.KnownServo]:
        """All known servos, on the bus or not, most recently seen first. `q`: only those with this text in serial
        number, nickname or unique ID."""
        return self._request("GET", "/inventory", q=q)

    def benches(self) -> list[responses.SiteBench]:
        """Benches that share the database of the server, its own first."""
        return self._request("GET", "/benches")

    def servo(self, uid: str) -> responses.KnownServo:
        """One known servo, with its last known ROM values."""
        return self._request("GET", f"/inventory/{uid}")

    def servos_csv(self, *, q: str | None = None) -> bytes:
        """Inventory as CSV, with one column per ROM value. `q`: as in `servos`."""
        return self._download("/inventory.csv", q=q)

    def label(self, uid: str, label: str) -> responses.KnownServo:
        """Set the nickname of a servo (up to 64 characters), on the bus or not."""
        return self._request("PATCH", f"/inventory/{uid}", {"label": label})

    def set_notes(self, uid: str, notes: str) -> responses.KnownServo:
        """Replace the notes on a servo (up to 4000 characters), on the bus or not."""
        return self._request("PATCH", f"/inventory/{uid}", {"notes": notes})

    def forget(self, uid: str, *, history: bool = False) -> None:
        """Forget a servo that is off the bus; with `history` also its snapshots and faults."""
        self._request("DELETE", f"/inventory/{uid}", history=history)

    def audit(
        self,
        *,
        limit: int = 200,
        uid: str | None = None,
        key: str | None = None,
        action: str | None = None,
        since: float | None = None,
        before_id: int | None = None,
    ) -> list[responses.AuditRow]:
        """Audit rows, newest first. `since`: seconds since 1970 UTC; `before_id`: for the next page."""
        query: dict[str, Any] = {"uid": uid, "key": key, "action": action, "since": since, "before_id": before_id}
        return self._request("GET", "/audit", limit=limit, **query)

    def audit_csv(
        self, *, uid: str | None = None, key: str | None = None, action: str | None = None, since: float | None = None
    ) -> bytes:
        """All matching audit rows as CSV."""
        return self._download("/audit.csv", uid=uid, key=key, action=action, since=since)

    def runs(self, *, uid: str | None = None, limit: int = 50) -> list[responses.StepRun]:
        """Step test runs, newest first, without samples."""
        return self._request("GET", "/runs", uid=uid, limit=limit)

    def run(self, number: int) -> responses.StepRun:
        """One step test run with samples and metrics."""
        return self._request("GET", f"/runs/{number}")

    def run_csv(self, number: int) -> bytes:
        """Samples of a run as CSV."""
        return self._download(f"/runs/{number}/csv")

    def overlay(self, numbers: Sequence[int]) -> responses.RunOverlay:
        """Several runs with samples, and the parameters in which they differ."""
        return self._request("GET", "/runs/overlay", ids=",".join(map(str, numbers)))

    def delete_run(self, number: int) -> None:
        """Delete a run."""
        self._request("DELETE", f"/runs/{number}")

    def frequency_responses(self, *, uid: str | None = None, limit: int = 50) -> list[responses.FrequencyResponse]:
        """Frequency responses, newest first, without the lists of their curves."""
        return self._request("GET", "/frequency-responses", uid=uid, limit=limit)

    def frequency_response(self, number: int) -> responses.FrequencyResponse:
        """One frequency response with its curves."""
        return self._request("GET", f"/frequency-responses/{number}")

    def frequency_response_csv(self, number: int) -> bytes:
        """Curves of a frequency response as CSV."""
        return self._download(f"/frequency-responses/{number}/csv")

    def delete_frequency_response(self, number: int) -> None:
        """Delete a frequency response."""
        self._request("DELETE", f"/frequency-responses/{number}")

    def recorder(self) -> responses.RecorderState:
        """State of the recorder."""
        return self._request("GET", "/recorder")

    def create_recording(self, reason: str = "", *, before_s: float | None = None) -> responses.Recording:
        """Create a recording of recent events. Returns when the file is written."""
        body = {"reason": reason, "before_s": before_s}
        return self._request("POST", "/recorder/recordings", body, wait=True, timeout_s=120.0)

    def recordings(self) -> list[responses.Recording]:
        """Recordings on the server, newest first."""
        return self._request("GET", "/recorder/recordings")

    def recording(self, name: str) -> bytes:
        """Content of a recording, a ZIP file."""
        return self._download(f"/recorder/recordings/{quote(name, safe='')}")

    def recording_content(self, name: str) -> responses.RecordingContent:
        """Metadata, telemetry, events and writes of a recording."""
        return self._request("GET", f"/recorder/recordings/{quote(name, safe='')}/content")

    def import_recording(self, name: str, content: bytes) -> responses.Recording:
        """Import a recording."""
        kind = {"Content-Type": "application/zip"}
        return self._request("PUT", f"/recorder/recordings/{quote(name, safe='')}", content=content, headers=kind)

    def delete_recording(self, name: str) -> None:
        """Delete a recording."""
        self._request("DELETE", f"/recorder/recordings/{quote(name, safe='')}")

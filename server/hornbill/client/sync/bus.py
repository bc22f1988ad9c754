"""The server's adapter, who is on the bus, node ids, and the log."""

# Made from hornbill.client.aio by `make generate`: change it there.

from typing import TYPE_CHECKING, Literal
from urllib.parse import quote

from hornbill.client import answers

if TYPE_CHECKING:
    from hornbill.client.sync.connection import Connection


class Bus:
    """The bus of the server; `hornbill.bus`. What is wrong with it: `hornbill.doctor()`."""

    def __init__(self, connection: "Connection") -> None:
        self._connection = connection
        self._ask = connection.ask

    def state(self) -> answers.Bus:
        """Adapter, load, rates, errors, and whether it gives node ids."""
        return self._ask("GET", "/bus")

    def adapters(self) -> list[answers.Adapter]:
        """What is plugged in, and what keeps it from being used."""
        return self._ask("GET", "/bus/adapters")

    def connect(self, address: str, *, bitrate: int = 1_000_000, frame_gap_ms: float | None = None) -> answers.Bus:
        """Open an adapter, INTERFACE:CHANNEL as socketcan:can0, at so many bit/s, in place of the present one.

        `frame_gap_ms` is the pause between the frames of one transfer; none unless given.
        """
        body = {"address": address, "bitrate": bitrate, "frame_gap_ms": frame_gap_ms}
        return self._ask("PUT", "/bus", body)

    def disconnect(self) -> answers.Bus:
        """Let go of the adapter."""
        return self._ask("DELETE", "/bus")

    def nodes(self) -> list[answers.Node]:
        """Who is heard by its NodeStatus, servo or not."""
        return self._ask("GET", "/nodes")

    def ids(self) -> answers.Allocations:
        """Node ids given, who waits for one, and how many are left."""
        return self._ask("GET", "/allocations")

    def pin(self, uid: str, node_id: int) -> answers.AllocationChange:
        """Keep a node id (1 to 125) for a unique id; `note` says when it acts."""
        return self._ask("PUT", f"/allocations/{uid}", {"node_id": node_id})

    def forget_id(self, uid: str) -> answers.AllocationChange:
        """Free the node id of a unique id."""
        return self._ask("DELETE", f"/allocations/{uid}")

    def recycle_ids(self, idle_longer_than_s: float) -> answers.Recycled:
        """Free the node ids of all that were not seen for so long, and are not pinned."""
        return self._ask("POST", "/allocations/recycle", {"idle_longer_than_s": idle_longer_than_s})

    def set_allocator(self, mode: Literal["on", "off", "force"]) -> answers.AllocatorState:
        """Give node ids, or not; force: beside another allocator, too."""
        return self._ask("PUT", "/bus/allocator", {"mode": mode})

    def log(self) -> answers.LogState:
        """How far the log is."""
        return self._ask("GET", "/bus/log")

    def start_log(
        self,
        *,
        form: Literal["candump", "asc", "blf", "csv"] = "candump",
        name: str | None = None,
        limit_mb: float = 100.0,
    ) -> answers.LogState:
        """Write every frame to a file of the server; it ends by itself at so many MB."""
        return self._ask("POST", "/bus/log", {"format": form, "name": name, "limit_mb": limit_mb})

    def stop_log(self) -> answers.LogState:
        """End the log; answers when the file is complete."""
        return self._ask("DELETE", "/bus/log")

    def logs(self) -> list[answers.LogFile]:
        """The logs there are, the newest first."""
        return self._ask("GET", "/bus/logs")

    def log_file(self, name: str) -> bytes:
        """A log, byte by byte."""
        return self._connection.download(f"/bus/logs/{quote(name, safe='')}")

    def delete_log(self, name: str) -> None:
        """Delete a log."""
        self._ask("DELETE", f"/bus/logs/{quote(name, safe='')}")

"""Bus of the server: adapter, nodes, node IDs and logs."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from typing import TYPE_CHECKING, Literal
from urllib.parse import quote

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection


class Bus:
    """Bus of the server, as `hornbill.bus`. For a diagnosis see `hornbill.doctor()`."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._request = connection.request

    def state(self) -> responses.Bus:
        """State of adapter, counters and node ID allocator."""
        return self._request("GET", "/bus")

    def adapters(self) -> list[responses.Adapter]:
        """Adapters of the server, and why an adapter is unavailable."""
        return self._request("GET", "/bus/adapters")

    def connect(
        self,
        address: str,
        *,
        bitrate: int = 1_000_000,
        frame_gap_ms: float | None = None,
        role: Literal["auto", "host", "guest", "observer"] | None = None,
    ) -> responses.Bus:
        """Open an adapter, INTERFACE:CHANNEL such as socketcan:can0, in place of the current one.

        `bitrate`: bit/s. `frame_gap_ms`: pause between the frames of one transfer; default none. `role`: default the
        one last used with this adapter, otherwise auto.
        """
        body = {"address": address, "bitrate": bitrate, "frame_gap_ms": frame_gap_ms, "role": role}
        return self._request("PUT", "/bus", body)

    def set_role(self, role: Literal["host", "guest", "observer"]) -> responses.Bus:
        """Change the connection role. Torque goes off first on servos under command."""
        return self._request("PUT", "/bus/role", {"role": role})

    def disconnect(self) -> responses.Bus:
        """Disconnect the bus."""
        return self._request("DELETE", "/bus")

    def nodes(self) -> list[responses.Node]:
        """Nodes on the bus."""
        return self._request("GET", "/nodes")

    def allocations(self) -> responses.Allocations:
        """Allocation table of node IDs, and nodes waiting for one."""
        return self._request("GET", "/allocations")

    def pin(self, uid: str, node_id: int) -> responses.AllocationChange:
        """Reserve a node ID (1 to 125) for a unique ID. `note` states when the change takes effect."""
        return self._request("PUT", f"/allocations/{uid}", {"node_id": node_id})

    def release_node_id(self, uid: str) -> responses.AllocationChange:
        """Free the node ID of a unique ID."""
        return self._request("DELETE", f"/allocations/{uid}")

    def recycle_node_ids(self, idle_longer_than_s: float) -> responses.Recycled:
        """Free the node IDs of nodes not seen for this time, except pinned ones."""
        return self._request("POST", "/allocations/recycle", {"idle_longer_than_s": idle_longer_than_s})

    def set_allocator(self, mode: Literal["on", "off", "force"]) -> responses.AllocatorState:
        """Set the mode of the node ID allocator. force: allocate even if there is another allocator."""
        return self._request("PUT", "/bus/allocator", {"mode": mode})

    def log(self) -> responses.LogState:
        """State of the current or last log."""
        return self._request("GET", "/bus/log")

    def start_log(
        self,
        *,
        form: Literal["candump", "asc", "blf", "csv"] = "candump",
        name: str | None = None,
        limit_mb: float = 100.0,
    ) -> responses.LogState:
        """Start logging all frames to a file on the server, up to `limit_mb`."""
        return self._request("POST", "/bus/log", {"format": form, "name": name, "limit_mb": limit_mb})

    def stop_log(self) -> responses.LogState:
        """Stop logging. Returns when the file is complete."""
        return self._request("DELETE", "/bus/log")

    def logs(self) -> list[responses.LogFile]:
        """Logs on the server, newest first."""
        return self._request("GET", "/bus/logs")

    def log_file(self, name: str) -> bytes:
        """Content of a log."""
        return self._connection.download(f"/bus/logs/{quote(name, safe='')}")

    def delete_log(self, name: str) -> None:
        """Delete a log."""
        self._request("DELETE", f"/bus/logs/{quote(name, safe='')}")

"""Our own NodeStatus and GetNodeInfo response."""

from hornbill.units import Instant
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.services import GetNodeInfoResponse, HardwareVersion, SoftwareVersion

_HARDWARE = (1, 0)


class Presence:
    """State of our own node: always health OK and mode OPERATIONAL."""

    def __init__(self, *, name: str, unique_id: bytes, software_version: SoftwareVersion, born: Instant) -> None:
        """`name` has at most 80 characters, `unique_id` 16 bytes. Raises ValueError for values out of range."""
        self.born = born
        self.unique_id = unique_id
        self._name = name
        self._software = software_version
        self._hardware = HardwareVersion(*_HARDWARE, unique_id)
        self.info(born).encode()  # raises now rather than at the first request

    def status(self, now: Instant) -> NodeStatus:
        """Table 2-17. Uptime in whole seconds since `born`."""
        return NodeStatus(int(now - self.born), NodeHealth.OK, Mode.OPERATIONAL)

    def info(self, now: Instant) -> GetNodeInfoResponse:
        """Table 2-6."""
        return GetNodeInfoResponse(self.status(now), self._software, self._hardware, self._name)

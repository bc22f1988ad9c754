"""What our own node says of itself, as NodeStatus and in answer to GetNodeInfo."""

from hornbill.units import Instant
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.services import GetNodeInfoResponse, HardwareVersion, SoftwareVersion

_HARDWARE = (1, 0)


class Presence:
    """A node that is well and works for as long as it is there: health OK, mode OPERATIONAL."""

    def __init__(self, *, name: str, unique_id: bytes, software_version: SoftwareVersion, born: Instant) -> None:
        """`name` has at most 80 characters, `unique_id` 16 bytes. Raises ValueError for what does not fit."""
        self.born = born
        self.unique_id = unique_id
        self._name = name
        self._software = software_version
        self._hardware = HardwareVersion(*_HARDWARE, unique_id)
        self.info(born).encode()  # complains now rather than when somebody asks

    def status(self, now: Instant) -> NodeStatus:
        """Table 2-17, with the whole seconds since `born`."""
        return NodeStatus(int(now - self.born), NodeHealth.OK, Mode.OPERATIONAL)

    def info(self, now: Instant) -> GetNodeInfoResponse:
        """Table 2-6."""
        return GetNodeInfoResponse(self.status(now), self._software, self._hardware, self._name)

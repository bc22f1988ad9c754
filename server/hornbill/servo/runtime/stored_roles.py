"""Connection roles last chosen, by adapter."""

from hornbill.domain.bus import ConnectionRoleChoice
from hornbill.node.role import ConnectionRole
from hornbill.store.settings import SettingTable
from hornbill.wire.port import split_frame_gap

ALONE = ("memory:", "file:", "recording:")
"""Prefixes of buses without other programs: simulated servos and recordings. There auto means host."""
AUTOPILOTS = ("mcast:", "mavcan:")
"""Prefixes of buses that belong to an autopilot. There auto means guest."""


class StoredRoles:
    """Stores the role of each adapter as a setting."""

    def __init__(self, settings: SettingTable) -> None:
        self._settings = settings

    def choose(self, address: str, wanted: ConnectionRoleChoice | None) -> ConnectionRole | None:
        """The role to connect an adapter with; None to listen first. Remembers `wanted` unless it is None.

        `wanted` None: the role last chosen for this adapter, otherwise auto.
        """
        if address.startswith(ALONE):
            return ConnectionRole.HOST if wanted in (None, "auto") else ConnectionRole(wanted)
        automatic = ConnectionRole.GUEST if address.startswith(AUTOPILOTS) else None
        key = f"role/{split_frame_gap(address)[0][:80]}"
        if wanted is None:
            stored = self._settings.get(key)
            return ConnectionRole(stored) if stored in {one.value for one in ConnectionRole} else automatic
        self._settings.put(key, wanted)
        return automatic if wanted == "auto" else ConnectionRole(wanted)

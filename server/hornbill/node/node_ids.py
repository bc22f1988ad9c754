"""Search for a free node ID."""

from collections.abc import Collection
from typing import Final

HIGHEST_DYNAMIC: Final = 125
"""126 and 127 are reserved for tools and never assigned."""


def find_free(preferred: int, taken: Collection[int]) -> int | None:
    """The first free node ID 1..125, searching upward from `preferred`, then downward. None if all are taken.

    0 means no preference and returns the highest free ID. A preference above 125 is searched downward from 125
    (uavcan.protocol.dynamic_node_id.Allocation).
    """
    start = min(preferred, HIGHEST_DYNAMIC) if preferred > 0 else HIGHEST_DYNAMIC
    upward = range(start, HIGHEST_DYNAMIC + 1)
    downward = range(start - 1, 0, -1)
    return next((each for direction in (upward, downward) for each in direction if each not in taken), None)

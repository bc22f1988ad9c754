"""The search for a free node id."""

from collections.abc import Collection
from typing import Final

HIGHEST_DYNAMIC: Final = 125
"""126 and 127 are for tools and never given to a node that asks."""


def find_free(preferred: int, taken: Collection[int]) -> int | None:
    """The free node id 1..125 first met upward from `preferred`, then downward; None when all are taken.

    0 stands for no preference and gives the highest free one. A preference above 125 is met downward from
    there (uavcan.protocol.dynamic_node_id.Allocation).
    """
    start = min(preferred, HIGHEST_DYNAMIC) if preferred > 0 else HIGHEST_DYNAMIC
    upward = range(start, HIGHEST_DYNAMIC + 1)
    downward = range(start - 1, 0, -1)
    return next((each for way in (upward, downward) for each in way if each not in taken), None)

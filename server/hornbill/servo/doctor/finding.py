"""Shared wording of findings."""

from collections.abc import Iterable

from hornbill.domain.bus import Check, Finding
from hornbill.domain.fields import Param, known


def ok(code: Check, text: str, evidence: str, **params: Param | None) -> Finding:
    """A check without finding. `params`: values in its evidence, None if unknown."""
    return Finding(code, "ok", text, evidence, None, params=known(**params))


def count(number: int, one: str) -> str:
    """A number and its noun: "1 frame", "2 frames"."""
    return f"{number} {one if number == 1 else one + 's'}"


def percent(share: float, decimals: int = 0) -> str:
    """A share from 0 to 1 as text: "34 %"."""
    return f"{100 * share:.{decimals}f} %"


def nodes(node_ids: Iterable[int]) -> str:
    """Node IDs in a sentence: "node 9", "nodes 9 and 12", "nodes 9, 12 and 13"."""
    *most, last = [str(each) for each in sorted(node_ids)]
    return f"nodes {', '.join(most)} and {last}" if most else f"node {last}"

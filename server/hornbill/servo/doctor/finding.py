"""Owns Finding: one thing the doctor looked at, for people: what it is, how it is known, what helps."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How bad it is. `ok`: looked at and found well; `notice`: worth knowing, and nothing to repair."""

    OK = "ok"
    NOTICE = "notice"
    WARNING = "warning"
    FAILURE = "failure"


@dataclass(frozen=True, slots=True)
class Finding:
    """`code` names the cause for programs, `evidence` holds the numbers, `remedy` what to do about it."""

    code: str
    severity: Severity
    text: str
    evidence: str
    remedy: str | None = None
    node_ids: tuple[int, ...] = ()
    uids: tuple[str, ...] = ()


def ok(code: str, text: str, evidence: str) -> Finding:
    """Something that was looked at and found well."""
    return Finding(code, Severity.OK, text, evidence)


def count(number: int, one: str) -> str:
    """A number and its noun: "1 frame", "2 frames"."""
    return f"{number} {one if number == 1 else one + 's'}"


def percent(share: float, decimals: int = 0) -> str:
    """A share 0..1 as people write it: "34 %"."""
    return f"{100 * share:.{decimals}f} %"


def nodes(node_ids: Iterable[int]) -> str:
    """Node ids in a sentence: "node 9", "nodes 9 and 12", "nodes 9, 12 and 13"."""
    *most, last = [str(each) for each in sorted(node_ids)]
    return f"nodes {', '.join(most)} and {last}" if most else f"node {last}"

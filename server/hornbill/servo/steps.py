"""Owns Step: one step of a job; and the document in which the store keeps what a job did and how it ended."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, cast

from hornbill import errors
from hornbill.errors import HornbillError
from hornbill.store.tables import Json
from hornbill.units import Uid


@dataclass(slots=True)
class Step:
    """One step of a job. `state`: waiting, running, done, failed or skipped; times are seconds since 1970.

    `uid`: the servo it is about, in a job over several.
    """

    name: str
    text: str
    state: str = "waiting"
    evidence: str | None = None
    started_at: float | None = None
    ended_at: float | None = None
    uid: Uid | None = None


def write(steps: list[Step], result: Mapping[str, object] | None, error: HornbillError | None) -> dict[str, Json]:
    """The document; what is no JSON in a result or in the facts of an error becomes text."""
    document = {
        "steps": [asdict(step) for step in steps],
        "result": result,
        "error": error
        and {"class": type(error).__name__, "code": error.code, "detail": error.detail, "facts": error.facts},
    }
    return cast("dict[str, Json]", json.loads(json.dumps(document, default=str)))


def read(document: Mapping[str, Any]) -> tuple[list[Step], dict[str, object] | None, HornbillError | None]:
    """Steps, result and error of a document. Raises KeyError, TypeError on one that nobody here wrote."""
    return [Step(**step) for step in document["steps"]], document["result"], _error(document["error"])


def _error(kept: Mapping[str, Any] | None) -> HornbillError | None:
    if kept is None:
        return None
    kind = getattr(errors, kept["class"], None)
    if not (isinstance(kind, type) and issubclass(kind, HornbillError)):
        return HornbillError(kept["detail"], **kept["facts"])
    error = kind.__new__(kind)  # past its own __init__: each class may want other arguments
    HornbillError.__init__(error, kept["detail"], **kept["facts"])
    error.code = kept["code"]
    return error

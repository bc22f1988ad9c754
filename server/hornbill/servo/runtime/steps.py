"""One step of a job; and the document in which the store keeps what a job did and how it ended."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self, cast

from hornbill import errors
from hornbill.domain.fields import Param
from hornbill.domain.job import EvidenceCode
from hornbill.errors import HornbillError
from hornbill.store.tables import Json
from hornbill.units import Uid


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a step observed, or why it was skipped or failed: a code with its values, and the same in English.

    `ahead`: the end of the text, where it is about what the job has still to do.
    """

    code: EvidenceCode
    text: str
    params: Mapping[str, Param] = field(default_factory=dict[str, Param])
    ahead: str | None = None

    @classmethod
    def of(cls, error: HornbillError) -> Self:
        """A problem as evidence: its code is the value `problem`, its plain facts are the other values."""
        return cls("problem", error.detail, error.note_params)


@dataclass(slots=True)
class Step:
    """One step of a job. `state`: waiting, running, done, failed or skipped; times are seconds since 1970.

    `uid` and `params["servo"]`: the servo it is about, in a job over several. `ahead`: the end of `evidence`, where it
    is about what the job has still to do.
    """

    name: str
    text: str
    state: str = "waiting"
    evidence: str | None = None
    started_at: float | None = None
    ended_at: float | None = None
    uid: Uid | None = None
    ahead: str | None = None
    params: dict[str, Param] = field(default_factory=dict[str, Param])
    evidence_code: EvidenceCode | None = None
    evidence_params: dict[str, Param] = field(default_factory=dict[str, Param])

    @property
    def code(self) -> str:
        """What it does, by name: its name without the place of its servo."""
        return self.name.partition(" ")[0]

    def observe(self, found: Evidence | None) -> None:
        """Set its evidence; None clears it."""
        self.evidence = None if found is None else found.text
        self.evidence_code = None if found is None else found.code
        self.evidence_params = {} if found is None else dict(found.params)
        self.ahead = None if found is None else found.ahead


_STEP_FIELDS = tuple(one.name for one in fields(Step))


def write(steps: list[Step], result: Mapping[str, object] | None, error: HornbillError | None) -> dict[str, Json]:
    """The document; what is no JSON in a result or in the facts of an error becomes text."""
    document = {
        "steps": [{name: getattr(step, name) for name in _STEP_FIELDS} for step in steps],
        "result": result,
        "error": error
        and {
            "class": type(error).__name__,
            "code": error.code,
            "detail": error.detail,
            "facts": error.facts,
        },
    }
    return cast("dict[str, Json]", json.loads(json.dumps(document, default=str)))


def read(document: Mapping[str, Any]) -> tuple[list[Step], dict[str, object] | None, HornbillError | None]:
    """Steps, result and error of a document. Raises KeyError, TypeError on one that nobody here wrote."""
    return [Step(**step) for step in document["steps"]], document["result"], _error(document["error"])


def _error(kept: Mapping[str, Any] | None) -> HornbillError | None:
    if kept is None:
        return None
    kind = getattr(errors, kept["class"], None)
    facts = {"cause": None, **kept["facts"]}
    if not (isinstance(kind, type) and issubclass(kind, HornbillError)):
        return HornbillError(kept["detail"], **facts)
    error = kind.__new__(kind)  # past its own __init__: each class may want other arguments
    HornbillError.__init__(error, kept["detail"], **facts)
    error.code = kept["code"]
    return error

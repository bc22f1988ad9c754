"""Step of a job, and the document in which the store keeps its steps, result and error."""

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
    """Observation of a step, or the reason it was skipped or failed: a code with values, and the same in English.

    `ahead`: the end of the text, if it describes remaining work of the job.
    """

    code: EvidenceCode
    text: str
    params: Mapping[str, Param] = field(default_factory=dict[str, Param])
    ahead: str | None = None

    @classmethod
    def of(cls, error: HornbillError) -> Self:
        """A problem as evidence: the value `problem` is its code, the other values are its plain facts."""
        return cls("problem", error.detail, error.note_params)


@dataclass(slots=True)
class Step:
    """One step of a job. `state`: waiting, running, done, failed or skipped; times are seconds since 1970.

    `uid` and `params["servo"]`: the servo of this step, in a job on several servos. `ahead`: the end of `evidence`, if
    it describes remaining work of the job.
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
        """Code of the step: its name without the position of its servo."""
        return self.name.partition(" ")[0]

    def observe(self, found: Evidence | None) -> None:
        """Set its evidence; None clears it."""
        self.evidence = None if found is None else found.text
        self.evidence_code = None if found is None else found.code
        self.evidence_params = {} if found is None else dict(found.params)
        self.ahead = None if found is None else found.ahead


_STEP_FIELDS = tuple(one.name for one in fields(Step))


def write(steps: list[Step], result: Mapping[str, object] | None, error: HornbillError | None) -> dict[str, Json]:
    """The document to store. Values of a result or of an error's facts that are not JSON become text."""
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
    """Steps, result and error of a document. Raises KeyError or TypeError if its format is unknown."""
    return [Step(**step) for step in document["steps"]], document["result"], _error(document["error"])


def _error(stored: Mapping[str, Any] | None) -> HornbillError | None:
    if stored is None:
        return None
    kind = getattr(errors, stored["class"], None)
    facts = {"cause": None, **stored["facts"]}
    if not (isinstance(kind, type) and issubclass(kind, HornbillError)):
        return HornbillError(stored["detail"], **facts)
    error = kind.__new__(kind)  # bypasses __init__, whose arguments differ between classes
    HornbillError.__init__(error, stored["detail"], **facts)
    error.code = stored["code"]
    return error

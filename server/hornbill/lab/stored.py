"""Stored runs as shown to clients, also those of older versions: with verdict, and whether they can be compared."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, cast, get_origin

from hornbill.domain.frequency_response import FrequencyCurve, FrequencyResponse
from hornbill.domain.note import Note
from hornbill.domain.set_up import SetUp
from hornbill.domain.step_test import RunOverlay, StepRun, StepTrace
from hornbill.lab import verdict
from hornbill.lab.verdict import RunFacts
from hornbill.store.runs import Run

FIRST_PROCEDURE: Final = "step/1"
"""Procedure of runs that were stored before procedures had versions."""

LISTS: Final = tuple(name for name, one in FrequencyCurve.model_fields.items() if get_origin(one.annotation) is list)
"""Fields of a curve with one value per frequency."""


def step_run(run: Run, *, traces: bool = True) -> StepRun:
    """A step test, with or without its samples."""
    document = common(run)
    steps = [StepTrace.model_validate(one) for one in document.pop("steps")]
    facts = facts_of(document)
    document["verdict"] = verdict.of_steps(steps, document["band_deg"], facts)
    if not traces:
        for one in steps:
            one.t, one.angle_deg = [], []
    return StepRun.model_validate({**document, "steps": steps})


def frequency_response(run: Run, *, curves: bool = True) -> FrequencyResponse:
    """A frequency response, with or without the lists of its curves."""
    document = common(run)
    facts = facts_of(document)
    found = [FrequencyCurve.model_validate(one) for one in document.pop("curves")]
    dependence = document.pop("dependence")
    document["dependence"] = None if dependence is None else Note(**dependence)
    document["verdict"] = verdict.of_frequency_response(found, document["dependence"], facts)
    if not curves:
        for one in found:
            for name in LISTS:
                setattr(one, name, [])
    return FrequencyResponse.model_validate({**document, "curves": found})


def common(run: Run) -> dict[str, Any]:
    """The document of a run of any kind and version with the fields of `RunConditions` but the verdict."""
    document: dict[str, Any] = dict(run.document)
    document.setdefault("procedure", FIRST_PROCEDURE)
    document["set_up"] = SetUp.model_validate(document.get("set_up") or {})
    # an older hornbill stored warnings as text
    warnings = cast("list[str | dict[str, Any]]", document.get("warnings") or [])
    document["warnings"] = [Note(one, "text") if isinstance(one, str) else Note(**one) for one in warnings]
    return {**document, "id": run.id, "uid": run.uid, "at": run.at, "note": run.note}


def facts_of(document: dict[str, Any]) -> RunFacts:
    """Conditions that verdicts depend on. Removes those that are not shown from `document`."""
    notes = {one.code: one for one in cast("list[Note]", document["warnings"])}
    limits = notes["limit_reached"].params.get("keys", ["unknown"]) if "limit_reached" in notes else []
    return RunFacts(
        document["parameters"],
        smoothing="smoothing_on" in notes,
        limits=tuple(str(one) for one in cast("list[str]", limits)),
        voltage_v=document["voltage_v"],
        nominal_v=document.pop("nominal_v", None),
    )


def overlay(runs: list[StepRun]) -> RunOverlay:
    """Runs for comparison: the rows in which they differ, and whether their metrics can be compared."""
    keys = {key: None for run in runs for key in run.parameters}
    differ = {key: [run.parameters.get(key) for run in runs] for key in keys}
    reason = not_comparable(runs)
    return RunOverlay(
        runs=runs,
        differences={key: values for key, values in differ.items() if any(one != values[0] for one in values)},
        comparable=reason is None,
        not_comparable=reason,
    )


_COMPARED: Final[Mapping[str, tuple[Callable[[StepRun], object], str]]] = {
    "other_servo": (lambda run: run.uid, "The runs are of different servos."),
    "other_set_up": (lambda run: run.set_up, "The runs have different set-ups."),
    "other_procedure": (lambda run: run.procedure, "The runs followed different versions of the procedure."),
    "other_step": (lambda run: (run.step_deg, run.band_deg), "The runs have different steps or settling bands."),
}
"""What must be equal, by the code of the reason why runs cannot be compared."""


def not_comparable(runs: Sequence[StepRun]) -> Note | None:
    """Reason why the metrics of runs cannot be compared, or None."""
    for code, (value, text) in _COMPARED.items():
        if any(value(run) != value(runs[0]) for run in runs):
            return Note(text, cast("Any", code))
    return None

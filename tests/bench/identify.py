"""Identification against the truth: frequency responses over the bus and an independent integration of the plant."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

from bench.line import line
from frequency_truth import INERTIAS, MODELS, Case, deviation


def figures() -> Iterator[dict[str, Any]]:
    """Frequency responses of 8 models with 3 inertias, with and without 0x25."""
    yield from frequency_responses()


def frequency_responses() -> Iterator[dict[str, Any]]:
    """Deviation at the reliable frequencies up to 15 Hz, for each inertia and for all."""
    cases = [Case(model, inertia, cascade) for inertia in INERTIAS for model in MODELS for cascade in (False, True)]
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        found = dict(zip(cases, pool.map(deviation, cases), strict=True))
    for inertia in (*INERTIAS, None):
        of = [one for case, one in found.items() if inertia in (None, case.inertia)]
        gain = np.concatenate([one.gain_db for one in of])
        phase = np.concatenate([one.phase_deg for one in of])
        reliable = len(gain)
        figures = {
            "responses": len(of),
            "frequencies": sum(one.frequencies for one in of),
            "reliable": reliable,
            "gain_db_95": round(float(np.percentile(gain, 95)), 2),
            "gain_db_max": round(float(gain.max()), 2),
            "phase_deg_95": round(float(np.percentile(phase, 95)), 1),
            "phase_deg_max": round(float(phase.max()), 1),
            "outside_pct": round(100 * sum(one.outside for one in of) / reliable, 2),
        }
        load = "all inertias" if inertia is None else f"inertia {inertia:g}"
        yield line(
            f"frequency response, {load}: beyond 0.5 dB or 5°",
            figures,
            must=5.0,
            aim=0.0,
            of="outside_pct",
            limit="5 % by definition",
        )

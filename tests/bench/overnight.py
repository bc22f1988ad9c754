"""An overnight rig under chaos in virtual time: reports that were not true, and how fast it ran."""

import os
import tempfile
import time
from collections.abc import Iterator
from typing import Any

from bench.line import line
from overnight_rig import check, night

HOURS = 8.0


def figures() -> Iterator[dict[str, Any]]:
    """`OVERNIGHT_HOURS` for a shorter night. Fails also if too little happened."""
    hours = float(os.environ.get("OVERNIGHT_HOURS", HOURS))
    with tempfile.TemporaryDirectory() as folder:
        began = time.process_time()
        tally = night(hours, seed=7, store=folder)
        took = time.process_time() - began
    shown = {
        "virtual_hours": hours, "untrue": len(tally.lies), "checks": tally.checked.total(),
        "undecided": tally.undecided, "injections": tally.injected.total(), "requests": tally.outcomes.total(),
        "cpu_s": round(took), "virtual_s_per_cpu_s": round(hours * 3600 / took, 1),
    }  # fmt: skip
    yield line(
        "reports of an overnight rig under chaos, compared with the truth",
        shown,
        of="untrue",
        must=0,
        limit="the truth of the simulator",
    )
    check(tally, hours)

"""Four minutes of an overnight rig under chaos: every report is true. `make test-release` plays half an hour."""

from pathlib import Path

import pytest

from overnight_rig import check, night

HOURS = 4 / 60
SEED = 14
"""Has every kind of fault in this time."""


@pytest.mark.release
def test_every_report_of_a_rig_under_chaos_is_true(tmp_path: Path) -> None:
    check(night(HOURS, seed=SEED, store=str(tmp_path)), HOURS)

"""Half an hour of an overnight rig under chaos; `make bench BENCH=overnight` plays eight hours."""

from pathlib import Path

from overnight_rig import check, night

HOURS = 0.5


def test_every_report_of_a_night_is_true(tmp_path: Path) -> None:
    check(night(HOURS, seed=14, store=str(tmp_path)), HOURS)

"""Eight hours of an overnight rig under chaos, of which `make test` plays four minutes."""

from pathlib import Path

from overnight_rig import check, night

HOURS = 8


def test_every_report_of_a_night_is_true(tmp_path: Path) -> None:
    check(night(HOURS, seed=7, store=str(tmp_path)), HOURS)

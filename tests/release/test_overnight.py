"""Eight hours of an overnight rig under chaos, of which `make test` plays twenty minutes."""

from pathlib import Path

from overnight_rig import check, night


def test_every_report_of_a_night_is_true(tmp_path: Path) -> None:
    check(night(8, seed=7, store=str(tmp_path)))

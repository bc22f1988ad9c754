"""Twenty minutes of an overnight rig under chaos: every report is true. `make test-release` runs eight hours."""

from pathlib import Path

from overnight_rig import check, night


def test_every_report_of_a_rig_under_chaos_is_true(tmp_path: Path) -> None:
    check(night(20 / 60, seed=2, store=str(tmp_path)))

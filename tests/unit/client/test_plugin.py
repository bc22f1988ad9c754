"""Decisions of the pytest plugin; tests/commands/test_examples.py tests its fixtures."""

import pytest

from hornbill.pytest_plugin import is_ours


@pytest.mark.parametrize(
    ("by", "ours"),
    [("pytest 7", True), ("rig 3 · pytest 7", True), ("pytest 17", False), ("Ann", False), ("", False)],
)
def test_a_stop_of_the_test_itself_is_recognized(by: str, ours: bool) -> None:
    assert is_ours(by, "pytest 7") is ours

"""The tests of what the pytest plugin decides; that its fixtures work is in tests/commands/test_examples.py."""

import pytest

from hornbill.pytest_plugin import is_ours


@pytest.mark.parametrize(
    ("by", "ours"),
    [("pytest 7", True), ("rig 3 · pytest 7", True), ("pytest 17", False), ("somebody", False), ("", False)],
)
def test_a_stop_of_the_test_itself_is_known_with_a_token_and_without(by: str, ours: bool) -> None:
    assert is_ours(by, "pytest 7") is ours

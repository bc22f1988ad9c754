"""Shared by tests of commands: a server with simulated servos."""

from collections.abc import Iterator

import pytest

from e2e.servers import Demo, ready_demo


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """One demo per file of tests, with six ready servos of mixed models and firmware."""
    with ready_demo(6) as one:
        yield one

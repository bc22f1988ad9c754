"""What tests of commands share: servers with simulated servos."""

from collections.abc import Iterator

import pytest

from e2e.servers import Demo, ready_demo


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """The demo of one file of tests, its six servos of mixed models and firmware ready."""
    with ready_demo(6) as one:
        yield one

"""What holds for all tests: those in a browser come last, and none fails because the machine is busy."""

import pytest
from hypothesis import settings

settings.register_profile("hornbill", deadline=None)
settings.load_profile("hornbill")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Playwright keeps an event loop running in this thread from its first use on, and no test could run its own."""
    items.sort(key=lambda item: "e2e" in item.path.parts)

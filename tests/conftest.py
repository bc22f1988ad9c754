"""Owns the order of the tests: those in a browser come last."""

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Playwright keeps an event loop running in this thread from its first use on, and no test could run its own."""
    items.sort(key=lambda item: "e2e" in item.path.parts)

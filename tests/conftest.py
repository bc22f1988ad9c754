"""What holds for all tests: those in a browser come last, none fails on a busy machine, and any order will do."""

import gc
from random import Random

import pytest
from hypothesis import settings

settings.register_profile("hornbill", deadline=None)
settings.load_profile("hornbill")


def pytest_addoption(parser: pytest.Parser) -> None:
    """--shuffle: files, and the tests of each file, in an order drawn from a seed."""
    parser.addoption("--shuffle", type=int, metavar="SEED", help="run files, and tests of a file, in a random order")


def pytest_report_header(config: pytest.Config) -> str | None:
    """Say which order it is."""
    seed: int | None = config.getoption("shuffle")
    return None if seed is None else f"shuffled: repeat this order with --shuffle {seed}"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Playwright keeps an event loop running in this thread from its first use on, and no test could run its own."""
    seed: int | None = config.getoption("shuffle")
    if seed is not None:
        items[:] = shuffled(items, Random(seed))
    items.sort(key=lambda item: "e2e" in item.path.parts)


def pytest_collection_finish() -> None:
    """Collect garbage seldom: what is imported lives as long as the process, and looking through it takes time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


def shuffled(items: list[pytest.Item], random: Random) -> list[pytest.Item]:
    """Tests of one file stay together, as fixtures of a file start servers."""
    files: dict[str, list[pytest.Item]] = {}
    for item in sorted(items, key=lambda item: item.nodeid):
        files.setdefault(str(item.path), []).append(item)
    groups = list(files.values())
    random.shuffle(groups)
    for group in groups:
        random.shuffle(group)
    return [item for group in groups for item in group]

"""The bench shared by these tests: our server and two simulated servos, each in its own process."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from socketcan.processes import hornbill, line, serving, until
from socketcan.server.bench import Bench


# Shared by this folder, because starting a server takes ten times as long as most tests.
@pytest.fixture(scope="package")
def bench(vcan0: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    data = Path(tmp_path_factory.mktemp("data"))
    with hornbill("sim", "--bus", vcan0, "--servos", "2") as sim, serving(vcan0, data) as api:
        resident, requesting = line(sim), line(sim)
        assert requesting.endswith("requested")
        made = Bench(api, resident.split()[0], requesting.split()[0])
        until(made.ready, "both servos are ready")
        yield made

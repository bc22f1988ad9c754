"""`make bench`: results as JSON lines, each compared with a peer in the same run or with a physical limit."""

import json
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

from bench import (  # noqa: E402
    adapter,
    allocation,
    commanding,
    configuring,
    connecting,
    database,
    endurance,
    guest,
    identify,
    improve,
    jogging,
    load,
    mechanics,
    overnight,
    plots,
    reading,
    recorder,
    simulation,
    soak,
    sockets,
    stack,
    start,
    stopping,
    streaming,
)


def main(chosen: list[str]) -> None:
    """Run all benchmarks, or those named on the command line."""
    for module in (
        stack, reading, configuring, streaming, endurance, stopping, jogging, commanding, start, adapter, connecting,
        allocation, simulation, mechanics, improve, recorder, sockets, load, plots, guest, soak, overnight,
        identify, database,
    ):  # fmt: skip
        if chosen and module.__name__.rpartition(".")[2] not in chosen:
            continue
        for line in module.figures():
            sys.stdout.write(json.dumps(line) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])

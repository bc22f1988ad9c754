"""Writes rows of every kind in a child process, kills it at random points, and checks the database.

`python killing.py SEED ROUNDS PLACE [FRESH]`; with FRESH every tenth round has a new database, so that some kills
happen while its tables are created. Exits with 1 and the lost row. It is a program because it forks.
"""

import os
import random
import signal
import sqlite3
import sys
import time
from collections.abc import Callable
from pathlib import Path

import alembic.command as _command  # so that children need not
import alembic.script as _script

from hornbill.store.audit import NewAuditEntry
from hornbill.store.database import FILE_NAME
from hornbill.store.jobs import StoredJob
from hornbill.store.store import Store
from hornbill.units import NodeId, Uid

LOADED = (_command, _script)
ROWS = 12
"""A child is killed after fewer reported rows than this,"""
AFTER_S = 0.006
"""and at most this long after the last: a row takes some milliseconds."""
OPENING_S = 0.06
"""Duration of opening on a busy machine; creating tables takes longer."""
OPEN = "open"


def uid(n: int) -> Uid:
    return Uid(f"{n:032x}")


def node(n: int) -> NodeId:
    return NodeId(n % 125 + 1)


def snapshot(store: Store, n: int) -> None:
    store.snapshots.add(
        uid(n), reason=f"{n}", by="", automatic=bool(n % 2), model=None, firmware=None, schema_revision="",
        ram={"n": n}, rom={},
    )  # fmt: skip


def servo_is(store: Store, n: int, what: Callable[[str, dict[str, int]], bool]) -> bool:
    found = store.servos.get(uid(n))
    return found is not None and what(found.label, dict(found.rom))


def put_twice(store: Store, n: int) -> None:
    store.jobs.put(StoredJob(f"job{n}", "save", None, "running", float(n), None, None, {"n": 0}))
    store.jobs.put(StoredJob(f"job{n}", "save", None, "running", float(n), None, None, {"n": n}))


WRITES: dict[str, tuple[Callable[[Store, int], object], Callable[[Store, int], bool]]] = {
    "allocation": (
        lambda store, n: store.allocations.record(uid(node(n)), node(n)),
        lambda store, n: store.allocations.entries().get(uid(node(n))) == node(n),
    ),
    "label": (
        lambda store, n: store.servos.set_label(uid(n), f"L{n}"),
        lambda store, n: servo_is(store, n, lambda label, rom: label == f"L{n}"),
    ),
    "rom": (
        lambda store, n: store.servos.put_rom(uid(n), {"n": n}),
        lambda store, n: servo_is(store, n, lambda label, rom: rom == {"n": n}),
    ),
    "snapshot": (snapshot, lambda store, n: [one.ram for one in store.snapshots.of(uid(n))] == [{"n": n}]),
    "profile": (
        lambda store, n: store.profiles.put(f"P{n}", {"n": n}),
        lambda store, n: store.profiles.get(f"P{n}").document == {"n": n},
    ),
    "audit": (
        lambda store, n: store.audit.add(
            [NewAuditEntry("a", "write", "one", uid(n)), NewAuditEntry("a", "write", "two", uid(n))]
        ),
        lambda store, n: [row.entry.outcome for row in store.audit.rows(uid=uid(n))] == ["two", "one"],
    ),
    "setting": (
        lambda store, n: store.settings.put(f"S{n}", n),
        lambda store, n: store.settings.get(f"S{n}") == n,
    ),
    "job": (put_twice, lambda store, n: {"n": n} in [one.document for one in store.jobs.all()]),
}
KINDS = list(WRITES)


def write(place: str, first: int, pipe: int) -> None:
    """Write endlessly, and report each committed row."""
    with Store(place) as store:
        os.write(pipe, f"{OPEN} 0\n".encode())
        for n in range(first, first + 1_000_000):
            kind = KINDS[n % len(KINDS)]
            WRITES[kind][0](store, n)
            os.write(pipe, f"{kind} {n}\n".encode())


def play(place: str, first: int, opening_s: float | None, rows: int, after_s: float) -> list[tuple[str, int]]:
    """One round: the rows reported by the child until it was killed, `opening_s` after its start, or after `rows`."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            write(place, first, writing)
        finally:
            os._exit(3)
    os.close(writing)
    reported = b""
    if opening_s is None:
        while reported.count(b"\n") <= rows and (more := os.read(reading, 4096)):
            reported += more
    time.sleep(after_s if opening_s is None else opening_s)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    with os.fdopen(reading, "rb") as pipe:
        reported += pipe.read()
    if not os.WIFSIGNALED(status):
        sys.exit(f"the child ended ({status}) after {reported[-80:]!r}")
    return [(kind, int(n)) for kind, n in (line.split() for line in reported.decode().splitlines())][1:]


def check(place: str, written: list[tuple[str, int]]) -> None:
    """Open as the next start would, and check every row."""
    if "://" not in place and (file := Path(place) / FILE_NAME).exists():
        connection = sqlite3.connect(file)
        result = connection.execute("PRAGMA integrity_check").fetchall()
        connection.close()
        if result != [("ok",)]:
            sys.exit(f"damaged: {result}")
    with Store(place) as store:
        for kind, n in written:
            if not WRITES[kind][1](store, n):
                sys.exit(f"lost: {kind} {n}")


def main(seed: int, rounds: int, place: str, *, fresh: bool) -> None:
    chance = random.Random(seed)
    with Store("sqlite://") as store:  # so that children inherit what is set up once
        for add, _ in WRITES.values():
            add(store, 0)
    began, written, killed_early = time.monotonic(), dict[str, list[tuple[str, int]]](), 0
    for at in range(rounds):
        here = str(Path(place) / str(at // 10)) if fresh else place
        # the first kill in a new database happens while its tables are created
        opening = here not in written or chance.random() < 0.2
        reported = play(
            here,
            at * 10_000,
            chance.uniform(0.0, OPENING_S) if opening else None,
            chance.randrange(ROWS),
            chance.uniform(0.0, AFTER_S),
        )
        check(here, reported)
        written.setdefault(here, []).extend(reported)
        killed_early += not reported
    for here, rows_there in written.items():
        check(here, rows_there)  # later kills lost no row of an earlier round
    total = sum(map(len, written.values()))
    took_s = time.monotonic() - began
    print(f"{rounds} kills, {total} rows acknowledged, {killed_early} kills before the first, {took_s:.1f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], fresh="FRESH" in sys.argv[4:])

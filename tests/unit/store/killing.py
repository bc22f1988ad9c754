"""A program that writes rows of every kind in a child, kills it at random points, and looks what is left.

`python killing.py SEED ROUNDS PLACE [FRESH]`; with FRESH every tenth round has a new database, so that some kills
fall into the making of its tables. Ends with 1 and says what was lost. It runs as a program because it forks.
"""

import os
import random
import signal
import sqlite3
import sys
import time
from collections.abc import Callable
from pathlib import Path

import alembic.command as _command  # so that no child has to
import alembic.script as _script

from hornbill.store.audit import NewAuditEntry
from hornbill.store.database import FILE_NAME
from hornbill.store.jobs import StoredJob
from hornbill.store.store import Store
from hornbill.units import NodeId, Uid

LOADED = (_command, _script)
ROWS = 12
"""A round is killed before its child has told so many rows,"""
AFTER_S = 0.006
"""and up to so long after the last of them: a row takes some milliseconds."""
OPENING_S = 0.06
"""What opening takes on a machine with something else to do; the making of tables takes longer."""
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


def kept_again(store: Store, n: int) -> None:
    store.jobs.put(StoredJob(f"job{n}", "save", None, "running", float(n), None, None, {"n": 0}))
    store.jobs.put(StoredJob(f"job{n}", "save", None, "running", float(n), None, None, {"n": n}))


DEEDS: dict[str, tuple[Callable[[Store, int], object], Callable[[Store, int], bool]]] = {
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
    "job": (kept_again, lambda store, n: {"n": n} in [one.document for one in store.jobs.all()]),
}
KINDS = list(DEEDS)


def write(place: str, first: int, told: int) -> None:
    """Write for ever, and tell each row once it is committed."""
    with Store(place) as store:
        os.write(told, f"{OPEN} 0\n".encode())
        for n in range(first, first + 1_000_000):
            kind = KINDS[n % len(KINDS)]
            DEEDS[kind][0](store, n)
            os.write(told, f"{kind} {n}\n".encode())


def play(place: str, first: int, opening_s: float | None, rows: int, after_s: float) -> list[tuple[str, int]]:
    """One round: what the child had told when it was killed, so long after its start, or after so many rows."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            write(place, first, writing)
        finally:
            os._exit(3)
    os.close(writing)
    told = b""
    if opening_s is None:
        while told.count(b"\n") <= rows and (more := os.read(reading, 4096)):
            told += more
    time.sleep(after_s if opening_s is None else opening_s)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    with os.fdopen(reading, "rb") as pipe:
        told += pipe.read()
    if not os.WIFSIGNALED(status):
        sys.exit(f"the child ended by itself ({status}) after {told[-80:]!r}")
    return [(kind, int(n)) for kind, n in (line.split() for line in told.decode().splitlines())][1:]


def examine(place: str, told: list[tuple[str, int]]) -> None:
    """Open as the next start would, and look for every row."""
    if "://" not in place and (file := Path(place) / FILE_NAME).exists():
        connection = sqlite3.connect(file)
        answer = connection.execute("PRAGMA integrity_check").fetchall()
        connection.close()
        if answer != [("ok",)]:
            sys.exit(f"damaged: {answer}")
    with Store(place) as store:
        for kind, n in told:
            if not DEEDS[kind][1](store, n):
                sys.exit(f"lost: {kind} {n}")


def main(seed: int, rounds: int, place: str, *, fresh: bool) -> None:
    chance = random.Random(seed)
    with Store("sqlite://") as store:  # what is made once a process is made before the children are
        for deed, _ in DEEDS.values():
            deed(store, 0)
    began, kept, killed_early = time.monotonic(), dict[str, list[tuple[str, int]]](), 0
    for at in range(rounds):
        here = str(Path(place) / str(at // 10)) if fresh else place
        # the first kill in a new database falls into the making of its tables
        opening = here not in kept or chance.random() < 0.2
        told = play(
            here,
            at * 10_000,
            chance.uniform(0.0, OPENING_S) if opening else None,
            chance.randrange(ROWS),
            chance.uniform(0.0, AFTER_S),
        )
        examine(here, told)
        kept.setdefault(here, []).extend(told)
        killed_early += not told
    for here, told in kept.items():
        examine(here, told)  # and no later kill took what an earlier round had kept
    rows = sum(map(len, kept.values()))
    took_s = time.monotonic() - began
    print(f"{rounds} kills, {rows} rows acknowledged, {killed_early} kills before the first, {took_s:.1f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], fresh="FRESH" in sys.argv[4:])

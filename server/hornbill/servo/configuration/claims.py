"""Servo IDs and node IDs in use: on the bus, in ROM, in the store, or reserved by a running change."""

from collections.abc import Callable, Collection, Generator, Mapping
from contextlib import contextmanager

from hornbill.node.directory import Directory
from hornbill.servo.configuration.rules import Claim
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.servos import StoredServo
from hornbill.store.store import Store
from hornbill.units import Raw, Uid


class Claims:
    """IDs in use. Sends nothing."""

    def __init__(
        self,
        servos: Callable[[], list[Servo]],
        store: Store,
        directory: Callable[[], Directory | None],
        base: TimeBase,
        *,
        own_id: int,
    ) -> None:
        """`servos`: seen since the start. `directory`: nodes on the bus. `own_id`: node ID of this server."""
        self._servos = servos
        self._store = store
        self._directory = directory
        self._base = base
        self._own_id = own_id
        self._reserved: dict[Uid, Mapping[str, Raw]] = {}

    def of(self, key: str, servo: Servo, leaving: Collection[Uid] = ()) -> list[Claim]:
        """The numbers of row `key` (servo_id or node_id) that `servo` must not use.

        RAM and ROM values both count, because a restart brings back the ROM value. `leaving`: servos whose numbers do
        not count, because the same batch moves them.
        """
        others = [one for one in self._servos() if one.uid != servo.uid]
        found = [claim for one in others for claim in self._held(key, one)]
        known = {claim.owner for claim in found}
        kept = {one.uid: one for one in self._store.servos.all(but=[servo.uid, *(uid for uid in known if uid)])}
        found += [claim for one in kept.values() for claim in self._remembered(key, one)]
        titles = {uid: one.label or uid[:8] for uid, one in kept.items()} | {one.uid: one.title for one in others}
        for uid, rows in self._reserved.items():
            if uid != servo.uid and key in rows:
                found.append(Claim(rows[key], uid, titles.get(uid, uid[:8]), "being written now"))
        if key == "node_id":
            found += self._on_the_bus(servo, titles)
            found += [
                Claim(node, uid, titles.get(uid, f"node {uid[:8]}"), "in the allocation table")
                for uid, node in self._store.allocations.entries().items()
                if uid != servo.uid
            ]
        gone = set(leaving)
        return [claim for claim in found if claim.number and (claim.owner is None or claim.owner not in gone)]

    def on_the_bus(self, servo: Servo, node: int) -> Claim | None:
        """Another user of a node ID on the bus. Its RAM or ROM may differ: an ID takes effect at a restart."""
        here = {one.uid: one.node_id for one in self._servos() if one.uid != servo.uid}
        for claim in self._on_the_bus(servo, {one.uid: one.title for one in self._servos()}):
            if claim.number == node and (claim.owner is None or here.get(claim.owner, node) == node):
                return claim
        return None

    @contextmanager
    def reserved(self, servo: Servo, wanted: Mapping[str, Raw]) -> Generator[None]:
        """Reserve the IDs in `wanted` for this servo while a change that is not written yet is in progress."""
        ids = {key: raw for key, raw in wanted.items() if key in servo.catalog.unique}
        if ids:
            self._reserved[servo.uid] = ids
        try:
            yield
        finally:
            self._reserved.pop(servo.uid, None)

    @staticmethod
    def _held(key: str, servo: Servo) -> list[Claim]:
        register = servo.registers.get(key)
        if register is None:
            return []
        where = "on the bus" if servo.online else "offline"
        found = [] if register.raw is None else [Claim(register.raw, servo.uid, servo.title, where)]
        if register.rom is not None and register.rom != register.raw:
            found.append(Claim(register.rom, servo.uid, servo.title, "in its ROM until it is saved"))
        return found

    @staticmethod
    def _remembered(key: str, one: StoredServo) -> list[Claim]:
        numbers = {one.rom.get(key), one.facts.servo_id if key == "servo_id" else None}
        title = one.label or f"servo {one.uid[:8]}"
        return [Claim(number, one.uid, title, "offline") for number in numbers if number is not None]

    def _on_the_bus(self, servo: Servo, titles: Mapping[Uid, str]) -> list[Claim]:
        found = [Claim(self._own_id, None, "this server", "on the bus")]
        directory = self._directory()
        if directory is None:
            return found
        for node in sorted(directory.occupied(self._base.now())):
            occupant = directory.unique_id_at(node)
            uid = None if occupant is None else Uid(occupant.hex())
            if uid == servo.uid or (uid is None and node == servo.node_id):
                continue
            title = f"node {node}" if uid is None else titles.get(uid, f"node {node}")
            found.append(Claim(node, uid, title, "on the bus"))
        return found

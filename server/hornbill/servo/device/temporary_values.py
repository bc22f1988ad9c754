"""Temporary values of rows in a servo's RAM, restored afterwards, even by another process."""

import asyncio
import logging
from collections.abc import Callable, Collection, Iterable, Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, field
from typing import Any, Final, cast

from hornbill.errors import BusDisconnected, HornbillError, NoResponse, StoreFailed, UnexpectedResult
from hornbill.schema import scale
from hornbill.servo.device.requests import READ, WRITE, RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import Hub, LogEvent, ServoChanged, ServoSeen
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Raw, Uid

log = logging.getLogger(__name__)

_RESTORE = RetryPolicy(WRITE.priority, WRITE.timeout_s, READ.tries, kind="write")
"""A row left with a temporary value is worse than a wait of 3 s."""

CHECK_PERIOD_S: Final = 0.05
RETRY_S: Final = (1.0, 5.0)
"""First and longest interval between attempts to restore, doubled after each."""

FORCE_LIMITS: Final = ("speed_limit_cw", "speed_limit_ccw", "torque_limit_cw", "torque_limit_ccw")
"""Limits of speed and torque, which a procedure may tighten."""

RESTARTED_S: Final = 2.0
"""Tolerance of an expected uptime, in whole seconds at both ends."""


@dataclass(slots=True)
class Owed:
    """Original raw values of one servo by key, in the order in which temporary values were written.

    `sent`: those temporary values by key. `rom`: values known to be in ROM. `at` and `uptime_s`: time (seconds since
    1970 UTC) and uptime of the servo at the first write. `boot_count`: None if the record is to be compared with the
    servo first: one of an earlier server, or one whose last writes may have followed an unnoticed restart
    (`restarted`).
    """

    at: float
    uptime_s: int
    boot_count: int | None
    original: dict[str, Raw] = field(default_factory=dict[str, Raw])
    sent: dict[str, list[Raw]] = field(default_factory=dict[str, list[Raw]])
    rom: dict[str, Raw] = field(default_factory=dict[str, Raw])
    restarted: bool = False

    @classmethod
    def of(cls, stored: object) -> "Owed | None":
        """Parse a stored record; None if there is none or its format is unknown."""
        if not isinstance(stored, dict):
            return None
        found = cast("Mapping[str, Any]", stored)
        try:
            original = {str(key): int(raw) for key, raw in found["original"].items()}
            sent = {str(key): [int(raw) for raw in raws] for key, raws in found["sent"].items()}
            rom = {str(key): int(raw) for key, raw in found["rom"].items()}
            return cls(float(found["at"]), int(found["uptime_s"]), None, original, sent, rom)
        except (KeyError, TypeError, ValueError, AttributeError):
            return None

    def to_json(self) -> Json:
        """As stored."""
        return cast("Json", asdict(self) | {"boot_count": None})


class OwedValues:
    """Original values of all rows with a temporary value, in the database before the first write until restored.

    If their user cannot restore them, or the server is killed meanwhile, they are written back and verified as soon as
    the servo responds, unless it has restarted since: then its values are those in ROM. Until then changes, saves and
    motion of the servo are refused (`permission`). `Servo.overridden` contains the original values, so no temporary
    value ever counts as configured.
    """

    def __init__(
        self, requests: ServoRequests, store: Store, hub: Hub, base: TimeBase, find: Callable[[Uid], Servo | None]
    ) -> None:
        """`find` returns the servo with a unique ID."""
        self._requests = requests
        self._store = store
        self._hub = hub
        self._base = base
        self._find = find
        self._owed: dict[Uid, Owed] = {}
        self._tasks: dict[Uid, asyncio.Task[None]] = {}
        hub.subscribe(lambda seen: self._on_seen(seen.uid), ServoSeen)
        hub.subscribe(lambda change: self._on_changed(change.uid), ServoChanged)

    async def add(self, servo: Servo, values: Mapping[str, Raw]) -> None:
        """Store the present values of these rows, which were just read, before temporary `values` are written.

        Call under the servo's `changing` lock. Raises StoreFailed; then nothing may be written.
        """
        assert servo.changing.locked()
        before = self._current(servo)
        before = None if before is None or before.boot_count is None else before
        uptime = 0 if servo.status is None else servo.status.uptime_sec
        owed = Owed(self._base.utc_now(), uptime, servo.boot_count) if before is None else deepcopy(before)
        for key, raw in values.items():
            present = servo.raw(key)
            assert present is not None, "read it first"
            owed.original.setdefault(key, present)
            if (rom := servo.registers[key].rom) is not None:
                owed.rom[key] = rom
            if raw not in owed.sent.setdefault(key, []):
                owed.sent[key].append(raw)
        if owed != before:
            try:
                await self._store.run(self._store.settings.put, _key(servo.uid), owed.to_json())
            except Exception as error:
                log.exception("the original values of %s could not be stored", servo.uid)
                raise StoreFailed(
                    f"The original values of {servo.title} cannot be stored, so nothing was changed on it. Check the "
                    "data folder and its disk.",
                    cause="values_not_storable",
                    servo=servo.title,
                ) from error
        self._owed[servo.uid] = owed
        servo.overridden |= {key: owed.original[key] for key in values}

    def settle(self, servo: Servo, keys: Iterable[str]) -> None:
        """Note that these rows are restored, or that their present values are kept."""
        owed = self._owed.get(servo.uid)
        for key in keys:
            servo.overridden.pop(key, None)
            if owed is not None:
                owed.original.pop(key, None)
                owed.sent.pop(key, None)
        if owed is not None:
            self._write(servo.uid, owed)

    async def restore(
        self, servo: Servo, before_each: Callable[[], object] = lambda: None, but: Collection[str] = ()
    ) -> list[str]:
        """Restore all rows except `but`, last one first, and verify them. Returns the keys that were not restored.

        Ends at the first row without a response, because the servo is not there. `before_each` is called before every
        write, each of which may take 3 s.
        """
        owed = self._current(servo)
        if owed is not None and owed.boot_count is None:
            return []  # it is compared first
        keys: list[str] = [] if owed is None else [key for key in reversed(owed.original) if key not in but]
        for key in keys:
            if owed is None or self._current(servo) is not owed:  # it restarted
                return []
            before_each()
            raw = owed.original[key]
            try:
                held = await self._requests.write(servo, servo.registers[key].parameter, raw, _RESTORE)
            except (NoResponse, BusDisconnected):
                break
            except HornbillError:
                continue
            if held == raw and self._current(servo) is owed:
                self.settle(servo, [key])
        if owed is None or self._current(servo) is not owed:
            return []
        return [key for key in keys if key in owed.original]

    def leave(self, servo: Servo) -> None:
        """Take over what the user of the temporary values could not restore, and report it."""
        owed = self._current(servo)
        if owed is None or servo.restoring or owed.boot_count is None:
            return
        keys = [*reversed(owed.original)]
        text = (
            f"Not restored yet on {servo.title}: {', '.join(keys)}. These rows have temporary values, in RAM only. "
            "hornbill restores them as soon as the servo responds; a restart of the servo restores them, too."
        )
        params: dict[str, object] = {"servo": servo.title, "keys": keys}
        self._hub.publish(LogEvent("warning", "not_restored", text, servo.uid, params))
        self._begin(servo)

    def forget(self, uid: Uid) -> None:
        """Delete the record of a servo."""
        self._owed.pop(uid, None)
        self._write(uid, None)

    async def close(self) -> None:
        """End all attempts. What is still owed stays stored."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _current(self, servo: Servo) -> Owed | None:
        """What is owed to a servo that has not restarted since, as far as is known."""
        owed = self._owed.get(servo.uid)
        return owed if owed is not None and owed.original and owed.boot_count in (None, servo.boot_count) else None

    def _begin(self, servo: Servo) -> None:
        servo.restoring = True
        if servo.uid not in self._tasks:
            task = self._tasks[servo.uid] = asyncio.get_running_loop().create_task(self._keep_restoring(servo))
            task.add_done_callback(lambda _done: self._tasks.pop(servo.uid, None))
        self._hub.publish(ServoChanged(servo.uid))

    async def _keep_restoring(self, servo: Servo) -> None:
        """Restore as soon as the servo is ready, and again until nothing is owed or it is offline (see `_on_seen`).

        Only after its next status each time, which would reveal a restart.
        """
        interval, longest = RETRY_S
        since = self._base.now()
        while (owed := self._current(servo)) is not None and servo.online:
            told = servo.status_at is not None and servo.status_at > since
            if not told or servo.state not in (State.READY, State.PROTECTED) or servo.changing.locked():
                await asyncio.sleep(CHECK_PERIOD_S)
                continue
            if owed.boot_count is None:
                self._compare(servo, owed)
                continue
            keys = [*reversed(owed.original)]
            async with servo.changing:
                left = await self.restore(servo)
            if not left:
                self._over(servo, keys)
                return
            since = self._base.now()
            await asyncio.sleep(interval)
            interval = min(2 * interval, longest)
        if servo.restoring and not servo.overridden:
            self._over(servo, [])

    def _compare(self, servo: Servo, owed: Owed) -> None:
        """Compare a record with the servo, whose rows were just read.

        A row is restored only if it still has a temporary value. After a restart it may have that value from ROM.
        """
        owed.boot_count = servo.boot_count
        servo.overridden |= owed.original
        # the clock of this computer may have been set, so it alone proves no restart
        late = owed.restarted or self._late(servo, owed)
        if owed.restarted:
            owed.original |= {key: raw for key, raw in owed.rom.items() if key in owed.original}
            servo.overridden |= owed.original
        done: list[str] = []
        for key, original in owed.original.items():
            register = servo.registers.get(key)
            unknown = None if register is None or owed.restarted else register.raw
            from_rom = late and register is not None and owed.rom.get(key, unknown) == register.raw
            temporary = register is not None and register.raw in owed.sent[key] and register.raw != original
            if from_rom or not temporary:
                done.append(key)
        self.settle(servo, done)

    def _late(self, servo: Servo, owed: Owed) -> bool:
        """Whether its uptime is too short for a servo that ran on since."""
        uptime = 0 if servo.status is None else servo.status.uptime_sec
        return uptime + RESTARTED_S < owed.uptime_s + self._base.utc_now() - owed.at

    def _over(self, servo: Servo, keys: list[str]) -> None:
        servo.restoring = False
        if keys:
            text = f"The temporary values of {servo.title} were restored and verified: {', '.join(keys)}."
            params: dict[str, object] = {"servo": servo.title, "keys": keys}
            self._hub.publish(LogEvent("info", "restored_later", text, servo.uid, params))
        self._hub.publish(ServoChanged(servo.uid))

    def _on_seen(self, uid: Uid) -> None:
        """Take up a record of an earlier server before anything is read, or one from before the servo was offline."""
        servo = self._find(uid)
        if servo is None or servo.recorded or self._requests.silent:
            return
        if uid not in self._owed:
            stored = self._stored(uid)
            if stored is None or not stored.original:
                return
            if servo.status is not None and servo.status.uptime_sec < stored.uptime_s:
                self.forget(uid)  # it restarted
                return
            self._owed[uid] = stored
            if not self._late(servo, stored):
                servo.overridden |= stored.original
        if self._current(servo) is not None and not servo.changing.locked():
            self._begin(servo)

    def _on_changed(self, uid: Uid) -> None:
        """Drop what is owed to a servo that has restarted. Cheap if there is nothing to do.

        Not rows that may have been written after it started and before that was noticed: they are compared.
        """
        owed = self._owed.get(uid)
        servo = None if owed is None else self._find(uid)
        if owed is None or servo is None or servo.recorded or owed.boot_count in (None, servo.boot_count):
            return
        uptime = 0 if servo.status is None else servo.status.uptime_sec
        started = (self._base.now() if servo.status_at is None else servo.status_at) - uptime - RESTARTED_S
        late = [key for key in owed.original if servo.registers[key].written_at >= started]
        self.settle(servo, [key for key in owed.original if key not in late])
        if late:
            owed.boot_count, owed.restarted = None, True
            servo.overridden = dict(owed.original)
            self._begin(servo)
        else:
            self.forget(uid)
            if servo.restoring:
                self._over(servo, [])

    def _stored(self, uid: Uid) -> Owed | None:
        try:
            return Owed.of(self._store.settings.get(_key(uid)))
        except Exception:
            log.exception("the original values of %s could not be read", uid)
            return None

    def _write(self, uid: Uid, owed: Owed | None) -> None:
        """Store a record behind. Never raises: a record that remains is compared with RAM before it is used."""
        settings = self._store.settings
        try:
            settings.put(_key(uid), owed.to_json()) if owed is not None and owed.original else settings.drop(_key(uid))
        except Exception:
            log.exception("the original values of %s could not be stored", uid)


class TemporaryValues:
    """Temporary values of one servo. They are only in RAM: a restart restores the values from ROM (4.10).

    Use under the servo's `changing` lock; end with `restore`.
    """

    def __init__(self, owed: OwedValues, requests: ServoRequests, servo: Servo) -> None:
        self._owed = owed
        self._requests = requests
        self._servo = servo
        self._boot_count = servo.boot_count

    async def set(self, values: Mapping[str, Raw]) -> None:
        """Write temporary values in this order to rows that were just read.

        Raises StoreFailed before anything is written; NoResponse, Refused, BusDisconnected; and UnexpectedResult if the
        servo restarted or set a different value.
        """
        servo = self._servo
        if servo.boot_count != self._boot_count:
            raise UnexpectedResult(
                f"{servo.title} restarted meanwhile. Its values are those in ROM.",
                cause="servo_restarted",
                servo=servo.title,
            )
        values = {key: raw for key, raw in values.items() if servo.raw(key) != raw}
        if not values:
            return
        await self._owed.add(servo, values)  # before the write, which may arrive even without a response
        for key, raw in values.items():
            row = servo.registers[key].parameter
            held = await self._requests.write(servo, row, raw, _RESTORE)
            if held != raw:
                raise UnexpectedResult(
                    f"{servo.title} was sent {scale.to_text(row, raw)} as {row.label.lower()} but has "
                    f"{scale.to_text(row, held)}.",
                    key=key,
                    cause="value_changed_by_servo",
                    servo=servo.title,
                )

    def keep(self, keys: Iterable[str]) -> None:
        """Keep the present values of these rows: they count as configured from now on."""
        self._owed.settle(self._servo, keys)

    async def restore(self, before_each: Callable[[], object] = lambda: None, but: Collection[str] = ()) -> list[str]:
        """Restore all rows except `but` and verify them. Returns the keys that follow as soon as the servo responds.

        `before_each` is called before every write, each of which may take 3 s.
        """
        left = await self._owed.restore(self._servo, before_each, but)
        if left:
            self._owed.leave(self._servo)
        return left

    async def restore_all(self, before_each: Callable[[], object] = lambda: None, but: Collection[str] = ()) -> None:
        """As `restore`, also if the caller is cancelled. Raises UnexpectedResult if a row could not be restored."""
        if left := await shielded(self.restore(before_each, but)):
            raise not_restored(self._servo, left)


def not_restored(servo: Servo, keys: list[str]) -> UnexpectedResult:
    """The problem that rows do not have their original values."""
    return UnexpectedResult(
        f"The original values of {servo.title} could not be verified.",
        keys=keys,
        cause="rows_not_restored",
        servo=servo.title,
    )


def tightened(servo: Servo, speed_rpm: float | None, torque_pct: float | None) -> dict[str, Raw]:
    """Raw limits of speed and torque, in both directions, none wider than the present ones, which were just read."""
    limits: dict[str, Raw] = {}
    for key, most in zip(FORCE_LIMITS, (speed_rpm, speed_rpm, torque_pct, torque_pct), strict=True):
        if most is not None:
            held, wanted = servo.raw(key) or 0, round(most * servo.registers[key].parameter.per_unit)
            limits[key] = max(held, -wanted) if key.endswith("ccw") else min(held, wanted)
    return limits


def _key(uid: Uid) -> str:
    return f"temporary_values.{uid}"

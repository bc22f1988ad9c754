"""Steps of a probe, in order, with the confirmation required before each.

All requests use the server, so all its rules apply: ranges, motion control, Stop, the guard before the wire. A probe
writes one row (to RAM), saves only values already in ROM, and leaves torque off on a servo it moved.
"""

import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, TypeAlias

from hornbill.client import Hornbill, Servo, WaitTimeout
from hornbill.errors import Conflict, HornbillError, Stopped
from hornbill.probe.evaluation import ProbeAnswer, array_command
from hornbill.probe.evaluation import answers as evaluate
from hornbill.probe.evidence import ProbeEvidence
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS

Confirm: TypeAlias = Callable[[str], bool]
Report: TypeAlias = Callable[[str], None]

LISTEN_S: Final = 4.0
"""Listening time, s: several NodeStatus and forty Status."""
AWAY_DEG: Final = 20.0
SLOWLY_DEG_S: Final = 30.0
BURST_DEG: Final = 5.0
MARK: Final = "angle_dead_band"
"""The row written to RAM to check that a restart discards it. A change by one step moves nothing."""
LOG_MB: Final = 50.0
READY_WITHIN_S: Final = 30.0


@dataclass
class ProbeResult:
    """Result of a probe: the servo, completed and skipped steps, and all answers."""

    servo: dict[str, object]
    started_at: float
    completed: list[str] = field(default_factory=list[str])
    skipped: dict[str, str] = field(default_factory=dict[str, str])
    answers: list[ProbeAnswer] = field(default_factory=list[ProbeAnswer])
    recording: bytes = b""


class Probe:
    """One probe of one servo. `confirm` is called with a description of a step and returns whether to run it."""

    def __init__(
        self,
        hornbill: Hornbill,
        servo: Servo,
        confirm: Confirm,
        report: Report = lambda _text: None,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._hornbill = hornbill
        self._servo = servo
        self._confirm = confirm
        self._report = report
        self._sleep = sleep
        self._nodes: set[int] = set()
        self._extra: list[ProbeAnswer] = []
        self._target: float | None = None
        self._refused: str | None = None

    def run(self) -> ProbeResult:
        """Run the confirmed steps and answer the questions.

        Raises Conflict for a servo with unsaved values (a restart would lose them), Stopped while a stop is latched,
        and errors of reading. Errors in other steps are in the report.
        """
        self._check_first()
        known = self._servo.known
        result = ProbeResult({key: known[key] for key in _SHOWN}, time.time())  # pyright: ignore[reportTypedDictNotRequiredAccess]
        with self._recording(result):
            self._step(result, "read", None, self._read)
            self._step(result, "move", self._move_text(), self._move)
            self._step(result, "restart", self._restart_text(save=False), self._restart)
            self._step(result, "save", self._restart_text(save=True), self._save)
        with tempfile.TemporaryDirectory(prefix="hornbill-probe-") as folder:
            file = Path(folder) / "probe.log"
            file.write_bytes(result.recording)
            seen = ProbeEvidence.read(file, self._nodes)
            result.answers = [*evaluate(seen), *self._array_command(seen), *self._extra]
        return result

    def _check_first(self) -> None:
        stop = self._hornbill.stop_state()
        if stop["latched"]:
            raise Stopped(
                f"Stopped by {stop['by']}. Check the servo, then clear the stop: 'hornbill stop --clear'.", cause=None
            )
        servo = self._servo.refresh()
        if servo["state"] not in ("ready", "soft_start"):
            raise Conflict(
                f"{self._servo.title} is {servo['state']}. Check its supply and connector first.", cause=None
            )
        # Torque off is not an unsaved setting: a restart restores the value in ROM, and the forecast says so.
        rows = ", ".join(key for key in servo["unsaved"] if key != "torque_mode")
        if rows:
            raise Conflict(
                f"A restart of {self._servo.title} would lose unsaved values: {rows}. Save or restore them first.",
                cause=None,
            )
        self._note_node()

    def _step(self, result: ProbeResult, name: str, question: str | None, do: Callable[[], None]) -> None:
        if question is not None and not self._confirm(question):
            result.skipped[name] = "not confirmed"
            return
        self._report(f"{name} …")
        try:
            if question is None:
                do()
            else:
                with self._hornbill.lease(self._hornbill.by):
                    do()
        except HornbillError as error:
            if question is None:
                raise
            result.skipped[name] = f"{error.code}: {error.detail}"
            self._report(f"{name} failed: {error.detail}")
            return
        result.completed.append(name)

    def _read(self) -> None:
        """Read all rows of the servo, then record its broadcasts and 0x08."""
        self._servo.read_all()
        self._record(LISTEN_S)

    def _move_text(self) -> str:
        return (
            f"Turns torque on at the present angle, moves {AWAY_DEG:g}° at {SLOWLY_DEG_S:g} °/s and then "
            f"{BURST_DEG:g}° in one step, then turns torque off. Can the horn move freely?"
        )

    def _move(self) -> None:
        low, high = self._limits()
        start = self._angle()
        away = AWAY_DEG if start + AWAY_DEG <= high else -AWAY_DEG
        target = min(max(start + away, low), high)
        self._servo.torque("on")
        self._servo.move(target, timeout_s=10, speed_deg_s=SLOWLY_DEG_S)
        self._record(1.5)
        self._burst(target - BURST_DEG * (1 if away > 0 else -1))

    def _burst(self, target: float) -> None:
        """Move by ArrayCommand, which has no response: 0x08 and 0x00 show its effect."""
        self._target = target
        try:
            self._hornbill.command_many([(self._servo, "angle", target)])
        except HornbillError as error:
            self._refused = error.detail
            return
        self._record(1.0)

    def _array_command(self, seen: ProbeEvidence) -> list[ProbeAnswer]:
        """Answers about ArrayCommand, none if the horn was not moved."""
        servo_id = self._servo.known["servo_id"]
        if self._target is None or servo_id is None:
            return []
        found = array_command(seen, servo_id, self._target)
        return found if self._refused is None else [replace(one, value=None, text=self._refused) for one in found]

    def _restart_text(self, *, save: bool) -> str:
        path = f"/servos/{self._servo.uid}/restart-forecast"
        forecast = str(self._hornbill.request("GET", path, save=save)["text"])
        action = "Saves (ROM is written with its present values) and restarts" if save else (
            f"Writes {MARK} to RAM, restarts, and checks that the value is lost"
        )  # fmt: skip
        return f"{action}. {forecast}"

    def _restart(self) -> None:
        before = self._servo.reading(MARK)
        value = before["value"]
        if not isinstance(value, (int, float)):
            raise Conflict(f"{MARK} cannot be read, so loss of RAM could not be detected.", cause=None)
        step = 1 / max(1, round(abs(before["raw"] or 1) / abs(value))) if value else 0.1
        highest = before["maximum"]
        other = value + step if highest is None or value + step <= highest else value - step
        self._servo.write(MARK, round(other, 3))
        self._run_job("restart")
        after = self._servo.read(MARK)
        self._extra.append(
            ProbeAnswer("restart_loses_ram", "Does a restart discard unsaved values?", after == value,
                   "Yes." if after == value else "No.", f"{MARK} {value} → {other:g} in RAM, {after} after the restart")
        )  # fmt: skip
        self._record(2.5)

    def _save(self) -> None:
        if self._servo.refresh()["unsaved"]:
            raise Conflict("RAM differs from ROM, so nothing is saved.", cause=None)
        self._run_job("save")
        self._record(2.5)

    def _run_job(self, kind: str) -> None:
        """Run a job, and during soft start read the rows documented to change then."""
        ramped = [key for key, row in Catalog.load().parameters.items() if row.soft_start is not None]
        job = str(self._hornbill.request("POST", f"/servos/{self._servo.uid}/{kind}")["id"])
        was_read = False
        until = time.monotonic() + READY_WITHIN_S
        while True:
            seen = self._hornbill.request("GET", f"/jobs/{job}")
            self._note_node()
            if not was_read and self._servo.known["state"] == "soft_start":
                was_read = True
                for key in ramped:
                    self._try_read(key)
            if seen["state"] not in ("queued", "running"):
                break
            if time.monotonic() > until:
                raise WaitTimeout(f"The {kind} timed out after {READY_WITHIN_S:g} s.", cause=None)
            self._sleep(0.1)
        if seen["state"] != "succeeded":
            raise Conflict(f"The {kind} failed: {(seen['error'] or {}).get('detail', seen['state'])}", cause=None)
        for key in ramped:
            self._try_read(key)

    def _record(self, seconds: float) -> None:
        """Read 0x08 and the commands periodically, to compare them with the broadcasts."""
        for turn in range(max(1, round(seconds / 0.25))):
            self._try_read("current_angle")
            if turn % 4 == 0:
                for key in COMMANDS:
                    self._try_read(key)
            self._sleep(0.25)

    def _try_read(self, key: str) -> None:
        """Read a row for the log. A missing row or response is a result, too."""
        try:
            self._servo.reading(key)
        except HornbillError:
            return

    def _angle(self) -> float:
        value = self._servo.read("current_angle")
        if not isinstance(value, (int, float)):
            raise Conflict("0x08 has no angle: the horn is not moved.", cause=None)
        return float(value)

    def _limits(self) -> tuple[float, float]:
        rows = self._servo.read_all(refresh=False)["parameters"]
        limits = [rows[key]["value"] for key in ("angle_limit_cw", "angle_limit_ccw")]
        numbers = sorted(float(one) for one in limits if isinstance(one, (int, float)))
        if len(numbers) != 2:
            raise Conflict("The angle limits cannot be read: the horn is not moved.", cause=None)
        return numbers[0], numbers[1]

    def _note_node(self) -> None:
        node = self._servo.refresh()["node_id"]
        if node is not None:
            self._nodes.add(node)

    @contextmanager
    def _recording(self, result: ProbeResult) -> Generator[None]:
        """Log the bus on the server meanwhile. Raises Busy if a log is running."""
        name = f"probe-{result.servo['serial'] or self._servo.uid[:8]}-{time.strftime('%Y%m%d-%H%M%S')}"
        body = {"format": "candump", "name": name, "limit_mb": LOG_MB}
        self._hornbill.request("POST", "/bus/log", body)
        try:
            yield
        finally:
            log = self._hornbill.request("DELETE", "/bus/log")
        result.recording = self._hornbill.download(f"/bus/logs/{log['name']}")


_SHOWN: Final = ("uid", "label", "serial", "model", "firmware", "hardware_version", "production_date", "node_id",
                 "servo_id", "name")  # fmt: skip

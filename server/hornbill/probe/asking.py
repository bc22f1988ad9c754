"""The steps of a probe: what is done to the servo, in which order, and what has to be agreed to before.

Everything goes through the server, so all its rules hold: ranges, motion control, the stop, the guard before the wire.
A probe writes one row of its own choice (to RAM), saves nothing but what ROM held already, and leaves torque off on
what it moved.
"""

import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeAlias

from hornbill.client import Hornbill, Servo, TookTooLong
from hornbill.errors import Conflict, HornbillError, Stopped
from hornbill.probe.evidence import ProbeEvidence
from hornbill.probe.judging import ProbeAnswer
from hornbill.probe.judging import answers as judged
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS

Agree: TypeAlias = Callable[[str], bool]
Tell: TypeAlias = Callable[[str], None]

LISTEN_S: Final = 4.0
"""Long enough for some NodeStatus and forty Status."""
AWAY_DEG: Final = 20.0
SLOWLY_DEG_S: Final = 30.0
BURST_DEG: Final = 5.0
MARK: Final = "angle_dead_band"
"""The row that is written to RAM to see it go: it moves nothing by a step of one."""
LOG_MB: Final = 50.0
READY_WITHIN_S: Final = 30.0


@dataclass
class Probed:
    """What came out: of which servo, what was done, what was not and why, and every answer."""

    servo: dict[str, object]
    began: float
    done: list[str] = field(default_factory=list[str])
    left_out: dict[str, str] = field(default_factory=dict[str, str])
    answers: list[ProbeAnswer] = field(default_factory=list[ProbeAnswer])
    recording: bytes = b""


class Probe:
    """One probe of one servo. `agree` is shown what a step will do and says whether it may."""

    def __init__(
        self,
        hornbill: Hornbill,
        servo: Servo,
        agree: Agree,
        tell: Tell = lambda _text: None,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._hornbill = hornbill
        self._servo = servo
        self._agree = agree
        self._tell = tell
        self._sleep = sleep
        self._nodes: set[int] = set()
        self._extra: list[ProbeAnswer] = []

    def run(self) -> Probed:
        """Do what is agreed to and answer what can be.

        Raises Conflict for a servo with unsaved values (a restart would lose them), Stopped while a stop is latched,
        and what reading raises. What goes wrong in a step that acts is in the report.
        """
        self._look_first()
        known = self._servo.known
        probed = Probed({key: known[key] for key in _SHOWN}, time.time())  # pyright: ignore[reportTypedDictNotRequiredAccess]
        with self._recording(probed):
            self._step(probed, "read", None, self._read)
            self._step(probed, "move", self._move_text(), self._move)
            self._step(probed, "restart", self._restart_text(save=False), self._restart)
            self._step(probed, "save", self._restart_text(save=True), self._save)
        with tempfile.TemporaryDirectory(prefix="hornbill-probe-") as folder:
            file = Path(folder) / "probe.log"
            file.write_bytes(probed.recording)
            probed.answers = [*judged(ProbeEvidence.read(file, self._nodes)), *self._extra]
        return probed

    def _look_first(self) -> None:
        stop = self._hornbill.stop_state()
        if stop["latched"]:
            raise Stopped(
                f"Stopped by {stop['by']}. Look at the servo, then clear it: 'hornbill stop --clear'.", cause=None
            )
        servo = self._servo.refresh()
        if servo["state"] not in ("ready", "soft_start"):
            raise Conflict(
                f"{self._servo.title} is {servo['state']}: look at its supply and its plug first.", cause=None
            )
        # Torque that was turned off is no configuration: a restart brings back what ROM says, and tells so beforehand.
        rows = ", ".join(key for key in servo["unsaved"] if key != "torque_mode")
        if rows:
            raise Conflict(
                f"{rows} of {self._servo.title} would be lost in a restart: save or restore first.", cause=None
            )
        self._note_node()

    def _step(self, probed: Probed, name: str, question: str | None, do: Callable[[], None]) -> None:
        if question is not None and not self._agree(question):
            probed.left_out[name] = "not agreed to"
            return
        self._tell(f"{name} …")
        try:
            if question is None:
                do()
            else:
                with self._hornbill.lease(self._hornbill.by):
                    do()
        except HornbillError as error:
            if question is None:
                raise
            probed.left_out[name] = f"{error.code}: {error.detail}"
            self._tell(f"{name} failed: {error.detail}")
            return
        probed.done.append(name)

    def _read(self) -> None:
        """Every row of the servo, then its broadcasts beside 0x08."""
        self._servo.read_all()
        self._watch(LISTEN_S)

    def _move_text(self) -> str:
        return (
            f"Turn torque on where the horn stands, go {AWAY_DEG:g}° away at {SLOWLY_DEG_S:g} °/s and a last "
            f"{BURST_DEG:g}° in one step, then torque off. It is free to move?"
        )

    def _move(self) -> None:
        low, high = self._limits()
        here = self._angle()
        away = AWAY_DEG if here + AWAY_DEG <= high else -AWAY_DEG
        target = min(max(here + away, low), high)
        self._servo.torque("on")
        self._servo.move(target, timeout_s=10, speed_deg_s=SLOWLY_DEG_S)
        self._watch(1.5)
        self._burst(target - BURST_DEG * (1 if away > 0 else -1))

    def _burst(self, target: float) -> None:
        """The last bit by ArrayCommand, which answers nothing: 0x08 and 0x00 tell what came of it."""
        obeyed, shows = "Is ArrayCommand obeyed, in that unit?", "Does 0x00 read what ArrayCommand commanded?"
        try:
            self._hornbill.command_many([(self._servo, "angle", target)])
        except HornbillError as error:
            for key, question in (("array_command_obeyed", obeyed), ("array_command_shows", shows)):
                self._extra.append(ProbeAnswer(key, question, None, error.detail))
            return
        self._watch(1.0)
        there, command = self._angle(), self._servo.read("command_angle")
        near = abs(there - target) < 1
        self._extra.append(
            ProbeAnswer("array_command_obeyed", obeyed, near, "Yes." if near else "No.",
                   f"commanded {target:.1f}°, stands at {there:.1f}°")
        )  # fmt: skip
        told = isinstance(command, (int, float)) and abs(command - target) < 0.2
        self._extra.append(
            ProbeAnswer("array_command_shows", shows, told, "Yes." if told else "No.", f"it reads {command}",
                   "array_command_shows")
        )  # fmt: skip

    def _restart_text(self, *, save: bool) -> str:
        path = f"/servos/{self._servo.uid}/restart-forecast"
        told = str(self._hornbill.ask("GET", path, save=save)["text"])
        what = "Save (ROM is written with what it holds already) and restart" if save else (
            f"Write {MARK} to RAM, restart, and see it gone"
        )  # fmt: skip
        return f"{what}. {told}"

    def _restart(self) -> None:
        before = self._servo.reading(MARK)
        value = before["value"]
        if not isinstance(value, (int, float)):
            raise Conflict(f"{MARK} cannot be read, so that nothing would show whether RAM is lost.", cause=None)
        step = 1 / max(1, round(abs(before["raw"] or 1) / abs(value))) if value else 0.1
        highest = before["maximum"]
        other = value + step if highest is None or value + step <= highest else value - step
        self._servo.write(MARK, round(other, 3))
        self._begin("restart")
        after = self._servo.read(MARK)
        self._extra.append(
            ProbeAnswer("restart_loses_ram", "Is what was not saved gone after a restart?", after == value,
                   "Yes." if after == value else "No.", f"{MARK} {value} → {other:g} in RAM, {after} after the restart")
        )  # fmt: skip
        self._watch(2.5)

    def _save(self) -> None:
        if self._servo.refresh()["unsaved"]:
            raise Conflict("RAM is not what ROM holds, so nothing is saved.", cause=None)
        self._begin("save")
        self._watch(2.5)

    def _begin(self, kind: str) -> None:
        """A job, and while the servo starts softly the rows that are said to change then."""
        ramped = [key for key, row in Catalog.load().parameters.items() if row.soft_start is not None]
        job = str(self._hornbill.ask("POST", f"/servos/{self._servo.uid}/{kind}")["id"])
        asked = False
        until = time.monotonic() + READY_WITHIN_S
        while True:
            seen = self._hornbill.ask("GET", f"/jobs/{job}")
            self._note_node()
            if not asked and self._servo.known["state"] == "soft_start":
                asked = True
                for key in ramped:
                    self._quietly(key)
            if seen["state"] not in ("queued", "running"):
                break
            if time.monotonic() > until:
                raise TookTooLong(f"The {kind} is not done after {READY_WITHIN_S:g} s.", cause=None)
            self._sleep(0.1)
        if seen["state"] != "succeeded":
            raise Conflict(
                f"The {kind} did not succeed: {(seen['error'] or {}).get('detail', seen['state'])}", cause=None
            )
        for key in ramped:
            self._quietly(key)

    def _watch(self, seconds: float) -> None:
        """Reads 0x08 and the commands now and then, so that they stand beside what is broadcast."""
        for turn in range(max(1, round(seconds / 0.25))):
            self._quietly("current_angle")
            if turn % 4 == 0:
                for key in COMMANDS:
                    self._quietly(key)
            self._sleep(0.25)

    def _quietly(self, key: str) -> None:
        """A reading for the recording; a servo that lacks it or is silent for a moment is an answer, too."""
        try:
            self._servo.reading(key)
        except HornbillError:
            return

    def _angle(self) -> float:
        value = self._servo.read("current_angle")
        if not isinstance(value, (int, float)):
            raise Conflict("0x08 reads no angle: the horn is not moved.", cause=None)
        return float(value)

    def _limits(self) -> tuple[float, float]:
        rows = self._servo.read_all(refresh=False)["parameters"]
        found = [rows[key]["value"] for key in ("angle_limit_cw", "angle_limit_ccw")]
        numbers = sorted(float(one) for one in found if isinstance(one, (int, float)))
        if len(numbers) != 2:
            raise Conflict("The angle limits cannot be read: the horn is not moved.", cause=None)
        return numbers[0], numbers[1]

    def _note_node(self) -> None:
        node = self._servo.refresh()["node_id"]
        if node is not None:
            self._nodes.add(node)

    @contextmanager
    def _recording(self, probed: Probed) -> Generator[None]:
        """The bus is logged meanwhile, on the server. Raises Busy when a log is being written already."""
        name = f"probe-{probed.servo['serial'] or self._servo.uid[:8]}-{time.strftime('%Y%m%d-%H%M%S')}"
        body = {"format": "candump", "name": name, "limit_mb": LOG_MB}
        self._hornbill.ask("POST", "/bus/log", body)
        try:
            yield
        finally:
            log = self._hornbill.ask("DELETE", "/bus/log")
        probed.recording = self._hornbill.download(f"/bus/logs/{log['name']}")


_SHOWN: Final = ("uid", "label", "serial", "model", "firmware", "hardware_version", "production_date", "node_id",
                 "servo_id", "name")  # fmt: skip

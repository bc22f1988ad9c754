"""Owns Request, Unit and Run: what a commissioning job was asked for, and how far each of its servos came."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from hornbill.errors import HornbillError
from hornbill.schema.scale import Value
from hornbill.servo.configuration.commission_plan import Stage, Wanted
from hornbill.servo.configuration.profiles import Profile, Profiles
from hornbill.servo.configuration.sheet import Sheet
from hornbill.servo.jobs import Job
from hornbill.servo.servo import Servo
from hornbill.units import Raw, Uid


@dataclass(frozen=True, slots=True)
class Request:
    """What was asked for; `profile` as it was then. It is kept with the job, and enough to go on with it."""

    wanted: tuple[Wanted, ...]
    profile: Mapping[str, Any] | None
    save: bool
    identify: bool
    on_anomaly: Literal["stop", "continue"]
    confirm: tuple[str, ...]

    @property
    def uids(self) -> list[Uid]:
        """Whom it is about."""
        return [one.uid for one in self.wanted]

    @property
    def kinds(self) -> list[str]:
        """The steps of a unit."""
        asked = {"identify": self.identify, "write": True, "save": self.save, "verify": True}
        return [kind for kind, wished in asked.items() if wished]

    def document(self) -> dict[str, object]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "Request":
        """As it was kept."""
        wanted = tuple(Wanted(**one) for one in document["wanted"])
        return cls(
            wanted, document["profile"], document["save"], document["identify"], document["on_anomaly"],
            tuple(document["confirm"]),
        )  # fmt: skip


@dataclass(slots=True)
class Unit:
    """One servo of the job and how far it came. `finished`: in an earlier run of the job."""

    place: int
    wanted: Wanted
    sheet: Sheet
    finished: bool = False
    problem: HornbillError | None = None
    aside: Raw | None = None

    @property
    def title(self) -> str:
        """What to call it in a sentence."""
        return self.sheet.title or f"servo {self.wanted.uid[:8]}"


@dataclass(slots=True)
class Run:
    """One run of a job. `pinned`: servos whose allocation was pinned on the way, and is to be forgotten."""

    job: Job
    request: Request
    units: Sequence[Unit]
    order: Sequence[Stage]
    lease_id: str | None
    by: str
    pinned: set[Uid] = field(default_factory=set[Uid])

    @property
    def stopped(self) -> bool:
        """Whether an anomaly ends it here."""
        return self.request.on_anomaly == "stop" and any(unit.problem is not None for unit in self.units)

    def unit(self, uid: Uid) -> Unit:
        """The unit of that servo."""
        return next(unit for unit in self.units if unit.wanted.uid == uid)

    @property
    def fixed(self) -> set[int]:
        """The static node ids this job gives."""
        return {one.node_id for one in self.request.wanted if one.node_id}

    def leaving(self) -> list[Uid]:
        """Servos whose ids do not count as taken: this job moves them. One that failed keeps its own."""
        return [unit.wanted.uid for unit in self.units if unit.problem is None]

    def result(self) -> dict[str, object]:
        """The job's result as of now."""
        profile = self.request.profile
        done = sum(unit.sheet.verdict == "done" for unit in self.units)
        told = "" if self.request.save else " Nothing of it is in ROM: it is lost at the next restart."
        return {
            "units": [unit.sheet.document() for unit in self.units],
            "profile": None if profile is None else profile["name"],
            "saved": self.request.save,
            "done": done,
            "pinned": sorted(self.pinned),
            "text": f"{done} of {len(self.units)} servos are commissioned.{told}",
        }

    def tell(self) -> None:
        """Let the job keep what is known now; the next change of a step carries it into the store."""
        self.job.result = self.result()


def wanted_values(profiles: Profiles, request: Request, one: Wanted, servo: Servo) -> dict[str, Value]:
    """Everything to write to a servo: the profile's values without identity rows, and its ids.

    Raises NotInThisModel, OutOfRange, InvalidValue: then nothing of it is to be written.
    """
    values: dict[str, Value] = {}
    if request.profile is not None:
        taken, _ = profiles.values_for(Profile(**request.profile), servo)
        values = {key: value for key, value in taken.items() if not servo.registers[key].parameter.identity}
    ids = {"servo_id": one.servo_id, "node_id": one.node_id}
    return values | {key: number for key, number in ids.items() if number is not None}

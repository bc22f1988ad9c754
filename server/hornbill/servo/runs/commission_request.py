"""Request of a commissioning job: which servos get which names, IDs and values, and how."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from hornbill.domain.profile import Profile
from hornbill.errors import Conflict, InvalidValue
from hornbill.schema.scale import Value
from hornbill.servo.configuration.torque_in_rom import confirmed
from hornbill.servo.device.servo import Servo
from hornbill.servo.profiles.profiles import Profiles
from hornbill.servo.runs.fleet_run import OnAnomaly
from hornbill.units import Raw, Uid


@dataclass(frozen=True, slots=True)
class Wanted:
    """Requested name and IDs of one servo. None and "" leave them unchanged; `node_id` 0 is dynamic."""

    uid: Uid
    servo_id: int | None = None
    node_id: int | None = None
    label: str = ""

    @property
    def ids(self) -> dict[str, int | None]:
        """The number of each ID row."""
        return {"servo_id": self.servo_id, "node_id": self.node_id}


@dataclass(frozen=True, slots=True)
class CommissionRequest:
    """One request, with a copy of the profile. Stored with the job, and enough to resume it."""

    wanted: tuple[Wanted, ...]
    profile: Mapping[str, Any] | None
    save: bool
    identify: bool
    on_anomaly: OnAnomaly
    confirm: tuple[str, ...]
    torque: Mapping[str, Raw | None] = field(default_factory=dict[str, Raw | None])
    """By uid: the 0x20 to be in ROM, decided when the job was requested. ROM may be unknown when it is resumed."""

    @property
    def uids(self) -> list[Uid]:
        """The servos of the request."""
        return [one.uid for one in self.wanted]

    @property
    def kinds(self) -> list[str]:
        """The steps of a target."""
        asked = {"identify": self.identify, "write": True, "save": self.save, "verify": True}
        return [kind for kind, wished in asked.items() if wished]

    @property
    def fixed(self) -> set[int]:
        """The static node IDs it gives."""
        return {one.node_id for one in self.wanted if one.node_id}

    def words(self, values: Mapping[str, object]) -> tuple[str, ...]:
        """What is confirmed when these values are saved."""
        return confirmed(self.confirm, values)

    def document(self) -> dict[str, object]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "CommissionRequest":
        """As it was stored."""
        wanted = tuple(Wanted(**one) for one in document["wanted"])
        return cls(
            wanted, document["profile"], document["save"], document["identify"], document["on_anomaly"],
            tuple(document["confirm"]), document.get("torque", {}),
        )  # fmt: skip


def check_wanted(wanted: Sequence[Wanted]) -> None:
    """Raises InvalidValue for a servo named twice, Conflict for an id asked for twice; the owner is the first."""
    named: set[Uid] = set()
    owners: dict[tuple[str, int], Uid] = {}
    for one in wanted:
        if one.uid in named:
            raise InvalidValue(f"Servo {one.uid} is named twice. Name each once.", uid=one.uid, cause="named_twice")
        named.add(one.uid)
        for key, number in one.ids.items():
            owner = owners.setdefault((key, number or 0), one.uid)
            if number and owner != one.uid:
                raise Conflict(
                    f"{key.replace('_', ' ').capitalize()} {number} is asked for by two servos, {owner[:8]} and "
                    f"{one.uid[:8]}. Give each one of its own.",
                    key=key, requested=number, owner=owner, owner_title=f"servo {owner[:8]}", cause="id_wanted_twice",
                )  # fmt: skip


def wanted_values(profiles: Profiles, request: CommissionRequest, one: Wanted, servo: Servo) -> dict[str, Value]:
    """Everything to write to a servo: the profile's values without identity rows, and its IDs.

    Raises NotInThisModel, OutOfRange, InvalidValue: then nothing of it is to be written.
    """
    values: dict[str, Value] = {}
    if request.profile is not None:
        taken, _ = profiles.values_for(Profile(**request.profile), servo)
        values = {key: value for key, value in taken.items() if not servo.registers[key].parameter.identity}
    return values | {key: number for key, number in one.ids.items() if number is not None}

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
    """The 0x20 to save, by unique ID, decided at the request because ROM may be unknown when the job is resumed."""

    @property
    def uids(self) -> list[Uid]:
        """The servos of the request."""
        return [one.uid for one in self.wanted]

    @property
    def kinds(self) -> list[str]:
        """The steps of a target."""
        kinds = {"identify": self.identify, "write": True, "save": self.save, "verify": True}
        return [kind for kind, requested in kinds.items() if requested]

    @property
    def fixed(self) -> set[int]:
        """The static node IDs in the request."""
        return {one.node_id for one in self.wanted if one.node_id}

    def words(self, values: Mapping[str, object]) -> tuple[str, ...]:
        """The confirmations for a save of these values."""
        return confirmed(self.confirm, values)

    def document(self) -> dict[str, object]:
        """The request as JSON."""
        return asdict(self)

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "CommissionRequest":
        """The request from stored JSON."""
        wanted = tuple(Wanted(**one) for one in document["wanted"])
        return cls(
            wanted, document["profile"], document["save"], document["identify"], document["on_anomaly"],
            tuple(document["confirm"]), document.get("torque", {}),
        )  # fmt: skip


def check_wanted(wanted: Sequence[Wanted]) -> None:
    """Raises InvalidValue for a duplicate servo, Conflict for a duplicate ID. The fact `owner` is its first servo."""
    listed: set[Uid] = set()
    owners: dict[tuple[str, int], Uid] = {}
    for one in wanted:
        if one.uid in listed:
            raise InvalidValue(
                f"Servo {one.uid} is listed twice. List each servo once.", uid=one.uid, cause="duplicate_servo"
            )
        listed.add(one.uid)
        for key, number in one.ids.items():
            owner = owners.setdefault((key, number or 0), one.uid)
            if number and owner != one.uid:
                raise Conflict(
                    f"{key.replace('_', ' ').capitalize()} {number} is requested for two servos, {owner[:8]} and "
                    f"{one.uid[:8]}. Assign a different ID to each servo.",
                    key=key, requested=number, owner=owner, owner_title=f"servo {owner[:8]}", cause="duplicate_id",
                )  # fmt: skip


def wanted_values(profiles: Profiles, request: CommissionRequest, one: Wanted, servo: Servo) -> dict[str, Value]:
    """Everything to write to a servo: the profile's values without identity rows, and its IDs.

    Raises NotInThisModel, OutOfRange, InvalidValue. Then nothing must be written.
    """
    values: dict[str, Value] = {}
    if request.profile is not None:
        accepted, _ = profiles.values_for(Profile(**request.profile), servo)
        values = {key: value for key, value in accepted.items() if not servo.registers[key].parameter.identity}
    return values | {key: number for key, number in one.ids.items() if number is not None}

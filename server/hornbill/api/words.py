"""Owns what a field or parameter is for, where its own declaration leaves it to its name: one meaning, wherever it is.

A name with its shape before it (`Restore.source`) is told for that shape alone. What is declared with a description
of its own keeps it. What is only answered has its words in `answer_words.py`.
tests/contract/test_operations.py holds that everything is told.
"""

from collections.abc import Iterator
from typing import Any, Final, cast

from hornbill.api.answer_words import ANSWERS

WORDS: Final = {
    "accel_deg_s2": "acceleration and deceleration, °/s²",
    "action": "what was done, as in the rows of the audit",
    "all": "also what was looked at and found well",
    "angle_deg": "where the horn stands, °",
    "band_deg": "how near is near enough, °",
    "by": "who did it, for people",
    "channels": "keys of readable parameters",
    "clamp": "bring a value beyond the servo's limits to the limit, instead of refusing it",
    "commands": "one a servo",
    "confirm": "words that a refusal `needs_confirmation` named: do it all the same",
    "dry_run": "check everything, tell what would be, send nothing that changes anything",
    "dwell_s": "how long the horn has to stay that near, s",
    "firmware": "version, as `1.300`",
    "format": "of the file",
    "frames": "what of the bus to carry, for topic `frames`",
    "from_snapshot": "id of the snapshot to take the values from",
    "from_uid": "the servo to take the values from",
    "hold": "last only while it is asked for again",
    "holder": "who has motion control, for people; a token's name is put in its place where one is needed",
    "identity": "also origin, servo id and node id (0x44 to 0x46)",
    "idle_longer_than_s": "not seen for longer than this, s",
    "If-Match": "the `revision` last read: refused as `stale_revision` when somebody has written since",
    "job_id": "of a job",
    "keep_identity": "origin, servo id and node id stay",
    "key": "of a parameter, as in the parameter manual",
    "kind": "which kind; all unless told",
    "label": "nickname",
    "lease": "id of the lease",
    "lease_id": "of a lease",
    "limit": "at most so many, the newest first",
    "limit_mb": "ends by itself at this size, MB",
    "model": "of the servo, as `BLA21-06U-A0`",
    "name": "what it is called",
    "node_id": "on the bus, 1 to 127",
    "on_anomaly": "at the first servo that does not do as told: leave the rest alone, or go on",
    "power": "of the servo",
    "problems_only": "only what makes no whole transfer",
    "profile": "speed and acceleration to go there with; at once unless told",
    "rate_hz": "how often, 1/s",
    "reason": "why, for people and the audit",
    "request_id": "of a request for motion control",
    "role": "what the token may do",
    "runs": "how often there and back",
    "save": "then write ROM: the servo restarts, its horn may move, and everything is read back",
    "serial": "as printed on the servo, such as `61-466861`",
    "servo_id": "0x45, 1 to 254; 0 is one that was never set",
    "servos": "those it concerns",
    "speed_deg_s": "greatest speed, °/s",
    "state": "which state; all unless told",
    "step_deg": "how far, °; the sign says which way",
    "stream_id": "of a stream",
    "timeout_s": "how long to wait for it, s",
    "token": "as `hornbill token add` printed it",
    "topics": "what to hear of",
    "ttl_s": "it lapses so long after its last renewal, s",
    "type": "what kind it is",
    "uid": "unique id, 32 hex digits",
    "uids": "unique ids, 32 hex digits each",
    "unit": "what position 1.0 means",
    "value": "in the unit of its name or parameter",
    "values": "by key, in the units of the parameter manual",
    "view": "frames as they are, or transfers in words",
    "wait": "answer once it has left, or once the horn has settled",
    # of one shape
    "AllocatorMode.mode": "give ids, keep silent, or answer beside another allocator, too",
    "BatchPatch.servos": "values by key, by uid",
    "BurstCommand.value": "°, rpm or %",
    "BusAddress.address": "INTERFACE:CHANNEL, such as `socketcan:can0`; `GET /bus/adapters` names what is plugged in",
    "Command.value": "°, rpm or %",
    "Commissioning.profile": "name of a profile to give to all of them",
    "LeaseRequest.holder": "who asks, for people",
    "NewSimServo.uid": "made up unless told",
    "NewStream.type": "°, rpm or %",
    "ProfilePut.description": "what it is for",
    "ProfilePut.firmware": "it was made for; any unless told",
    "ProfilePut.model": "it was made for; any unless told",
    "Restore.source": "what the snapshot holds of RAM, or what was known of ROM then",
    "SimChange.answer_delay_s": "every answer comes so late, s",
    "SimChange.drop_responses_pct": "share of answers that are lost, %",
    "SimChange.load_inertia": "inertia on the horn, as a multiple of the servo's own as the horn feels it",
    "SimChange.load_pct": "constant torque on the horn, % of the servo's greatest; + pushes clockwise",
    "SimChange.mute": "it answers nothing, and says nothing",
    "SimChange.position_unit": "what position 1.0 means in what it broadcasts",
    "SimChange.restart_delay_s": "it stays away so long at a restart, s",
    "SimChange.sensor_error": "error of the sensors of temperature and supply, -1 to 1 of their ±5 °C and ±0.5 V",
    "SimChange.software_update": "it says that its software is being updated",
    "SimChange.temperature_c": "of the servo, °C",
    "SimChange.voltage_v": "of the supply, V",
    "SocketCommand.value": "°, rpm or %",
    "StopMessage.mode": "torque off, or the brake",
    "StopRequest.mode": "torque off, or the brake",
    "StreamMessage.id": "of the stream",
    "StreamMessage.values": "by uid: °, rpm or %",
    "StreamValues.values": "by uid: °, rpm or %",
    "TakeOver.holder": "who asks, for people",
    "TorqueMode.mode": "0x20",
}


def given(made: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Shape (empty for a parameter), name and declaration of whatever a program may send, by REST or by socket."""
    schemas = made["components"]["schemas"]
    operations = [one for verbs in made["paths"].values() for one in verbs.values()]
    for one in operations:
        yield from (("", each["name"], each) for each in one.get("parameters", ()))
    seen: set[str] = set()
    waiting = _named([schemas["ClientMessage"], *(one.get("requestBody") for one in operations)])
    while waiting:
        shape = waiting.pop()
        if shape not in seen:
            seen.add(shape)
            waiting |= _named(schemas[shape])
            yield from ((shape, name, field) for name, field in schemas[shape].get("properties", {}).items())


def is_told(declared: dict[str, Any]) -> bool:
    """Whether a declaration says what it is for."""
    return bool(declared.get("description") or declared.get("schema", {}).get("description"))


def fields(made: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Shape, name and declaration of every field, of what is sent and of what is answered, but for a lone reference to
    a shape that tells of itself."""
    schemas = made["components"]["schemas"]
    for shape, schema in schemas.items():
        for name, field in schema.get("properties", {}).items():
            if "$ref" not in field or not schemas[field["$ref"].rpartition("/")[2]].get("description"):
                yield shape, name, field


def describe(made: dict[str, Any]) -> None:
    """Give words to whatever says nothing of itself in an OpenAPI document."""
    for words, found in ((WORDS, given(made)), (ANSWERS, fields(made))):
        for shape, name, declared in found:
            told = words.get(f"{shape}.{name}") or words.get(name)
            if told and not is_told(declared):
                declared["description"] = told if _nullable(declared) else told.partition("; null: ")[0]


def _nullable(declared: dict[str, Any]) -> bool:
    return any(one.get("type") == "null" for one in declared.get("anyOf", ()))


def _named(part: object) -> set[str]:
    """The schemas that a part of the document refers to."""
    if isinstance(part, dict):
        inside = cast("dict[str, object]", part)
        here = {str(inside["$ref"]).rpartition("/")[2]} if "$ref" in inside else set[str]()
        return here.union(*map(_named, inside.values()))
    if isinstance(part, list):
        return set[str]().union(*map(_named, cast("list[object]", part)))
    return set()

"""Servos of one model or of several, and requests about profiles."""

from typing import Any

from behaviour.rig import Response, Rig, json
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

GAINS: dict[str, Any] = {"angle_p_gain": 55, "timeout_time": 500, "angle_limit_cw": 60.5, "timeout_action": "brake"}
ADDRESSES = {"angle_p_gain": 0x2C, "timeout_time": 0x27, "angle_limit_cw": 0x38, "timeout_action": 0x26}
RAW = {"angle_p_gain": 55, "timeout_time": 500, "angle_limit_cw": 605, "timeout_action": 2}

MIXED = (
    Recipe("BLA21-06U-AB", "1.300", servo_id=1, node_id=11),
    Recipe("BLA21-12U-A0", "1.010", servo_id=2, node_id=12),
    Recipe("BLA15-06U-A0", "1.300", servo_id=3, node_id=13),
)
THREE = tuple(Recipe("BLA21-06U-A0", "1.300", servo_id=n, node_id=10 + n) for n in (1, 2, 3))


async def put(rig: Rig, name: str = "gains", **body: Any) -> Any:
    """Store a profile, by default the gains; the response."""
    response = await rig.call("PUT", f"/profiles/{name}", body or {"values": GAINS})
    assert response.status_code in (200, 201), response.text
    return response.json()


async def in_order(rig: Rig, count: int) -> list[Servo]:
    """The servos by node ID, once they are ready."""
    return sorted(await rig.ready(count), key=lambda servo: servo.node_id or 0)


async def apply(rig: Rig, servos: list[Servo], name: str = "gains", **more: Any) -> Any:
    """Apply a profile and wait for the job."""
    body = {"uids": [servo.uid for servo in servos], **more}
    return json(await rig.call("POST", f"/profiles/{name}/apply?wait=true", body))


def memory(rig: Rig, servo: Servo) -> dict[str, int]:
    """Raw values in RAM of the simulated servo, by key."""
    return {key: rig.sim(servo).memory.get(address) for key, address in ADDRESSES.items()}


def outcomes(job: Any) -> list[str]:
    """The outcome for each servo, in order."""
    return [one["outcome"] for one in job["result"]["servos"]]


def states(job: Any) -> dict[str, str]:
    """States of the steps by name."""
    return {step["name"]: step["state"] for step in job["steps"]}


async def send(rig: Rig, name: str, text: str, form: str) -> Response:
    """Import a file."""
    headers = {"Content-Type": f"application/{form}"}
    return await rig.http.put(f"/profiles/{name}/file", content=text.encode(), headers=headers)

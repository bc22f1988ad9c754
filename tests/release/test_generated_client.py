"""A client generated from the served OpenAPI document moves a servo."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from e2e.servers import ready_demo

SCRIPT = """
import sys
from rig_client import Client
from rig_client.api.motion import command_servo, release_lease, set_torque, take_lease
from rig_client.api.parameters import get_current_angle, set_angle_p_gain
from rig_client.api.servos import list_servos
from rig_client.models import (
    AnglePGainValue, Command, CommandKind, CommandWait, Commanded, IntegerReading, Lease, LeaseRequest, Problem,
    TorqueMode, TorqueModeMode,
)

client = Client(base_url=sys.argv[1], raise_on_unexpected_status=True)
servo = list_servos.sync(client=client)[0]
gain = set_angle_p_gain.sync(servo.uid, client=client, body=AnglePGainValue(value=41))
assert isinstance(gain, IntegerReading) and gain.value == 41, gain
outside = set_angle_p_gain.sync(servo.uid, client=client, body=AnglePGainValue(value=0))
assert isinstance(outside, Problem) and outside.code == "out_of_range", outside
lease = take_lease.sync(client=client, body=LeaseRequest(holder="generated", ttl_s=10.0))
assert isinstance(lease, Lease), lease
set_torque.sync(servo.uid, client=client, body=TorqueMode(mode=TorqueModeMode.ON), lease=lease.id)
order = Command(type_=CommandKind.ANGLE, value=20.0, wait=CommandWait.SETTLED)
done = command_servo.sync(servo.uid, client=client, body=order, lease=lease.id)
assert isinstance(done, Commanded) and done.settled, done
angle = get_current_angle.sync(servo.uid, client=client)
release_lease.sync(lease.id, client=client)
print(angle.value)
"""


def generator() -> str | None:
    """openapi-python-client, next to this Python or on the path."""
    local = Path(sys.executable).parent / "openapi-python-client"
    return str(local) if local.is_file() else shutil.which("openapi-python-client")


def test_a_generated_client_moves_a_servo(tmp_path: Path) -> None:
    program = generator()
    if program is None:
        pytest.skip("openapi-python-client is not installed: 'make setup' installs it")
    with ready_demo(1) as demo:
        document = tmp_path / "openapi.json"
        document.write_bytes(demo.api.get("/openapi.json").content)
        settings = tmp_path / "config.yaml"
        settings.write_text("post_hooks: []\n")
        made = subprocess.run(
            [program, "generate", "--path", document, "--config", settings, "--meta", "none", "--output-path",
             tmp_path / "rig_client"],
            capture_output=True, text=True, check=False, cwd=tmp_path, timeout=120,
        )  # fmt: skip
        assert made.returncode == 0, made.stdout + made.stderr
        paths = os.pathsep.join(filter(None, (str(tmp_path), os.environ.get("PYTHONPATH"))))
        ran = subprocess.run(
            [sys.executable, "-c", SCRIPT, demo.url.rstrip("/")],
            capture_output=True, text=True, check=False, timeout=60, env={**os.environ, "PYTHONPATH": paths},
        )  # fmt: skip
        assert ran.returncode == 0, ran.stdout + ran.stderr
        assert 19 < float(ran.stdout) < 21

"""A server killed while a horn turns: the servo's own timeout stops it (0x26, 0x27, B74)."""

import re
import signal
import time
from pathlib import Path

import httpx

from socketcan.peer import Peer, uavcan
from socketcan.processes import TIMEOUT_S, hornbill, line, until

TIME_OUT_S = 3.0
"""For 0x27, longer than a busy machine may keep the server from its refreshes. The default of 0x26 is: output off."""


def test_the_horn_stops_within_its_timeout_when_the_server_is_killed(vcan0: str, tmp_path: Path) -> None:
    data = str(tmp_path / "data")
    sim = hornbill("sim", "--bus", vcan0, "--servos", "1", "--node-id", "20")
    serve = hornbill("serve", "--bus", vcan0, "--port", "0", "--data-dir", data)
    with sim as servo, serve as server, Peer(101) as peer:
        uid = line(servo).split()[0]
        found = re.search(r"http://\S+/", line(server))
        assert found is not None
        limits = httpx.Limits(max_keepalive_connections=0)
        with httpx.Client(base_url=found[0] + "api/v1", timeout=TIMEOUT_S, limits=limits) as api:
            until(lambda: [one for one in api.get("/servos").json() if one["state"] == "ready"], "the servo is ready")
            path = f"/servos/{uid}"
            values = {"speed_torque_control": True, "timeout_time": TIME_OUT_S * 1000}
            patched = api.patch(path + "/parameters", json={"values": values}).json()
            assert patched["outcome"] == "applied"
            lease = api.post("/leases", json={"holder": "test", "ttl_s": 60}).json()["id"]
            turn = {"type": "speed", "value": 60}
            api.post(path + "/command", json=turn, headers={"Lease": lease}).raise_for_status()
        time.sleep(1.5 * TIME_OUT_S)
        assert _speed(peer) > 40, "kept alive for longer than the timeout"
        server.send_signal(signal.SIGKILL)
        server.wait(timeout=TIMEOUT_S)
        until(lambda: _speed(peer) == 0, "nothing else can stop it")
        assert _register(peer, "0x20") == 0, "the servo itself disabled torque"


def _speed(peer: Peer) -> float:
    return _register(peer, "0x09")


def _register(peer: Peer, name: str) -> float:
    request = uavcan.protocol.param.GetSet.Request(name=name)
    (response,) = peer.registers((20, request))
    assert isinstance(response.value, int)
    return response.value

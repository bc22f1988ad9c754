"""The set-up of compose.yaml on a kernel's CAN: servos and server as two processes, and others who join in.

The words are the compose file's own. What a person does first is done over REST, and candump is the witness.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import can
import httpx
import pytest

from commands import command_line
from hornbill.servo.device.recent_starts import FRESH_UPTIME_S
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from socketcan import can_utils
from socketcan.processes import TIMEOUT_S, hornbill, identified, line, until

ROOT: Final = Path(__file__).parents[2]
SIM, SERVE = (
    json.loads(each)
    for each in re.findall(r"command: (\[.*\])$", (ROOT / "compose.yaml").read_text(encoding="utf-8"), re.MULTILINE)
)
COUNT: Final = int(SIM[SIM.index("--servos") + 1])
OURS: Final = 127
FOREIGN: Final = 42
NODE_STATUS_ID: Final = 0x18015500
"""Priority 24, data type 341, a message: the source goes into the last seven bits."""


@dataclass(frozen=True)
class Bench:
    """Both processes are up, and all servos were seen."""

    api: httpx.Client
    uids: list[str]
    """In the order in which the servos' process named them."""


@pytest.fixture(scope="module")
def bench(vcan0: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    assert vcan0 in SIM
    assert vcan0 in SERVE
    folder = str(tmp_path_factory.mktemp("data"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HORNBILL_CONTAINER", "1")
        patch.setenv("HORNBILL_DATA_DIR", folder)
        with ExitStack() as processes:
            servos = processes.enter_context(hornbill(*SIM))
            uids = [line(servos).split()[0] for _ in range(COUNT)]
            time.sleep(FRESH_UPTIME_S + 1)  # for the server, they have not just started
            server = processes.enter_context(hornbill(*SERVE, "--port", "0"))
            assert line(server).startswith("hornbill: open http://0.0.0.0:")
            said = ""
            while "#token=" not in said:
                said = line(server)
            url, _, token = said.strip().partition("#token=")
            with httpx.Client(
                base_url=url + "api/v1", timeout=TIMEOUT_S, headers={"Authorization": f"Bearer {token}"},
                limits=httpx.Limits(max_keepalive_connections=0),
            ) as api:  # fmt: skip
                until(lambda: identified(api) >= set(uids), f"all {COUNT} servos are ready")
                yield Bench(api, uids)


def _json(response: httpx.Response) -> Any:
    assert response.is_success, response.text
    return response.json()


def test_the_first_start_prints_a_link_and_access_needs_a_token(bench: Bench) -> None:
    anonymous = httpx.get(str(bench.api.base_url) + "servos", timeout=TIMEOUT_S)
    assert (anonymous.status_code, anonymous.json()["code"]) == (401, "unauthorized")
    assert _json(bench.api.get("/health"))["demo"] is False


def test_servos_are_controlled_over_rest_as_recorded_by_candump(bench: Bench, tmp_path: Path) -> None:
    can_utils.needed()
    log = tmp_path / "candump.log"
    uid = bench.uids[0]
    with can_utils.candump(log):
        found = {one["uid"]: one for one in _json(bench.api.get("/servos"))}
        assert set(found) == set(bench.uids)
        node_id = found[uid]["node_id"]
        read = _json(bench.api.get(f"/servos/{uid}/parameters/angle_limit_cw"))
        wanted = read["value"] - 5
        # Its own timeout of one second could strike while a busy machine lets neither process run.
        values = {"angle_limit_cw": wanted, "timeout_time": 5000}
        changed = _json(bench.api.patch(f"/servos/{uid}/parameters", json={"values": values}))
        assert changed["outcome"] == "applied"
        # It was on before the server was, so what its ROM holds as torque mode is for the caller to say.
        requested = bench.api.post(f"/servos/{uid}/save?wait=true")
        assert (requested.status_code, requested.json().get("choices")) == (
            409, ["torque_on_in_rom", "torque_off_in_rom"],
        ), requested.text  # fmt: skip
        saved = _json(bench.api.post(f"/servos/{uid}/save?wait=true", json={"confirm": ["torque_on_in_rom"]}))
        assert (saved["state"], saved["error"]) == ("succeeded", None)
        again = _json(bench.api.get(f"/servos/{uid}/parameters/angle_limit_cw"))
        assert (again["value"], again["rom"]) == (wanted, wanted)

        lease = _json(bench.api.post("/leases", json={"holder": "bench", "ttl_s": 30}))["id"]
        headers = {"Lease": lease}
        order = {"type": "angle", "value": 20, "wait": "settled", "timeout_s": 60, "band_deg": 1.0}
        moved = _json(bench.api.post(f"/servos/{uid}/command", json=order, headers=headers))
        assert moved["settled"], moved
        assert moved["angle_deg"] == pytest.approx(20, abs=1.5)
        assert {one["uid"] for one in _json(bench.api.post("/stop"))["servos"]} == set(bench.uids)
        until(lambda: _torque(bench, uid) == "off", "torque is off after a stop")
        refused = bench.api.post(f"/servos/{uid}/command", json=order, headers=headers)
        assert (refused.status_code, refused.json()["code"]) == (423, "stopped")
        _json(bench.api.delete("/stop"))
    seen = _decoded(log)
    requests = [one for one in seen if one["source"] == OURS and one["kind"] == "request"]
    assert {one["type"] for one in requests if one["destination"] == node_id} >= {
        "uavcan.protocol.param.GetSet", "uavcan.protocol.param.ExecuteOpcode",
    }  # fmt: skip
    responding = {one["source"] for one in seen if one["kind"] == "response"}
    assert {one["node_id"] for one in found.values()} <= responding, "every servo served the stop"


def test_a_python_can_program_receives_the_servos_and_is_listed(bench: Bench) -> None:
    alive = NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL, 0, 0).encode() + b"\xc0"
    sources: set[int] = set()
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        period = bus.send_periodic(can.Message(arbitration_id=NODE_STATUS_ID | FOREIGN, data=alive), 0.5)
        nodes = {one["node_id"] for one in _json(bench.api.get("/servos"))} | {OURS}

        def all_seen() -> bool:
            while (got := bus.recv(0.05)) is not None and not nodes <= sources:
                if got.arbitration_id & ~0x7F == NODE_STATUS_ID & ~0x7F or got.arbitration_id >> 8 & 0xFFFF == 341:
                    sources.add(got.arbitration_id & 0x7F)
            return nodes <= sources

        until(all_seen, "NodeStatus of all servos, and of the server")
        until(lambda: FOREIGN in {one["node_id"] for one in _nodes(bench)}, "the foreign node is listed")
        period.stop()


@pytest.mark.release
def test_the_bus_of_the_compose_file_works_in_its_own_namespace(vcan0: str) -> None:
    """As the containers do: one makes vcan0 with NET_ADMIN alone, and who joins it has no capability at all."""
    if os.geteuid() != 0 or not all(map(shutil.which, ("unshare", "setpriv", "ip"))):
        pytest.skip("this takes root, unshare, setpriv and ip")
    # Of the standard library, and Python outside the checkout: user 1000 may not be allowed to read a checkout of root.
    python = str(Path(sys.base_prefix, "bin", "python3"))
    talk = (
        "import os, socket, struct; "
        "a, b = (socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW) for _ in 'ab'); "
        "a.bind(('vcan0',)); b.bind(('vcan0',)); b.settimeout(5); "
        "a.send(struct.pack('=IB3x8s', 7, 8, b'hornbill')); print(os.getuid(), b.recv(16)[8:].decode())"
    )
    makes = "setpriv --bounding-set=-all,+net_admin --inh-caps=-all,+net_admin docker/vcan-up"
    script = (
        f"{makes} & for n in $(seq 100); do ip link show vcan0 2>/dev/null | grep -q '[<,]UP[,>]' && break; "
        f"sleep 0.1; done; "
        f"setpriv --reuid=1000 --regid=1000 --clear-groups --bounding-set=-all --inh-caps=-all --no-new-privs "
        f'"$0" -c "$1"; code=$?; kill %1 2>/dev/null || kill $!; exit $code'
    )
    done = subprocess.run(
        ["unshare", "--net", "sh", "-c", script, python, talk], cwd=ROOT, capture_output=True, text=True,
        timeout=TIMEOUT_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["vcan0 is up", "1000 hornbill"]


def _torque(bench: Bench, uid: str) -> object:
    return _json(bench.api.get(f"/servos/{uid}/parameters/torque_mode"))["value"]


def _nodes(bench: Bench) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = _json(bench.api.get("/nodes"))
    return found


def _decoded(log: Path) -> list[dict[str, Any]]:
    return [json.loads(each) for each in command_line.hornbill(None, "decode", "--json", log).stdout.splitlines()]

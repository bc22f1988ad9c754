"""`serve --sim-api` on a Linux CAN bus: simulated servos join the served bus."""

from pathlib import Path

import pytest

from socketcan.processes import serving, until

pytestmark = pytest.mark.release


def test_simulated_servos_join_the_servers_bus(vcan0: str, tmp_path: Path) -> None:
    with serving(vcan0, tmp_path / "data", "--sim-api") as api:
        new = [{"model": "BLA15-06U-A0", "node_id": 20}, {"model": "BLA21-12U-AB", "firmware": "1.100"}]
        uids = {api.post("/sim/servos", json=one).raise_for_status().json()["uid"] for one in new}

        def ready() -> set[str]:
            found = {one["uid"] for one in api.get("/servos").json() if one["state"] == "ready"}
            return found if found == uids else set()

        until(ready, "both are found on the kernel's bus")
        requested = next(one for one in api.get("/sim/servos").json() if one["model"] == "BLA21-12U-AB")
        assert requested["node_id"] == 125
        assert api.delete(f"/sim/servos/{requested['uid']}").status_code == 204
        until(lambda: [one for one in api.get("/servos").json() if not one["online"]], "its cable is out")

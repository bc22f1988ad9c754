"""The server and the two servos shared by the tests of this folder."""

from dataclasses import dataclass
from typing import Any

import httpx


@dataclass(frozen=True)
class Bench:
    """The server's API, and the unique ids of a servo that has its node id and one that requested it."""

    api: httpx.Client
    resident: str
    requesting: str

    @property
    def uids(self) -> set[str]:
        """Of both servos."""
        return {self.resident, self.requesting}

    def ready(self) -> list[dict[str, Any]]:
        """Both servos, the one with a static ID first, once both are ready."""
        found = {each["uid"]: each for each in self.api.get("/servos").json() if each["state"] == "ready"}
        return [found[self.resident], found[self.requesting]] if found.keys() == self.uids else []

    def allocations(self) -> dict[str, int]:
        """Node IDs by unique ID, as stored by the server."""
        return {each["uid"]: each["node_id"] for each in self.api.get("/allocations").json()["allocations"]}

    def bus(self) -> dict[str, Any]:
        """The bus according to the server."""
        return self.api.get("/bus").json()

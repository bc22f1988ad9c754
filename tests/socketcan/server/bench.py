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
        """Both servos, the resident first, when both are ready; else nothing."""
        found = {each["uid"]: each for each in self.api.get("/servos").json() if each["state"] == "ready"}
        return [found[self.resident], found[self.requesting]] if found.keys() == self.uids else []

    def allocations(self) -> dict[str, int]:
        """Node ids by unique id, as the server keeps them."""
        return {each["uid"]: each["node_id"] for each in self.api.get("/allocations").json()["allocations"]}

    def bus(self) -> dict[str, Any]:
        """The bus as the server sees it."""
        return self.api.get("/bus").json()

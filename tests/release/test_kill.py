"""Acknowledged rows survive many kills at random points."""

from unit.store.conftest import place, postgresql
from unit.store.test_kill import kill_and_check

__all__ = ["place", "postgresql"]


def test_acknowledged_rows_survive_many_kills(place: str) -> None:
    kill_and_check(place, 110)

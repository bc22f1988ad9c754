"""`place`: a new, empty database of each kind; `store`: opened there, with the clock `wall`."""

import os
import secrets
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import URL, create_engine, make_url, text

from hornbill.store.store import Store
from unit.store.clock import Wall
from unit.store.postgres import Cluster, Missing

TEST_DATABASE = "HORNBILL_TEST_DATABASE"


@pytest.fixture(scope="session")
def postgresql() -> Iterator[URL]:
    """A PostgreSQL database: that of the environment, or of a server started for the tests."""
    pytest.importorskip("psycopg", reason="psycopg is not installed")
    given = os.environ.get(TEST_DATABASE)
    if given is not None:
        yield make_url(given).set(drivername="postgresql+psycopg")
        return
    try:
        cluster = Cluster()
        with cluster:
            yield make_url(cluster.url).set(drivername="postgresql+psycopg")
    except Missing as missing:
        pytest.skip(f"no PostgreSQL: {missing}. Install it, or name a database in {TEST_DATABASE}")


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.release)])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """The address of a database for `Store`; on PostgreSQL, a schema that no other test uses."""
    if request.param == "sqlite":
        yield str(tmp_path / "data")
        return
    database: URL = request.getfixturevalue("postgresql")
    schema = f"hornbill_test_{secrets.token_hex(4)}"
    engine = create_engine(database)
    try:
        with engine.begin() as connection:
            connection.execute(text(f"CREATE SCHEMA {schema}"))
        url = database.set(drivername="postgresql").update_query_dict({"options": f"-csearch_path={schema}"})
        yield url.render_as_string(hide_password=False)
        with engine.begin() as connection:
            connection.execute(text("SET lock_timeout = '5s'"))
            connection.execute(text(f"DROP SCHEMA {schema} CASCADE"))
    finally:
        engine.dispose()


@pytest.fixture
def wall() -> Wall:
    return Wall(1000.0)


@pytest.fixture
def store(place: str, wall: Wall) -> Iterator[Store]:
    with Store(place, wall=wall) as opened:
        yield opened

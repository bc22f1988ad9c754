"""The pytest plugin: a server, a servo and motion control as fixtures, simulated unless a server is named.

    def test_it_reaches_30_degrees(hornbill_servo, hornbill_lease):
        hornbill_servo.torque("on")
        assert hornbill_servo.move(30)["settled"]

With `--hornbill-url` (or HORNBILL_URL) the tests run on that server's servo named by `--hornbill-servo`; without, on
one simulated servo that starts and ends with the session. Nothing is imported or started before a fixture is used.
"""

import os
import re
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from hornbill.client import Hornbill, Lease, Servo

BY = "pytest"
END_S = 30.0
APPEAR_S = 10.0
"""How long a servo may take to be found after the start of its server."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of rigs."""
    group = parser.getgroup("hornbill", "servos over hornbill")
    group.addoption("--hornbill-url", metavar="URL", help="server to use; HORNBILL_URL unless given")
    group.addoption("--hornbill-servo", metavar="SERVO", help="label, serial or uid of the servo under test")
    group.addoption("--hornbill-sim", action="store_true", help="simulated servo, also where HORNBILL_URL is set")


@pytest.fixture(scope="session")
def hornbill(pytestconfig: pytest.Config) -> "Iterator[Hornbill]":
    """A client of the server under test; the token is read from HORNBILL_TOKEN."""
    from hornbill.client import Hornbill
    from hornbill.errors import HornbillError

    url = _url(pytestconfig)
    by = f"{BY} {os.getpid()}"
    if url is None:
        with _demo() as here, Hornbill(here, by=by) as client:
            yield client
        return
    with Hornbill(url, by=by) as client:
        try:
            client.ask("GET", "/health")
        except HornbillError as error:
            pytest.fail(f"The rig's server cannot be used: {error.detail}", pytrace=False)
        yield client


@pytest.fixture
def hornbill_servo(hornbill: "Hornbill", pytestconfig: pytest.Config) -> "Iterator[Servo]":
    """The servo under test, its torque off before and after the test.

    A stop that the test itself made is cleared after it. One that somebody else made stays: tests fail until a person
    has looked at the rig and cleared it.
    """
    from hornbill.errors import HornbillError

    state = hornbill.stop_state()
    if state["latched"]:
        told = f"Stopped by {state['by']}. Look at the rig, then clear it with 'hornbill stop --clear'."
        pytest.fail(told, pytrace=False)
    try:
        servo = _under_test(hornbill, pytestconfig)
    except HornbillError as error:
        pytest.fail(f"There is no servo to test. {error.detail}", pytrace=False)
    servo.torque("off")
    yield servo
    servo.torque("off")
    state = hornbill.stop_state()
    if state["latched"] and is_ours(state["by"] or "", hornbill.by):
        hornbill.clear_stop()


@pytest.fixture
def hornbill_lease(hornbill: "Hornbill", hornbill_servo: "Servo", request: pytest.FixtureRequest) -> "Iterator[Lease]":
    """Motion control for the length of the test, held in its name; at its end torque goes off."""
    name = str(request.node.name)  # pyright: ignore[reportUnknownArgumentType]
    with hornbill.lease(f"{BY}: {name}"[:64]) as lease:
        yield lease


def is_ours(by: str, us: str) -> bool:
    """Whether we made a stop that is known to be by `by`: the server puts the name of the token before ours."""
    return by == us or by.endswith(f" · {us}")


def _url(config: pytest.Config) -> str | None:
    """The server to use; None: one of our own with a simulated servo."""
    given, simulated = config.getoption("--hornbill-url"), config.getoption("--hornbill-sim")
    if given and simulated:
        raise pytest.UsageError("--hornbill-url and --hornbill-sim exclude one another.")
    return None if simulated else given or os.environ.get("HORNBILL_URL")


def _under_test(hornbill: "Hornbill", config: pytest.Config) -> "Servo":
    from hornbill.errors import Busy, InvalidValue, Unknown

    name = config.getoption("--hornbill-servo")
    if name is None and _url(config) is not None:
        raise InvalidValue("Say which with --hornbill-servo LABEL, SERIAL or UID.", cause=None)
    until = time.monotonic() + APPEAR_S
    state = None
    while time.monotonic() < until:
        for one in hornbill.servos():
            if name is None or name in (one.known["label"], one.known["serial"], one.uid):
                state = one.known["state"]
                if state == "ready":
                    return hornbill.find(uid=one.uid)
        time.sleep(0.1)
    if state is not None:
        raise Busy(f"The servo is not ready after {APPEAR_S:g} s: it is {state.replace('_', ' ')}.", cause=None)
    raise Unknown("unknown_servo", f"No servo on the bus has the label, serial or uid {name!r}.", cause=None)


@contextmanager
def _demo() -> Generator[str]:
    """`hornbill demo` with one servo on a free port: its address."""
    command = [sys.executable, "-m", "hornbill", "demo", "--port", "0", "--servos", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+/", process.stdout.readline())
            if found is None:
                pytest.fail("The simulated servo did not start: see above what 'hornbill demo' says.", pytrace=False)
            yield found[0]
        finally:
            process.terminate()
            process.wait(END_S)

"""Pytest plugin: a server, a servo and a lease as fixtures, simulated unless a server is given.

    def test_it_reaches_30_degrees(hornbill_servo, hornbill_lease):
        hornbill_servo.torque("on")
        assert hornbill_servo.move(30)["settled"]

With `--hornbill-url` (or HORNBILL_URL) the tests use the servo `--hornbill-servo` of that server; otherwise a
simulated servo, started for the session. Nothing is imported or started before a fixture is used.
"""

import os
import re
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from hornbill.client import Hornbill, Lease, Servo

BY = "pytest"
END_S = 30.0
APPEAR_S = 10.0
"""Time allowed for a servo to appear after the start of its server."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the command line options."""
    group = parser.getgroup("hornbill", "servos over hornbill")
    group.addoption("--hornbill-url", metavar="URL", help="server to use (default: HORNBILL_URL)")
    group.addoption("--hornbill-servo", metavar="SERVO", help="label, serial or unique ID of the servo under test")
    group.addoption("--hornbill-sim", action="store_true", help="use a simulated servo even if HORNBILL_URL is set")


@pytest.fixture(scope="session")
def hornbill(pytestconfig: pytest.Config) -> "Iterator[Hornbill]":
    """Client of the server under test. The token is read from HORNBILL_TOKEN."""
    from hornbill.client import Hornbill
    from hornbill.errors import HornbillError

    url = _url(pytestconfig)
    by = f"{BY} {os.getpid()}"
    if url is None:
        with _demo() as address, Hornbill(address, by=by) as client:
            yield client
        return
    with Hornbill(url, by=by) as client:
        try:
            client.request("GET", "/health")
        except HornbillError as error:
            pytest.fail(f"The server under test is unavailable. {error.detail}", pytrace=False)
        yield client


@pytest.fixture
def hornbill_servo(hornbill: "Hornbill", pytestconfig: pytest.Config) -> "Iterator[Servo]":
    """Servo under test. Torque is off before and after the test.

    A stop by the test itself is cleared afterwards. A stop by another client stays, and tests fail until it is cleared.
    """
    from hornbill.errors import HornbillError

    state = hornbill.stop_state()
    if state["latched"]:
        text = f"Stopped by {state['by']}. Check the rig, then clear the stop with 'hornbill stop --clear'."
        pytest.fail(text, pytrace=False)
    try:
        servo = _under_test(hornbill, pytestconfig)
    except HornbillError as error:
        pytest.fail(f"No servo to test. {error.detail}", pytrace=False)
    servo.torque("off")
    yield servo
    servo.torque("off")
    state = hornbill.stop_state()
    if state["latched"] and is_ours(state["by"] or "", hornbill.by):
        hornbill.clear_stop()


@pytest.fixture
def hornbill_lease(hornbill: "Hornbill", hornbill_servo: "Servo", request: pytest.FixtureRequest) -> "Iterator[Lease]":
    """Lease (motion control) for the duration of the test, in its name. At its end torque goes off."""
    name = str(request.node.name)  # pyright: ignore[reportUnknownArgumentType]
    with hornbill.lease(f"{BY}: {name}"[:64]) as lease:
        yield lease


def is_ours(by: str, us: str) -> bool:
    """Whether the stop by `by` is our own: the server may prefix our name with that of the token."""
    return by == us or by.endswith(f" · {us}")


def _url(config: pytest.Config) -> str | None:
    """Server to use. None: start one with a simulated servo."""
    given, simulated = config.getoption("--hornbill-url"), config.getoption("--hornbill-sim")
    if given and simulated:
        raise pytest.UsageError("--hornbill-url and --hornbill-sim are mutually exclusive.")
    return None if simulated else given or os.environ.get("HORNBILL_URL")


def _under_test(hornbill: "Hornbill", config: pytest.Config) -> "Servo":
    from hornbill.errors import Busy, InvalidValue, Unknown

    name = config.getoption("--hornbill-servo")
    if name is None and _url(config) is not None:
        raise InvalidValue("Specify the servo with --hornbill-servo LABEL, SERIAL or UID.", cause=None)
    until = time.monotonic() + APPEAR_S
    state = None
    while time.monotonic() < until:
        for servo in hornbill.servos():
            if name is None or name in (servo.known["label"], servo.known["serial"], servo.uid):
                state = servo.known["state"]
                if state == "ready":
                    return hornbill.find(uid=servo.uid)
        time.sleep(0.1)
    if state is not None:
        text = f"The servo is not ready after {APPEAR_S:g} s. Its state is {state.replace('_', ' ')}."
        raise Busy(text, cause=None)
    raise Unknown("unknown_servo", f"No servo on the bus has the label, serial or unique ID {name!r}.", cause=None)


@contextmanager
def _demo() -> Generator[str]:
    """Run `hornbill demo` with one servo on a free port. Yields its address."""
    if find_spec("hornbill.cli") is None:
        text = "hornbill-client has no simulated servo. Give the server with --hornbill-url URL, or install hornbill."
        pytest.fail(text, pytrace=False)
    command = [sys.executable, "-m", "hornbill", "demo", "--port", "0", "--servos", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+/", process.stdout.readline())
            if found is None:
                pytest.fail(
                    "The simulated servo did not start. See the output of 'hornbill demo' above.", pytrace=False
                )
            yield found[0]
        finally:
            process.terminate()
            process.wait(END_S)

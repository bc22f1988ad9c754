"""`hornbill demo` from nothing: ready soon, prints where, ends cleanly. What guides say is run by test_docs.py."""

import os
import re
import signal
import subprocess
import sys
import time

import httpx

from e2e.servers import running_demo


def test_http_answers_and_all_six_servos_become_ready() -> None:
    began = time.monotonic()
    with running_demo("--servos", "6", "--seed", "5") as (process, url):
        assert httpx.get(url + "api/v1/health").json()["demo"] is True
        took = time.monotonic() - began
        assert took < 20, f"{took:.1f} s; the goal of 2 s is measured by make bench, a loaded machine is slower"
        while True:
            servos = httpx.get(url + "api/v1/servos").json()
            if sum(one["state"] == "ready" for one in servos) == 6:
                break
            assert time.monotonic() - began < 30 + took
            time.sleep(0.2)
        assert "<title>" in httpx.get(url).text
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=10) == 0


def test_a_port_that_is_taken_is_named_with_the_remedy() -> None:
    with running_demo("--servos", "1") as (_, url):
        port = re.search(r":(\d+)/", url)
        assert port is not None
        command = [sys.executable, "-m", "hornbill", "demo", "--port", port[1]]
        again = subprocess.run(command, capture_output=True, text=True, check=False)
        assert again.returncode == 1
        assert "--port" in again.stderr


def test_no_other_address_is_listened_on() -> None:
    refused = subprocess.run(
        [sys.executable, "-m", "hornbill", "demo", "--host", "0.0.0.0"],
        capture_output=True, text=True, check=False, timeout=20,
        env={**os.environ, "HORNBILL_CONTAINER": "0"},  # wherever the tests run: in a container it would be open
    )  # fmt: skip
    assert refused.returncode == 2
    assert "127.0.0.1" in refused.stderr

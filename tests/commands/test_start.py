"""`hornbill demo` starts, prints its address, and ends."""

import os
import re
import signal
import subprocess
import sys
import time

import httpx

from e2e.servers import running_demo


def test_the_demo_starts_and_six_servos_become_ready() -> None:
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


def test_a_port_in_use_is_an_error() -> None:
    with running_demo("--servos", "1") as (_, url):
        port = re.search(r":(\d+)/", url)
        assert port is not None
        command = [sys.executable, "-m", "hornbill", "demo", "--port", port[1]]
        again = subprocess.run(command, capture_output=True, text=True, check=False)
        assert again.returncode == 1
        assert "--port" in again.stderr


def test_a_network_address_without_a_token_is_rejected() -> None:
    refused = subprocess.run(
        [sys.executable, "-m", "hornbill", "demo", "--host", "0.0.0.0"],
        capture_output=True, text=True, check=False, timeout=20,
        env={**os.environ, "HORNBILL_CONTAINER": "0"},  # in a container it would be allowed
    )  # fmt: skip
    assert refused.returncode == 2
    assert "127.0.0.1" in refused.stderr

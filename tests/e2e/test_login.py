"""Signing in to a server that requires a token: with the form, with the link of the first start, and signing out."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, BrowserContext, expect

from e2e.contexts import TIMEOUT_MS
from e2e.looks import complaints
from e2e.servers import running
from e2e.state import WAIT_S

TOKEN = "a-token-for-the-browser-test"


@pytest.fixture
def profile(browser: Browser) -> Generator[BrowserContext]:
    made = browser.new_context(viewport={"width": 1440, "height": 900})
    made.set_default_timeout(TIMEOUT_MS)
    yield made
    made.close()


@contextmanager
def served(*flags: str, **environment: str) -> Generator[tuple[subprocess.Popen[str], list[str]]]:
    """`hornbill serve`: the process, and its output until it serves."""
    command = [sys.executable, "-m", "hornbill", "serve", "--port", "0", *flags]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**os.environ, **environment}
    ) as process:
        try:
            assert process.stdout is not None
            said = [process.stdout.readline()]
            while said[-1] and "http" not in said[-1]:
                said.append(process.stdout.readline())
            yield process, said
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=60)


def test_a_token_signs_in_and_signing_out_ends_the_session(profile: BrowserContext) -> None:
    with running("demo", "--servos", "2", "--token", TOKEN) as server:
        url, page = server.url, profile.new_page()
        page.goto(url)
        box = page.get_by_test_id("login-token")
        expect(box).to_be_focused()
        assert complaints(page) == []
        box.fill("wrong")
        page.keyboard.press("Enter")
        expect(page.get_by_test_id("login-refusal")).to_be_visible()
        box.fill(TOKEN)
        page.keyboard.press("Enter")
        expect(page.locator("[data-testid^=servo-row-]")).to_have_count(2)
        expect(page.get_by_test_id("signed-in")).to_contain_text("command line")
        cookie = next(one for one in profile.cookies() if one.get("name") == "hornbill_session")
        assert cookie.get("httpOnly")
        assert cookie.get("sameSite") == "Strict"
        assert page.evaluate("document.cookie") == ""
        assert TOKEN not in page.url
        page.reload()
        expect(page.locator("[data-testid^=servo-row-]")).to_have_count(2)
        page.get_by_test_id("sign-out").click()
        expect(page.get_by_test_id("login")).to_be_visible()
        assert (
            httpx.get(
                url + "api/v1/servos", timeout=WAIT_S, cookies={"hornbill_session": str(cookie.get("value"))}
            ).status_code
            == 401
        )


def test_the_first_start_link_signs_in_and_leaves_no_token(profile: BrowserContext, tmp_path: Path) -> None:
    flags = ("--host", "127.0.0.1", "--behind-proxy", "--data-dir", str(tmp_path))
    with served(*flags, HORNBILL_CONTAINER="1") as (process, said):
        assert process.stdout is not None
        lines = [*said, process.stdout.readline(), process.stdout.readline()]
        found = re.search(r"(http://localhost:\d+/)#token=(hb_[\w-]+)", "".join(lines))
        assert found is not None, lines
        page = profile.new_page()
        urls: list[str] = []
        page.on("request", lambda request: urls.append(request.url))
        page.goto(found[0])
        expect(page.get_by_test_id("signed-in")).to_contain_text("first start")
        secret = found[2]
        assert page.url == found[1] + "servos"
        assert not any(secret in url for url in urls)
        page.go_back()
        assert secret not in page.url
    with served(*flags, HORNBILL_CONTAINER="1") as (_, said):
        assert "#token=" not in "".join(said)
    # In a container the first token is in a private file until it is used.
    kept = [file for file in tmp_path.rglob("*") if file.is_file() and file.name != "first-token"]
    assert kept
    assert not any(secret.encode() in file.read_bytes() for file in kept)


def test_server_output_contains_no_secret(tmp_path: Path) -> None:
    """All log output, with every kind of request that carries a secret."""
    flags = ("--host", "127.0.0.1", "--token", TOKEN, "--data-dir", str(tmp_path))
    with served(*flags) as (process, said):
        url = re.findall(r"http://\S+/", "".join(said))[0]
        with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=WAIT_S) as client:
            ticket = client.post("/api/v1/tickets").json()["ticket"]
            cookie = client.post("/api/v1/session", json={"token": TOKEN}).cookies["hornbill_session"]
            made = client.post("/api/v1/tokens", json={"name": "rig", "role": "view"}).json()["token"]
            client.post("/api/v1/session", json={"token": "hb_wrong-one"})
            client.post("/api/v1/session", json={"token": {"hb_wrong-one": 1}})
            client.get(f"/api/v1/ws?ticket={ticket}")
            client.get(f"/api/v1/nothing?token={TOKEN}")
            audit = client.get("/api/v1/audit.csv").text
        process.send_signal(signal.SIGTERM)
        assert process.stdout is not None
        printed = "".join(said) + process.stdout.read()
    for secret in (TOKEN, ticket, cookie, made, "hb_wrong-one"):
        assert secret not in printed
        assert secret not in audit
        for file in tmp_path.rglob("*"):
            assert not file.is_file() or secret.encode() not in file.read_bytes(), file
    assert "failed login from 127.0.0.1" in printed

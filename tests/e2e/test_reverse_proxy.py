"""Behind a real nginx, below a path: page, REST, sockets, 3D view and login, with the documented configuration."""

import asyncio
import json
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Request, expect
from websockets.asyncio.client import connect as aconnect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from e2e.conftest import DRIVER
from e2e.contexts import TIMEOUT_MS, WIDE
from e2e.servers import running
from e2e.state import WAIT_S, wait_for
from e2e.steps import chord
from hornbill.view.page import client as viser_client

DOCUMENT = Path(__file__).parents[2] / "docs" / "reverse-proxy.md"
TOKEN = "a-token-behind-the-proxy"
NGINX = shutil.which("nginx", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin:/opt/homebrew/bin")

CONFIG = """
daemon off; worker_processes 1; pid {folder}/pid; error_log {folder}/error.log; {user}
events {{}}
http {{
  access_log {folder}/access.log;
  client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy; fastcgi_temp_path {folder}/f;
  uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
  {map}
  server {{ listen 127.0.0.1:{port}; {block} }}
}}
"""


@contextmanager
def nginx(folder: Path, upstream: str, *, strips: bool) -> Generator[tuple[str, Path]]:
    """nginx with the documented configuration in front of `upstream`: its address, and its log."""
    if NGINX is None:
        pytest.skip("no nginx: install the package nginx-light")
    document = DOCUMENT.read_text(encoding="utf-8")
    block = re.findall(r"```nginx\n(.*?)```", document, re.DOTALL)[0]
    block = block.replace("http://127.0.0.1:8000;", f"{upstream.rstrip('/')}{'/' if strips else ''};")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    user = "user root;" if Path.home() == Path("/root") else ""
    maps = re.findall(r"`(map .*?})`", document)
    file = folder / "nginx.conf"
    file.write_text(CONFIG.format(folder=folder, port=port, block=block, map=maps[0], user=user), encoding="utf-8")
    with subprocess.Popen([NGINX, "-p", str(folder), "-c", str(file)], stderr=subprocess.DEVNULL) as process:
        try:
            until = time.monotonic() + WAIT_S
            while True:
                try:
                    socket.create_connection(("127.0.0.1", port), 1).close()
                    break
                except OSError:
                    assert process.poll() is None, (folder / "error.log").read_text()
                    assert time.monotonic() < until
                    time.sleep(0.05)
            yield f"http://127.0.0.1:{port}/hornbill/", folder / "access.log"
        finally:
            process.terminate()
            process.wait(timeout=WAIT_S)


@pytest.fixture(scope="module")
def upstream() -> Iterator[str]:
    flags = ("--servos", "2", "--token", TOKEN, "--behind-proxy", "--root-path", "/hornbill")
    with running("demo", *flags) as server:
        servos, headers = server.url + "api/v1/servos", {"Authorization": f"Bearer {TOKEN}"}
        wait_for(
            lambda: len(httpx.get(servos, headers=headers, timeout=WAIT_S).json()) == 2, "not both servos are there"
        )
        yield server.url


@pytest.mark.parametrize("strips", [False, True])
def test_rest_sockets_and_view_work_below_a_path(upstream: str, tmp_path: Path, strips: bool) -> None:
    with nginx(tmp_path, upstream, strips=strips) as (url, log), httpx.Client(base_url=url, timeout=WAIT_S) as client:
        page = client.get("servos")
        assert 'content="/hornbill"' in page.text
        files = re.findall(r'(?:src|href)="(/hornbill/[^"]+)"', page.text)
        assert len(files) >= 4
        assert all(
            httpx.get(url.removesuffix("/hornbill/") + file, timeout=WAIT_S).status_code == 200 for file in files
        )
        assert client.get("api/v1/servos").status_code == 401
        assert client.post("api/v1/stop").status_code == 401, "the proxy is on this machine; who is behind it is not"
        response = client.post("api/v1/session", json={"token": TOKEN})
        assert "Path=/hornbill" in response.headers["set-cookie"]
        assert len(client.get("api/v1/servos").json()) == 2
        assert client.get("api/v1/openapi.json").json()["servers"] == [{"url": "/hornbill"}]
        foreign = client.post("api/v1/tickets", headers={"Origin": "http://evil.example"})
        assert foreign.json()["code"] == "forbidden_origin"

        ticket = client.post("api/v1/tickets").json()["ticket"]
        ws = url.replace("http", "ws", 1)
        with connect(f"{ws}api/v1/ws?ticket={ticket}") as opened:
            assert json.loads(opened.recv(WAIT_S))["type"] == "hello"
        for query in (f"?ticket={ticket}", ""):
            with pytest.raises(InvalidStatus) as refused:
                connect(f"{ws}api/v1/ws{query}")
            assert refused.value.response.status_code == 401

        cookie = {"Cookie": f"hornbill_session={client.cookies['hornbill_session']}"}
        ours = Origin(url.removesuffix("/hornbill/"))
        viser = [Subprotocol(viser_client().subprotocol)]
        moved = client.get("viser", follow_redirects=False)
        assert moved.headers["location"].startswith("/hornbill/viser/")
        where = client.get("viser/", follow_redirects=True)
        assert where.status_code == 200
        assert "3D view" in where.text
        path = where.url.path.rstrip("/")
        address = f"{ws.removesuffix('/hornbill/')}{path}"
        with connect(address, origin=ours, subprotocols=viser, additional_headers=cookie, max_size=None) as opened:
            assert opened.subprotocol == viser[0]
        for origin, headers, status in ((ours, {}, 401), (Origin("http://evil.example"), cookie, 403)):
            with pytest.raises(InvalidStatus) as refused:
                connect(address, origin=origin, subprotocols=viser, additional_headers=headers)
            assert refused.value.response.status_code == status
        assert TOKEN not in log.read_text()


@pytest.mark.release
def test_the_page_works_below_a_path(upstream: str, tmp_path: Path, scene_browser: Browser) -> None:
    with nginx(tmp_path, upstream, strips=False) as (url, _):
        context = scene_browser.new_context(viewport=WIDE)
        context.set_default_timeout(TIMEOUT_MS)
        try:
            page = context.new_page()
            outside: list[str] = []
            complaints: list[str] = []

            def on_request(request: Request) -> None:
                if not request.url.startswith((url, "data:", "blob:", url.replace("http", "ws", 1))):
                    outside.append(request.url)

            page.on("request", on_request)
            page.goto(f"{url}#token={TOKEN}")
            rows = page.locator("[data-testid^=servo-row-]")
            expect(rows).to_have_count(2)
            assert page.url == url + "servos"
            page.on("console", lambda one: complaints.append(one.text) if one.type in ("error", "warning") else None)
            page.on("pageerror", lambda one: complaints.append(str(one)))
            chord(page, "g", "b")
            expect(page).to_have_url(url + "bus")
            page.reload()
            expect(page.get_by_test_id("signed-in")).to_be_visible()
            page.go_back()
            expect(rows).to_have_count(2)
            rows.first.locator("input[type=checkbox]").check()
            page.get_by_test_id("edit-together").click()
            expect(page).to_have_url(re.compile(re.escape(url) + r"servos/matrix\?uids=[0-9a-f]{32}$"))
            page.reload()
            expect(page.locator(".matrix")).to_be_visible()
            for name in ("Commission", "Matrix", "Faults", "Bus", "Records", "API", "Motion", "Servos"):
                page.locator(".rail nav").get_by_role("link", name=re.compile(f"^{name}")).click()
                assert page.url.startswith(url), name
                expect(page.locator("main h1").first).to_be_visible()
                expect(page.get_by_test_id("missing-page")).to_have_count(0)
            rows.first.locator("a").first.click()
            expect(page).to_have_url(re.compile(re.escape(url) + r"servos/[0-9a-f]{32}$"))
            for tab in ("motion", "tune", "faults", "parameters"):
                page.get_by_test_id(f"servo-tab-{tab}").click()
                expect(page).to_have_url(re.compile(re.escape(url) + rf"servos/[0-9a-f]{{32}}/{tab}$"))
                expect(page.locator("main h1").first).to_be_visible()
            frame = page.frame_locator("iframe")
            frame.locator("canvas").first.wait_for()
            assert outside == []
            assert [text for text in complaints if DRIVER not in text] == []
        finally:
            context.close()


def test_with_a_certificate_it_serves_https_with_a_secure_cookie(tmp_path: Path) -> None:
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("no openssl to make a certificate with")
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    subprocess.run(
        [openssl, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
         "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(cert)],
        check=True, capture_output=True,
    )  # fmt: skip
    trusted = ssl.create_default_context(cafile=str(cert))
    flags = ("--servos", "1", "--token", TOKEN, "--tls-cert", str(cert), "--tls-key", str(key))
    with running("demo", *flags) as server, httpx.Client(base_url=server.url, verify=trusted, timeout=WAIT_S) as client:
        url = server.url
        assert url.startswith("https://")
        response = client.post("api/v1/session", json={"token": TOKEN})
        assert "secure" in response.headers["set-cookie"].lower()
        ticket = client.post("api/v1/tickets").json()["ticket"]
        greeting = hello(f"{url.replace('http', 'ws', 1)}api/v1/ws?ticket={ticket}", trusted)
        with ThreadPoolExecutor(1) as elsewhere:  # this thread has the loop of the browser
            assert elsewhere.submit(asyncio.run, greeting).result() == "hello"
        watch = [sys.executable, "-m", "hornbill", "watch", "--seconds", "1"]
        here = {**os.environ, "HORNBILL_URL": url, "HORNBILL_TOKEN": TOKEN}
        for trust, code, stream, said in (("", 3, "stderr", "SSL_CERT_FILE"), (str(cert), 0, "stdout", "state")):
            ended = subprocess.run(
                watch, capture_output=True, text=True, check=False, env={**here, "SSL_CERT_FILE": trust}
            )
            assert (ended.returncode, said in getattr(ended, stream)) == (code, True), ended


async def hello(url: str, trusted: ssl.SSLContext) -> str:
    """Type of the first message. Without threads: two that share a TLS connection sometimes hang."""
    async with asyncio.timeout(WAIT_S), aconnect(url, ssl=trusted) as opened:
        return json.loads(await opened.recv())["type"]

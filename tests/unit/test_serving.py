"""The listening socket of the server, and its log."""

import asyncio
import logging
import os
import socket
import sys

import pytest

from hornbill.app.serving import NICENESS, REPEAT_S, RateLimit, listen, raise_priority


def test_accepted_connections_have_no_delay() -> None:
    async def scene() -> int:
        found: asyncio.Future[int] = asyncio.get_running_loop().create_future()

        async def serve(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            accepted: socket.socket = writer.get_extra_info("socket")
            found.set_result(accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()
            await writer.wait_closed()

        listening = listen("127.0.0.1", 0)
        async with await asyncio.start_server(serve, sock=listening):
            _, writer = await asyncio.open_connection(*listening.getsockname())
            no_delay = await found
            writer.close()
            await writer.wait_closed()
        return no_delay

    assert asyncio.run(scene()), "with Nagle's delay a response of two writes arrives 40 ms late"


def logged(limit: RateLimit, text: str) -> str | None:
    record = logging.LogRecord("uvicorn.error", logging.WARNING, "", 0, text, (), None)
    return record.getMessage() if limit(record) else None


def test_malformed_requests_are_logged_as_one_line_with_their_number() -> None:
    now, text = 0.0, "Invalid HTTP request received."
    limit = RateLimit(lambda: now)
    assert [logged(limit, text) for _ in range(1000)] == [text, *[None] * 999]
    now = REPEAT_S
    assert logged(limit, text) == f"{text} 999 more since the last message."
    now = 2 * REPEAT_S
    assert logged(limit, text) == text


def test_other_log_lines_are_kept_except_one() -> None:
    limit = RateLimit(lambda: 0.0)
    for _ in range(2):
        assert logged(limit, "Exception in ASGI application") == "Exception in ASGI application"
    assert logged(limit, "ASGI callable returned without completing handshake.") is None


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX priorities")
@pytest.mark.parametrize("refusal", [None, PermissionError()])
def test_the_server_takes_a_higher_priority_if_it_may(refusal: OSError | None, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def set_priority(_which: int, _who: int, niceness: int) -> None:
        asked.append(niceness)
        if refusal is not None:
            raise refusal

    def get_priority(_which: int, _who: int) -> int:
        return 0

    monkeypatch.setattr(os, "getpriority", get_priority)
    monkeypatch.setattr(os, "setpriority", set_priority)
    raise_priority()
    assert asked == [NICENESS]

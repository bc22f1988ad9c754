"""The socket the server listens on, and what it says in its log."""

import asyncio
import logging
import socket

from hornbill.app.serving import REPEAT_S, RateLimit, listen


def test_what_is_accepted_sends_at_once_and_waits_for_no_acknowledgement() -> None:
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

    assert asyncio.run(scene()), "with Nagle's delay an answer of two writes comes 40 ms late"


def said(sparing: RateLimit, text: str) -> str | None:
    record = logging.LogRecord("uvicorn.error", logging.WARNING, "", 0, text, (), None)
    return record.getMessage() if sparing(record) else None


def test_a_flood_of_malformed_requests_is_one_line_in_a_while_that_counts_them() -> None:
    now, text = 0.0, "Invalid HTTP request received."
    sparing = RateLimit(lambda: now)
    assert [said(sparing, text) for _ in range(1000)] == [text, *[None] * 999]
    now = REPEAT_S
    assert said(sparing, text) == f"{text} 999 more since the last message."
    now = 2 * REPEAT_S
    assert said(sparing, text) == text


def test_every_other_line_of_the_log_stays_but_for_one_that_is_wrong() -> None:
    sparing = RateLimit(lambda: 0.0)
    for _ in range(2):
        assert said(sparing, "Exception in ASGI application") == "Exception in ASGI application"
    assert said(sparing, "ASGI callable returned without completing handshake.") is None

"""Checks of request bodies: JSON unless the route takes a file, and a size limit."""

from typing import Final

from starlette.types import Message, Receive, Scope

from hornbill.errors import TooLarge, WrongMediaType

LARGEST: Final = 1 << 20
"""Maximum size of a JSON body, bytes; a request for 100 servos has about 100 kB."""
LARGEST_FILE: Final = 128 << 20
"""Maximum size of a file, bytes; its route applies a lower limit."""

_FILES: Final = (("/api/v1/profiles/", "/file"), ("/api/v1/recorder/recordings/", ""))
"""Start and end of the paths at which PUT takes a file."""
_FORMS: Final = ("application/x-www-form-urlencoded", "multipart/form-data", "text/plain")
"""Media types that a form of any site can send without a CORS preflight."""


async def ready(scope: Scope, path: str, receive: Receive) -> Receive:
    """Receive callable for the route; a JSON body is read completely first. Raises WrongMediaType and TooLarge."""
    headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
    length, chunked = headers.get(b"content-length", "0"), b"transfer-encoding" in headers
    size = int(length) if length.isdecimal() and len(length) < 19 else LARGEST_FILE + 1
    if not size and not chunked:
        return receive
    media = headers.get(b"content-type", "").partition(";")[0].strip().lower()
    if takes_file(scope["method"], path):
        if media in _FORMS:
            raise WrongMediaType(
                f"Content-Type {media} is not accepted for a file. Send the file's own media type.",
                cause="form_media_type",
                media=media,
            )
        _within(size, LARGEST_FILE)
        return receive
    if path.startswith("/api/") and not (media == "application/json" or media.endswith("+json")):
        raise WrongMediaType(
            f"Content-Type is {media[:60] or 'missing'}. Send 'Content-Type: application/json'.",
            cause="media_type_not_json",
            media=media[:60],
        )
    _within(size, LARGEST)
    return (await whole(receive))[1]


def takes_file(method: str, path: str) -> bool:
    """Whether the route takes a raw file."""
    return method == "PUT" and any(path.startswith(begin) and path.endswith(end) for begin, end in _FILES)


def _within(size: int, limit: int) -> None:
    if size > limit:
        raise TooLarge(
            f"The body exceeds the limit of {limit // 1024} kB.",
            cause="body_too_large",
            limit_kb=limit // 1024,
            limit_bytes=limit,
        )


async def whole(receive: Receive) -> tuple[bytes | None, Receive]:
    """The complete body, and a receive callable that replays it. The body is None if the client disconnected.

    Raises TooLarge.
    """
    body, message = bytearray(), await receive()
    while message["type"] == "http.request":
        body += message.get("body", b"")
        _within(len(body), LARGEST)
        if not message.get("more_body", False):
            message = {"type": "http.request", "body": bytes(body), "more_body": False}
            break
        message = await receive()
    waiting = [message]

    async def replay() -> Message:
        return waiting.pop() if waiting else await receive()

    return bytes(body) if message["type"] == "http.request" else None, replay

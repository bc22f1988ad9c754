"""Owns the page's files: served as built, with a strict content security policy, or a sentence on how to build them."""

from collections.abc import Callable
from pathlib import Path

from fastapi import FastAPI, Request
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, PlainTextResponse, Response

CSP = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "font-src 'self'",
        "frame-src 'self'",
        "frame-ancestors 'self'",
        "base-uri 'none'",
        "form-action 'none'",
    )
)
"""The page loads nothing from anywhere else and runs no inline script."""

HEADERS = {"Content-Security-Policy": CSP, "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer"}
NOT_BUILT = "The page is not built. Run 'make build' (needs Node 20 or later), then start hornbill again.\n"


def install(app: FastAPI, find: Callable[[], Path | None]) -> None:
    """Serve the page under every path that is neither an API nor a file: its links are paths of the page."""

    @app.get("/{path:path}", include_in_schema=False)
    async def page(path: str, request: Request) -> Response:
        if path.startswith("api/"):
            raise HTTPException(404, "There is no such path")
        folder = find()
        if folder is None:
            return PlainTextResponse(NOT_BUILT, 503, headers=HEADERS)
        file = (folder / path).resolve()
        if path and file.is_relative_to(folder.resolve()) and file.is_file():
            lasting = path.startswith("assets/")  # their names carry a hash of their content
            cache = "public, max-age=31536000, immutable" if lasting else "no-cache"
            return FileResponse(file, headers={**HEADERS, "Cache-Control": cache})
        if "." in path.rsplit("/", 1)[-1]:
            raise HTTPException(404, "There is no such file")
        return FileResponse(folder / "index.html", headers={**HEADERS, "Cache-Control": "no-cache"})

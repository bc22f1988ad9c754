"""Owns the page's files: as built, with a strict content security policy, below whatever path a proxy puts them."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Final

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
_RELATIVE: Final = ('="./', '="{root}/')
"""How the page, as built, names its files; and how it is served, for it is shown under addresses of any depth."""
_ROOT: Final = ('name="hornbill-root" content=""', 'name="hornbill-root" content="{root}"')
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
        file = _file(folder, path)
        if file is not None:
            lasting = path.startswith("assets/")  # their names carry a hash of their content
            cache = "public, max-age=31536000, immutable" if lasting else "no-cache"
            return FileResponse(file, headers={**HEADERS, "Cache-Control": cache})
        if "." in path.rsplit("/", 1)[-1]:
            raise HTTPException(404, "There is no such file")
        index = folder / "index.html"
        html = _index(index, index.stat().st_mtime_ns, str(request.scope.get("root_path", "")))
        return Response(html, media_type="text/html; charset=utf-8", headers={**HEADERS, "Cache-Control": "no-cache"})


def _file(folder: Path, path: str) -> Path | None:
    """The file of that path below `folder`, if there is one; no name a disk cannot have is an error of ours."""
    try:
        file = (folder / path).resolve()
        return file if path and file.is_relative_to(folder.resolve()) and file.is_file() else None
    except (OSError, ValueError):
        return None


@lru_cache(maxsize=4)
def _index(file: Path, _changed_ns: int, root: str) -> str:
    """The page with the addresses of its files, and of the API, below `root`."""
    html = file.read_text(encoding="utf-8")
    for built, served in (_RELATIVE, _ROOT):
        html = html.replace(built, served.format(root=root))
    return html

"""Owns /docs/: the documentation as it was built, under the content security policy of the page."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response

from hornbill.api.page import HEADERS

NOT_BUILT: Final = (
    "The documentation is not built. Run 'make docs', then load this page again; its sources are in docs/.\n"
)


def install(app: FastAPI, find: Callable[[], Path | None]) -> None:
    """Serve what `find` says was built. Links in it are relative, so it does not care where a proxy puts it."""

    @app.get("/docs", include_in_schema=False)
    async def to_folder() -> Response:
        return RedirectResponse("docs/")

    @app.get("/docs/{path:path}", include_in_schema=False)
    async def documentation(path: str) -> Response:
        folder = find()
        if folder is None:
            return PlainTextResponse(NOT_BUILT, 503, headers=HEADERS)
        file = (folder / (path or "index.html")).resolve()
        if not file.is_relative_to(folder.resolve()) or not file.is_file():
            raise HTTPException(404, "The documentation has no such page. It begins at /docs/")
        return FileResponse(file, headers={**HEADERS, "Cache-Control": "no-cache"})

"""The built documentation at /docs/, with the page's content security policy extended for its search form."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from fastapi import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response

from hornbill import resources
from hornbill.api.pages.page import CSP, HEADERS, notice
from hornbill.api.routing import Routes
from hornbill.api.security.roles import PUBLIC

POLICY: Final = CSP.replace("form-action 'none'", "form-action 'self'")
"""Policy of the page, plus the search form."""
_WORDS: Final = {
    "en": {
        "missing": "Documentation not available",
        "build": "It has not been built in this checkout. Run <code>make docs</code> there, then reload this page.",
        "install": "This installation of hornbill contains no documentation. Install a released package or image.",
        "unknown": "No such page in the documentation",
        "moved": "It may have been renamed. The contents list all pages.",
        "contents": "Contents",
        "back": "Back to hornbill",
    },
    "ja": {
        "missing": "ドキュメントがありません",
        "build": "このソースではまだ生成されていません。<code>make docs</code> を実行し、再読み込みしてください。",
        "install": "ドキュメントが含まれていません。配布されているパッケージかイメージを使ってください。",
        "unknown": "このページはドキュメントにありません",
        "moved": "名前が変わった可能性があります。目次に全ページがあります。",
        "contents": "目次",
        "back": "hornbillに戻る",
    },
}


def routes(find: Callable[[], Path | None], find_page: Callable[[], Path | None]) -> Routes:
    """Routes that serve the folder returned by `find`. Links are relative, so any proxy sub-path works."""

    made = Routes("page", prefix="")

    @made.get("/docs", PUBLIC, include_in_schema=False)
    async def to_folder() -> Response:
        return RedirectResponse("docs/")

    @made.get("/docs/{path:path}", PUBLIC, include_in_schema=False)
    async def documentation(path: str, request: Request) -> Response:
        folder = find()
        if folder is None:
            why = "install" if resources.checkout() is None else "build"
            return _notice(request, find_page(), 503, "missing", why, {"back": "/"})
        file = (folder / (path or "index.html")).resolve()
        if not file.is_relative_to(folder.resolve()) or not file.is_file():
            return _notice(request, find_page(), 404, "unknown", "moved", {"contents": "/docs/", "back": "/"})
        return FileResponse(file, headers={**HEADERS, "Content-Security-Policy": POLICY, "Cache-Control": "no-cache"})

    return made


def _notice(request: Request, page: Path | None, status: int, title: str, line: str, links: dict[str, str]) -> Response:
    """Notice in the style of the page if it is built, in the browser's preferred language."""
    language = "ja" if request.headers.get("accept-language", "").lower().startswith("ja") else "en"
    words = _WORDS[language]
    if page is None:
        plain = words[line].replace("<code>", "'").replace("</code>", "'")
        return PlainTextResponse(f"{words[title]}. {plain}\n", status, headers=HEADERS)
    root = str(request.scope.get("root_path", ""))
    labelled = {words[name]: path for name, path in links.items()}
    html = notice(page, root, language, words[title], [words[line]], labelled)
    headers = {**HEADERS, "Cache-Control": "no-store", "Vary": "Accept-Language"}
    return Response(html, status, media_type="text/html; charset=utf-8", headers=headers)

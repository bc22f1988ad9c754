"""The documentation at /docs/, as it was built, under the content security policy of the page and its search form."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from fastapi import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response

from hornbill import resources
from hornbill.api.pages.page import CSP, HEADERS, notice
from hornbill.api.routing import Routes
from hornbill.api.security.roles import ANYBODY

POLICY: Final = CSP.replace("form-action 'none'", "form-action 'self'")
"""The page's, and its search box leads to the page of results."""
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
    """Serve what `find` says was built. Links in it are relative, so it does not care where a proxy puts it."""

    made = Routes("page", prefix="")

    @made.get("/docs", ANYBODY, include_in_schema=False)
    async def to_folder() -> Response:
        return RedirectResponse("docs/")

    @made.get("/docs/{path:path}", ANYBODY, include_in_schema=False)
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


def _notice(request: Request, page: Path | None, status: int, title: str, line: str, ways: dict[str, str]) -> Response:
    """In the look of the page where that is built, and in the first language the browser asks for."""
    language = "ja" if request.headers.get("accept-language", "").lower().startswith("ja") else "en"
    words = _WORDS[language]
    if page is None:
        plain = words[line].replace("<code>", "'").replace("</code>", "'")
        return PlainTextResponse(f"{words[title]}. {plain}\n", status, headers=HEADERS)
    root = str(request.scope.get("root_path", ""))
    links = {words[name]: path for name, path in ways.items()}
    html = notice(page, root, language, words[title], [words[line]], links)
    headers = {**HEADERS, "Cache-Control": "no-store", "Vary": "Accept-Language"}
    return Response(html, status, media_type="text/html; charset=utf-8", headers=headers)

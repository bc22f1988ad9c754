"""Static files of the built page, with a strict content security policy, below any proxy sub-path."""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Final

from fastapi import Request
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, PlainTextResponse, Response

from hornbill.api.routing import Routes
from hornbill.api.security.roles import PUBLIC

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
"""The page loads nothing from other origins and runs no inline scripts."""

HEADERS = {"Content-Security-Policy": CSP, "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer"}
_RELATIVE: Final = ('="./', '="{root}/')
"""File references in the built page, and as served: absolute, because page paths have any depth."""
_ROOT: Final = ('name="hornbill-root" content=""', 'name="hornbill-root" content="{root}"')
PAGES: Final = re.compile(
    r"(?:|servos|commission|tune|faults|bus|recorder|records|scope|site|api-page|servos/matrix"
    r"|servos/[0-9a-f]{32}(?:/(?:parameters|motion|tune|faults))?)/?"
)
"""Paths of the page, as in `web/src/bench/route.ts`; all others are 404, for browsers with the page, which says so."""

_SCRIPTS: Final = re.compile(r'\s*(?:<script type="module"[^>]*></script>|<link rel="modulepreload"[^>]*>)')
NOT_BUILT = "The page is not built. Run 'make build' (needs Node 20 or later), then start hornbill again.\n"


def routes(find: Callable[[], Path | None]) -> Routes:
    """Routes that serve the files of the page, and the page itself under its own paths."""

    made = Routes("page", prefix="")

    @made.get("/{path:path}", PUBLIC, include_in_schema=False)
    async def page(path: str, request: Request) -> Response:
        if path.startswith("api/"):
            raise HTTPException(404, "Path not found")
        folder = find()
        if folder is None:
            return PlainTextResponse(NOT_BUILT, 503, headers=HEADERS)
        file = _file(folder, path)
        if file is not None:
            lasting = path.startswith("assets/")  # names contain a hash of the content
            cache = "public, max-age=31536000, immutable" if lasting else "no-cache"
            return FileResponse(file, headers={**HEADERS, "Cache-Control": cache})
        if "." in path.rsplit("/", 1)[-1]:
            raise HTTPException(404, "File not found")
        root = str(request.scope.get("root_path", ""))
        known = PAGES.fullmatch(path) is not None
        headers = {**HEADERS, "Cache-Control": "no-cache"} | ({} if known else {"Vary": "Accept"})
        if not known and "text/html" not in request.headers.get("accept", ""):
            return PlainTextResponse(f"Not found. The page is at {root}/\n", 404, headers=headers)
        index = folder / "index.html"
        html = _index(index, index.stat().st_mtime_ns, root)
        return Response(html, 200 if known else 404, media_type="text/html; charset=utf-8", headers=headers)

    return made


def notice(folder: Path, root: str, language: str, title: str, lines: Sequence[str], paths: Mapping[str, str]) -> str:
    """HTML notice in the style of the built page, without its scripts: a title, lines of HTML, and links.

    `paths`: path below `root` by link text.
    """
    index = folder / "index.html"
    html = _index(index, index.stat().st_mtime_ns, root)
    html = _SCRIPTS.sub("", html).replace('<html lang="en"', f'<html lang="{language}"')
    links = "".join(
        f'<a class="button{" primary" if number == 0 else ""}" href="{root}{path}">{escape(text)}</a> '
        for number, (text, path) in enumerate(paths.items())
    )
    mark = f'<p class="notice-mark"><img src="{root}/mark.svg" width="32" height="32" alt=""><span>hornbill</span></p>'
    body = (
        f'{mark}<h1>{escape(title)}</h1>{"".join(f"<p>{line}</p>" for line in lines)}<p class="below-line">{links}</p>'
    )
    body = f'<body><main class="page"><section class="empty"><div>{body}</div></section></main></body>'
    return re.sub("<body>.*</body>", lambda _: body, html, flags=re.DOTALL)


def _file(folder: Path, path: str) -> Path | None:
    """File of that path below `folder`; None if there is none or the name is invalid."""
    try:
        file = (folder / path).resolve()
        return file if path and file.is_relative_to(folder.resolve()) and file.is_file() else None
    except (OSError, ValueError):
        return None


@lru_cache(maxsize=4)
def _index(file: Path, _changed_ns: int, root: str) -> str:
    """Index page with file and API addresses below `root`."""
    html = file.read_text(encoding="utf-8")
    for built, served in (_RELATIVE, _ROOT):
        html = html.replace(built, served.format(root=root))
    return html

"""Pages of lists, at most `limit` rows each. The header Link (RFC 8288) of a page leads to the next one."""

from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Callable, Iterable
from itertools import dropwhile, islice
from typing import Annotated, Any, Final, TypeVar
from urllib.parse import parse_qsl, urlencode

from fastapi import Depends, Query, Request, Response

from hornbill.errors import InvalidValue

T = TypeVar("T")

CURSOR: Final = "cursor"
ALL: Final = 1_000_000
"""More rows than any list of what exists now has."""
LINK: Final = {
    "Link": {
        "description": 'Address of the next page, relative to this one: `<?cursor=…>; rel="next"`. Absent on the last.',
        "schema": {"type": "string"},
    }
}


class Page:
    """Part of a list, as requested."""

    def __init__(self, request: Request, response: Response, limit: int, cursor: str | None) -> None:
        """Raises InvalidValue unless `cursor` comes from a header Link."""
        self.limit = limit
        self.after = None if cursor is None else _decoded(cursor)
        """Key of the last row of the previous page. None for the first page."""
        self._request = request
        self._response = response

    @property
    def before_id(self) -> int | None:
        """`after` of lists by number. Raises InvalidValue if it is not a number."""
        if self.after is None:
            return None
        if not (self.after.isascii() and self.after.isdigit() and len(self.after) < 19):
            raise _invalid()
        return int(self.after)

    def of(self, rows: Iterable[T], key: Callable[[T], object]) -> list[T]:
        """The page of a complete list. Raises InvalidValue if the row of the cursor no longer exists."""
        if self.after is not None:
            rest = dropwhile(lambda row: str(key(row)) != self.after, rows)
            if next(rest, None) is None:
                raise _invalid()
            rows = rest
        return self.cut(list(islice(rows, self.limit + 1)), key)

    def cut(self, rows: list[T], key: Callable[[T], object]) -> list[T]:
        """The page, of up to `limit` + 1 rows after the cursor: one more shows that there is another page."""
        if len(rows) > self.limit:
            pairs = parse_qsl(self._request.url.query, keep_blank_values=True)
            cursor = urlsafe_b64encode(str(key(rows[self.limit - 1])).encode()).decode().rstrip("=")
            query = urlencode([*(pair for pair in pairs if pair[0] != CURSOR), (CURSOR, cursor)])
            self._response.headers["Link"] = f'<?{query}>; rel="next"'
        return rows[: self.limit]


Cursor = Annotated[str | None, Query(max_length=400, description="Position of the next page, from the header `Link`.")]


def pages(default: int, largest: int) -> Any:
    """Dependency for the page of a history: query parameters `limit` and `cursor`."""

    async def page(
        request: Request,
        response: Response,
        limit: Annotated[int, Query(ge=1, le=largest, description="Maximum number of rows, newest first.")] = default,
        cursor: Cursor = None,
    ) -> Page:
        return Page(request, response, limit, cursor)

    return Depends(page)


async def _every(
    request: Request,
    response: Response,
    limit: Annotated[int | None, Query(ge=1, le=ALL, description="Maximum number of rows. Default: all.")] = None,
    cursor: Cursor = None,
) -> Page:
    return Page(request, response, ALL if limit is None else limit, cursor)


Every = Annotated[Page, Depends(_every)]
"""Page of a list of what exists now, complete by default."""


def _decoded(cursor: str) -> str:
    try:
        return urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)).decode()
    except ValueError:
        raise _invalid() from None


def _invalid() -> InvalidValue:
    return InvalidValue(
        "This cursor is invalid, or its row was deleted. Start again with the first page, without a cursor.",
        cause="cursor_invalid",
    )

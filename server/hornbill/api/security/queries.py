"""Checks of query strings: only declared parameters, each once."""

from collections import Counter
from collections.abc import Collection
from urllib.parse import parse_qsl

from fastapi.dependencies.models import Dependant
from starlette.types import Scope

from hornbill.api.names import nearest
from hornbill.api.security.roles import RouteRole
from hornbill.errors import InvalidValue


def check_query(row: RouteRole | None, scope: Scope) -> None:
    """Refuse query parameters that the route does not declare, and repeated ones. Raises InvalidValue."""
    known = row.query if row is not None and scope["query_string"] else None
    if known is None:
        return
    pairs = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
    for name, times in Counter(name for name, _ in pairs).items():
        if name not in known:
            raise InvalidValue(
                f"Unknown query parameter '{name[:60]}'. {_advice(name, known)} Nothing was done.",
                cause="query_parameter_unknown",
                parameter=name[:60],
                nearest=nearest(name, known),
                known=sorted(known),
            )
        if times > 1:
            raise InvalidValue(
                f"The query parameter '{name}' is given {times} times. Give it once. Nothing was done.",
                cause="query_parameter_repeated",
                parameter=name,
            )


def _advice(name: str, known: Collection[str]) -> str:
    if (near := nearest(name, known)) is not None:
        return f"The nearest name is '{near}'."
    return f"Known: {', '.join(sorted(known))}." if known else "This operation takes none."


def query_names(dependant: Dependant) -> list[str]:
    """Declared query parameters, those of its dependencies included."""
    return [
        *(parameter.alias for parameter in dependant.query_params),
        *(name for inner in dependant.dependencies for name in query_names(inner)),
    ]

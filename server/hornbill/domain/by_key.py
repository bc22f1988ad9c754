"""Parameter keys, and sets by key: the document names every row of the catalogue that is served.

Keys are checked where rows are found (`Catalog.parameter`), so that an unknown one is a problem of its own.
"""

from collections.abc import Generator, Iterable
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Annotated, Any, Final

from pydantic import GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from typing_extensions import TypeAliasType

_KEYS: Final[ContextVar[tuple[str, ...]]] = ContextVar("keys", default=())


@contextmanager
def documented(keys: Iterable[str]) -> Generator[None]:
    """Schemas that are made meanwhile name these keys."""
    token = _KEYS.set(tuple(keys))
    try:
        yield
    finally:
        _KEYS.reset(token)


class _Key:
    """Schema of a key: an enumeration of all."""

    def __get_pydantic_json_schema__(self, core: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {**handler(core), "enum": list(_KEYS.get())}


class ByKey:
    """Schema of a dictionary by key: a property per row, so that generated clients type each."""

    def __get_pydantic_json_schema__(self, core: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        each = handler(core)["additionalProperties"]
        return {"type": "object", "properties": dict.fromkeys(_KEYS.get(), each), "additionalProperties": False}


ParameterKey = TypeAliasType("ParameterKey", Annotated[str, _Key()])
"""Key of a row that can be read."""

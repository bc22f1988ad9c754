"""Parameter keys, and dictionaries by key. The OpenAPI document lists all rows of the served catalogue.

Keys are checked when a row is looked up (`Catalog.parameter`), so that an unknown one has its own problem.
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
    """Schemas generated in this context list these keys."""
    token = _KEYS.set(tuple(keys))
    try:
        yield
    finally:
        _KEYS.reset(token)


class _Key:
    """Schema of a key: an enumeration of all keys."""

    def __get_pydantic_json_schema__(self, core: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {**handler(core), "enum": list(_KEYS.get())}


class ByKey:
    """Schema of a dictionary by key: one property per row, so that generated clients type each."""

    def __get_pydantic_json_schema__(self, core: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        each = handler(core)["additionalProperties"]
        return {"type": "object", "properties": dict.fromkeys(_KEYS.get(), each), "additionalProperties": False}


ParameterKey = TypeAliasType("ParameterKey", Annotated[str, _Key()])
"""Key of a readable row."""

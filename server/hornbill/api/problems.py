"""Mapping of errors to HTTP responses (application/problem+json)."""

import json
from collections.abc import Iterable, Iterator
from typing import Any, Final, get_args

import orjson
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from hornbill import errors
from hornbill.api import remedies
from hornbill.api.names import nearest
from hornbill.domain.problem import Problem

STATUS: dict[str, int] = {
    "unknown_servo": 404,
    "unknown_parameter": 404,
    "unknown_job": 404,
    "unknown_lease": 404,
    "unknown_uid": 404,
    "unknown_log": 404,
    "unknown_snapshot": 404,
    "unknown_profile": 404,
    "unknown_run": 404,
    "unknown_stream": 404,
    "unknown_recording": 404,
    "unknown_fault": 404,
    "unknown_token": 404,
    "no_autopilot": 404,
    "no_verification": 404,
    "no_simulator": 404,
    "not_in_this_model": 409,
    "read_only": 409,
    "forbidden_parameter": 403,
    "out_of_range": 422,
    "invalid_value": 422,
    "refused_by_servo": 502,
    "no_response": 504,
    "bus_disconnected": 503,
    "bus_read_only": 409,
    "bus_open_failed": 502,
    "bus_trouble": 503,
    "cannot_start": 500,
    "mode_off": 409,
    "torque_off": 409,
    "torque_on": 409,
    "position_unit_unconfirmed": 409,
    "lease_required": 428,
    "lease_held": 409,
    "stopped": 423,
    "busy": 409,
    "commanded_elsewhere": 409,
    "conflict": 409,
    "needs_confirmation": 409,
    "bus_budget": 409,
    "configuration_lost": 409,
    "did_not_move": 502,
    "unexpected_result": 502,
    "interrupted": 500,
    "not_available": 501,
    "stale_revision": 412,
    "forbidden_origin": 403,
    "unauthorized": 401,
    "forbidden_role": 403,
    "too_many_attempts": 429,
    "unsupported_media_type": 415,
    "too_large": 413,
    "idempotency_key_reused": 422,
    "not_found": 404,
    "method_not_allowed": 405,
    "bad_table": 500,
    "store_failed": 500,
    "log_failed": 500,
    "internal": 500,
}
"""HTTP status by error code. A test checks that every error class is covered."""

MEDIA_TYPE = "application/problem+json"
_RESPONSE: Final = "#/components/responses/"
_CONTENT = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
_LIMITED: Final = {
    "Retry-After": {
        "description": "With 429: time to wait before the next attempt, s.",
        "schema": {"type": "integer", "minimum": 1},
    }
}
COMMON: Final = (
    "unauthorized", "forbidden_role", "forbidden_origin", "too_large", "unsupported_media_type", "too_many_attempts",
    "internal",
)  # fmt: skip
"""Codes of the guard, which may refuse any request before its route is called."""


def _common(*codes: str) -> str:
    return f"Refused before the operation: {', '.join(f'`{code}` ({STATUS[code]})' for code in codes)}."


OWN_RESPONSE: Final = (
    "invalid_value", "bus_disconnected", "no_response", "unknown_servo", "refused_by_servo", "not_in_this_model",
    "stopped", "lease_required", "forbidden_parameter", "store_failed",
)  # fmt: skip
"""Codes that are often the only one of their status: each is a component of its own."""

RESPONSES: Final[dict[str, Any]] = {
    "Problem": {"description": "Problem and remedy.", "content": _CONTENT},
    "CommonProblem": {"description": _common(*COMMON), "headers": _LIMITED, "content": _CONTENT},
    "StopProblem": {
        "description": _common(*(code for code in COMMON if code != "too_many_attempts")),
        "content": _CONTENT,
    },
    **{code: {"description": f"`{code}`", "content": _CONTENT} for code in OWN_RESPONSE},
}
"""Responses shared by operations, as components of the document; each operation adds its codes."""


def problem(error: errors.HornbillError) -> Problem:
    """Problem document of an error; its facts become extra members."""
    status = STATUS[error.code]
    facts = {key: value for key, value in error.facts.items() if key not in Problem.model_fields}
    return Problem(
        type=f"urn:hornbill:{error.code}", title=error.title, status=status, code=error.code,
        detail=remedies.detail(error), summary=error.detail, params=error.params,
        cause=error.facts.get("cause"), **facts,
    )  # fmt: skip


def problem_response(error: errors.HornbillError) -> Response:
    """HTTP response of an error."""
    shown = problem(error)
    # Facts may quote the request: integers of any size and lone surrogates, which orjson rejects, and NaN, which JSON
    # lacks and which becomes a string.
    text = json.dumps(json.loads(json.dumps(shown.model_dump(), default=str), parse_constant=str))
    wait_s = error.facts.get("retry_after_s")
    headers = None if wait_s is None else {"Retry-After": str(wait_s)}
    return Response(text, shown.status, headers, media_type=MEDIA_TYPE)


def declared(*codes: str, limited: bool = True) -> dict[int | str, dict[str, Any]]:
    """OpenAPI responses for these codes, grouped by status. `limited`: subject to rate limiting (429)."""
    by_status: dict[int, list[str]] = {}
    for code in dict.fromkeys(codes):
        by_status.setdefault(STATUS[code], []).append(code)
    own = {status: _declared(named) for status, named in by_status.items()}
    return {**own, "default": {"$ref": f"{_RESPONSE}{'CommonProblem' if limited else 'StopProblem'}"}}


def _declared(codes: list[str]) -> dict[str, Any]:
    if len(codes) == 1 and codes[0] in OWN_RESPONSE:
        return {"$ref": f"{_RESPONSE}{codes[0]}"}
    return {"$ref": f"{_RESPONSE}Problem", "description": ", ".join(f"`{code}`" for code in codes)}


def install(app: FastAPI) -> None:
    """Register handlers that turn our errors, validation errors and routing errors into problems."""

    @app.exception_handler(errors.HornbillError)
    async def _ours(_request: Request, error: Exception) -> Response:
        assert isinstance(error, errors.HornbillError)
        return problem_response(error)

    @app.exception_handler(RequestValidationError)
    async def _invalid(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        body = _body(request.scope.get("route"))
        found = [
            {"where": ".".join(str(part) for part in one["loc"]), "what": _what(one, body)} for one in error.errors()
        ]
        text = "; ".join(f"{one['where']}: {one['what']}" for one in found[:3])
        return problem_response(
            errors.InvalidValue(
                f"The request does not match the API description. {text}.",
                cause="request_malformed",
                where=[one["where"] for one in found[:3]],
                errors=found,
            )
        )

    @app.exception_handler(HTTPException)
    async def _routing(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        if error.status_code == 400:
            return problem_response(
                errors.InvalidValue(f"The body is not valid JSON: {error.detail}.", cause="body_not_json")
            )
        code = {404: "not_found", 405: "method_not_allowed"}.get(error.status_code, "internal")
        shown = Problem(
            type=f"urn:hornbill:{code}", title=str(error.detail), status=error.status_code, code=code,
            detail=f"{request.method} {request.url.path}: {error.detail}. See /api/v1/openapi.json for all operations.",
            summary=f"{request.method} {request.url.path}: {error.detail}.",
        )  # fmt: skip
        return Response(orjson.dumps(shown.model_dump()), error.status_code, media_type=MEDIA_TYPE)


def _what(error: dict[str, Any], body: object) -> str:
    """Text of a validation error; of an unknown field of the body with the nearest known one, or all."""
    where = error["loc"]
    if error["type"] != "extra_forbidden" or where[0] != "body":
        return str(error["msg"])
    models = [body]
    for part in where[1:-1]:
        models = [one.model_fields[part].annotation for one in _models(models) if part in one.model_fields]
    fields = sorted(name for one in _models(models) for name in one.model_fields)
    near = nearest(str(where[-1]), fields)
    if near is not None:
        return f"Unknown field. The nearest name is '{near}'."
    return f"Unknown field. Known: {', '.join(fields)}." if fields else "Unknown field."


def _models(types: Iterable[object]) -> Iterator[Any]:
    """The models among types, also in unions, such as those of optional fields."""
    for one in types:
        if hasattr(one, "model_fields"):
            yield one
        yield from _models(get_args(one))


def _body(route: object) -> object:
    """Type of a route's body."""
    field = getattr(route, "body_field", None)
    return None if field is None else field.field_info.annotation

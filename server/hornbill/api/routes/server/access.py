"""Routes of access: log in and out, who am I, a ticket for a socket, and tokens for an admin."""

import logging
from typing import Annotated

from fastapi import Depends, Path, Request, Response
from pydantic import Field

from hornbill.api.dependencies import TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.access import COOKIE, WHO, Access, Identity, cookie
from hornbill.api.security.roles import ANYBODY, Role, RoleName
from hornbill.api.security.sessions import LASTING_S, TICKET_S
from hornbill.domain.fields import Model
from hornbill.domain.note import Note
from hornbill.errors import Conflict, Unauthorized
from hornbill.servo.host import Host
from hornbill.store.audit import NewAuditEntry
from hornbill.store.tokens import Token

log = logging.getLogger(__name__)
routes = Routes("access")


class Login(Model):
    """What the login page sends."""

    token: str = Field(
        min_length=1, max_length=200, repr=False, description="Token as printed by `hornbill token add`."
    )


class SessionState(Model):
    """Who asks, and whether anybody has to say so. Where nobody has to, everybody is an admin."""

    required: bool = Field(description="A token is required.")
    name: str | None = Field(description="Name of the token. Null without one.")
    role: RoleName | None = Field(description="Role of the token. Null: login only.")
    expires_in_s: float | None = Field(description="Time until the login expires unless used, s. Null without a login.")


class Ticket(Model):
    """Opens one WebSocket, as `?ticket=`, for who can set no header."""

    ticket: str = Field(description="Ticket that opens one socket, once.")
    expires_in_s: float = Field(description="Time until the ticket expires, s.")


class TokenDraft(Model):
    """A token to be made."""

    name: str = Field(min_length=1, max_length=32, description="Name: letters, digits, spaces and . _ @ -")
    role: RoleName = Field(description="Role of the token.")


class TokenView(Model):
    """A token without its secret."""

    name: str = Field(description="Name of the token.")
    role: str = Field(description="Role of the token.")
    created_at: float = Field(description="Time of creation, seconds since 1970 UTC.")
    last_used_at: float | None = Field(
        description="Last use, seconds since 1970 UTC, to within about a minute. Null if never used."
    )


class TokenMade(TokenView):
    """A new token: the one time its secret is told."""

    token: str = Field(repr=False, description="Secret of the token, returned only once.")


async def _access(request: Request) -> Access:
    access = request.app.state.access
    assert isinstance(access, Access)
    return access


TheAccess = Annotated[Access, Depends(_access)]


async def _who(request: Request) -> Identity | None:
    who = request.scope.get(WHO)
    assert who is None or isinstance(who, Identity)
    return who


Who = Annotated[Identity | None, Depends(_who)]


@routes.post("/session", ANYBODY, "unauthorized", "too_many_attempts", "invalid_value")
async def log_in(request: Request, response: Response, access: TheAccess, host: TheHost, body: Login) -> SessionState:
    """Log in with a token: the browser gets a cookie that no script can read and no other site can use."""
    address = request.client.host if request.client else ""
    try:
        who, secret = access.login(body.token.strip(), address)
    except Unauthorized:
        log.warning("a login from %s failed", address)
        raise
    before = cookie(request)
    if before is not None:
        access.logout(before)
    response.set_cookie(
        COOKIE, secret, max_age=round(LASTING_S), path=_path(request), httponly=True, samesite="strict",
        secure=request.url.scheme == "https",
    )  # fmt: skip
    note = Note(f"from {address}", "login_from", {"address": address})
    host.audit.note(NewAuditEntry(by=who.name, action="login", outcome="succeeded", notes=(note,)))
    return SessionState(required=access.required, name=who.name, role=who.role.word, expires_in_s=LASTING_S)


@routes.get("/session", ANYBODY)
async def get_session(request: Request, access: TheAccess, who: Who) -> SessionState:
    """Who asks. Without a token it says whether one is needed."""
    if who is None:
        role = None if access.required else Role.ADMIN.word
        return SessionState(required=access.required, name=None, role=role, expires_in_s=None)
    return SessionState(
        required=access.required, name=who.name, role=who.role.word, expires_in_s=access.left_s(request)
    )


@routes.delete("/session", ANYBODY, status_code=204)
async def log_out(request: Request, response: Response, access: TheAccess) -> None:
    """Log out: the cookie opens nothing any more, and the sockets that came with it end."""
    secret = cookie(request)
    if secret is not None:
        access.logout(secret)
    response.delete_cookie(COOKIE, path=_path(request), httponly=True, samesite="strict")


@routes.post("/tickets", Role.VIEW, status_code=201)
async def make_ticket(access: TheAccess, who: Who) -> Ticket:
    """A ticket for one WebSocket: `/api/v1/ws?ticket=…`, within 30 s. It may stand in a log: it works once."""
    return Ticket(ticket=access.ticket(who), expires_in_s=TICKET_S)


@routes.get("/tokens", Role.ADMIN)
async def list_tokens(access: TheAccess, host: TheHost) -> list[TokenView]:
    """Who may come in. The tokens themselves are kept nowhere and cannot be told."""
    return [_shown(one, access) for one in await host.store.run(host.store.tokens.all)]


@routes.post("/tokens", Role.ADMIN, "conflict", "invalid_value", status_code=201)
async def add_token(access: TheAccess, host: TheHost, body: TokenDraft) -> TokenMade:
    """Make a token. `token` is told this once. From the first one on, everybody needs one: it is an admin's."""
    if not access.required and body.role != "admin":
        raise Conflict(
            f"The first token must be for admin, not {body.role}: from then on everybody needs one, and nobody could "
            "make another.", cause="first_token_not_admin", role=body.role,
        )  # fmt: skip
    made, secret = await host.store.run(host.store.tokens.add, body.name, body.role)
    _note(host, made, "added")
    await access.refresh()
    return TokenMade(**_shown(made, access).model_dump(), token=secret)


@routes.delete("/tokens/{name}", Role.ADMIN, "unknown_token", status_code=204)
async def revoke_token(
    access: TheAccess, host: TheHost, name: Annotated[str, Path(description="Name of the token.")]
) -> None:
    """Revoke a token: it opens nothing any more, and every socket and login that came with it ends."""
    known = {one.name: one for one in await host.store.run(host.store.tokens.all)}
    await host.store.run(host.store.tokens.drop, name)
    _note(host, known[name], "revoked")
    await access.refresh()


def _note(host: Host, token: Token, outcome: str) -> None:
    by = host.leases.who(None, host.base.now())
    host.audit.note(NewAuditEntry(by=by, action="token", outcome=outcome, key=token.name, requested=token.role))


def _shown(one: Token, access: Access) -> TokenView:
    used = access.last_used_at(one.name) or one.last_used_at
    return TokenView(name=one.name, role=one.role, created_at=one.created_at, last_used_at=used)


def _path(request: Request) -> str:
    """Where the cookie goes: to us alone, where a proxy has others beside us."""
    return str(request.scope.get("root_path", "")) or "/"

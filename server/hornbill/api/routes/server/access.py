"""Routes of access control: login, session, tickets and tokens."""

import logging
from typing import Annotated

from fastapi import Depends, Path, Request, Response
from pydantic import Field

from hornbill.api.dependencies import TheHost
from hornbill.api.paging import Every
from hornbill.api.routing import Routes
from hornbill.api.security.access import COOKIE, WHO, Access, Identity, cookie
from hornbill.api.security.roles import PUBLIC, Role, RoleName
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
    """Login with a token."""

    token: str = Field(
        min_length=1, max_length=200, repr=False, description="Token as printed by `hornbill tokens create`."
    )


class SessionState(Model):
    """Identity of the client. Without access control, every client has the role admin."""

    required: bool = Field(description="A token is required.")
    name: str | None = Field(description="Name of the token. Null without one.")
    role: RoleName | None = Field(description="Role of the client. Null if it must log in first.")
    expires_in_s: float | None = Field(description="Time until the login expires unless used, s. Null without a login.")


class Ticket(Model):
    """Opens one WebSocket as `?ticket=`, for clients that cannot set headers."""

    ticket: str = Field(description="Ticket. Valid for one socket.")
    expires_in_s: float = Field(description="Time until the ticket expires, s.")


class TokenDraft(Model):
    """Token to create."""

    name: str = Field(min_length=1, max_length=32, description="Name: letters, digits, spaces and . _ @ -")
    role: RoleName = Field(description="Role of the token.")


class TokenView(Model):
    """Token without its secret."""

    name: str = Field(description="Name of the token.")
    role: str = Field(description="Role of the token.")
    created_at: float = Field(description="Time of creation, seconds since 1970 UTC.")
    last_used_at: float | None = Field(
        description="Last use, seconds since 1970 UTC, to within about a minute. Null if never used."
    )


class TokenMade(TokenView):
    """New token, with its secret."""

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


@routes.post("/session", PUBLIC, "unauthorized", "too_many_attempts", "invalid_value")
async def log_in(request: Request, response: Response, access: TheAccess, host: TheHost, body: Login) -> SessionState:
    """Log in with a token. Sets a session cookie that scripts cannot read and other sites cannot use."""
    address = request.client.host if request.client else ""
    try:
        who, secret = access.login(body.token.strip(), address)
    except Unauthorized:
        log.warning("failed login from %s", address)
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


@routes.get("/session", PUBLIC)
async def get_session(request: Request, access: TheAccess, who: Who) -> SessionState:
    """Get the identity of the client, and whether a token is required."""
    if who is None:
        role = None if access.required else Role.ADMIN.word
        return SessionState(required=access.required, name=None, role=role, expires_in_s=None)
    return SessionState(
        required=access.required, name=who.name, role=who.role.word, expires_in_s=access.left_s(request)
    )


@routes.delete("/session", PUBLIC, status_code=204)
async def log_out(request: Request, response: Response, access: TheAccess) -> None:
    """Log out. Ends the session of the cookie and closes its sockets."""
    secret = cookie(request)
    if secret is not None:
        access.logout(secret)
    response.delete_cookie(COOKIE, path=_path(request), httponly=True, samesite="strict")


@routes.post("/tickets", Role.VIEW, status_code=201)
async def create_ticket(access: TheAccess, who: Who) -> Ticket:
    """Create a ticket for one WebSocket: `/api/v1/ws?ticket=…`. It is valid once, within 30 s."""
    return Ticket(ticket=access.ticket(who), expires_in_s=TICKET_S)


@routes.get("/tokens", Role.ADMIN)
async def list_tokens(access: TheAccess, host: TheHost, page: Every) -> list[TokenView]:
    """List tokens. Their secrets are not stored and cannot be retrieved."""
    found = [_shown(one, access) for one in await host.store.run(host.store.tokens.all)]
    return page.of(found, lambda one: one.name)


@routes.post("/tokens", Role.ADMIN, "conflict", "invalid_value", status_code=201)
async def create_token(access: TheAccess, host: TheHost, body: TokenDraft) -> TokenMade:
    """Create a token. Its secret is returned once. The first token must be for admin; it enables access control."""
    if not access.required and body.role != "admin":
        raise Conflict(
            f"The role of the first token must be admin, not {body.role}. From then on every client needs a token, and "
            "other roles cannot create one.", cause="first_token_not_admin", role=body.role,
        )  # fmt: skip
    made, secret = await host.store.run(host.store.tokens.add, body.name, body.role)
    _note(host, made, "added")
    await access.refresh()
    return TokenMade(**_shown(made, access).model_dump(), token=secret)


@routes.delete("/tokens/{name}", Role.ADMIN, "unknown_token", status_code=204)
async def revoke_token(
    access: TheAccess, host: TheHost, name: Annotated[str, Path(description="Name of the token.")]
) -> None:
    """Revoke a token. Its sessions and sockets end."""
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
    """Path of the cookie: the sub-path of the proxy, which may serve other applications."""
    return str(request.scope.get("root_path", "")) or "/"

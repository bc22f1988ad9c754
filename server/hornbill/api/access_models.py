"""Owns the JSON shapes of access: tokens, the session of a browser, tickets."""

from pydantic import Field

from hornbill.api.models import Model
from hornbill.api.roles import RoleWord


class Login(Model):
    """What the login page sends."""

    token: str = Field(min_length=1, max_length=200, repr=False)


class SessionState(Model):
    """Who asks, and whether anybody has to say so. Where nobody has to, everybody is an admin."""

    required: bool = Field(description="whether a token is needed")
    name: str | None = Field(description="what the token is called; null where none came along")
    role: RoleWord | None = Field(description="what it is for; null: nothing but logging in")
    expires_in_s: float | None = Field(description="when the login has run out, unless it is used; null without one")


class Ticket(Model):
    """Opens one WebSocket, as `?ticket=`, for who can set no header."""

    ticket: str
    expires_in_s: float


class TokenDraft(Model):
    """A token to be made."""

    name: str = Field(min_length=1, max_length=32, description="letters, digits, spaces and . _ @ -")
    role: RoleWord


class TokenView(Model):
    """A token without its secret."""

    name: str
    role: str
    created_at: float = Field(description="seconds since 1970 UTC")
    last_used_at: float | None = Field(description="seconds since 1970 UTC; kept about once a minute")


class TokenMade(TokenView):
    """A new token: the one time its secret is told."""

    token: str = Field(repr=False)

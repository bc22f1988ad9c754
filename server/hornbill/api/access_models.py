"""Owns the JSON shapes of access: tokens, the session of a browser, tickets."""

from pydantic import Field

from hornbill.api.security.roles import RoleWord
from hornbill.domain.fields import Model


class Login(Model):
    """What the login page sends."""

    token: str = Field(
        min_length=1, max_length=200, repr=False, description="Token as printed by `hornbill token add`."
    )


class SessionState(Model):
    """Who asks, and whether anybody has to say so. Where nobody has to, everybody is an admin."""

    required: bool = Field(description="A token is required.")
    name: str | None = Field(description="Name of the token. Null without one.")
    role: RoleWord | None = Field(description="Role of the token. Null: login only.")
    expires_in_s: float | None = Field(description="Time until the login expires unless used, s. Null without a login.")


class Ticket(Model):
    """Opens one WebSocket, as `?ticket=`, for who can set no header."""

    ticket: str = Field(description="Ticket that opens one socket, once.")
    expires_in_s: float = Field(description="Time until the ticket expires, s.")


class TokenDraft(Model):
    """A token to be made."""

    name: str = Field(min_length=1, max_length=32, description="Name: letters, digits, spaces and . _ @ -")
    role: RoleWord = Field(description="Role of the token.")


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

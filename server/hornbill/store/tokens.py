"""Who may come in, by name, role and the digest of a token that is kept nowhere."""

import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from typing import Final

from sqlalchemy import select

from hornbill.errors import Conflict, InvalidValue, Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import TokenRow

NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._@-]{0,30}[A-Za-z0-9]|[A-Za-z0-9]")
"""How a token may be called: 1 to 32 characters that are harmless in a log, a file and an address."""
_PREFIX: Final = "hb_"
_SECRET_BYTES: Final = 32


@dataclass(frozen=True, slots=True)
class Token:
    """One token without its secret; instants in seconds since 1970 (UTC). What `role` allows is not known here."""

    name: str
    role: str
    digest: str
    created_at: float
    last_used_at: float | None = None


def digest(secret: str) -> str:
    """What is kept of a token: SHA-256, 64 hex digits.

    A slow hash with salt defends passwords, which people choose from few. A token is 32 random bytes: to find one by
    its digest takes 2^255 tries, however fast each is. And each request checks one, so it has to be fast.
    """
    return sha256(secret.encode(errors="surrogatepass")).hexdigest()


class Tokens(Repository[TokenRow, Token]):
    """Tokens by name; one that was dropped opens nothing any more."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, TokenRow, Token)

    def all(self) -> list[Token]:
        """Every token, by name."""
        return sorted(self._facts(select(TokenRow)), key=lambda one: one.name)

    def add(self, name: str, role: str) -> tuple[Token, str]:
        """Make a token: what is kept of it, and its secret, which nobody can be told again.

        Raises InvalidValue for a name that does not fit `NAME`, and Conflict for one that is taken.
        """
        if not NAME.fullmatch(name):
            raise InvalidValue(
                f"{name[:40]!r} is no name for a token. Give 1 to 32 letters, digits, spaces and . _ @ - that begin "
                "and end with a letter or digit.",
                cause="no_token_name",
            )
        secret = _PREFIX + secrets.token_urlsafe(_SECRET_BYTES)
        with self._database.transaction() as session:
            if session.get(TokenRow, name) is not None:
                raise Conflict(
                    f"There is a token {name!r} already. Revoke it first, or take another name.",
                    name=name,
                    cause="token_name_taken",
                )
            row = TokenRow(name=name, role=role, digest=digest(secret), created_at=self._wall(), last_used_at=None)
            session.add(row)
            return self._fact(row), secret

    def used(self, instants: Mapping[str, float]) -> None:
        """Keep when tokens were used last, by name; one that was revoked meanwhile is passed over."""
        with self._database.transaction() as session:
            for name, at in instants.items():
                row = session.get(TokenRow, name)
                if row is not None:
                    row.last_used_at = at

    def _unknown(self, key: str) -> Unknown:
        return Unknown(
            "unknown_token",
            f"There is no token {key[:40]!r}.",
            cause="no_such_token",
            name=key[:40],
        )

"""Access tokens: name, role and digest. The tokens themselves are not stored."""

import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from hashlib import sha256
from typing import Final

from sqlalchemy import insert, select, update

from hornbill.errors import Conflict, InvalidValue, Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository, row_at
from hornbill.store.tables import TOKENS

NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._@-]{0,30}[A-Za-z0-9]|[A-Za-z0-9]")
"""Allowed token names: 1 to 32 characters that are safe in logs, files and URLs."""
_PREFIX: Final = "hb_"
_SECRET_BYTES: Final = 32


@dataclass(frozen=True, slots=True)
class Token:
    """One token without its secret. Instants: seconds since 1970 UTC. The API layer interprets `role`."""

    name: str
    role: str
    digest: str
    created_at: float
    last_used_at: float | None = None
    bench: str | None = None


def digest(secret: str) -> str:
    """Digest of a token: SHA-256, 64 hex digits.

    Passwords need a slow salted hash because users choose weak ones. A token is 32 random bytes, so finding it from its
    digest takes 2^255 tries at any speed. Each request checks a token, so the hash must be fast.
    """
    return sha256(secret.encode(errors="surrogatepass")).hexdigest()


def new_secret() -> str:
    """A secret for a token."""
    return _PREFIX + secrets.token_urlsafe(_SECRET_BYTES)


class Tokens(Repository[Token]):
    """Tokens by name. A dropped token is revoked."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, TOKENS, Token)

    def all(self) -> list[Token]:
        """All tokens, sorted by name."""
        return sorted(self._facts(select(TOKENS)), key=lambda one: one.name)

    def add(self, name: str, role: str, secret: str | None = None) -> tuple[Token, str]:
        """Create a token. Returns it with its secret, which cannot be retrieved again. `secret`: one of `new_secret`.

        Raises InvalidValue for a name that does not match `NAME`, and Conflict for a name in use.
        """
        if not NAME.fullmatch(name):
            raise InvalidValue(
                f"{name[:40]!r} is not a valid token name. Use 1 to 32 letters, digits, spaces and . _ @ - that begin "
                "and end with a letter or digit.",
                cause="token_name_invalid",
            )
        secret = secret or new_secret()
        with self._database.transaction() as connection:
            if row_at(connection, TOKENS, name) is not None:
                raise Conflict(
                    f"A token {name!r} already exists. Revoke it first, or use another name.",
                    name=name,
                    cause="token_name_in_use",
                )
            made = Token(name, role, digest(secret), self._wall(), None, self._database.bench)
            connection.execute(insert(TOKENS), asdict(made))
        return made, secret

    def used(self, instants: Mapping[str, float]) -> None:
        """Store the time of last use, by name. A revoked token is ignored."""
        with self._database.transaction() as connection:
            for name, at in instants.items():
                connection.execute(update(TOKENS).where(TOKENS.c.name == name).values(last_used_at=at))

    def _unknown(self, key: str) -> Unknown:
        return Unknown(
            "unknown_token",
            f"Unknown token {key[:40]!r}.",
            cause="token_not_found",
            name=key[:40],
        )

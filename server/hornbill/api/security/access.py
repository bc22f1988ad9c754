"""Authentication by token, session cookie or ticket, and its expiry."""

import asyncio
import logging
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from starlette.requests import HTTPConnection

from hornbill.api.security.roles import WORDS, Role
from hornbill.api.security.sessions import Attempts, Sessions, Tickets
from hornbill.errors import ForbiddenRole, StoreFailed, TooManyAttempts, Unauthorized
from hornbill.store.store import Store
from hornbill.store.tokens import Token, digest

log = logging.getLogger(__name__)

COOKIE: Final = "hornbill_session"
COMMAND_LINE: Final = "command line"
"""Name of the token given at start. It has the role admin and is not stored."""
WHO: Final = "hornbill.who"
"""Key of a request's Identity in its ASGI scope; the value is None without a credential."""
REFRESH_S: Final = 1.0
"""Interval at which tokens that another process changed are reloaded, s. The store notices changes within another
second."""
USED_S: Final = 60.0
"""Interval at which the last use of tokens is stored."""
MOST_PROVED: Final = 1000
"""Remembered pairs of address and valid token; the least recently used is dropped first."""
_NO_CREDENTIAL: Final = ""
"""Stands for the digest of a credential where there is none."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Authenticated client. `credential`: digest of the token or session it sent."""

    name: str
    role: Role
    token: str
    credential: str


class Access:
    """Tokens, sessions and tickets. Without any token every client is an admin, unless `required`."""

    def __init__(
        self,
        *,
        given: str | None = None,
        required: bool = False,
        now: Callable[[], float] = time.monotonic,
        wall: Callable[[], float] = time.time,
    ) -> None:
        """`given`: token from the command line. `required`: require a token even if none exists yet."""
        self._given = None if given is None else Token(COMMAND_LINE, Role.ADMIN.word, digest(given), wall())
        self._required = required or given is not None
        self._now = now
        self._wall = wall
        self._store: Store | None = None
        self._tokens: dict[str, Token] = {} if self._given is None else {self._given.digest: self._given}
        self._used: dict[str, float] = {}
        self._used_stored_at = now()
        self._changed = False
        self._failing = False
        self._ends: dict[str, set[asyncio.Future[None]]] = {}
        self.ended = 0
        """Changes whenever a credential may have been revoked or logged out."""
        self.sessions = Sessions()
        self.tickets = Tickets()
        self.attempts = Attempts()
        self.guesses = Attempts("requests with invalid tokens")
        self._proved: OrderedDict[tuple[str, str], None] = OrderedDict()

    @property
    def required(self) -> bool:
        """Whether a token is required. Once true, it stays true until the process exits, even without tokens."""
        return self._required

    def open(self, store: Store) -> None:
        """Load the tokens of a store. Raises StoreFailed."""
        self._store = store
        store.on_changed(self._on_changed)
        self._take(store.tokens.all())

    async def refresh(self) -> None:
        """Reload the tokens, close sockets whose credentials have ended, and store the last use of tokens."""
        self._age()
        if self._store is None:
            return
        self._changed = False  # before they are read, so that no later change is missed
        try:
            self._take(await self._store.run(self._store.tokens.all))
            if self._now() - self._used_stored_at >= USED_S:
                await self._store_used()
        except StoreFailed as error:
            self._changed = True
            self._note(error)
        else:
            self._note(None)

    async def keep_fresh(self) -> None:
        """Call `refresh` when another process changed the tokens, until it succeeds, and store their last use, until
        cancelled."""
        while True:
            await asyncio.sleep(REFRESH_S)
            self._age()
            if self._changed or self._now() - self._used_stored_at >= USED_S:
                await self.refresh()

    def _note(self, error: StoreFailed | None) -> None:
        """Log when reloading begins to fail, and when it works again."""
        if error is not None and not self._failing:
            log.warning("cannot reload the tokens; known tokens stay valid: %s", error)
        elif error is None and self._failing:
            log.warning("the tokens are reloaded again")
        self._failing = error is not None

    def _on_changed(self, table: str) -> None:
        self._changed = self._changed or table == "tokens"

    async def close(self) -> None:
        """Store the last use of tokens."""
        try:
            await self._store_used()
        except StoreFailed:
            log.warning("cannot store the last use of tokens", exc_info=True)

    def last_used_at(self, name: str) -> float | None:
        """Last use of a token that is not stored yet, seconds since 1970; None if there is none."""
        return self._used.get(name)

    def who(self, connection: HTTPConnection, ticket: str | None = None, *, stopping: bool = False) -> Identity | None:
        """Identity of a client: by header, else ticket, else cookie. None if unknown.

        `stopping`: the request is a stop. Raises TooManyAttempts as `offered`.
        """
        kind, _, secret = connection.headers.get("authorization", "").partition(" ")
        if kind.lower() == "bearer":  # other schemes are for a proxy in front of the server
            address = connection.client.host if connection.client else ""
            return self.offered(secret.strip(), address, stopping=stopping)
        if ticket is not None:
            taken = self.tickets.take(ticket, self._now())
            return None if taken is None else self._known(*taken)
        secret = cookie(connection)
        session = None if secret is None else self.sessions.get(secret, self._now())
        return None if session is None else self._known(session.token, session.key)

    def stopper(self, connection: HTTPConnection) -> Identity | None:
        """Identity of a client that stops with an expired session: Stop never requires a new login."""
        secret = cookie(connection)
        session = None if secret is None else self.sessions.spent(secret)
        return None if session is None else self._known(session.token, session.key)

    def bearer(self, secret: str) -> Identity | None:
        """Identity of a token. All tokens are compared, each in constant time."""
        offered, found = digest(secret), ""
        for known in self._tokens:
            if secrets.compare_digest(known, offered):
                found = known
        return self._known(found, found) if found else None

    def offered(self, secret: str, address: str, *, stopping: bool = False) -> Identity | None:
        """Identity of a token sent from `address`. Raises TooManyAttempts after too many invalid tokens.

        While limited, only tokens that were valid from this address before are checked, so that guessing yields
        nothing: running programs continue, new clients wait. A stop request is always checked.
        """
        place, now = (address, digest(secret)), self._now()
        if place not in self._proved:
            try:
                self.guesses.allow(address, now)
            except TooManyAttempts:
                if not stopping:
                    raise
                return self.bearer(secret)
        who = self.bearer(secret)
        if who is not None:
            self._proved[place] = None
            self._proved.move_to_end(place)
            while len(self._proved) > MOST_PROVED:
                self._proved.popitem(last=False)
        elif self._required:
            self._proved.pop(place, None)
            self.guesses.failed(address, now, place[1])
            log.warning("invalid token from %s", address)
        return who

    def login(self, secret: str, address: str) -> tuple[Identity, str]:
        """Identity, and secret of a new session. Raises Unauthorized and TooManyAttempts."""
        self.attempts.allow(address, self._now())
        who = self.bearer(secret)
        if who is None:
            self.attempts.failed(address, self._now())
            raise Unauthorized(
                "Invalid token. It may have been revoked or copied incompletely. Create a token with "
                "'hornbill tokens create NAME --role ROLE'.",
                cause="token_unknown",
            )
        session, cookie_secret = self.sessions.begin(who.token, self._now())
        return Identity(who.name, who.role, who.token, session.key), cookie_secret

    def ticket(self, who: Identity | None) -> str:
        """Ticket that opens one socket with the client's identity, or without one if no token is required."""
        return self.tickets.issue(*(("", "") if who is None else (who.token, who.credential)), self._now())

    def left_s(self, connection: HTTPConnection) -> float | None:
        """Seconds until the session of this cookie expires; None without one."""
        secret = cookie(connection)
        session = None if secret is None else self.sessions.get(secret, self._now())
        return None if session is None else session.ends_at() - self._now()

    def logout(self, secret: str) -> None:
        """End the session of this cookie and its sockets."""
        session = self.sessions.end(secret)
        if session is not None:
            self._end(session.key)

    def watch(self, who: Identity | None) -> asyncio.Future[None]:
        """Future that completes when the credential ends: revoked or logged out. Release it with `unwatch`.

        Without a credential (None) it completes when tokens become required.
        """
        made: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        for key in _credentials(who):
            self._ends.setdefault(key, set()).add(made)
        return made

    def unwatch(self, who: Identity | None, watched: asyncio.Future[None]) -> None:
        """Release a future of `watch`."""
        for key in _credentials(who):
            waiting = self._ends.get(key, set())
            waiting.discard(watched)
            if not waiting:
                self._ends.pop(key, None)

    def _known(self, token: str, credential: str) -> Identity | None:
        found = self._tokens.get(token)
        if found is None:
            return None
        role = WORDS.get(found.role)
        if role is None:  # a role of a newer hornbill grants nothing here
            return None
        if found is not self._given:
            self._used[found.name] = self._wall()
        return Identity(found.name, role, token, credential)

    async def _store_used(self) -> None:
        if self._used and self._store is not None:
            self._used_stored_at = self._now()
            used, self._used = self._used, {}
            await self._store.run(self._store.tokens.used, used)

    def _take(self, tokens: Iterable[Token]) -> None:
        before = self._tokens
        known = {one.digest: one for one in tokens}
        if self._given is not None:
            known[self._given.digest] = self._given
        self._tokens = known
        self.ended += 1
        self._required = self._required or bool(known)
        for gone in before.keys() - known.keys():
            self._end(gone)
        if self._required:
            self._end(_NO_CREDENTIAL)

    def _age(self) -> None:
        """Keep sessions with open sockets alive, and close the sockets of expired sessions."""
        now = self._now()
        for key in list(self._ends):
            session = self.sessions.at(key)
            if session is not None and session.ends_at() <= now:
                self._end(key)
            elif session is not None:
                session.used_at = now

    def _end(self, key: str) -> None:
        self.ended += 1
        for one in self._ends.pop(key, ()):
            if not one.done():
                one.set_result(None)


def _credentials(who: Identity | None) -> set[str]:
    return {_NO_CREDENTIAL} if who is None else {who.token, who.credential}


def cookie(connection: HTTPConnection) -> str | None:
    """Secret of the session cookie, if any."""
    return connection.cookies.get(COOKIE)


def forbidden(who: Identity, role: Role) -> ForbiddenRole:
    """Error for a token whose role is below `role`."""
    return ForbiddenRole(
        f"The role of token {who.name!r} is {who.role.word}. This operation requires {role.word}.",
        cause="role_insufficient", token=who.name, role=who.role.word, needed=role.word,
    )  # fmt: skip

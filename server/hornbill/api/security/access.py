"""Who a request comes from, by token, cookie or ticket, and when that ends."""

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
"""What the token given at start is called; it is an admin's, and is kept nowhere."""
WHO: Final = "hornbill.who"
"""Where in the scope of a request its Identity is; None there: nobody had to say who they are."""
FRESH_S: Final = 2.0
"""A token that another process made or revoked is known, or forgotten, after this at the latest."""
USED_S: Final = 60.0
"""How often it is kept that a token was used."""
AT_WORK: Final = 1000
"""Tokens at work that are remembered, each with where it was right; the one not used for longest goes first."""
_NOBODY: Final = ""
"""In the place of a digest: what whoever has none brings."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Who it is. `credential` is what they brought, by digest: a token's or a session's."""

    name: str
    role: Role
    token: str
    credential: str


class Access:
    """Knows tokens, sessions and tickets. Without any token it is open, unless `required`."""

    def __init__(
        self,
        *,
        given: str | None = None,
        required: bool = False,
        now: Callable[[], float] = time.monotonic,
        wall: Callable[[], float] = time.time,
    ) -> None:
        """`given`: the token of the command line. `required`: nobody gets in without a token, even if there is none."""
        self._given = None if given is None else Token(COMMAND_LINE, Role.ADMIN.word, digest(given), wall())
        self._required = required or given is not None
        self._now = now
        self._wall = wall
        self._store: Store | None = None
        self._tokens: dict[str, Token] = {} if self._given is None else {self._given.digest: self._given}
        self._used: dict[str, float] = {}
        self._used_kept_at = now()
        self._ends: dict[str, set[asyncio.Future[None]]] = {}
        self.sessions = Sessions()
        self.tickets = Tickets()
        self.attempts = Attempts()
        self.guesses = Attempts("wrong tokens came")
        self._at_work: OrderedDict[tuple[str, str], None] = OrderedDict()

    @property
    def required(self) -> bool:
        """Whether a token is needed. Once it is, it is until the process ends: revoking the last opens nothing."""
        return self._required

    def open(self, store: Store) -> None:
        """Begin with the tokens of a store. Raises StoreFailed."""
        self._store = store
        self._take(store.tokens.all())

    async def refresh(self) -> None:
        """Read the tokens again, end the sockets of what has ended, and keep when tokens were used."""
        self._age()
        if self._store is None:
            return
        try:
            self._take(await self._store.run(self._store.tokens.all))
            if self._now() - self._used_kept_at >= USED_S:
                await self._keep_used()
        except StoreFailed:
            log.warning("the tokens cannot be read again; those known stay", exc_info=True)

    async def keep_fresh(self) -> None:
        """`refresh`, again and again, until cancelled."""
        while True:
            await asyncio.sleep(FRESH_S)
            await self.refresh()

    async def close(self) -> None:
        """Keep when tokens were used, at the end."""
        try:
            await self._keep_used()
        except StoreFailed:
            log.warning("when tokens were used could not be kept", exc_info=True)

    def last_used_at(self, name: str) -> float | None:
        """When a token was used that is not kept yet, seconds since 1970; None when there is nothing newer."""
        return self._used.get(name)

    def who(self, connection: HTTPConnection, ticket: str | None = None, *, stopping: bool = False) -> Identity | None:
        """Who a request comes from: the header counts, then the ticket, then the cookie. None: nobody we know.

        `stopping`: Stop is pressed. Raises TooManyAttempts as `offered`.
        """
        kind, _, secret = connection.headers.get("authorization", "").partition(" ")
        if kind.lower() == "bearer":  # any other is for a proxy in front of us
            address = connection.client.host if connection.client else ""
            return self.offered(secret.strip(), address, stopping=stopping)
        if ticket is not None:
            taken = self.tickets.take(ticket, self._now())
            return None if taken is None else self._known(*taken)
        secret = cookie(connection)
        session = None if secret is None else self.sessions.get(secret, self._now())
        return None if session is None else self._known(session.token, session.key)

    def stopper(self, connection: HTTPConnection) -> Identity | None:
        """Who presses Stop with a session that has run out: it was proved once, and Stop does not ask for a login."""
        secret = cookie(connection)
        session = None if secret is None else self.sessions.spent(secret)
        return None if session is None else self._known(session.token, session.key)

    def bearer(self, secret: str) -> Identity | None:
        """Who has this token. All are compared, each in a time that does not tell how much of it was right."""
        offered, found = digest(secret), ""
        for known in self._tokens:
            if secrets.compare_digest(known, offered):
                found = known
        return self._known(found, found) if found else None

    def offered(self, secret: str, address: str, *, stopping: bool = False) -> Identity | None:
        """Who has the token that came from `address`. Raises TooManyAttempts after too many that were wrong.

        From then on none is looked at that was not right from there before, so that nobody learns by it which is:
        programs at work go on, newcomers wait. A stop is looked at always: it must not wait for what others do.
        """
        place, now = (address, digest(secret)), self._now()
        if place not in self._at_work:
            try:
                self.guesses.allow(address, now)
            except TooManyAttempts:
                if not stopping:
                    raise
                return self.bearer(secret)
        who = self.bearer(secret)
        if who is not None:
            self._at_work[place] = None
            self._at_work.move_to_end(place)
            while len(self._at_work) > AT_WORK:
                self._at_work.popitem(last=False)
        elif self._required:
            self._at_work.pop(place, None)
            self.guesses.failed(address, now, place[1])
            log.warning("a token that is not known came from %s", address)
        return who

    def login(self, secret: str, address: str) -> tuple[Identity, str]:
        """Who it is, and the secret of a new session. Raises Unauthorized and TooManyAttempts."""
        self.attempts.allow(address, self._now())
        who = self.bearer(secret)
        if who is None:
            self.attempts.failed(address, self._now())
            raise Unauthorized(
                "No token is like this one. Perhaps it was revoked, or not all of it was copied. "
                "'hornbill token add NAME --role ROLE' makes one.",
                cause="token_unknown",
            )
        session, cookie_secret = self.sessions.begin(who.token, self._now())
        return Identity(who.name, who.role, who.token, session.key), cookie_secret

    def ticket(self, who: Identity | None) -> str:
        """A ticket for one socket of whoever asks; where no token is needed, it is one for nobody."""
        return self.tickets.issue(*(("", "") if who is None else (who.token, who.credential)), self._now())

    def left_s(self, connection: HTTPConnection) -> float | None:
        """Seconds until the session of this cookie has run out; None without one."""
        secret = cookie(connection)
        session = None if secret is None else self.sessions.get(secret, self._now())
        return None if session is None else session.ends_at() - self._now()

    def logout(self, secret: str) -> None:
        """End the session of this cookie, and the sockets that came with it."""
        session = self.sessions.end(secret)
        if session is not None:
            self._end(session.key)

    def watch(self, who: Identity | None) -> asyncio.Future[None]:
        """Done when what they brought opens nothing any more: revoked, or logged out. Give it back by `unwatch`.

        None brought nothing: that opens nothing any more from the first token on.
        """
        made: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        for key in _brought(who):
            self._ends.setdefault(key, set()).add(made)
        return made

    def unwatch(self, who: Identity | None, watched: asyncio.Future[None]) -> None:
        """No more news wanted."""
        for key in _brought(who):
            waiting = self._ends.get(key, set())
            waiting.discard(watched)
            if not waiting:
                self._ends.pop(key, None)

    def _known(self, token: str, credential: str) -> Identity | None:
        found = self._tokens.get(token)
        if found is None:
            return None
        role = WORDS.get(found.role)
        if role is None:  # of a newer hornbill: it opens nothing here
            return None
        if found is not self._given:
            self._used[found.name] = self._wall()
        return Identity(found.name, role, token, credential)

    async def _keep_used(self) -> None:
        if self._used and self._store is not None:
            self._used_kept_at = self._now()
            used, self._used = self._used, {}
            await self._store.run(self._store.tokens.used, used)

    def _take(self, tokens: Iterable[Token]) -> None:
        before = self._tokens
        known = {one.digest: one for one in tokens}
        if self._given is not None:
            known[self._given.digest] = self._given
        self._tokens = known
        self._required = self._required or bool(known)
        for gone in before.keys() - known.keys():
            self._end(gone)
        if self._required:
            self._end(_NOBODY)

    def _age(self) -> None:
        """A session with an open socket is in use; one that has run out takes its sockets along."""
        now = self._now()
        for key in list(self._ends):
            session = self.sessions.at(key)
            if session is not None and session.ends_at() <= now:
                self._end(key)
            elif session is not None:
                session.used_at = now

    def _end(self, key: str) -> None:
        for one in self._ends.pop(key, ()):
            if not one.done():
                one.set_result(None)


def _brought(who: Identity | None) -> set[str]:
    return {_NOBODY} if who is None else {who.token, who.credential}


def cookie(connection: HTTPConnection) -> str | None:
    """The secret of the session cookie, if there is one."""
    return connection.cookies.get(COOKIE)


def forbidden(who: Identity, role: Role) -> ForbiddenRole:
    """The refusal of whoever's token does not reach to `role`."""
    return ForbiddenRole(
        f"The token {who.name!r} is for {who.role.word}; this needs {role.word}.",
        cause="role_insufficient", token=who.name, role=who.role.word, needed=role.word,
    )  # fmt: skip

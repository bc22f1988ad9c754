"""Browser sessions, socket tickets, and limits on failed attempts.

Held in memory by digest, until the process exits. Time is passed as an argument.
"""

import secrets
from collections import OrderedDict
from dataclasses import dataclass
from hashlib import sha256
from ipaddress import ip_address
from typing import Final

from hornbill.errors import TooManyAttempts

IDLE_S: Final = 12 * 3600.0
"""Time after which an unused session expires: one shift."""
LASTING_S: Final = 7 * 24 * 3600.0
"""Maximum lifetime of a session."""
TICKET_S: Final = 30.0
"""Lifetime of an unused ticket."""
_MOST: Final = 1000
"""Maximum number of stored sessions, tickets and addresses; the oldest are dropped."""

TRIES: Final = 10
"""Failed logins or invalid tokens allowed per address within `WINDOW_S`; ten times as many over all addresses."""
WINDOW_S: Final = 60.0


@dataclass(slots=True)
class Session:
    """One login. `token` is the digest of its token."""

    key: str
    token: str
    began_at: float
    used_at: float

    def ends_at(self) -> float:
        """Time of expiry unless it is used before."""
        return min(self.used_at + IDLE_S, self.began_at + LASTING_S)


class Sessions:
    """Sessions by secret, which the browser stores in a cookie."""

    def __init__(self) -> None:
        self._sessions: OrderedDict[str, Session] = OrderedDict()

    def begin(self, token: str, now: float) -> tuple[Session, str]:
        """Create a session for the token with this digest. Returns it with its secret."""
        secret = secrets.token_urlsafe(32)
        made = Session(_key(secret), token, now, now)
        self._sessions[made.key] = made
        while len(self._sessions) > _MOST:
            self._sessions.popitem(last=False)
        return made, secret

    def get(self, secret: str, now: float) -> Session | None:
        """Session of this secret unless expired. Counts as use."""
        found = self._sessions.get(_key(secret))
        if found is None:
            return None
        if found.ends_at() <= now:
            return None
        found.used_at = now
        return found

    def spent(self, secret: str) -> Session | None:
        """Session of this secret, even if expired."""
        return self._sessions.get(_key(secret))

    def at(self, key: str) -> Session | None:
        """Session of this key, even if expired."""
        return self._sessions.get(key)

    def end(self, secret: str) -> Session | None:
        """Delete the session of this secret."""
        return self._sessions.pop(_key(secret), None)


class Tickets:
    """Single-use secrets that open one socket each, for clients that cannot set headers."""

    def __init__(self) -> None:
        self._tickets: OrderedDict[str, tuple[str, str, float]] = OrderedDict()

    def issue(self, token: str, credential: str, now: float) -> str:
        """Create a ticket for the token with this digest and `credential`, valid once within `TICKET_S`."""
        secret = secrets.token_urlsafe(32)
        self._tickets[_key(secret)] = (token, credential, now + TICKET_S)
        while len(self._tickets) > _MOST:
            self._tickets.popitem(last=False)
        return secret

    def take(self, secret: str, now: float) -> tuple[str, str] | None:
        """Consume a ticket. Returns the token and credential it was issued for, or None if it is invalid or expired."""
        token, credential, until = self._tickets.pop(_key(secret), ("", "", 0.0))
        return (token, credential) if until > now else None


class Attempts:
    """Counts failed attempts by address. Successful ones are not counted."""

    def __init__(self, what: str = "failed logins") -> None:
        """`what`: plural noun of the attempts, for the error text."""
        self._what = what
        self._failed: OrderedDict[str, list[tuple[float, str]]] = OrderedDict()

    def allow(self, address: str, now: float) -> None:
        """Raises TooManyAttempts if too many failed from `address`, or in total, within WINDOW_S."""
        if not self._failed:
            return
        self._forget(now)
        mine = [at for at, _ in self._failed.get(_network(address), [])]
        every = sorted(at for one in self._failed.values() for at, _ in one)
        for times, most in ((mine, TRIES), (every, TRIES * 10)):
            if len(times) >= most:
                wait_s = max(1, round(times[-most] + WINDOW_S - now))
                raise TooManyAttempts(
                    f"{len(times)} {self._what} in the last minute. Try again in {wait_s} s.",
                    cause="too_many_attempts",
                    count=len(times),
                    retry_after_s=wait_s,
                )

    def failed(self, address: str, now: float, guess: str = "") -> None:
        """Count a failed attempt. Repetitions of the same `guess` (a digest) count once."""
        known = self._failed.setdefault(_network(address), [])
        if not guess or all(before != guess for _, before in known):
            known.append((now, guess))
        while len(self._failed) > _MOST:
            self._failed.popitem(last=False)

    def _forget(self, now: float) -> None:
        for address in list(self._failed):
            recent = [one for one in self._failed[address] if one[0] + WINDOW_S > now]
            if recent:
                self._failed[address] = recent
            else:
                del self._failed[address]


def _network(address: str) -> str:
    """Network by which attempts are counted: an IPv6 client has a /64 prefix, so its addresses count together."""
    try:
        known = ip_address(address)
    except ValueError:  # a name, or empty
        return address
    return known.exploded[:19] if known.version == 6 and known.ipv4_mapped is None else address


def _key(secret: str) -> str:
    """Digest of a secret, by which it is looked up: the lookup time reveals nothing about the secret."""
    return sha256(secret.encode(errors="surrogatepass")).hexdigest()

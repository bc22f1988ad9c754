"""What a login leaves behind: sessions of browsers, tickets for sockets, and how often a guess may fail.

All of it is in memory and by digest: it ends with the process. Time is an argument.
"""

import secrets
from collections import OrderedDict
from dataclasses import dataclass
from hashlib import sha256
from ipaddress import ip_address
from typing import Final

from hornbill.errors import TooManyAttempts

IDLE_S: Final = 12 * 3600.0
"""A session nobody has used for so long has run out: one shift."""
LASTING_S: Final = 7 * 24 * 3600.0
"""However much it is used, a session ends after this."""
TICKET_S: Final = 30.0
"""How long a ticket waits to be used."""
_MOST: Final = 1000
"""Sessions, tickets and addresses kept; the oldest go first."""

TRIES: Final = 10
"""Logins, or tokens, that may be wrong from one address within `WINDOW_S`; from all together ten times as many."""
WINDOW_S: Final = 60.0


@dataclass(slots=True)
class Session:
    """One login: of which token, and since when. `token` is the token's digest."""

    key: str
    token: str
    began_at: float
    used_at: float

    def ends_at(self) -> float:
        """When it has run out, unless it is used before."""
        return min(self.used_at + IDLE_S, self.began_at + LASTING_S)


class Sessions:
    """Sessions by their secret, which the browser has in a cookie."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, Session] = OrderedDict()

    def begin(self, token: str, now: float) -> tuple[Session, str]:
        """A session for the token with this digest, and the secret of it."""
        secret = secrets.token_urlsafe(32)
        made = Session(_key(secret), token, now, now)
        self._kept[made.key] = made
        while len(self._kept) > _MOST:
            self._kept.popitem(last=False)
        return made, secret

    def get(self, secret: str, now: float) -> Session | None:
        """The session of this secret while it has not run out; looking is using."""
        found = self._kept.get(_key(secret))
        if found is None:
            return None
        if found.ends_at() <= now:
            return None
        found.used_at = now
        return found

    def spent(self, secret: str) -> Session | None:
        """The session of this secret, also when it has run out: it was proved once."""
        return self._kept.get(_key(secret))

    def at(self, key: str) -> Session | None:
        """The session of this key, run out or not."""
        return self._kept.get(key)

    def end(self, secret: str) -> Session | None:
        """Log out: the session is forgotten."""
        return self._kept.pop(_key(secret), None)


class Tickets:
    """One-shot secrets, each for one socket, for who can set no header."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, tuple[str, str, float]] = OrderedDict()

    def issue(self, token: str, credential: str, now: float) -> str:
        """A ticket for whoever has the token with this digest and brought `credential`; for one use in `TICKET_S`."""
        secret = secrets.token_urlsafe(32)
        self._kept[_key(secret)] = (token, credential, now + TICKET_S)
        while len(self._kept) > _MOST:
            self._kept.popitem(last=False)
        return secret

    def take(self, secret: str, now: float) -> tuple[str, str] | None:
        """Token and credential it was issued for; the ticket is gone, whatever it was."""
        token, credential, until = self._kept.pop(_key(secret), ("", "", 0.0))
        return (token, credential) if until > now else None


class Attempts:
    """Counts what failed. Who brings what is right is never counted."""

    def __init__(self, what: str = "logins have failed") -> None:
        """`what` is said of a number of them."""
        self._what = what
        self._failed: OrderedDict[str, list[tuple[float, str]]] = OrderedDict()

    def allow(self, address: str, now: float) -> None:
        """Raises TooManyAttempts when too many have failed from `address`, or from everywhere, in the last minute."""
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
        """One more has failed. The same `guess`, by digest, is one however often it comes: that guesses at nothing."""
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
    """What one household is counted by: of IPv6 it has 2^64 addresses, and can guess from each."""
    try:
        known = ip_address(address)
    except ValueError:  # a name, or nothing
        return address
    return known.exploded[:19] if known.version == 6 and known.ipv4_mapped is None else address


def _key(secret: str) -> str:
    """Looked up by digest: how long that takes says nothing of the secret."""
    return sha256(secret.encode(errors="surrogatepass")).hexdigest()

"""A wall clock for tests."""


class Wall:
    """Seconds since 1970 (UTC), as set."""

    def __init__(self, now: float = 1_700_000_000.0) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now

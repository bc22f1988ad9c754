"""A list of callbacks, isolated from each other's exceptions."""

import logging
from collections.abc import Callable
from typing import Generic, ParamSpec

log = logging.getLogger(__name__)

P = ParamSpec("P")


class Hooks(list[Callable[P, object]], Generic[P]):
    """Callbacks, called in the order they were appended. A callback may remove itself while it runs."""

    def notify(self, *args: P.args, **kwargs: P.kwargs) -> None:
        """Call every callback. Exceptions are logged. Never raises."""
        for hook in tuple(self):
            try:
                hook(*args, **kwargs)
            except Exception:
                log.exception("%s failed", getattr(hook, "__qualname__", hook))

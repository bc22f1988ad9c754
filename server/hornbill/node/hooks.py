"""A list of functions to call when something happens, none of which can hurt the others."""

import logging
from collections.abc import Callable
from typing import Generic, ParamSpec

log = logging.getLogger(__name__)

P = ParamSpec("P")


class Hooks(list[Callable[P, object]], Generic[P]):
    """Functions, called in the order they were appended; one may remove itself while it is called."""

    def tell(self, *args: P.args, **kwargs: P.kwargs) -> None:
        """Call every function. What one raises is logged, and the next one is called. Never raises."""
        for hook in tuple(self):
            try:
                hook(*args, **kwargs)
            except Exception:
                log.exception("%s failed", getattr(hook, "__qualname__", hook))

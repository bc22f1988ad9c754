"""Who wants to hear which message."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from hornbill.node.hooks import Hooks
from hornbill.wire.datatype import Kind, Structure
from hornbill.wire.transfer import Transfer

M = TypeVar("M", bound=Structure)


@dataclass(frozen=True, slots=True)
class _Audience:
    message: type[Structure]
    handlers: Hooks[Transfer, Any] = field(default_factory=Hooks[Transfer, Any])


class Subscriptions:
    """Handlers by type of message, called in the order they came."""

    def __init__(self) -> None:
        self.malformed = 0
        """Messages somebody wanted and that could not be decoded."""
        self._audiences: dict[int, _Audience] = {}

    def add(self, message: type[M], handler: Callable[[Transfer, M], object]) -> Callable[[], None]:
        """Call `handler` with every `message` from now on; returns what ends it (twice is harmless).

        Raises ValueError for a structure that is not a message.
        """
        if message.KIND != Kind.MESSAGE:
            raise ValueError(f"{message.__name__} is not a message. Only messages are broadcast.")
        audience = self._audiences.setdefault(message.TYPE.id, _Audience(message))

        def call(transfer: Transfer, structure: M) -> None:
            handler(transfer, structure)

        def remove() -> None:
            if call in audience.handlers:
                audience.handlers.remove(call)

        audience.handlers.append(call)
        return remove

    def dispatch(self, transfer: Transfer) -> None:
        """Decode a message from the bus once and hand it to everybody who wants it. Never raises."""
        audience = self._audiences.get(transfer.type_id)
        if audience is None or not audience.handlers:
            return
        message = audience.message.decode(transfer.payload)
        if message is None:
            self.malformed += 1
        else:
            audience.handlers.tell(transfer, message)

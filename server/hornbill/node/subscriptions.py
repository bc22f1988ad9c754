"""Delivery of received messages to their subscribers."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from hornbill.node.hooks import Hooks
from hornbill.wire.datatype import Kind, Structure
from hornbill.wire.transfer import Transfer

M = TypeVar("M", bound=Structure)


@dataclass(frozen=True, slots=True)
class _Topic:
    message: type[Structure]
    handlers: Hooks[Transfer, Any] = field(default_factory=Hooks[Transfer, Any])


class Subscriptions:
    """Handlers by message type, called in the order of subscription."""

    def __init__(self) -> None:
        self.malformed = 0
        """Number of subscribed messages that could not be decoded."""
        self._topics: dict[int, _Topic] = {}

    def add(self, message: type[M], handler: Callable[[Transfer, M], object]) -> Callable[[], None]:
        """Call `handler` with every `message`. Returns a function that unsubscribes (idempotent).

        Raises ValueError for a structure that is not a message.
        """
        if message.KIND != Kind.MESSAGE:
            raise ValueError(f"{message.__name__} is not a message. Only messages are broadcast.")
        topic = self._topics.setdefault(message.TYPE.id, _Topic(message))

        def call(transfer: Transfer, structure: M) -> None:
            handler(transfer, structure)

        def remove() -> None:
            if call in topic.handlers:
                topic.handlers.remove(call)

        topic.handlers.append(call)
        return remove

    def dispatch(self, transfer: Transfer) -> None:
        """Decode a received message once and deliver it to its subscribers. Never raises."""
        topic = self._topics.get(transfer.type_id)
        if topic is None or not topic.handlers:
            return
        message = topic.message.decode(transfer.payload)
        if message is None:
            self.malformed += 1
        else:
            topic.handlers.notify(transfer, message)

"""One in-process bus: whoever publishes a message knows nobody who listens."""

from collections import defaultdict
from collections.abc import Callable
from typing import Any, TypeVar

from pipelines.online.messages import Notice

MessageT = TypeVar("MessageT")


class Bus:
    """Hands each message to those who asked for its class or a base of it, in the order in which they asked."""

    def __init__(self) -> None:
        self._handlers: dict[type, list[Callable[[Any], object]]] = defaultdict(list)

    def subscribe(self, kind: type[MessageT], handler: Callable[[MessageT], object]) -> None:
        """Has every message of a class handed to a function.

        Args:
            kind: The class; messages of classes derived from it count too.
            handler: The function. One that raises is told in a `Notice`, and the others still get the message.
        """
        self._handlers[kind].append(handler)

    def publish(self, message: object) -> None:
        """Hands a message to all who asked for it."""
        for kind in type(message).__mro__:
            for handler in tuple(self._handlers.get(kind, ())):
                try:
                    handler(message)
                except Exception as error:
                    if isinstance(message, Notice):
                        raise
                    name = getattr(handler, "__qualname__", repr(handler))
                    sentence = f"{name} failed on a {type(message).__name__}: {type(error).__name__}: {error}"
                    self.publish(Notice(f"listener {name}", sentence))

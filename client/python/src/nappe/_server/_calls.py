"""What sessions and streams use of a server.

They are written against these protocols, which the servers of both shells fulfil: so a server uses sessions, sessions
use streams, and neither uses a server.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from typing import Any, Protocol, TypeVar

from nappe._ask._requests import Call
from nappe._wire._contract import Message

T = TypeVar("T")


class StreamServer(Protocol):
    """A server as its streams use it, with or without asyncio."""

    @property
    def address(self) -> str:
        """Where the server listens."""
        ...

    def _stream(self, name: str, message: Message, every: bool) -> Any:
        """A stream of the method `name`, on the connection for streams of every frame or on the one for the rest."""
        ...

    def _find_token_again(self) -> bool:
        """Looks for the token again, and says whether it is another one."""
        ...

    def _check_usable(self) -> None:
        """Refuses a connection that is closed, or of another process or event loop."""
        ...


class CallServer(StreamServer, Protocol):
    """A server as its sessions use it, with calls that wait for their answers."""

    def _call(self, call: Call[T]) -> T:
        """One call, and what its answer means."""
        ...

    def _pieces(self, call: Call[Message]) -> Iterator[Message]:
        """The messages of an answer that comes in pieces."""
        ...

    def _known_limits(self) -> dict[str, int]:
        """The limits of the server, which is asked for them once."""
        ...


class AwaitedServer(StreamServer, Protocol):
    """A server as its sessions and streams use it, with calls that are awaited."""

    async def _rest(self, seconds: float) -> None:
        """Waits, but no longer than until the connection is closed."""
        ...

    async def _call(self, call: Call[T]) -> T:
        """One call, and what its answer means."""
        ...

    def _pieces(self, call: Call[Message]) -> AsyncIterator[Message]:
        """The messages of an answer that comes in pieces."""
        ...

    async def _known_limits(self) -> dict[str, int]:
        """The limits of the server, which is asked for them once."""
        ...

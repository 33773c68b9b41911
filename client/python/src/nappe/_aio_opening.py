"""Something that is made when it is awaited, or entered with `async with`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Generator
from types import TracebackType
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Opening(Generic[T]):
    """Something that is made when it is awaited, or entered with `async with`, which also ends it."""

    def __init__(self, make: Callable[[], Awaitable[T]]) -> None:
        """What makes it; nothing happens yet."""
        self._make = make
        self._made: Any = None

    def __await__(self) -> Generator[Any, None, T]:
        """Makes it."""
        return self._make().__await__()

    async def __aenter__(self) -> T:
        """Makes it, for the block."""
        self._made = await self._make()
        entered: T = await self._made.__aenter__()
        return entered

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends it."""
        await self._made.__aexit__(kind, error, trace)

"""Something that is made when it is awaited, or entered with `async with`; where that is forgotten, it says so."""

from __future__ import annotations

import warnings
from collections.abc import Awaitable, Callable, Generator
from types import TracebackType
from typing import Any, Generic, NoReturn, TypeVar

T = TypeVar("T")


class Opening(Generic[T]):
    """Something that is made when it is awaited, or entered with `async with`, which also ends it."""

    def __init__(self, call: str, make: Callable[[], Awaitable[T]]) -> None:
        """What makes it, and the call in words; nothing happens yet."""
        self._call = call
        self._make = make
        self._made: Any = None
        self._is_begun = False

    def __await__(self) -> Generator[Any, None, T]:
        """Makes it."""
        self._is_begun = True
        return self._make().__await__()

    async def __aenter__(self) -> T:
        """Makes it, for the block."""
        self._is_begun = True
        self._made = await self._make()
        entered: T = await self._made.__aenter__()
        return entered

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends it."""
        await self._made.__aexit__(kind, error, trace)

    def __getattr__(self, name: str) -> NoReturn:
        """What is asked of it before it is made."""
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(f"{self._forgotten()}; it has no {name!r} before")

    def __enter__(self) -> NoReturn:
        """What `with` without `async` comes to."""
        raise TypeError(self._forgotten())

    def __exit__(self, *_: object) -> None:
        """Nothing, since it is never entered so."""

    def __repr__(self) -> str:
        """What is to be done with it."""
        return f"<{self._forgotten()}>"

    def __del__(self) -> None:
        """Warns as Python does of a coroutine that was forgotten."""
        if not self._is_begun:
            self._is_begun = True
            warnings.warn(f"{self._call} was never awaited", RuntimeWarning, stacklevel=2)

    def _forgotten(self) -> str:
        return f"{self._call} is to be awaited: `await {self._call}`, or `async with {self._call} as ...`"

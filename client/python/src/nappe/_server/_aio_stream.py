"""Streams that are read with `async for`: frames, diagnostics, changes of state."""

from __future__ import annotations

import asyncio
import time
from types import TracebackType
from typing import Any, Generic, NoReturn, TypeVar

import grpc
import grpc.aio
import numpy as np
from numpy.typing import NDArray

from nappe._ask._resume import Reader
from nappe._server._aio_loop import is_cancelled
from nappe._server._calls import AwaitedServer
from nappe._wire._diagnostics import diagnostics_array, diagnostics_table
from nappe._wire._errors import Error, Unauthenticated, from_call
from nappe._wire._frames import Frame
from nappe._wire._reports import Diagnostics

T = TypeVar("T")

_EOF: Any = vars(grpc.aio)["EOF"]


class Stream(Generic[T]):
    """A stream of the server, to be read with `async for`. Leaving the loop, `close()`, or cancelling the task ends
    it."""

    def __init__(self, server: AwaitedServer, reader: Reader[T]) -> None:
        """Asks for the stream; errors come with the first read."""
        self._call: Any = None
        self._server = server
        self._reader = reader
        self._closed = False
        self._first: Any = None
        self._begun = False
        self._is_reading = False
        self._open()

    @property
    def reconnects(self) -> int:
        return self._reader.reconnects

    @property
    def end(self) -> Any:
        return self._reader.end

    async def opened(self) -> None:
        if self._begun or self._closed:
            return
        self._server._check_usable()
        try:
            self._first = await self._call.read()
            self._begun = True
        except grpc.RpcError:
            pass  # the first read meets it again
        except asyncio.CancelledError:
            if not self._is_cut():
                raise

    def close(self) -> None:
        self._closed = True
        if self._call is not None:
            self._call.cancel()

    def __iter__(self) -> NoReturn:
        """What a loop without `async` comes to."""
        raise TypeError("a stream of nappe.aio is read with `async for`, not `for`")

    def __aiter__(self: S) -> S:
        """The stream itself."""
        return self

    async def __anext__(self) -> T:
        """What comes next. Raises an error where the stream broke for good."""
        if not self._closed and self._reader.end is None:
            self._server._check_usable()
        if self._is_reading:
            raise Error("two tasks read from one stream; give each its own", remedy="Ask for a stream per task.")
        self._is_reading = True
        try:
            return await self._next()
        except BaseException:
            self.close()
            raise
        finally:
            self._is_reading = False

    async def _next(self) -> T:
        while not self._closed and self._reader.end is None:
            try:
                message = await self._call.read() if self._first is None else self._first
                self._first, self._begun = None, True
                if message is _EOF:
                    await self._call.code()
                    self._reader.over()
                    break
            except grpc.RpcError as status:
                await self._broken(from_call(status, self._server.address, self._reader.method, None))
                continue
            except asyncio.CancelledError:
                if self._is_cut():
                    break
                raise
            item = self._reader.take(message)
            if item is not None:
                return item
        raise StopAsyncIteration

    async def _broken(self, error: Error) -> None:
        """Waits and asks again, if that can help."""
        if self._closed:
            return
        self._server._check_usable()
        if not (isinstance(error, Unauthenticated) and self._server._find_token_again()):
            await self._server._rest(self._reader.failed(error, time.monotonic()))
        if not self._closed:
            self._open()

    def _is_cut(self) -> bool:
        """Whether `close()` in another task ended a read. Raises `Closed` where the whole connection was closed."""
        if is_cancelled():
            return False
        if not self._closed:
            self._server._check_usable()
        return self._closed

    def _open(self) -> None:
        self._call = self._server._stream(self._reader.method, self._reader.request(), self._reader.every)

    async def __aenter__(self: S) -> S:
        """The stream itself."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends the stream."""
        self.close()

    def __del__(self) -> None:
        """Ends the stream that nobody reads any more."""
        self.close()


S = TypeVar("S", bound=Stream[Any])


class Frames(Stream[Frame]):
    """Frames of a session; see `Session.frames`."""


class DiagnosticsStream(Stream[Diagnostics]):
    """Diagnostics of a session; see `Session.diagnostics`."""

    async def array(self) -> NDArray[np.void]:
        return diagnostics_array([step async for step in self])

    async def table(self) -> dict[str, NDArray[Any]]:
        return diagnostics_table([step async for step in self])

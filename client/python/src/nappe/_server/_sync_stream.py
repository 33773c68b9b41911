"""Streams that a loop waits for: frames, diagnostics, changes of state.

What is asked for, and what a message means, `_resume` says; here it is called for, and waited for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from types import TracebackType
from typing import Any, Generic, TypeVar

import grpc
import numpy as np
from numpy.typing import NDArray

from nappe._ask._resume import Reader
from nappe._server._calls import StreamServer
from nappe._server._ctrl_c import is_ctrl_c
from nappe._wire._diagnostics import diagnostics_array, diagnostics_table
from nappe._wire._errors import Error, Unauthenticated, from_call
from nappe._wire._frames import Frame
from nappe._wire._reports import Diagnostics

T = TypeVar("T")

PATIENCE = 60.0
"""How long a broken stream is asked for again (s)."""


class Stream(Generic[T]):
    """A stream of the server, to be read in a loop.

    It ends on the server too with `close()`, with its `with` block, or when nobody holds it any more, as after a loop
    over `session.frames()` that was left.
    """

    def __init__(self, server: StreamServer, reader: Reader[T]) -> None:
        """Asks for the stream; errors come with the first read."""
        self._call: Any = None
        self._server = server
        self._reader = reader
        self._closed = False
        self._first: Any = None
        self._begun = False
        self._reading = threading.Lock()
        self._open()

    @property
    def reconnects(self) -> int:
        """How often the connection broke and came back."""
        return self._reader.reconnects

    @property
    def end(self) -> Any:
        """How the session finished (`SessionEnd`), once the stream is at its end."""
        return self._reader.end

    def opened(self) -> None:
        """Waits until the server has begun to answer: what is made from then on comes, with all that was asked for."""
        if not self._begun:
            with suppress(StopIteration, grpc.RpcError):  # the first read meets it again
                self._first = next(self._call)
                self._begun = True

    def close(self) -> None:
        """Ends the stream."""
        self._closed = True
        if self._call is not None:
            self._call.cancel()

    def __iter__(self) -> Iterator[T]:
        """The stream itself."""
        return self

    def __next__(self) -> T:
        """What comes next. Raises an error where the stream broke for good."""
        if not self._reading.acquire(blocking=False):
            raise Error("two threads read from one stream; give each its own", remedy="Ask for a stream per thread.")
        try:
            return self._next()
        except BaseException as error:
            self.close()
            if is_ctrl_c(error) and not isinstance(error, KeyboardInterrupt):
                raise KeyboardInterrupt from None
            raise
        finally:
            self._reading.release()

    def _next(self) -> T:
        while not self._closed:
            if self._reader.end is not None:
                break
            try:
                message = next(self._call) if self._first is None else self._first
                self._first, self._begun = None, True
            except StopIteration:
                self._reader.over()
                break
            except grpc.RpcError as status:
                self._broken(from_call(status, self._server.address, self._reader.method, None))
                continue
            item = self._reader.take(message)
            if item is not None:
                return item
        raise StopIteration

    def _broken(self, error: Error) -> None:
        """Waits and asks again, if that can help."""
        if self._closed:
            return
        self._server._check_usable()
        if not (isinstance(error, Unauthenticated) and self._server._find_token_again()):
            time.sleep(self._reader.failed(error, time.monotonic()))
        if not self._closed:
            self._open()

    def _open(self) -> None:
        self._call = self._server._stream(self._reader.method, self._reader.request(), self._reader.every)

    def __enter__(self: S) -> S:
        """The stream itself."""
        return self

    def __exit__(
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

    def array(self) -> NDArray[np.void]:
        """All that come until the session ends, as one structured array: a row per frame, a column per number."""
        return diagnostics_array(list(self))

    def table(self) -> dict[str, NDArray[Any]]:
        """All that come until the session ends, as flat columns by their names: `pandas.DataFrame(...)` takes them.

        A vector is three columns, such as `momentum_x`; a whole number is int64. Where a row lacks a value, as that of
        the first frame does, which no step made, a number is nan, a count is 0, a particle is -1, and a word is "". A
        column is left out if no row has a value for it, as those of snow are without snow.
        """
        return diagnostics_table(list(self))

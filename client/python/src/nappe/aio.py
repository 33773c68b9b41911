"""The same names as in `nappe`, for programs of asyncio: what waits is awaited, and loops are `async for`.

    import nappe.aio

    async with nappe.aio.serve() as server, server.create("flag") as session:
        await session.play()
        async for frame in session.frames(every=True):
            print(frame.time, frame.positions.mean(axis=0))

What makes something (`connect`, `serve`, `create`, `fork`) is awaited, or entered as a context manager as above.
"""

from __future__ import annotations

from typing import Any

from nappe._server import _sync_server, _sync_session, _sync_stream
from nappe._server._aio_opening import Opening
from nappe._server._aio_server import Server, connect, serve
from nappe._server._aio_session import Session
from nappe._server._aio_stream import DiagnosticsStream, Frames, Stream

__all__ = ["DiagnosticsStream", "Frames", "Opening", "Server", "Session", "Stream", "connect", "serve"]


def _borrow_words(own: type[Any], other: type[Any]) -> None:
    """What a method does is said once, in `nappe`."""
    for name, member in vars(own).items():
        words = getattr(other, name, None)
        if getattr(member, "__doc__", "") is None and words is not None:
            member.__doc__ = words.__doc__


_borrow_words(Server, _sync_server.Server)
_borrow_words(Session, _sync_session.Session)
_borrow_words(Stream, _sync_stream.Stream)
_borrow_words(DiagnosticsStream, _sync_stream.DiagnosticsStream)

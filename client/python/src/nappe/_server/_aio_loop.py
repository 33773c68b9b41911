"""The event loop that a connection of asyncio belongs to, and whether a task in it was cancelled.

Connections of gRPC cannot change their loop.
"""

from __future__ import annotations

import asyncio

from nappe._wire._errors import Error

_REMEDY = "Connect within the function that asyncio.run() is given, and make all calls within it."


def is_cancelled() -> bool:
    """Whether somebody has cancelled the task that runs, where a call may have been cancelled in its place.

    Python 3.10 cannot tell: there, nobody has.
    """
    requests = getattr(asyncio.current_task(), "cancelling", None)
    return bool(requests is not None and requests() > 0)


class OwnLoop:
    """The event loop that runs while this is made."""

    def __init__(self) -> None:
        """Remembers the loop."""
        self._loop = asyncio.get_running_loop()

    @property
    def is_running(self) -> bool:
        """Whether it is the one that runs now."""
        try:
            return asyncio.get_running_loop() is self._loop
        except RuntimeError:
            return False

    def check(self, address: str) -> None:
        """Refuses what is asked for outside of it."""
        if self.is_running:
            return
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            raise Error("nappe.aio is called outside of an event loop", remedy=_REMEDY) from None
        ended = "which has ended, and not to this one" if self._loop.is_closed() else "and not to this one"
        raise Error(f"the connection to {address} belongs to another event loop, {ended}", remedy=_REMEDY)

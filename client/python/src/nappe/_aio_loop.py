"""The event loop that a connection of asyncio belongs to: connections of gRPC cannot change theirs."""

from __future__ import annotations

import asyncio

from nappe._errors import Error

_REMEDY = "Connect within the function that asyncio.run() is given, and make all calls within it."


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

"""The file of a session on its way to a path: it is written beside it, and takes its place once it is whole.

Enters: the pieces that a server sends. Leaves: a file, from which `create(checkpoint=...)` goes on.
"""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType

from nappe._wire._contract import Message
from nappe._wire._errors import Error


class Saving:
    """A file that is written in a `with` block. An error in the block leaves an earlier file as it was."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """A file that goes to a path."""
        self.path = Path(path)
        self._beside = self.path.with_name(self.path.name + ".new")
        self._left: int | None = None

    def __enter__(self) -> Saving:
        """Makes the file."""
        self._beside.write_bytes(b"")
        return self

    def take(self, piece: Message) -> None:
        """Writes the next piece."""
        left = piece.byte_count if self._left is None else self._left
        self._left = left - len(piece.data)
        with self._beside.open("ab") as file:
            file.write(piece.data)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Gives the file its name, if all of it came."""
        if kind is None and self._left == 0:
            self._beside.replace(self.path)
            return
        self._beside.unlink(missing_ok=True)
        if kind is None:
            raise Error(f"the server ended before all of {self.path} came", remedy="Save the session again.")

"""Files that come with the package, beside its modules."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
# The root of the repository, if the package is read from it.
REPOSITORY = _PACKAGE.parents[3] if len(_PACKAGE.parents) > 3 else _PACKAGE


def packed_bytes(name: str) -> bytes:
    """All of a file that the package brings along."""
    return (_PACKAGE / name).read_bytes()

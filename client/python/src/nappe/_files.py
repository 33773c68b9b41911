"""Files that come with the package: beside it in a wheel, in the repository otherwise."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parent
# The root of the repository, if the package is read from it.
REPOSITORY = _PACKAGE.parents[3] if len(_PACKAGE.parents) > 3 else _PACKAGE

_IN_REPOSITORY = {
    "reasons.json": "proto/nappe/v1/reasons.json",
    "replay.html": "viewer/web/dist/replay.html",
}


def packed_bytes(name: str) -> bytes:
    """All of a file that the package brings along."""
    beside = _PACKAGE / name
    if not beside.is_file() and name in _IN_REPOSITORY:
        return (REPOSITORY / _IN_REPOSITORY[name]).read_bytes()
    return beside.read_bytes()

"""Pulls at particles of cloths, checked and put into messages.

Enters: what a caller gives, and a message that has the field. Leaves: the message, with numbers packed as bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nappe._ask._checks import array, finite, index, named
from nappe._wire._contract import Message
from nappe._wire._errors import refused

Pulls = Mapping[str, ArrayLike | Mapping[int, ArrayLike | None] | None]
"""Points (m) by the name of the body: `{"cloth": {7: (0, 1, 0)}}` by the index of the particle within the body, or an
array (n, 3) with one for each of its particles. None in place of a point ends the pull of the particle, in place of all
those of the body."""

_HOW = ("frequency", "most", "seconds")


def fill_pulls(message: Message, pulls: Any, how: Mapping[str, Any], particles: int) -> None:
    """Adds pulls at particles of bodies. `how` has frequency, most and seconds, where they are given."""
    if not isinstance(pulls, Mapping):
        raise refused(f"pulls is {pulls!r}; allowed: a dict of points by the name of the body", "pulls")
    for body, given in pulls.items():
        name = f"pulls[{named(body, 'pulls')!r}]"
        if given is None:
            message.pulls.add(body=body)
        elif isinstance(given, Mapping):
            _fill_some(message, body, given, how, particles)
        else:
            points = array(given, name, (-1, 3))
            if not 0 < len(points) <= particles:
                told = f"allowed: one for each particle of the body; the session has {particles} in all"
                raise refused(f"{name} has {len(points)} points; {told}", name)
            message.pulls.add(body=body, points_f64=points.tobytes(), **_numbers(how))


def _fill_some(message: Message, body: str, given: Mapping[Any, Any], how: Mapping[str, Any], particles: int) -> None:
    """Pulls at the particles that are named, and ends of others. An empty list would stand for all of them."""
    name = f"pulls[{body!r}]"
    if not given:
        raise refused(f"{name} names no particle; allowed: a dict of points by the index of the particle", name)
    points = {index(at, particles, name): point for at, point in given.items()}
    ended = [at for at, point in points.items() if point is None]
    if ended:
        message.pulls.add(body=body, particles_u32=_packed(ended))
    rows = {at: array(point, f"{name}[{at}]", (3,)) for at, point in points.items() if point is not None}
    if rows:
        drawn = np.concatenate(list(rows.values())).tobytes()
        message.pulls.add(body=body, particles_u32=_packed(list(rows)), points_f64=drawn, **_numbers(how))


def _numbers(how: Mapping[str, Any]) -> dict[str, float]:
    """How the points draw: all three numbers are needed."""
    for name in _HOW:
        if name not in how:
            raise refused(f"pulls draw with a frequency, at most so hard, for a time: {name} is missing", name)
    return {name: finite(how[name], name) for name in _HOW}


def _packed(indices: list[int]) -> bytes:
    return np.array(indices, "<u4").tobytes()

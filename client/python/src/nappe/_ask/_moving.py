"""Where colliders go, checked and put into messages.

Enters: positions and turns by the name of the collider, and a message that has the field. Leaves: the message.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from nappe._ask._checks import array, named
from nappe._wire._contract import MESSAGES, Message
from nappe._wire._errors import refused

Poses = Mapping[str, ArrayLike | tuple[ArrayLike | None, ArrayLike | None]]
"""Positions (m) of colliders by their names, or tuples of a position and a turn: a quaternion x, y, z, w, length 1."""

# How far the length of a turn may be from 1, as the server has it.
_UNIT_TOLERANCE = 1e-6


def fill_colliders(message: Message, colliders: Any, duration: float) -> None:
    """Adds moves of colliders, which all take a duration (s)."""
    if not isinstance(colliders, Mapping):
        told = "allowed: a dict of positions, or of tuples of a position and a turn, by the name of the collider"
        raise refused(f"colliders is {colliders!r}; {told}", "colliders")
    for collider, given in colliders.items():
        name = f"colliders[{named(collider, 'colliders', 'a collider')!r}]"
        is_pair = isinstance(given, tuple) and len(given) == 2
        position, turn = given if is_pair else (given, None)
        if position is None and turn is None:
            raise refused(f"{name} has neither a position nor a turn; allowed: one of them, or both", name)
        made = message.colliders.add(name=collider, duration_seconds=duration)
        if position is not None:
            x, y, z = array(position, f"{name}[0]" if is_pair else name, (3,)).tolist()
            made.position.CopyFrom(MESSAGES["Vector3"](x=x, y=y, z=z))
        if turn is not None:
            x, y, z, w = _turn(turn, f"{name}[1]")
            made.turn.CopyFrom(MESSAGES["Quaternion"](x=x, y=y, z=z, w=w))


def _turn(given: Any, name: str) -> list[float]:
    turn: list[float] = array(given, name, (4,)).tolist()
    length = math.hypot(*turn)
    if abs(length - 1) > _UNIT_TOLERANCE:
        raise refused(f"{name} is of length {length:g}; allowed: 1, within 1e-6", name)
    return turn

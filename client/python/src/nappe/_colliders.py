"""Colliders, checked so that they can be drawn: finite numbers, lengths above 0, directions of length 1.

Enters: shapes of the wire. Leaves: colliders under the names of the contract.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from nappe._contract import Message
from nappe._errors import Error
from nappe._reading import is_vector
from nappe._reports import Vector

# How far a direction's length may be from 1, and the cosine of two at right angles from 0: the rounding of binary32.
_UNIT_TOLERANCE = 1e-5
# Directions of each shape, and ends that must be apart.
_DIRECTIONS = {"plane": ("normal",), "box": ("axis_x", "axis_y"), "half_pipe": ("axis", "up")}
_ENDS = {"cylinder": ("start", "end")}


@dataclass(frozen=True)
class Collider:
    """A collider, to be drawn. It moves at constant velocity, and does not turn."""

    name: str
    """Its name in the scene."""
    kind: str
    """`plane`, `sphere`, `capsule`, `box`, `cylinder` or `half_pipe`."""
    velocity: Vector
    """Velocity (m/s)."""
    shape: dict[str, float | Vector]
    """Its numbers at time 0 (m), under the names of the contract."""


def read_collider(wire: Message) -> Collider | None:
    """A collider, unless its shape is newer than this package."""
    kind = wire.WhichOneof("shape")
    if kind is None:
        return None
    message = getattr(wire, kind)
    shape: dict[str, Any] = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        shape[field.name] = (value.x, value.y, value.z) if is_vector(field) else value
    velocity = (wire.velocity.x, wire.velocity.y, wire.velocity.z)
    what = _wrong(kind, shape, velocity)
    if what is not None:
        raise Error(f"the server's stream does not decode: collider {wire.name!r}: {what}")
    return Collider(wire.name, kind, velocity, shape)


def _wrong(kind: str, shape: dict[str, Any], velocity: Vector) -> str | None:
    """What stands against drawing a shape."""
    vectors = [velocity, *(value for value in shape.values() if isinstance(value, tuple))]
    if not all(math.isfinite(component) for vector in vectors for component in vector):
        return "a coordinate is not finite"
    if "radius" in shape and not 0 < shape["radius"] < math.inf:
        return "its radius is not a positive number"
    if any(half <= 0 for half in shape.get("half_extent", ())):
        return "half of its extent is not positive along each axis"
    if kind in _ENDS and len({shape[name] for name in _ENDS[kind]}) == 1:
        return "its two ends are one point"
    directions = [shape[name] for name in _DIRECTIONS.get(kind, ())]
    if any(abs(math.sqrt(_dot(one, one)) - 1) > _UNIT_TOLERANCE for one in directions):
        return "a direction of it is not of length 1"
    if len(directions) == 2 and abs(_dot(directions[0], directions[1])) > _UNIT_TOLERANCE:
        return "two directions of it are not at right angles"
    return None


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))

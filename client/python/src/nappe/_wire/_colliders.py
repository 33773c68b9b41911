"""Colliders, checked so that they can be drawn: finite numbers, lengths above 0, directions of length 1.

Enters: shapes of the wire. Leaves: colliders under the names of the contract; triangles name points that are there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._wire._contract import Message
from nappe._wire._errors import Error
from nappe._wire._reading import is_vector
from nappe._wire._reports import Vector

# How far a direction's length may be from 1, and the cosine of two at right angles from 0: the rounding of binary32.
_UNIT_TOLERANCE = 1e-5
# Directions of each shape, and ends that must be apart.
_DIRECTIONS = {"plane": ("normal",), "box": ("axis_x", "axis_y"), "half_pipe": ("axis", "up")}
_ENDS = {"cylinder": ("start", "end")}


@dataclass(frozen=True)
class Collider:
    """A collider, to be drawn. It moves at constant velocity, and does not turn, unless frames have its pose."""

    name: str
    """Its name in the scene."""
    kind: str
    """`plane`, `sphere`, `capsule`, `box`, `cylinder`, `half_pipe` or `mesh`."""
    velocity: Vector
    """Velocity (m/s)."""
    shape: dict[str, float | Vector | NDArray[np.float32] | NDArray[np.uint32]]
    """Its numbers at time 0 (m), under the names of the contract. Of a mesh: `points` (n, 3), `triangles` (m, 3), which
    are indices of points, turned outwards, and `origin`, its reference point."""

    def __eq__(self, other: object) -> bool:
        """Whether all is the same; arrays are, if all their numbers are."""
        if not isinstance(other, Collider):
            return NotImplemented
        mine, its = (self.name, self.kind, self.velocity), (other.name, other.kind, other.velocity)
        same = mine == its and self.shape.keys() == other.shape.keys()
        return same and all(np.array_equal(value, other.shape[name]) for name, value in self.shape.items())


def read_colliders(wires: Iterable[Message]) -> tuple[Collider, ...]:
    """The colliders of a whole topology, but those whose shape is newer than this package."""
    colliders = tuple(collider for wire in wires if (collider := _read(wire)))
    meshes: set[str] = set()
    for collider in colliders:
        if collider.kind == "mesh":
            # Parts that followed each other are one by now.
            if collider.name in meshes:
                raise _broken(collider.name, "its arrays go on behind another collider")
            meshes.add(collider.name)
    return colliders


def _read(wire: Message) -> Collider | None:
    kind = wire.WhichOneof("shape")
    if kind is None:
        return None
    velocity = (wire.velocity.x, wire.velocity.y, wire.velocity.z)
    if kind == "mesh":
        surface = _surface(wire)
        if not all(map(math.isfinite, (*velocity, *surface["origin"]))):
            raise _broken(wire.name, "a coordinate is not finite")
        return Collider(wire.name, kind, velocity, surface)
    message = getattr(wire, kind)
    shape: dict[str, Any] = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        shape[field.name] = (value.x, value.y, value.z) if is_vector(field) else value
    what = _wrong(kind, shape, velocity)
    if what is not None:
        raise _broken(wire.name, what)
    return Collider(wire.name, kind, velocity, shape)


def _surface(wire: Message) -> dict[str, Any]:
    """The arrays of a mesh, and its reference point."""
    if len(wire.mesh.points_f32) % 12 or len(wire.mesh.triangles_u32) % 12:
        raise _broken(wire.name, "its arrays hold no whole number of points and triangles")
    points = np.frombuffer(wire.mesh.points_f32, "<f4").reshape(-1, 3)
    triangles = np.frombuffer(wire.mesh.triangles_u32, "<u4").reshape(-1, 3)
    if not len(triangles):
        raise _broken(wire.name, "it has no triangles")
    if not np.isfinite(points).all():
        raise _broken(wire.name, "a coordinate is not finite")
    if triangles.max() >= len(points):
        raise _broken(wire.name, "a triangle of it names a point that is not there")
    origin = wire.mesh.origin
    return {"points": points, "triangles": triangles, "origin": (origin.x, origin.y, origin.z)}


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


def _broken(name: str, what: str) -> Error:
    return Error(f"the server's stream does not decode: collider {name!r}: {what}")

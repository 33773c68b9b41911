"""Colliders as triangles: their surfaces at time 0, and of endless ones as much as the scene needs.

Enters: colliders, and a ball around the particles (m). Leaves: points (m), and triangles over them, turned outwards.
The command's `--save FILE.pvd` draws the same ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._wire._colliders import Collider

Points = NDArray[np.float64]
Triangles = NDArray[np.uint32]

_CORNERS = 48
"""Corners of a circle."""
_RINGS = 12
"""Rings of half a ball."""
_REACH = 1.4
"""Half the side of what is shown of an endless surface, over the radius of the scene."""
_SIDES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
"""The corners of each side of a box, as bits of x, y and z."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A ball around the particles."""

    center: Points
    """Its centre (3,) (m)."""
    radius: float
    """Its radius (m), above 0."""


def scene_around(positions: NDArray[Any]) -> Scene:
    """The ball around positions (n, 3) (m)."""
    if not len(positions):
        return Scene(np.zeros(3), 1.0)
    low, high = (np.asarray(ends, np.float64) for ends in (positions.min(axis=0), positions.max(axis=0)))
    return Scene(0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)) or 1.0)


def reference(collider: Collider) -> Points:
    """The reference point of a collider at time 0 (m), which poses place."""
    shape: dict[str, Any] = collider.shape
    if "start" in shape:
        return 0.5 * (np.array(shape["start"], np.float64) + np.array(shape["end"], np.float64))
    name = {"sphere": "center", "box": "center", "mesh": "origin"}.get(collider.kind, "point")
    return np.array(shape.get(name, (0.0, 0.0, 0.0)), np.float64)


def surface(collider: Collider, scene: Scene) -> tuple[Points, Triangles]:
    """Points (n, 3) and triangles (m, 3) of a collider at time 0."""
    shape: dict[str, Any] = collider.shape
    if collider.kind == "mesh":
        return np.array(shape["points"], np.float64), np.array(shape["triangles"], np.uint32)
    given = {name: np.array(value, np.float64) for name, value in shape.items()}
    if collider.kind == "plane":
        return _plane(given["point"], given["normal"], scene)
    if collider.kind == "half_pipe":
        return _half_pipe(given, scene)
    if collider.kind == "box":
        return _box(given)
    radius = float(given["radius"])
    if collider.kind == "sphere":
        return _capsule(given["center"], given["center"], radius)
    if collider.kind == "cylinder":
        return _cylinder(given["start"], given["end"], radius)
    return _capsule(given["start"], given["end"], radius)


def _capsule(start: Points, end: Points, radius: float) -> tuple[Points, Triangles]:
    """All points within a radius of a segment, which may be a point."""
    far = float(np.linalg.norm(end - start))
    axis = (end - start) / far if far > 0 else np.array((0.0, 1.0, 0.0))
    angles = [0.5 * math.pi * ring / _RINGS for ring in range(_RINGS + 1)]
    rings = [(-radius * math.cos(angle), radius * math.sin(angle)) for angle in angles[1:]]
    # The ring in the middle of a ball is one.
    first = 0 if far > 0 else 1
    rings += [(far + radius * math.sin(angle), radius * math.cos(angle)) for angle in angles[first:_RINGS]]
    return _revolved(start, axis, (-radius, far + radius), rings)


def _cylinder(start: Points, end: Points, radius: float) -> tuple[Points, Triangles]:
    """A cylinder with flat ends."""
    far = float(np.linalg.norm(end - start))
    return _revolved(start, (end - start) / far, (0.0, far), [(0.0, radius), (far, radius)])


def _revolved(
    base: Points, axis: Points, ends: tuple[float, float], rings: Sequence[tuple[float, float]]
) -> tuple[Points, Triangles]:
    """A surface around an axis, from rings with their place along it and their radius; a point closes either end."""
    first, second = _tangents(axis)
    turns = 2 * math.pi * np.arange(_CORNERS) / _CORNERS
    circle = np.cos(turns)[:, None] * first + np.sin(turns)[:, None] * second
    parts = [base[None] + ends[0] * axis]
    parts += [base + place * axis + radius * circle for place, radius in rings]
    parts.append(base[None] + ends[1] * axis)
    last = 1 + _CORNERS * len(rings)

    def at(ring: int, corner: int) -> int:
        return 1 + ring * _CORNERS + corner % _CORNERS

    triangles: list[tuple[int, int, int]] = []
    for corner in range(_CORNERS):
        triangles.append((0, at(0, corner + 1), at(0, corner)))
        for ring in range(1, len(rings)):
            a, b = at(ring - 1, corner), at(ring - 1, corner + 1)
            c, d = at(ring, corner), at(ring, corner + 1)
            triangles += [(a, b, c), (b, d, c)]
        triangles.append((last, at(len(rings) - 1, corner), at(len(rings) - 1, corner + 1)))
    return np.concatenate(parts), np.array(triangles, np.uint32)


def _box(given: dict[str, Points]) -> tuple[Points, Triangles]:
    axes = np.stack((given["axis_x"], given["axis_y"], _cross(given["axis_x"], given["axis_y"])))
    bits = np.arange(8)[:, None] >> np.arange(3) & 1
    points = np.asarray(given["center"] + ((2.0 * bits - 1.0) * given["half_extent"]) @ axes, np.float64)
    triangles = [half for a, b, c, d in _SIDES for half in ((a, b, c), (a, c, d))]
    return points, np.array(triangles, np.uint32)


def _plane(point: Points, normal: Points, scene: Scene) -> tuple[Points, Triangles]:
    """A square of a plane, below the middle of the scene."""
    foot = scene.center - float((scene.center - point) @ normal) * normal
    first, second = (_REACH * scene.radius * tangent for tangent in _tangents(normal))
    points = np.stack([foot + a * first + b * second for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return points, np.array([(0, 1, 2), (0, 2, 3)], np.uint32)


def _half_pipe(given: dict[str, Points], scene: Scene) -> tuple[Points, Triangles]:
    """The inside of a tube below its axis, along the scene, with a bank on either side."""
    point, axis, up, radius = given["point"], given["axis"], given["up"], float(given["radius"])
    side, reach = _cross(up, axis), _REACH * scene.radius
    middle = point + float((scene.center - point) @ axis) * axis
    angles = [math.pi * corner / _CORNERS for corner in range(_CORNERS + 1)]
    profile = [(radius * math.cos(angle), -radius * math.sin(angle)) for angle in angles]
    profile = [(radius + reach, 0.0), *profile, (-radius - reach, 0.0)]
    lines = [middle + aside * side + height * up for aside, height in profile]
    points = np.stack([line + along * axis for line in lines for along in (-reach, reach)])
    starts = range(0, 2 * len(lines) - 2, 2)
    triangles = [half for a in starts for half in ((a, a + 2, a + 1), (a + 2, a + 3, a + 1))]
    return points, np.array(triangles, np.uint32)


def _tangents(normal: Points) -> tuple[Points, Points]:
    """Two unit vectors that make a right-handed frame with a unit vector."""
    # The axis farthest from it, so that the cross product is not small.
    helper = (0.0, 1.0, 0.0) if abs(normal[1]) < 0.9 else (0.0, 0.0, 1.0)
    first = _cross(np.array(helper), normal)
    first = first / float(np.linalg.norm(first))
    return first, _cross(normal, first)


def _cross(a: Points, b: Points) -> Points:
    return np.asarray(np.cross(a, b), np.float64)

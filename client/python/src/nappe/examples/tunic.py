"""Makes a garment for a figure: the surface that lies off its first frame, cut at neck, wrists and hem.

    python -m nappe.examples.tunic --mesh man.obj --hem 0.75 --neck 1.35 --wrist 0.55 --out tunic.obj

The figure stands upright along y. Without `--mesh` it is one of a scene of the server. The edges of the garment are as
long as half of `--cell` or longer, so that a quarter of it is the largest thickness.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe.examples import _server

Numbers = NDArray[np.float64]
Indices = NDArray[np.integer[Any]]
Marks = NDArray[np.bool_]

WITHIN = 0.25
"""How far a point of the garment is from the middle of its cell along each axis at most, in cells."""

SIDES = [(axis, turn) for axis in range(3) for turn in (1, -1)]
"""The six neighbours of a node: along which axis, and which way."""


def distances(points: Numbers, corners: Numbers) -> Numbers:
    """How far points (n, 3) are from a triangle (3, 3) (m)."""
    best = np.full(len(points), np.inf)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    is_above = np.full(len(points), bool(normal.any()))
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge, off = end - start, points - start
        share = np.clip(off @ edge / max(float(edge @ edge), 1e-300), 0, 1)
        best = np.minimum(best, np.linalg.norm(off - share[:, None] * edge, axis=1))
        is_above &= off @ np.cross(normal, edge) >= 0
    height = np.abs((points - corners[0]) @ normal) / max(float(np.linalg.norm(normal)), 1e-300)
    return np.where(is_above, height, best)


def field(points: Numbers, triangles: Indices, gap: float, cell: float) -> tuple[Numbers, Numbers]:
    """The distance from a mesh (m) at the nodes of a grid, where it is near, and the place of the first node."""
    reach = gap + 2 * cell
    low = points.min(0) - reach - cell
    shape = np.ceil((points.max(0) + reach + cell - low) / cell).astype(int) + 1
    found = np.full(tuple(shape), np.inf)
    for corners in points[triangles]:
        first = np.maximum(np.floor((corners.min(0) - reach - low) / cell).astype(int), 0)
        last = np.minimum(np.ceil((corners.max(0) + reach - low) / cell).astype(int) + 1, shape)
        part = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
        nodes = np.stack(np.meshgrid(*(np.arange(a, b) for a, b in zip(first, last, strict=True)), indexing="ij"), -1)
        near = distances(low + cell * nodes.reshape(-1, 3), corners).reshape(nodes.shape[:3])
        found[part] = np.minimum(found[part], near)
    return found, low


def shifted(marks: Marks, axis: int, turn: int) -> Marks:
    """Marks of the neighbours along an axis; none beyond the grid."""
    moved = np.roll(marks, turn, axis)
    edge: list[slice | int] = [slice(None)] * 3
    edge[axis] = 0 if turn > 0 else -1
    moved[tuple(edge)] = False
    return moved


def solid(away: Numbers) -> Marks:
    """Which nodes are no part of the outside, which is in one piece; `away` is above 0 off the garment's surface.

    Where the outside touches itself along an edge of a cell alone, which no surface could follow, it is taken back.
    """
    is_free = away > 0
    outside = np.zeros_like(is_free)
    outside[0, 0, 0] = True
    while True:
        grown = outside.copy()
        for axis, turn in SIDES:
            grown |= shifted(outside, axis, turn)
        grown &= is_free
        if (grown == outside).all():
            break
        outside = grown
    while True:
        taken = np.zeros_like(outside)
        for a, b in ((0, 1), (0, 2), (1, 2)):
            along_a, along_b = shifted(outside, a, -1), shifted(outside, b, -1)
            both = shifted(along_a, b, -1)
            taken |= outside & both & ~along_a & ~along_b
            taken |= shifted(along_a & along_b & ~outside & ~both, a, 1)
        if not taken.any():
            return ~outside
        outside &= ~taken


def surface(away: Numbers, is_solid: Marks) -> tuple[Numbers, Indices]:
    """The surface between solid and free nodes: a point in each cell that it crosses, in cells, and its triangles."""
    total, count = np.zeros((*away.shape, 3)), np.zeros(away.shape, int)
    quads = []
    for axis in range(3):
        before = tuple(slice(None, -1) if own == axis else slice(None) for own in range(3))
        behind = tuple(slice(1, None) if own == axis else slice(None) for own in range(3))
        starts = np.argwhere(is_solid[before] != is_solid[behind])
        first, second = away[before][tuple(starts.T)], away[behind][tuple(starts.T)]
        is_out = ~is_solid[before][tuple(starts.T)]
        inner, outer = np.where(is_out, second, first), np.where(is_out, first, second)
        share = np.clip(np.maximum(outer, 0) / np.maximum(outer - inner, 1e-300), 0, 1)
        crossing = starts.astype(float)
        crossing[:, axis] += np.where(is_out, share, 1 - share)
        # The four cells around the edge, in a circle that goes round it as the outside asks.
        u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
        cells = np.stack([starts, starts - u, starts - u - v, starts - v], 1)
        for corner in range(4):
            np.add.at(total, tuple(cells[:, corner].T), crossing)
            np.add.at(count, tuple(cells[:, corner].T), 1)
        quads.append(np.where(is_out[:, None, None], cells[:, ::-1], cells))

    used = np.argwhere(count > 0)
    numbers = np.full(count.shape, -1)
    numbers[tuple(used.T)] = np.arange(len(used))
    mean = total[tuple(used.T)] / count[tuple(used.T)][:, None]
    points = used + 0.5 + np.clip(mean - used - 0.5, -WITHIN, WITHIN)
    corners = numbers[tuple(np.moveaxis(np.concatenate(quads), -1, 0))]
    return points, np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def garment(
    points: Numbers, triangles: Indices, gap: float, cell: float, bounds: tuple[float, float, float]
) -> tuple[Numbers, Indices]:
    """Points (n, 3) (m) and triangles of a garment around a figure, between hem and neck and within the wrists."""
    found, low = field(points, triangles, gap, cell)
    away = np.minimum(found, gap + 2 * cell) - gap
    places, faces = surface(away, solid(away))
    places = low + cell * places
    hem, neck, wrist = bounds
    off = places - (points.min(0) + points.max(0)) / 2
    is_kept = (places[:, 1] > hem) & (places[:, 1] < neck) & (np.hypot(off[:, 0], off[:, 2]) < wrist)
    faces = faces[is_kept[faces].all(1)]
    used, faces = np.unique(faces, return_inverse=True)
    return places[used], faces.reshape(-1, 3)


def read_obj(path: Path) -> tuple[Numbers, Indices]:
    """Points and triangles of an OBJ file; `nappe mesh convert man.ply man.obj` makes one."""
    words = [line.split() for line in path.read_text().splitlines()]
    points = [[float(number) for number in line[1:4]] for line in words if line[:1] == ["v"]]
    faces = [[int(corner.split("/")[0]) - 1 for corner in line[1:4]] for line in words if line[:1] == ["f"]]
    return np.array(points, float), np.array(faces, int)


def main(arguments: Sequence[str] | None = None) -> None:
    """Reads a figure, makes the garment and writes it."""
    parser = _server.parser(__doc__)
    parser.add_argument("--mesh", type=Path, help="OBJ file of the figure at its first frame")
    parser.add_argument("--scene", default="walker", help="without --mesh: a scene of the server")
    parser.add_argument("--figure", default="walker", help="and a figure in it")
    parser.add_argument("--gap", type=float, default=0.016, help="how far the garment lies off the figure, in m")
    parser.add_argument("--cell", type=float, default=0.018, help="length of its edges, about, in m")
    parser.add_argument("--hem", type=float, default=0.8, help="height at which it begins, in m")
    parser.add_argument("--neck", type=float, default=1.42, help="height at which it ends, in m")
    parser.add_argument("--wrist", type=float, default=0.35, help="how far its sleeves reach from the middle, in m")
    parser.add_argument("--out", type=Path, default=Path("tunic.obj"), help="OBJ file to write")
    options = parser.parse_args(arguments)
    # Of a longer edge both ends could be off the skin, one of them within the figure.
    if not 0 < options.cell < 2 * options.gap:
        parser.error(f"--cell is {options.cell}; allowed: above 0, and below twice the gap, {2 * options.gap}")

    if options.mesh is not None:
        points, triangles = read_obj(options.mesh)
    else:
        with _server.opened(options) as server, server.create(options.scene) as session:
            figure = session.trajectory(stop=1).body(options.figure)
        points, triangles = figure.positions[0].astype(float), figure.triangles.astype(int)
    bounds = (options.hem, options.neck, options.wrist)
    places, faces = garment(points, triangles, options.gap, options.cell, bounds)
    if not len(faces):
        parser.error("nothing of the figure is between --hem, --neck and --wrist")

    with options.out.open("w") as file:
        file.writelines(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in places)
        file.writelines(f"f {a} {b} {c}\n" for a, b, c in faces + 1)
    print(f"{options.out}: {len(places)} points, {len(faces)} triangles")


if __name__ == "__main__":
    main()

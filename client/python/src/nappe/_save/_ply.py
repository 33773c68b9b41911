"""A folder of PLY files: one per frame, with the particles, what is kept of them, and the triangles.

Particles: x, y, z (m) and, where they are kept, vx, vy, vz (m/s), plastic_ratio (1), stress_norm (Pa), fx, fy, fz (N)
and ax, ay, az (m/s²), each in its precision: float32 as `float`, float64 as `double`. Step and time stand in comments.
The surfaces of all mesh colliders at time 0 stand once in colliders.ply, if there are any. The command's `--save
FOLDER` writes the same bytes, in the precision of the session; with velocities its comments say more, so that a run can
go on from them.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._save._stacked import StackedFrames
from nappe._wire._arrays import Array
from nappe._wire._colliders import Collider
from nappe._wire._errors import Error

# What files call the numbers of an array beside the position, in the order in which they stand.
_PROPERTIES = {
    "velocities": ("vx", "vy", "vz"),
    "plastic_ratio": ("plastic_ratio",),
    "stress": ("stress_norm",),
    "force": ("fx", "fy", "fz"),
    "acceleration": ("ax", "ay", "az"),
}
_NUMBERS = {"float": "<f4", "double": "<f8"}
_COLLIDERS = "colliders.ply"
_TRIANGLE = np.dtype([("count", "u1"), ("corners", "<u4", (3,))])


def write_folder(trajectory: StackedFrames, path: Path) -> None:
    """Writes frame-000000.ply and so on, by the numbers of the frames, into a folder that holds no frames yet."""
    kept: dict[tuple[str, ...], Array] = {("x", "y", "z"): trajectory.positions}
    kept |= {words: trajectory.arrays[name] for name, words in _PROPERTIES.items() if name in trajectory.arrays}
    check_room(path)
    faces = _faces(trajectory.topology.triangles)
    for index, number in enumerate(trajectory.number):
        columns = {
            word: array[index].reshape(-1, len(words))[:, column]
            for words, array in kept.items()
            for column, word in enumerate(words)
        }
        types = {word: "double" if column.dtype.itemsize == 8 else "float" for word, column in columns.items()}
        particles = np.zeros(trajectory.topology.particle_count, [(word, _NUMBERS[types[word]]) for word in columns])
        for word, column in columns.items():
            particles[word] = column
        step, time = int(trajectory.step[index]), float(trajectory.time[index])
        header = _header(step, time, types, len(particles), len(faces))
        (path / f"frame-{int(number):06}.ply").write_bytes(header + particles.tobytes() + faces.tobytes())
    _write_surfaces(trajectory.topology.colliders, path / _COLLIDERS)


def check_room(path: Path) -> None:
    """Makes a folder for frames, or takes one that holds none yet, of whatever kind."""
    path.mkdir(parents=True, exist_ok=True)
    for entry in sorted(path.iterdir()):
        if entry.name.startswith(("frame-", "grid-", "colliders-")) or entry.name == _COLLIDERS:
            raise Error(
                f"the folder {path} holds frames already ({entry.name}): two runs would be mixed up",
                remedy="Remove them, or give another folder.",
            )


def _write_surfaces(colliders: Iterable[Collider], path: Path) -> None:
    """Writes the surfaces of all mesh colliders at time 0 as one, if there are any."""
    points: list[Array] = [np.zeros((0, 3), "<f4")]
    triangles: list[NDArray[np.uint32]] = [np.zeros((0, 3), np.uint32)]
    count = 0
    for collider in colliders:
        if collider.kind == "mesh":
            shape: dict[str, Any] = collider.shape
            points.append(np.asarray(shape["points"], "<f4"))
            triangles.append(shape["triangles"] + np.uint32(count))
            count += len(shape["points"])
    faces = _faces(np.concatenate(triangles))
    if len(faces):
        header = _header(0, 0.0, dict.fromkeys("xyz", "float"), count, len(faces))
        path.write_bytes(header + np.concatenate(points).tobytes() + faces.tobytes())


def _header(step: int, time: float, types: dict[str, str], point_count: int, face_count: int) -> bytes:
    """The lines of a file that say what follows."""
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment step {step}",
        f"comment time_seconds {np.format_float_positional(time, trim='-')}",
        f"element vertex {point_count}",
        *(f"property {kind} {word}" for word, kind in types.items()),
        f"element face {face_count}",
        "property list uchar uint vertex_indices",
        "end_header\n",
    ]
    return "\n".join(lines).encode("ascii")


def _faces(triangles: NDArray[np.uint32]) -> NDArray[np.void]:
    """Triangles (m, 3) as the file has them: how many corners, and which."""
    faces = np.zeros(len(triangles), _TRIANGLE)
    faces["count"], faces["corners"] = 3, triangles
    return faces

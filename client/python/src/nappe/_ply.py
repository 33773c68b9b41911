"""A folder of PLY files: one per frame, with the particles, what is kept of them, and the triangles.

Particles: x, y, z (m) and, where they are kept, vx, vy, vz (m/s), plastic_ratio (1) and stress_norm (Pa), each in its
precision: float32 as `float`, float64 as `double`. Step and time stand in comments. The command's `--save FOLDER`
writes the same bytes, in the precision of the session.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nappe._arrays import Array
from nappe._errors import Error
from nappe._stacked import StackedFrames

# What files call the numbers of an array beside the position, in the order in which they stand.
_PROPERTIES = {
    "velocities": ("vx", "vy", "vz"),
    "plastic_ratio": ("plastic_ratio",),
    "stress": ("stress_norm",),
}
_NUMBERS = {"float": "<f4", "double": "<f8"}
_TRIANGLE = np.dtype([("count", "u1"), ("corners", "<u4", (3,))])


def write_folder(trajectory: StackedFrames, path: Path) -> None:
    """Writes frame-000000.ply and so on, by the numbers of the frames, into a folder that holds no frames yet."""
    kept: dict[tuple[str, ...], Array] = {("x", "y", "z"): trajectory.positions}
    kept |= {words: trajectory.arrays[name] for name, words in _PROPERTIES.items() if name in trajectory.arrays}
    path.mkdir(parents=True, exist_ok=True)
    for entry in sorted(path.iterdir()):
        if entry.name.startswith(("frame-", "grid-")):
            raise Error(
                f"the folder {path} holds frames already ({entry.name}): two runs would be mixed up",
                remedy="Remove them, or give another folder.",
            )
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
        header = _header(trajectory, index, types, len(particles), len(faces))
        (path / f"frame-{int(number):06}.ply").write_bytes(header + particles.tobytes() + faces.tobytes())


def _header(
    trajectory: StackedFrames, index: int, types: dict[str, str], particle_count: int, face_count: int
) -> bytes:
    """The lines of a frame's file that say what follows."""
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment step {int(trajectory.step[index])}",
        f"comment time_seconds {np.format_float_positional(trajectory.time[index], trim='-')}",
        f"element vertex {particle_count}",
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

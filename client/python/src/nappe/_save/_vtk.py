"""Files for ParaView and whatever else reads VTK: one of the particles per frame, and an index of their times.

Enters: a trajectory. Leaves: `frame-000000.vtp` and so on in a folder, `colliders-000000.vtp` of each frame in which a
collider has moved, and the text of the index. The command's `--save FILE.pvd` writes the same arrays by the same names.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._save._ply import check_room
from nappe._save._solids import Points, Scene, reference, scene_around, surface
from nappe._save._stacked import StackedFrames
from nappe._wire._arrays import Array
from nappe._wire._errors import refused
from nappe._wire._reports import Diagnostics
from nappe._wire._topology import Body

# Bytes that are packed together.
_BLOCK = 1 << 16
# Levels of zlib, for arrays of one file and of all.
_OF_ONE, _OF_ALL = 2, 6
# What files call the arrays beside the position.
NAMES = {
    "velocities": "velocity",
    "plastic_ratio": "plastic_ratio",
    "stress": "stress_norm",
    "force": "force",
    "acceleration": "acceleration",
}
_TYPES = {"<f4": "Float32", "<f8": "Float64", "<i4": "Int32"}
_NO_TURN = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class _Packed:
    """An array as a file has it, so that one which stays the same is packed once."""

    head: str
    """Its element, up to the place of its bytes."""
    data: bytes


def _packed(name: str, array: NDArray[Any], level: int = _OF_ONE) -> _Packed:
    """An array (n,) or (n, components) of a type that files have."""
    kind = _TYPES[array.dtype.newbyteorder("<").str]
    components = array.shape[1] if array.ndim == 2 else 1
    head = f'<DataArray type="{kind}" Name="{_escaped(name)}" NumberOfComponents="{components}" format="appended"'
    data = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
    blocks = [zlib.compress(data[start : start + _BLOCK], level) for start in range(0, len(data), _BLOCK)]
    sizes = [len(blocks), _BLOCK, len(data) % _BLOCK, *map(len, blocks)]
    return _Packed(head, np.array(sizes, "<u4").tobytes() + b"".join(blocks))


@dataclass(frozen=True)
class _Cells:
    """Cells over the points of a file: vertices, lines and triangles, and numbers of them."""

    counts: tuple[int, int, int]
    sections: dict[str, list[_Packed]]


def _cells(kinds: Sequence[NDArray[np.uint32]], name: str, numbers: Sequence[NDArray[np.int32]]) -> _Cells:
    """Vertices (n, 1), lines (n, 2) and triangles (n, 3), and a number of each of their cells."""
    sections = {"CellData": [_packed(name, np.concatenate(numbers), _OF_ALL)]}
    for section, cells in zip(("Verts", "Lines", "Polys"), kinds, strict=True):
        ends = np.arange(1, len(cells) + 1, dtype=np.int32) * np.int32(cells.shape[1])
        corners = cells.astype(np.int32).reshape(-1)
        arrays = {"connectivity": corners, "offsets": ends} if len(cells) else {}
        sections[section] = [_packed(array, values, _OF_ALL) for array, values in arrays.items()]
    return _Cells((len(kinds[0]), len(kinds[1]), len(kinds[2])), sections)


def write_vtk(trajectory: StackedFrames, folder: Path) -> bytes:
    """Writes the files of all frames into a folder that holds no frames yet; gives the text of the index beside it."""
    if not folder.name.isprintable():
        raise refused(f"{folder} has a character that no file can name; allowed: those that can be printed", "path")
    positions = trajectory.positions
    check_room(folder)
    kinds, numbers = kinds_of(trajectory.topology.bodies)
    bodies = _cells(kinds, "body", [numbers])
    colliders = _Colliders(trajectory, scene_around(positions[0] if len(positions) else np.zeros((0, 3))))
    rows: list[str] = []
    for index, number in enumerate(trajectory.number):
        name = f"frame-{int(number):06}.vtp"
        (folder / name).write_bytes(_of_frame(trajectory, index, bodies))
        parts = [(0, "particles", name)]
        newest = colliders.write(index, folder)
        if newest is not None:
            parts.append((1, "colliders", newest))
        time = _number(float(trajectory.time[index]))
        rows += [
            f'<DataSet timestep="{time}" part="{part}" name="{kind}" file="{_escaped(folder.name)}/{file}"/>\n'
            for part, kind, file in parts
        ]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n<Collection>\n'
    return (head + "".join(rows) + "</Collection>\n</VTKFile>\n").encode("utf-8")


def kinds_of(bodies: Sequence[Body]) -> tuple[list[NDArray[np.uint32]], NDArray[np.int32]]:
    """Particles of bodies that have neither triangles nor springs (n, 1), springs of those without triangles (n, 2),
    triangles (n, 3); and the number of the body of each of these cells, one kind after the other."""
    kinds: list[list[NDArray[np.uint32]]] = [[], [], []]
    numbers: list[list[NDArray[np.int32]]] = [[], [], []]
    for number, body in enumerate(bodies):
        if len(body.triangles):
            kind, cells = 2, body.triangles
        elif len(body.springs):
            kind, cells = 1, body.springs
        else:
            kind = 0
            cells = np.arange(body.particles.start, body.particles.stop, dtype=np.uint32).reshape(-1, 1)
        kinds[kind].append(cells)
        numbers[kind].append(np.full(len(cells), number, np.int32))
    joined = [
        np.concatenate([np.zeros((0, width), np.uint32), *cells]) for width, cells in zip((1, 2, 3), kinds, strict=True)
    ]
    of_cells = [part for kind in numbers for part in kind]
    return joined, np.concatenate([np.zeros(0, np.int32), *of_cells])


def _of_frame(trajectory: StackedFrames, index: int, bodies: _Cells) -> bytes:
    """The file of the particles of a frame."""
    arrays = {name: trajectory.arrays[key][index] for key, name in NAMES.items() if key in trajectory.arrays}
    facts = _of_instant(trajectory, index)
    facts.append(_texts("body_names", [body.name for body in trajectory.topology.bodies]))
    state_hash = trajectory.state_hash[index]
    if state_hash is not None:
        facts.append(_texts("state_hash", [state_hash]))
    step = trajectory.steps[index]
    if step is not None:
        facts += _of_step(step)
    return _file(facts, trajectory.positions[index], arrays, bodies)


def _of_instant(trajectory: StackedFrames, index: int) -> list[str]:
    """What every file tells: the time, the step, the number of the frame."""
    return [
        # Readers know this name.
        _vectors("TimeValue", 1, [float(trajectory.time[index])]),
        _counts("step", [int(trajectory.step[index])]),
        _counts("frame", [int(trajectory.number[index])]),
    ]


def _of_step(step: Diagnostics) -> list[str]:
    """What a step reported."""
    names = ("kinetic_energy", "elastic_energy", "gravitational_energy", "external_work", "max_stretch")
    facts = [_vectors(name, 1, [getattr(step, name)]) for name in names]
    facts.append(_counts("contact_count", [step.contact_count]))
    if step.loads:
        facts.append(_texts("load_names", [load.name for load in step.loads]))
        facts.append(_vectors("load_force", 3, [number for load in step.loads for number in load.force]))
        facts.append(_vectors("load_torque", 3, [number for load in step.loads for number in load.torque]))
        facts.append(_counts("load_contacts", [load.contacts for load in step.loads]))
    return facts


class _Colliders:
    """The colliders as triangles; a file of them is written whenever one has moved."""

    def __init__(self, trajectory: StackedFrames, scene: Scene) -> None:
        """Those of the trajectory, and as much of endless ones as the scene needs."""
        self._trajectory = trajectory
        self._colliders = trajectory.topology.colliders
        solids = [surface(collider, scene) for collider in self._colliders]
        self._points = [points for points, _ in solids]
        firsts = np.cumsum([0, *(len(points) for points in self._points)])
        none = np.zeros((0, 3), np.uint32)
        shifted = [triangles + np.uint32(first) for (_, triangles), first in zip(solids, firsts, strict=False)]
        numbers = [np.full(len(triangles), number, np.int32) for number, (_, triangles) in enumerate(solids)]
        kinds = [none[:, :1], none[:, :2], np.concatenate([none, *shifted])]
        self._cells = _cells(kinds, "collider", [np.zeros(0, np.int32), *numbers])
        self._poses: list[tuple[tuple[float, ...], tuple[float, ...]]] = []
        self._newest: str | None = None

    def write(self, index: int, folder: Path) -> str | None:
        """Writes the file of a frame if a collider has moved; gives the name of the newest one, if there are any."""
        poses = self._at(index)
        if poses != self._poses:
            facts = _of_instant(self._trajectory, index)
            facts.append(_texts("collider_names", [collider.name for collider in self._colliders]))
            facts.append(_vectors("collider_position", 3, [number for at, _ in poses for number in at]))
            facts.append(_vectors("collider_turn", 4, [number for _, turn in poses for number in turn]))
            moved = [
                _moved(points - reference(collider), at, turn)
                for points, collider, (at, turn) in zip(self._points, self._colliders, poses, strict=True)
            ]
            self._poses, self._newest = poses, f"colliders-{int(self._trajectory.number[index]):06}.vtp"
            (folder / self._newest).write_bytes(_file(facts, np.concatenate(moved), {}, self._cells))
        return self._newest

    def _at(self, index: int) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
        """Where each collider is in a frame, and how it is turned."""
        told = self._trajectory.poses[index] if self._trajectory.poses else {}
        time = float(self._trajectory.time[index])
        poses: list[tuple[tuple[float, ...], tuple[float, ...]]] = []
        for collider in self._colliders:
            if collider.name in told:
                poses.append(told[collider.name])
            else:
                start = reference(collider).tolist()
                at = tuple(float(p + time * v) for p, v in zip(start, collider.velocity, strict=True))
                poses.append((at, _NO_TURN))
        return poses


def _moved(points: Points, at: Sequence[float], turn: Sequence[float]) -> Points:
    """Points around a reference point, turned about it, where it is now."""
    across = 2.0 * np.cross(np.array(turn[:3]), points)
    return np.asarray(np.array(at) + points + turn[3] * across + np.cross(np.array(turn[:3]), across), np.float64)


def _file(facts: Sequence[str], points: Array, point_data: dict[str, Array], cells: _Cells) -> bytes:
    """A whole file."""
    vertices, lines, triangles = cells.counts
    sections = {
        "PointData": [_packed(name, array) for name, array in point_data.items()],
        "CellData": cells.sections["CellData"],
        "Points": [_packed("Points", points)],
        "Verts": cells.sections["Verts"],
        "Lines": cells.sections["Lines"],
        "Strips": [],
        "Polys": cells.sections["Polys"],
    }
    text = [
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt32" '
        'compressor="vtkZLibDataCompressor">\n<PolyData>\n<FieldData>\n',
        *facts,
        f'</FieldData>\n<Piece NumberOfPoints="{len(points)}" NumberOfVerts="{vertices}" NumberOfLines="{lines}" '
        f'NumberOfStrips="0" NumberOfPolys="{triangles}">\n',
    ]
    offset = 0
    appended: list[bytes] = []
    for section, arrays in sections.items():
        text.append(f"<{section}>\n")
        for array in arrays:
            text.append(f'{array.head} offset="{offset}"/>\n')
            appended.append(array.data)
            offset += len(array.data)
        text.append(f"</{section}>\n")
    text.append('</Piece>\n</PolyData>\n<AppendedData encoding="raw">\n_')
    return "".join(text).encode("utf-8") + b"".join(appended) + b"\n</AppendedData>\n</VTKFile>\n"


def _vectors(name: str, components: int, numbers: Sequence[float]) -> str:
    """A fact of vectors, one after the other; nothing where a number is not finite, which no reader takes."""
    if not np.isfinite(numbers).all():
        return ""
    shape = f'NumberOfComponents="{components}" NumberOfTuples="{len(numbers) // components}"'
    return _fact("DataArray", "Float64", name, shape, " ".join(map(_number, numbers)))


def _counts(name: str, counts: Sequence[int]) -> str:
    """A fact of whole numbers."""
    return _fact("DataArray", "UInt64", name, f'NumberOfTuples="{len(counts)}"', " ".join(map(str, counts)))


def _texts(name: str, texts: Sequence[str]) -> str:
    """A fact of texts: each byte as a number, and a 0 after each text."""
    data = b"".join(text.replace("\0", "").encode("utf-8") + b"\0" for text in texts)
    return _fact("Array", "String", name, f'NumberOfTuples="{len(texts)}"', " ".join(map(str, data)))


def _fact(element: str, kind: str, name: str, shape: str, text: str) -> str:
    return f'<{element} type="{kind}" Name="{name}" {shape} format="ascii">{text}</{element}>\n'


def _number(value: float) -> str:
    """A number with all its digits, as the command writes it."""
    return str(np.format_float_positional(float(value), trim="-"))


def _escaped(text: str) -> str:
    """A text as a value of an attribute."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")

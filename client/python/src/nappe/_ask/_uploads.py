"""Meshes to send: arrays or files, in pieces of at most 1 MiB, and the scene files that name them.

Enters: arrays, or paths. Leaves: messages of an upload, and the text of a scene in which meshes are uploads.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nappe._ask._checks import array, finite
from nappe._ask._springs import with_springs
from nappe._wire._contract import MESSAGES, Message, number
from nappe._wire._errors import Error, FileNotFound, refused

PIECE_BYTES = 1 << 20
"""Largest piece of an upload."""
UPLOAD_LIMIT = 660.0
"""Longest time that an upload may take: the server gives up before (s)."""

_FORMATS = {
    ".obj": number("FileFormat", "FILE_FORMAT_OBJ"),
    ".off": number("FileFormat", "FILE_FORMAT_OFF"),
    ".ply": number("FileFormat", "FILE_FORMAT_PLY"),
    ".stl": number("FileFormat", "FILE_FORMAT_STL"),
    ".pc2": number("FileFormat", "FILE_FORMAT_PC2"),
}
_SET = number("FileFormat", "FILE_FORMAT_ETI")
_CHECKPOINT = number("FileFormat", "FILE_FORMAT_CHECKPOINT")

# `file = "figure.obj"`, or a header `[[body]]`; texts and comments, in which the same may stand, are stepped over.
_MESH = re.compile(
    r"""^[ \t]*\[\[[ \t]*(?P<header>[A-Za-z][\w.-]*)[ \t]*\]\]"""
    r"""|(?<![\w-])file[ \t]*=[ \t]*(?:"(?P<double>[^"\\\n]+)"|'(?P<single>[^'\n]+)')"""
    r"""|\"{3}.*?\"{3}|'{3}.*?'{3}|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|\#[^\n]*""",
    re.DOTALL | re.MULTILINE,
)


@dataclass(frozen=True)
class Uploaded:
    """A mesh that the server keeps."""

    mesh_id: str
    """A scene names it as `mesh = { upload = "ID" }`."""
    warnings: tuple[str, ...]
    """What is odd about it but does not stop a simulation."""


@dataclass(frozen=True)
class Mesh:
    """A mesh to send: its header, and the data that follow."""

    header: Message
    data: tuple[memoryview, ...]

    def messages(self) -> Iterator[Message]:
        """The header, then the data in pieces."""
        kind = MESSAGES["UploadMeshRequest"]
        is_file = self.header.DESCRIPTOR.name == "FileHeader"
        yield kind(file=self.header) if is_file else kind(header=self.header)
        for data in self.data:
            for start in range(0, len(data), PIECE_BYTES):
                yield kind(data=bytes(data[start : start + PIECE_BYTES]))


def from_arrays(
    points: ArrayLike, triangles: ArrayLike, masses: ArrayLike | None, uv: ArrayLike | None, name: str
) -> Mesh:
    """A mesh as arrays, checked: shapes, finite numbers, indices."""
    where = array(points, "points", (-1, 3))
    if len(where) == 0:
        raise refused("points is empty; allowed: at least one point", "points")
    corners = _corners(triangles)
    outside = (corners < 0) | (corners >= len(where))
    if outside.any():
        row, column = np.unravel_index(int(np.argmax(outside)), outside.shape)
        told = f"triangles[{row}][{column}] is {corners[row, column]}; allowed: 0 to {len(where) - 1}"
        raise refused(told, "triangles")
    weights = np.zeros(0) if masses is None else array(masses, "masses", (len(where),))
    if (weights < 0).any():
        at = int(np.argmax(weights < 0))
        raise refused(f"masses[{at}] is {weights[at]:g} kg; allowed: 0 (pinned) or more", "masses")
    texture = np.zeros((0, 2), "<f4") if uv is None else array(uv, "uv", (len(where), 2), "<f4")
    header = MESSAGES["MeshHeader"](
        name=name,
        point_count=len(where),
        triangle_count=len(corners),
        mass_count=len(weights),
        uv_count=len(texture),
    )
    packed = b"".join(part.tobytes() for part in (where, corners.astype("<u4"), weights, texture))
    return Mesh(header, (memoryview(packed),))


def from_state(positions: ArrayLike, velocities: ArrayLike, name: str) -> Mesh:
    """The particles of a frame: positions (n, 3) (m) and velocities (n, 3) (m/s)."""
    where = array(positions, "positions", (-1, 3))
    speed = array(velocities, "velocities", (len(where), 3))
    header = MESSAGES["MeshHeader"](name=name, point_count=len(where), velocity_count=len(speed))
    return Mesh(header, (memoryview(where.tobytes() + speed.tobytes()),))


def _corners(triangles: ArrayLike) -> NDArray[np.int64]:
    """Triangles as whole numbers; an empty list is no triangles."""
    try:
        given = np.asarray(triangles)
    except ValueError:
        given = np.zeros((1, 3), int)  # `array` says below what is wrong with it
    if given.size and given.dtype.kind not in "iu":
        raise refused(f"triangles is an array of {given.dtype}; allowed: whole numbers", "triangles")
    corners: NDArray[np.int64] = array(triangles if given.size else np.zeros((0, 3)), "triangles", (-1, 3), "<i8")
    return corners


def from_file(path: Path, missing_mass: float | None = None) -> Mesh:
    """A file as it is: a mesh as OBJ, OFF, PLY, STL, or a set of the MecaSim course (its points.eti, or its folder); or
    frames of a figure as PC2."""
    suffix = path.suffix.lower()
    if path.is_dir() or suffix == ".eti":
        return _set(path if path.is_dir() else path.parent, missing_mass)
    if suffix not in _FORMATS:
        allowed = ".obj, .off, .ply, .stl, .pc2, points.eti or its folder"
        raise refused(f"{path} has the ending {suffix!r}; allowed: {allowed}", "path")
    data = _read(path)
    header = MESSAGES["FileHeader"](name=path.name, format=_FORMATS[suffix], byte_count=len(data))
    return Mesh(header, (memoryview(data),))


def from_checkpoint(path: Path) -> Mesh:
    """The file of a session, as `Session.save()` wrote it."""
    data = _read(path)
    return Mesh(MESSAGES["FileHeader"](format=_CHECKPOINT, byte_count=len(data)), (memoryview(data),))


def _set(folder: Path, missing_mass: float | None) -> Mesh:
    files = [folder / f"{part}.eti" for part in ("points", "faceset", "masses", "texcoord")]
    data = [_read(file) if file == files[0] or file.exists() else b"" for file in files]
    points, faceset, masses, texcoord = (len(part) for part in data)
    header = MESSAGES["FileHeader"](
        name=folder.name,
        format=_SET,
        byte_count=points,
        faceset_byte_count=faceset,
        masses_byte_count=masses,
        texcoord_byte_count=texcoord,
    )
    if missing_mass is not None:
        header.missing_mass = finite(missing_mass, "missing_mass")
    return Mesh(header, tuple(memoryview(part) for part in data))


@dataclass(frozen=True)
class Scene:
    """A scene to create a session from: the name of a shipped one, or a text and the mesh files that it names, of which
    some go with tables of springs, by the names of both."""

    name: str | None
    text: str | None
    folder: Path
    meshes: dict[str, Path]
    tables: dict[str, str]

    def mesh(self, name: str) -> Mesh:
        """A mesh file as it is sent: with the springs of its table, if it has one."""
        path = self.meshes[name]
        if name not in self.tables:
            return from_file(path)
        if path.suffix.lower() != ".ply":
            told = f"{path} goes with a table of springs; allowed here: a mesh that ends in .ply"
            raise refused(f"{told}. `nappe mesh springs MESH TABLE --out FILE.ply` makes one PLY of both", "scene")
        table = self.folder / self.tables[name]
        data = with_springs(_read(path), str(path), _read(table), str(table))
        header = MESSAGES["FileHeader"](name=path.name, format=_FORMATS[".ply"], byte_count=len(data))
        return Mesh(header, (memoryview(data),))

    def with_uploads(self, ids: dict[str, str]) -> str:
        """The text with the ids of uploads in place of files. Lines stay where they are."""

        def replaced(found: re.Match[str]) -> str:
            path = _path(found)
            if path in self.tables.values():
                return 'pattern = "file"'
            return f'upload = "{ids[path]}"' if path in ids else found[0]

        return _MESH.sub(replaced, self.text or "")


NOTHING = Scene(None, None, Path(), {}, {})
"""No scene: the session goes on from a file."""


def read_scene(scene: str | os.PathLike[str]) -> Scene:
    """The name of a shipped scene, the text of a scene file, or a path, which ends in `.toml` or is a `Path`."""
    if isinstance(scene, str) and ("\n" in scene or "=" in scene):
        return Scene(None, scene, Path(), {}, {})
    if isinstance(scene, str) and not scene.endswith(".toml"):
        return Scene(scene, None, Path(), {}, {})
    path = Path(scene)
    text = _read(path).decode("utf-8", errors="replace")
    meshes: dict[str, Path] = {}
    tables: dict[str, str | None] = {}
    for names in _files(text):
        springs = [name for name in names if _is_table(name)]
        others = [name for name in names if not _is_table(name)]
        if springs and (len(springs), len(others)) != (1, 1):
            told = f"{path} names the table of springs {springs[0]}, and it is not clear of which mesh"
            raise refused(f"{told}; allowed: one mesh file and one table below a line [[body]]", "scene")
        for name in others:
            meshes[name] = path.parent / name
            table = springs[0] if springs else None
            if tables.setdefault(name, table) != table:
                told = f"{path} takes the mesh {name} with different springs; allowed: a copy of the file for each"
                raise refused(told, "scene")
    return Scene(None, text, path.parent, meshes, {name: table for name, table in tables.items() if table is not None})


def _files(text: str) -> list[list[str]]:
    """The files that a scene names, by the elements of its arrays of tables: each body has some of its own."""
    groups: list[list[str]] = [[]]
    for found in _MESH.finditer(text):
        header, name = found["header"], _path(found)
        if header is not None and not header.startswith("body."):
            groups.append([])
        if name is not None:
            groups[-1].append(name)
    return groups


def _is_table(name: str) -> bool:
    """Whether a file is a table of springs: meshes and frames have other endings."""
    return name.lower().endswith(".csv")


def _path(found: re.Match[str]) -> str | None:
    """The mesh file that a piece of a scene names; None where it is a comment or another text."""
    return found["double"] if found["single"] is None else found["single"]


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise FileNotFound(
            f"there is no file {path}, looked for in {path.parent.absolute()}",
            metadata={"path": str(path)},
            remedy="A scene that the server ships is named without an ending, such as 'flag'."
            if path.suffix == ".toml"
            else None,
        ) from None
    except OSError as error:
        raise Error(f"{path} cannot be read: {error.strerror}") from error

"""Pieces of the wire to whole frames: each array is copied at most once, and every number is finite.

Enters: messages of a stream, from a server that is not trusted. Leaves: frames.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._wire._arrays import FIELDS, Array, Arrays, BodyArrays
from nappe._wire._contract import Message, number
from nappe._wire._errors import Error
from nappe._wire._poses import FramePoses, read_poses
from nappe._wire._reading import hexadecimal, read
from nappe._wire._reports import ColliderLoad, Diagnostics
from nappe._wire._topology import MAX_PARTICLES, Topology, place

MAX_GRID_NODES = 1 << 22
"""Most nodes of the snow's grid in a frame that this package agrees to hold."""

_NUMBERS = {
    "positions": number("Field", "FIELD_POSITIONS"),
    "velocities": number("Field", "FIELD_VELOCITIES"),
    "plastic_ratio": number("Field", "FIELD_PLASTIC_RATIO"),
    "stress": number("Field", "FIELD_STRESS_NORM"),
    "force": number("Field", "FIELD_FORCES"),
    "acceleration": number("Field", "FIELD_ACCELERATIONS"),
}
_NAMES = {value: name for name, value in _NUMBERS.items()}
_TYPES: dict[int, np.dtype[Any]] = {
    number("Encoding", "ENCODING_UNSPECIFIED"): np.dtype("<f4"),
    number("Encoding", "ENCODING_RAW_F32"): np.dtype("<f4"),
    number("Encoding", "ENCODING_RAW_F64"): np.dtype("<f8"),
}

# Most bytes of a frame: all arrays in binary64, and the nodes of a grid with all that stands around them.
_PARTICLE_BYTES = 8 * sum(FIELDS.values())
_FRAME_BYTES = 40 * MAX_GRID_NODES + (16 << 20)


def field_number(name: str) -> int:
    """The number of a field on the wire."""
    return _NUMBERS[name]


@dataclass(frozen=True, eq=False)
class Grid:
    """Nodes of the snow's grid that carry mass, at the time of a frame."""

    cell: float
    """Distance between neighbouring nodes (m)."""
    indices: NDArray[np.int32]
    """Indices of the nodes (n, 3): a node stands at cell * index."""
    masses: NDArray[np.float32]
    """Masses (n,) (kg)."""
    velocities: NDArray[np.float32]
    """Velocities (n, 3) (m/s)."""
    stride: int
    """Only nodes whose indices are multiples of this were sent. 1: all nodes."""
    node_count: int
    """Nodes of the selection, sent or not."""
    forces: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    """Forces of the stress (n, 3) (N), at the state that the frame shows, or (0, 3) where `force` was not asked for."""

    @property
    def positions(self) -> NDArray[np.float64]:
        """Where the nodes stand (n, 3) (m)."""
        return np.asarray(self.cell * self.indices, np.float64)


class Frame(Arrays):
    """The particles at one instant, in the order of the scene's own meshes and objects."""

    def __init__(
        self, wire: Message, arrays: dict[str, Array], grid: Grid | None, topology: Topology | None = None
    ) -> None:
        """A whole frame; `wire` is its first piece."""
        self.arrays = arrays
        """Its arrays over the particles, read-only, under their names."""
        self._topology = topology
        self._diagnostics = wire.diagnostics if wire.HasField("diagnostics") else None
        # What steps depend on beside the arrays, of frames that have velocities.
        self._carried = wire.carried if wire.HasField("carried") else None
        self.number: int = wire.frame
        """Frame number. Frame 0 is the initial state."""
        self.step: int = wire.step
        """Steps taken before this frame."""
        self.time: float = wire.time_seconds
        """Simulated time (s)."""
        self.state_hash: str | None = hexadecimal(wire.state_hash) if wire.HasField("state_hash") else None
        """Hash of all on which further steps depend, 16 hexadecimal digits; None in frames that carry none."""
        self.dropped: int = wire.dropped_count
        """Frames that were left out since the one before, of a stream of the newest."""
        self.grid = grid
        """Nodes of the snow's grid, if they were asked for."""
        self.poses: FramePoses = read_poses(wire)
        """Position (m) and turn, a quaternion x, y, z, w of length 1, of the colliders that keys of the scene or calls
        move, by their names. Any other is where its velocity has brought it since time 0, and is not turned."""

    @property
    def topology(self) -> Topology:
        """What the session is made of. A frame that came with the answer of a call has none."""
        if self._topology is None:
            raise Error("a frame that comes with a step has no topology; frames of session.frames() have")
        return self._topology

    @cached_property
    def diagnostics(self) -> Diagnostics | None:
        """Diagnostics of the step that made the frame."""
        return None if self._diagnostics is None else read(Diagnostics, self._diagnostics)

    @cached_property
    def loads(self) -> dict[str, ColliderLoad]:
        """What each collider felt in the step that made the frame, by its name. Empty without colliders."""
        return {} if self.diagnostics is None else {load.name: load for load in self.diagnostics.loads}

    def body(self, name: str) -> BodyArrays:
        """The arrays of one body, as views."""
        return BodyArrays(self.topology.body(name), self.arrays)

    @property
    def bodies(self) -> tuple[BodyArrays, ...]:
        """All bodies, in the order of their particles."""
        return tuple(BodyArrays(body, self.arrays) for body in self.topology.bodies)

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """The triangles of all bodies (m, 3)."""
        return self.topology.triangles

    @property
    def pins(self) -> NDArray[np.uint32]:
        """The pinned particles of all bodies (m,)."""
        return self.topology.pins

    @property
    def uv(self) -> NDArray[np.float32]:
        """Texture coordinates of all particles (n, 2); not numbers where a body has none."""
        return self.topology.uv

    def __repr__(self) -> str:
        """What the frame is, in a line."""
        count = len(self.positions) if "positions" in self.arrays else 0
        return f"<nappe.Frame {self.number}: step {self.step}, {self.time:g} s, {count} particles>"

    def _repr_html_(self) -> str:
        cells = {"frame": self.number, "step": self.step, "time": f"{self.time:g} s", "arrays": ", ".join(self.fields)}
        rows = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in cells.items())
        return f"<table>{rows}</table>"


class FrameJoiner:
    """Puts the pieces of frames together: an array that came in one piece is not copied, any other once."""

    def __init__(self) -> None:
        """No topology has come yet."""
        self.topology: Topology | None = None
        self._pieces: list[Message] = []
        self._bytes = self._most = 0

    def begin(self, topology: Topology | None) -> None:
        """A stream begins, or begins anew: a frame in the making is void."""
        self.topology, self._pieces = topology, []
        self._most = _FRAME_BYTES + _PARTICLE_BYTES * (topology.particle_count if topology else 0)

    def add(self, piece: Message) -> Frame | None:
        """Takes the next piece; the frame when its last one has come."""
        if self.topology is None or self.topology.id != piece.topology_id:
            raise _broken(piece, f"it belongs to topology {piece.topology_id}, which did not come")
        index, count = place(piece)
        begun = self._pieces
        if begun and begun[0].frame != piece.frame:
            raise _broken(begun[0], f"it broke off after {len(begun)} pieces; frame {piece.frame} came")
        if index != len(begun) or index >= count or (begun and place(begun[0])[1] != count):
            raise _broken(piece, f"piece {index} of {count} came where piece {len(begun)} was next")
        self._bytes = piece.ByteSize() + (self._bytes if begun else 0)
        if self._bytes > self._most:
            raise _broken(piece, f"more than {self._most} bytes came, which is all that its particles and nodes take")
        begun.append(piece)
        if index + 1 < count:
            return None
        self._pieces = []
        return read_frame(begun, self.topology.particle_count, self.topology)


def read_frame(pieces: list[Message], particles: int, topology: Topology | None = None) -> Frame:
    """A frame from all of its pieces, in order."""
    if particles > MAX_PARTICLES:
        raise _broken(pieces[0], f"{particles} particles are announced; at most {MAX_PARTICLES} are held")
    if not math.isfinite(pieces[0].time_seconds):
        raise _broken(pieces[0], f"its time is {pieces[0].time_seconds} s")
    parts: dict[int, list[Message]] = {}
    for piece in pieces:
        for part in piece.fields:
            parts.setdefault(part.field, []).append(part)
    arrays = {}
    for known, part_list in parts.items():
        name = _NAMES.get(known)
        if name is not None:
            arrays[name] = _array(pieces[0], name, part_list, particles)
    return Frame(pieces[0], arrays, _grid(pieces), topology)


def _array(frame: Message, name: str, parts: list[Message], particles: int) -> Array:
    """An array from its parts, in order."""
    width, dtype = FIELDS[name], _TYPES.get(parts[0].encoding)
    if dtype is None:
        raise _broken(frame, f"its {name} have encoding {parts[0].encoding}, which is newer than this package")
    whole: Array | None = None if len(parts) == 1 else np.empty((particles, width), dtype)
    filled = 0
    flat: Array = np.empty(0, dtype)
    for part in parts:
        data = part.data
        element = width * dtype.itemsize
        if part.encoding != parts[0].encoding or len(data) % element:
            raise _broken(frame, f"{len(data)} bytes of its {name} are no whole particles of {element} bytes")
        flat = np.frombuffer(data, dtype).reshape(-1, width)
        end = filled + len(flat)
        if part.first_particle != filled or end > particles:
            raise _broken(frame, f"its {name} go on at particle {part.first_particle} of {particles}, not at {filled}")
        if not np.isfinite(flat).all():
            at = filled + int(np.argmin(np.isfinite(flat).all(axis=1)))
            raise _broken(frame, f"the {name} of particle {at} are not finite")
        if whole is not None:
            whole[filled:end] = flat
        filled = end
    if filled != particles:
        raise _broken(frame, f"its {name} cover {filled} of {particles} particles")
    array = flat if whole is None else whole
    array.setflags(write=False)
    return array if width > 1 else array.reshape(-1)


def _grid(pieces: list[Message]) -> Grid | None:
    """The nodes of the grid in all pieces of a frame."""
    parts = [piece.grid for piece in pieces if piece.HasField("grid")]
    if not parts:
        return None
    first = parts[0]
    head = (first.cell, first.stride, first.node_count)
    if any((part.cell, part.stride, part.node_count) != head for part in parts):
        raise _broken(pieces[0], "the pieces of its grid are of different grids")
    if not 0 < first.cell < math.inf or first.stride == 0:
        raise _broken(pieces[0], f"its grid has cells of {first.cell} m and stride {first.stride}")
    lengths = [(len(part.index_i32), len(part.mass_f32), len(part.velocity_f32)) for part in parts]
    nodes = sum(mass for _, mass, _ in lengths) // 4
    if any((12 * (mass // 4), mass % 4, 12 * (mass // 4)) != (index, 0, speed) for index, mass, speed in lengths):
        raise _broken(pieces[0], "index, mass and velocity of its grid are of different lengths")
    if nodes > min(MAX_GRID_NODES, first.node_count) or (first.stride == 1 and nodes != first.node_count):
        raise _broken(pieces[0], f"{nodes} nodes of its grid came, and {first.node_count} were announced")
    names = ("index_i32", "mass_f32", "velocity_f32", "force_f32")
    data = [b"".join(getattr(part, name) for part in parts) for name in names]
    if len(data[3]) not in (0, 12 * nodes):
        raise _broken(pieces[0], f"{len(data[3])} bytes of forces of its grid are no 12 for each of {nodes} nodes")
    masses = np.frombuffer(data[1], "<f4")
    velocities, forces = (np.frombuffer(bytes_, "<f4").reshape(-1, 3) for bytes_ in data[2:])
    if not (np.isfinite(masses).all() and (masses >= 0).all() and np.isfinite(velocities).all()):
        raise _broken(pieces[0], "a mass or a velocity of its grid is not finite, or a mass below 0")
    if not np.isfinite(forces).all():
        raise _broken(pieces[0], "a force of its grid is not finite")
    return Grid(first.cell, np.frombuffer(data[0], "<i4").reshape(-1, 3), masses, velocities, *head[1:], forces)


def _broken(frame: Message, what: str) -> Error:
    return Error(f"the server's stream does not decode: frame {frame.frame}: {what}")

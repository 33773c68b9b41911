"""What does not change from frame to frame: bodies, their triangles or springs, pins, colliders.

Enters: the topology of a stream, in pieces. Leaves: a Topology whose indices are all in range, so that a program can
follow them without looking.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._wire._colliders import Collider, read_colliders
from nappe._wire._contract import MESSAGES, Message, number
from nappe._wire._errors import Error

MAX_PARTICLES = 1 << 24
"""Most particles of a frame that this package agrees to hold."""
MAX_TOPOLOGY_BYTES = 192 << 20
"""Most bytes of all pieces of a topology together."""

_ARRAYS = ("triangles_u32", "springs_u32", "pins_u32", "uv_f32", "mass_f32", "volume_f32")
_MESH_ARRAYS = ("points_f32", "triangles_u32")
_ROLES = {number("BodyRole", "BODY_ROLE_CLOTH"): "cloth", number("BodyRole", "BODY_ROLE_FIGURE"): "figure"}


@dataclass(frozen=True, eq=False)
class Body:
    """One body of the scene, and which particles are its own."""

    name: str
    """Its name in the scene."""
    first_particle: int
    """Index of its first particle over all particles of the session."""
    particle_count: int
    """Its particles follow each other."""
    triangles: NDArray[np.uint32]
    """Triangles (m, 3): indices over all particles of the session."""
    springs: NDArray[np.uint32]
    """Springs (m, 2), only for a body without triangles: indices over all particles of the session."""
    pins: NDArray[np.uint32]
    """Pinned particles (m,): indices over all particles of the session."""
    uv: NDArray[np.float32]
    """Texture coordinates (n, 2), or (0, 2) when the mesh has none."""
    color: tuple[int, int, int] | None = None
    """Red, green and blue of sRGB, each 0 to 255, that the scene gives it; None: a viewer chooses."""
    masses: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, np.float32))
    """Masses of its particles (n,) (kg), or (0,) from an older server."""
    volumes: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, np.float32))
    """Volumes of its particles at rest (n,) (m³), or (0,) of cloth."""
    role: str = ""
    """`"cloth"`, or `"figure"`, which its frames lead and which is to be drawn as solids are; empty: an object of snow,
    or a body of an older server."""

    @property
    def particles(self) -> slice:
        """Its part of an array over all particles."""
        return slice(self.first_particle, self.first_particle + self.particle_count)


@dataclass(frozen=True, eq=False)
class Topology:
    """What a session is made of."""

    id: int
    """Number of the topology, which frames refer to."""
    particle_count: int
    """Number of particles in every frame."""
    bodies: tuple[Body, ...]
    """The bodies, in the order of their particles; together they hold every particle once."""
    colliders: tuple[Collider, ...]
    """The colliders, in the order of the scene."""
    packed: bytes = field(repr=False, default=b"")
    """The message that it was read from, in one piece."""

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """The triangles of all bodies (m, 3)."""
        return np.concatenate([np.zeros((0, 3), np.uint32), *(body.triangles for body in self.bodies)])

    @property
    def pins(self) -> NDArray[np.uint32]:
        """The pinned particles of all bodies (m,)."""
        return np.concatenate([np.zeros(0, np.uint32), *(body.pins for body in self.bodies)])

    @property
    def uv(self) -> NDArray[np.float32]:
        """Texture coordinates of all particles (n, 2); those of a body without any are not numbers."""
        uv = np.full((self.particle_count, 2), np.nan, np.float32)
        for body in self.bodies:
            if len(body.uv):
                uv[body.particles] = body.uv
        return uv

    def body(self, name: str) -> Body:
        """The body of this name; an error that lists the names, if there is none."""
        for body in self.bodies:
            if body.name == name:
                return body
        names = ", ".join(repr(body.name) for body in self.bodies)
        there = f"there are: {names}" if names else "there are none"
        raise Error(f"no body is called {name!r}; {there}")


class TopologyJoiner:
    """Puts the pieces of one topology together."""

    def __init__(self) -> None:
        """Nothing has come yet."""
        self._pieces: list[Message] = []
        self._bytes = 0

    def add(self, piece: Message) -> Topology | None:
        """Takes the next piece; the whole when its last one has come. Piece 0 begins anew."""
        index, count = place(piece)
        if index == 0:
            self._pieces, self._bytes = [], 0
        first = self._pieces[0] if self._pieces else piece
        same = (first.topology_id, first.particle_count, place(first)[1]) == (
            piece.topology_id,
            piece.particle_count,
            count,
        )
        if index != len(self._pieces) or index >= count or not same:
            raise _broken(f"piece {index} of {count} of the topology came where piece {len(self._pieces)} was next")
        self._bytes += piece.ByteSize()
        if self._bytes > MAX_TOPOLOGY_BYTES:
            raise _broken(f"a topology of more than {MAX_TOPOLOGY_BYTES} bytes came, which is all that is held")
        self._pieces.append(piece)
        if index + 1 < count:
            return None
        pieces, self._pieces = self._pieces, []
        return read_topology(_joined(pieces))


def place(message: Message) -> tuple[int, int]:
    """Position of a message among the pieces of the same whole, and how many there are."""
    return (message.chunk.index, message.chunk.count) if message.HasField("chunk") else (0, 1)


def read_topology(wire: Message) -> Topology:
    """Reads a whole topology, and checks every count and index."""
    count = wire.particle_count
    if count > MAX_PARTICLES:
        raise _broken(f"{count} particles are announced; at most {MAX_PARTICLES} are held")
    bodies: list[Body] = []
    held = 0
    for body in wire.bodies:
        if body.first_particle != held or body.particle_count > count - held:
            raise _broken(
                f"body {body.name!r} starts at particle {body.first_particle} and has {body.particle_count}, "
                f"where {held} is next of {count}"
            )
        bodies.append(_body(body))
        held += body.particle_count
    if held != count:
        raise _broken(f"the bodies hold {held} of {count} particles")
    colliders = read_colliders(wire.colliders)
    return Topology(wire.topology_id, count, tuple(bodies), colliders, wire.SerializeToString(deterministic=True))


def _body(wire: Message) -> Body:
    def unpacked(name: str, dtype: str, width: int) -> NDArray[Any]:
        data = getattr(wire, name)
        if len(data) % (4 * width):
            raise _broken(f"{name} of body {wire.name!r} take {len(data)} bytes, no multiple of {4 * width}")
        return np.frombuffer(data, dtype).reshape(-1, width)

    first, count = wire.first_particle, wire.particle_count
    lists = {name: unpacked(name, "<u4", width) for name, width in zip(_ARRAYS[:3], (3, 2, 1), strict=True)}
    for name, indices in lists.items():
        if indices.size and not first <= indices.min() <= indices.max() < first + count:
            outside = indices[(indices < first) | (indices >= first + count)][0]
            raise _broken(
                f"{name} of body {wire.name!r} name particle {outside}; allowed: {first} to {first + count - 1}"
            )
    uv = unpacked("uv_f32", "<f4", 2)
    if len(uv) not in (0, count):
        raise _broken(f"body {wire.name!r} has {len(uv)} texture coordinates for {count} particles")
    weights = {name: unpacked(name, "<f4", 1).reshape(-1) for name in _ARRAYS[4:]}
    for name, numbers in weights.items():
        if len(numbers) not in (0, count) or not (np.isfinite(numbers) & (numbers >= 0)).all():
            raise _broken(
                f"{name} of body {wire.name!r} has {len(numbers)} numbers for {count} particles, "
                "all of which have to be finite and 0 or more"
            )
    triangles, springs, pins = lists.values()
    masses, volumes = weights.values()
    role = _ROLES.get(wire.role, "")
    return Body(wire.name, first, count, triangles, springs, pins.reshape(-1), uv, _color(wire), masses, volumes, role)


def _color(wire: Message) -> tuple[int, int, int] | None:
    if not wire.HasField("color"):
        return None
    return wire.color >> 16 & 255, wire.color >> 8 & 255, wire.color & 255


def _joined(pieces: list[Message]) -> Message:
    """The whole: parts of a body have one first particle, those of a mesh one name, and stand one after the other."""
    whole = MESSAGES["Topology"]()
    whole.CopyFrom(pieces[0])
    for name in ("chunk", "bodies", "colliders"):
        whole.ClearField(name)
    for parts in _runs((body for piece in pieces for body in piece.bodies), _body_continues):
        body = whole.bodies.add()
        body.CopyFrom(parts[0])
        _put(body, _ARRAYS, parts)
    for parts in _runs((collider for piece in pieces for collider in piece.colliders), _mesh_continues):
        collider = whole.colliders.add()
        collider.CopyFrom(parts[0])
        if len(parts) > 1:
            _put(collider.mesh, _MESH_ARRAYS, [part.mesh for part in parts])
    return whole


def _body_continues(before: Message, part: Message) -> bool:
    return bool(before.first_particle == part.first_particle and before.name == part.name)


def _mesh_continues(before: Message, part: Message) -> bool:
    return bool(before.name == part.name and before.WhichOneof("shape") == part.WhichOneof("shape") == "mesh")


def _runs(parts: Iterable[Message], continues: Callable[[Message, Message], bool]) -> list[list[Message]]:
    """What follows each other and continues, together."""
    runs: list[list[Message]] = []
    for part in parts:
        if runs and continues(runs[-1][0], part):
            runs[-1].append(part)
        else:
            runs.append([part])
    return runs


def _put(whole: Message, names: tuple[str, ...], parts: list[Message]) -> None:
    for name in names:
        setattr(whole, name, b"".join(getattr(part, name) for part in parts))


def _broken(what: str) -> Error:
    return Error(f"the server's stream does not decode: {what}")

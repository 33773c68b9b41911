"""Topologies: bodies that continue over pieces are the joined whole; counts and indices that do not fit are refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import nappe
from nappe import v1
from nappe._wire import _topology
from nappe._wire._topology import TopologyJoiner

ARRAYS = ("triangles_u32", "springs_u32", "pins_u32", "uv_f32", "mass_f32", "volume_f32")


def packed(*numbers: float, dtype: str = "<u4") -> bytes:
    return np.array(numbers, dtype).tobytes()


def body(name: str = "sheet", first: int = 0, count: int = 4, **arrays: bytes) -> Any:
    return v1.BodyTopology(name=name, first_particle=first, particle_count=count, **arrays)


def piece(*bodies: Any, index: int = 0, count: int = 1, particles: int = 4, **other: Any) -> Any:
    told = {"topology_id": 7, "session_uid": "u-1", **other}
    return v1.Topology(particle_count=particles, bodies=bodies, chunk=v1.Chunk(index=index, count=count), **told)


def whole(*bodies: Any, **other: Any) -> Any:
    """A topology in one piece, without a place among pieces."""
    made = piece(*bodies, **other)
    made.ClearField("chunk")
    return made


def joined(*pieces: Any) -> nappe.Topology:
    """The topology that comes with the last piece, and not before."""
    joiner = TopologyJoiner()
    for before in pieces[:-1]:
        assert joiner.add(before) is None
    topology = joiner.add(pieces[-1])
    assert topology is not None
    return topology


def refusal(*pieces: Any) -> str:
    """What is said of the last piece."""
    joiner = TopologyJoiner()
    for before in pieces[:-1]:
        assert joiner.add(before) is None
    with pytest.raises(nappe.Error) as told:
        joiner.add(pieces[-1])
    assert str(told.value).startswith("the server's stream does not decode: ")
    return str(told.value)


def arrays_of(topology: nappe.Topology) -> list[tuple[Any, ...]]:
    """Everything of the bodies, to be compared."""
    arrays = ("triangles", "springs", "pins", "uv", "masses", "volumes")
    return [
        (body.name, body.first_particle, body.particle_count, *(getattr(body, name).tolist() for name in arrays))
        for body in topology.bodies
    ]


def full_bodies() -> list[Any]:
    """Cloth with everything, a chain of springs, snow with masses and volumes."""
    uv = packed(0, 0, 1, 0, 0, 0.5, 1, 0.5, dtype="<f4")
    cloth = body("flag", 0, 4, triangles_u32=packed(0, 1, 2, 1, 3, 2), pins_u32=packed(0, 3), uv_f32=uv)
    weights = {"mass_f32": packed(0.5, 0.25, dtype="<f4"), "volume_f32": packed(1.0, 2.0, dtype="<f4")}
    chain = body("chain", 4, 3, springs_u32=packed(4, 5, 5, 6), pins_u32=packed(4))
    return [cloth, chain, body("snow", 7, 2, **weights)]


def full() -> Any:
    return whole(*full_bodies(), particles=9)


def test_a_topology_in_one_piece_has_every_body_with_its_arrays() -> None:
    topology = joined(full())
    assert (topology.id, topology.particle_count, topology.colliders) == (7, 9, ())
    cloth, chain, snow = topology.bodies
    assert (cloth.name, cloth.particles, cloth.triangles.tolist()) == ("flag", slice(0, 4), [[0, 1, 2], [1, 3, 2]])
    assert cloth.uv.tolist() == [[0, 0], [1, 0], [0, 0.5], [1, 0.5]] and cloth.springs.shape == (0, 2)
    assert (chain.name, chain.springs.tolist(), chain.pins.tolist()) == ("chain", [[4, 5], [5, 6]], [4])
    assert (snow.particles, snow.triangles.shape, snow.pins.shape, snow.uv.shape) == (slice(7, 9), (0, 3), (0,), (0, 2))
    assert (snow.masses.tolist(), snow.volumes.tolist(), cloth.masses.shape) == ([0.5, 0.25], [1.0, 2.0], (0,))
    assert (cloth.triangles.dtype, cloth.uv.dtype) == (np.dtype("<u4"), np.dtype("<f4"))
    for array in (cloth.triangles, chain.springs, cloth.pins, cloth.uv):
        assert not array.flags.writeable


def test_a_topology_knows_its_bodies_by_name_and_what_they_have_together() -> None:
    topology = joined(full())
    assert topology.body("chain") is topology.bodies[1]
    assert topology.triangles.tolist() == [[0, 1, 2], [1, 3, 2]] and topology.pins.tolist() == [0, 3, 4]
    assert topology.uv[:4].tolist() == topology.bodies[0].uv.tolist() and np.isnan(topology.uv[4:]).all()
    assert topology.uv.shape == (9, 2)
    with pytest.raises(nappe.Error, match="no body is called 'sail'; there are: 'flag', 'chain', 'snow'"):
        topology.body("sail")


def test_a_topology_without_bodies_has_empty_arrays() -> None:
    topology = joined(whole(particles=0))
    assert (topology.triangles.shape, topology.pins.shape, topology.uv.shape) == ((0, 3), (0,), (0, 2))
    with pytest.raises(nappe.Error, match="no body is called 'sail'; there are none"):
        topology.body("sail")


def test_the_particles_and_triangles_of_a_body_in_a_frame_count_from_its_first() -> None:
    topology = joined(whole(body("a", 0, 1), body("b", 1, 3, triangles_u32=packed(1, 2, 3)), particles=4))
    positions = v1.FieldData(field=1, encoding=1, data=np.arange(12, dtype="<f4").tobytes())
    frame = nappe._wire._frames.read_frame([v1.Frame(fields=[positions], topology_id=7)], 4, topology)
    triangles = frame.body("b").triangles
    assert triangles.tolist() == [[0, 1, 2]] and frame.body("b").positions[triangles].shape == (1, 3, 3)
    assert frame.triangles.tolist() == [[1, 2, 3]] and frame.pins.tolist() == [] and np.isnan(frame.uv).all()
    assert frame.body("b").topology is topology.bodies[1] and frame.topology is topology


def cut(size: int) -> list[Any]:
    """The full topology in pieces: every array in parts of so many bytes, one body's part in each piece."""
    parts = []
    for of in full_bodies():
        longest = max(len(getattr(of, name)) for name in ARRAYS)
        for at in range(0, max(longest, 1), size):
            arrays = {name: getattr(of, name)[at : at + size] for name in ARRAYS}
            parts.append(body(of.name, of.first_particle, of.particle_count, **arrays))
    return [piece(part, index=at, count=len(parts), particles=9) for at, part in enumerate(parts)]


@pytest.mark.parametrize("size", [1, 4, 7, 16, 1000])
def test_bodies_that_continue_over_pieces_are_those_of_the_whole(size: int) -> None:
    pieces = cut(size)
    assert len(pieces) == sum(-(-longest // size) for longest in (32, 16, 8))
    topology, expected = joined(*pieces), joined(full())
    assert arrays_of(topology) == arrays_of(expected)
    assert topology.packed == expected.packed and v1.Topology.FromString(topology.packed) == full()


def test_pieces_with_several_bodies_continue_the_last_of_the_one_before() -> None:
    flag, chain, snow = full_bodies()
    one = body("chain", 4, 3, springs_u32=packed(4, 5), pins_u32=packed(4))
    two = body("chain", 4, 3, springs_u32=packed(5, 6))
    collider = v1.ColliderShape(name="ball", sphere=v1.SphereShape(radius=0.5))
    pieces = [
        piece(flag, one, index=0, count=2, particles=9, colliders=[collider]),
        piece(two, snow, index=1, count=2, particles=9),
    ]
    topology = joined(*pieces)
    assert arrays_of(topology) == arrays_of(joined(whole(flag, chain, snow, particles=9)))
    assert [collider.name for collider in topology.colliders] == ["ball"]
    # The pieces are still what came.
    assert pieces[0].bodies[1].springs_u32 == packed(4, 5)


def test_bodies_of_one_name_stay_two() -> None:
    topology = joined(piece(body("a", 0, 2), index=0, count=2), piece(body("a", 2, 2), index=1, count=2))
    assert [(one.name, one.first_particle) for one in topology.bodies] == [("a", 0), ("a", 2)]


def test_piece_0_begins_anew() -> None:
    joiner = TopologyJoiner()
    first, second, *rest = cut(16)
    assert joiner.add(first) is None and joiner.add(second) is None
    assert joiner.add(first) is None and joiner.add(second) is None
    topologies = [joiner.add(last) for last in rest]
    assert topologies[:-1] == [None] * (len(rest) - 1) and topologies[-1] is not None
    assert arrays_of(topologies[-1]) == arrays_of(joined(full()))
    assert joiner.add(full()) is not None


def test_pieces_out_of_order_or_of_different_topologies_are_refused() -> None:
    first = piece(count=3)
    assert "piece 1 of 2 of the topology came where piece 0 was next" in refusal(piece(index=1, count=2))
    assert "piece 2 of 3 of the topology came where piece 1 was next" in refusal(first, piece(index=2, count=3))
    assert "piece 1 of 4 " in refusal(first, piece(index=1, count=4))
    assert "piece 1 of 3 " in refusal(first, piece(index=1, count=3, topology_id=8))
    assert "piece 1 of 3 " in refusal(first, piece(index=1, count=3, particles=5))
    second = piece(index=1, count=3)
    assert "piece 1 of 3 of the topology came where piece 2 was next" in refusal(first, second, second)
    assert "piece 0 of 0 " in refusal(piece(count=0))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda t: setattr(t, "particle_count", 2**32 - 1), "4294967295 particles are announced; at most 16777216"),
        (lambda t: setattr(t, "particle_count", (1 << 24) + 1), "16777217 particles are announced"),
        (lambda t: setattr(t, "particle_count", 10), "the bodies hold 9 of 10 particles"),
        (lambda t: setattr(t, "particle_count", 8), "body 'snow' starts at particle 7 and has 2, where 7 is next of 8"),
        (
            lambda t: setattr(t.bodies[1], "first_particle", 3),
            "body 'chain' starts at particle 3 and has 3, where 4 is",
        ),
        (lambda t: setattr(t.bodies[1], "first_particle", 5), "body 'chain' starts at particle 5"),
        (
            lambda t: setattr(t.bodies[0], "particle_count", 2**32 - 1),
            "'flag' starts at particle 0 and has 4294967295",
        ),
        (lambda t: t.bodies.pop(1), "body 'snow' starts at particle 7 and has 2, where 4 is next of 9"),
        (lambda t: t.bodies.pop(), "the bodies hold 7 of 9 particles"),
        (
            lambda t: setattr(t.bodies[0], "triangles_u32", packed(0, 1, 4)),
            "triangles_u32 of body 'flag' name particle 4;",
        ),
        (lambda t: setattr(t.bodies[1], "springs_u32", packed(4, 3)), "springs_u32 of body 'chain' name particle 3;"),
        (lambda t: setattr(t.bodies[1], "springs_u32", packed(4, 7)), "particle 7; allowed: 4 to 6"),
        (
            lambda t: setattr(t.bodies[0], "pins_u32", packed(2**32 - 1)),
            "pins_u32 of body 'flag' name particle 4294967295",
        ),
        (lambda t: setattr(t.bodies[2], "pins_u32", packed(6)), "pins_u32 of body 'snow' name particle 6"),
        (lambda t: setattr(t.bodies[0], "triangles_u32", packed(0, 1)), "take 8 bytes, no multiple of 12"),
        (lambda t: setattr(t.bodies[1], "springs_u32", packed(4, 5, 6)), "take 12 bytes, no multiple of 8"),
        (lambda t: setattr(t.bodies[0], "pins_u32", b"\0\0\0"), "take 3 bytes, no multiple of 4"),
        (lambda t: setattr(t.bodies[0], "uv_f32", b"\0" * 33), "uv_f32 of body 'flag' take 33 bytes, no multiple of 8"),
        (lambda t: setattr(t.bodies[0], "uv_f32", b"\0" * 24), "body 'flag' has 3 texture coordinates for 4 particles"),
        (lambda t: setattr(t.bodies[0], "uv_f32", b"\0" * 40), "body 'flag' has 5 texture coordinates for 4 particles"),
        (
            lambda t: setattr(t.bodies[0], "mass_f32", b"\0" * 8),
            "mass_f32 of body 'flag' has 2 numbers for 4 particles",
        ),
        (
            lambda t: setattr(t.bodies[2], "volume_f32", packed(1.0, math.nan, dtype="<f4")),
            "volume_f32 of body 'snow' has 2 numbers for 2 particles, all of which have to be finite",
        ),
    ],
)
def test_a_topology_whose_counts_or_indices_do_not_fit_is_refused(change: Callable[[Any], None], told: str) -> None:
    topology = full()
    assert joined(topology).particle_count == 9
    change(topology)
    assert told in refusal(topology)


def test_a_body_without_particles_has_no_indices() -> None:
    assert len(joined(whole(body("none", 0, 0), body(), particles=4)).bodies) == 2
    assert "name particle 0" in refusal(whole(body("none", 0, 0, pins_u32=packed(0)), body(), particles=4))


def test_as_many_particles_as_are_held_are_taken() -> None:
    assert joined(whole(body("snow", 0, 1 << 24), particles=1 << 24)).particle_count == 1 << 24


def test_a_topology_of_too_many_bytes_is_refused_before_its_last_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _topology.MAX_TOPOLOGY_BYTES == 192 << 20
    monkeypatch.setattr(_topology, "MAX_TOPOLOGY_BYTES", 1000)
    large = [piece(body(pins_u32=packed(*[0] * 100)), index=at, count=4) for at in range(3)]
    assert "more than 1000 bytes" in refusal(*large)
    joiner = TopologyJoiner()
    for _ in range(5):
        # What was begun anew does not count.
        assert joiner.add(large[0]) is None and joiner.add(large[1]) is None
    assert joined(piece(body(pins_u32=packed(*[0] * 200)))).pins.size == 200


SHAPES: dict[str, tuple[Any, dict[str, Any]]] = {
    "plane": (v1.PlaneShape, {"point": (0, 1, 0), "normal": (0, 1, 0)}),
    "sphere": (v1.SphereShape, {"center": (1, 2, 3), "radius": 0.5}),
    "capsule": (v1.CapsuleShape, {"start": (0, 0, 0), "end": (0, 1, 0), "radius": 0.25}),
    "box": (v1.BoxShape, {"center": (1, 2, 3), "half_extent": (1, 2, 0.5), "axis_x": (1, 0, 0), "axis_y": (0, 0, 1)}),
    "cylinder": (v1.CylinderShape, {"start": (0, 0, 0), "end": (0, 1, 0), "radius": 0.25}),
    "half_pipe": (v1.HalfPipeShape, {"point": (0, 2, 0), "axis": (0, 0, 1), "up": (0, 1, 0), "radius": 2.0}),
}


def vector(components: tuple[float, float, float]) -> Any:
    return v1.Vector3(x=components[0], y=components[1], z=components[2])


def collider(kind: str, **other: Any) -> Any:
    """A collider of a kind, with other numbers than the good ones."""
    shape, numbers = SHAPES[kind]
    values = {name: vector(value) if isinstance(value, tuple) else value for name, value in (numbers | other).items()}
    return v1.ColliderShape(name="c", velocity=vector((0, 0, 0.5)), **{kind: shape(**values)})


@pytest.mark.parametrize("kind", SHAPES)
def test_a_collider_of_each_kind_comes_with_its_numbers(kind: str) -> None:
    (read,) = joined(whole(body(), colliders=[collider(kind)])).colliders
    assert (read.name, read.kind, read.velocity) == ("c", kind, (0.0, 0.0, 0.5))
    assert read.shape == SHAPES[kind][1]


def test_every_kind_of_the_contract_is_tested_and_colliders_keep_their_order() -> None:
    shapes = {field.name for field in v1.ColliderShape.DESCRIPTOR.oneofs_by_name["shape"].fields}
    assert shapes == {*SHAPES, "mesh"}
    topology = joined(whole(body(), colliders=[collider(kind) for kind in SHAPES]))
    assert [read.kind for read in topology.colliders] == list(SHAPES)


def test_a_collider_that_does_not_move_stands_and_an_absent_vector_is_0() -> None:
    still = v1.ColliderShape(name="ball", sphere=v1.SphereShape(radius=1.0))
    (read,) = joined(whole(body(), colliders=[still])).colliders
    assert read.velocity == (0.0, 0.0, 0.0) and read.shape == {"center": (0.0, 0.0, 0.0), "radius": 1.0}


def test_a_collider_of_a_newer_shape_is_left_out() -> None:
    newer = v1.ColliderShape(name="torus", velocity=vector((0, 0, 0)))
    topology = joined(whole(body(), colliders=[newer, collider("sphere")]))
    assert [read.kind for read in topology.colliders] == ["sphere"]


@pytest.mark.parametrize(
    ("kind", "other"),
    [
        ("sphere", {"radius": 0.0}),
        ("sphere", {"radius": -1.0}),
        ("sphere", {"radius": math.nan}),
        ("capsule", {"radius": math.inf}),
        ("sphere", {"center": (0, math.nan, 0)}),
        ("plane", {"normal": (0, 0, 0)}),
        ("plane", {"normal": (0, 2, 0)}),
        ("box", {"half_extent": (1, 0, 1)}),
        ("box", {"axis_y": (1, 0, 0)}),
        ("cylinder", {"end": (0, 0, 0)}),
        ("half_pipe", {"up": (0, 0, 1)}),
    ],
    ids=str,
)
def test_a_collider_that_cannot_be_drawn_is_refused_as_by_the_client_in_rust(kind: str, other: dict[str, Any]) -> None:
    assert "collider 'c'" in refusal(whole(body(), colliders=[collider(kind, **other)]))


POINTS = (0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)
TRIANGLES = (0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2)


def mesh(points: bytes | None = None, triangles: bytes | None = None, name: str = "c") -> Any:
    """A mesh collider of a tetrahedron, with these arrays in place of its own."""
    points_f32 = packed(*POINTS, dtype="<f4") if points is None else points
    triangles_u32 = packed(*TRIANGLES) if triangles is None else triangles
    shape = v1.MeshShape(points_f32=points_f32, triangles_u32=triangles_u32, origin=vector((1, 2, 3)))
    return v1.ColliderShape(name=name, velocity=vector((0, 0, 0.5)), mesh=shape)


def test_a_mesh_comes_with_its_arrays() -> None:
    (read,) = joined(whole(body(), colliders=[mesh()])).colliders
    assert (read.name, read.kind, read.velocity) == ("c", "mesh", (0, 0, 0.5))
    assert read.shape.keys() == {"points", "triangles", "origin"} and read.shape["origin"] == (1, 2, 3)
    points, triangles = read.shape["points"], read.shape["triangles"]
    assert isinstance(points, np.ndarray) and isinstance(triangles, np.ndarray)
    assert (points.dtype, triangles.dtype) == (np.dtype("<f4"), np.dtype("<u4"))
    assert (points.reshape(-1).tolist(), triangles.reshape(-1).tolist()) == (list(POINTS), list(TRIANGLES))
    assert points.shape == triangles.shape == (4, 3) and not points.flags.writeable


@pytest.mark.parametrize("size", [1, 7, 12, 48])
def test_a_mesh_that_continues_over_pieces_is_that_of_the_whole(size: int) -> None:
    arrays = mesh().mesh
    starts = range(0, 48, size)
    parts = [mesh(arrays.points_f32[at : at + size], arrays.triangles_u32[at : at + size]) for at in starts]
    other = [collider("box"), mesh(name="d")]
    pieces = [piece(index=at, count=len(parts) + 1, colliders=[part]) for at, part in enumerate(parts)]
    pieces[0].colliders.insert(0, collider("plane"))
    pieces.append(piece(body(), index=len(parts), count=len(parts) + 1, colliders=other))
    topology = joined(*pieces)
    expected = joined(whole(body(), colliders=[collider("plane"), mesh(), *other]))
    assert topology.colliders == expected.colliders and topology.packed == expected.packed
    assert [(read.name, read.kind) for read in topology.colliders] == [
        ("c", "plane"), ("c", "mesh"), ("c", "box"), ("d", "mesh"),
    ]  # fmt: skip
    # Colliders with other numbers are others.
    changed = joined(whole(body(), colliders=[mesh(packed(*reversed(POINTS), dtype="<f4"))])).colliders
    assert changed[0] != expected.colliders[1] and expected.colliders[0] != expected.colliders[1]


@pytest.mark.parametrize(
    ("colliders", "words"),
    [
        ([mesh(points=packed(*POINTS[:-1], math.nan, dtype="<f4"))], "not finite"),
        ([mesh(triangles=packed(0, 1, 4))], "names a point that is not there"),
        ([mesh(points=b"")], "names a point that is not there"),
        ([mesh(triangles=packed(0, 1))], "no whole number of points and triangles"),
        ([mesh(points=bytes(49))], "no whole number of points and triangles"),
        ([mesh(triangles=b"")], "no triangles"),
        ([mesh(), mesh(name="d"), mesh()], "go on behind another collider"),
        ([v1.ColliderShape(name="c", velocity=vector((math.inf, 0, 0)), mesh=mesh().mesh)], "not finite"),
    ],
    ids=str,
)
def test_a_mesh_that_cannot_be_drawn_is_refused(colliders: list[Any], words: str) -> None:
    told = refusal(whole(body(), colliders=colliders))
    assert "collider 'c': " in told and words in told

"""What the joiners accept comes back as it was sent, whatever the pieces; what they refuse, they name."""

from __future__ import annotations

import math
import re
import tracemalloc
from typing import Any

import numpy as np
import pytest

import nappe
from nappe import v1
from nappe._wire import _frames
from nappe._wire._frames import FrameJoiner, read_frame
from nappe._wire._topology import read_topology

F32, F64 = v1.ENCODING_RAW_F32, v1.ENCODING_RAW_F64
TWO_POINTS = [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]


def part(values: Any, *, field: str = "POSITIONS", dtype: str = "<f4", first: int = 0, **other: Any) -> Any:
    """One field, or one piece of it."""
    known = {"data": np.asarray(values, dtype).tobytes(), "encoding": F32 if dtype == "<f4" else F64, **other}
    return v1.FieldData(**{"field": getattr(v1, f"FIELD_{field}"), "first_particle": first, **known})


def piece(*parts: Any, index: int = 0, count: int = 1, **other: Any) -> Any:
    """A frame, or one piece of it, as it comes from the wire."""
    told = {"frame": 3, "step": 12, "time_seconds": 0.5, "topology_id": 7, **other}
    made = v1.Frame(fields=parts, chunk=v1.Chunk(index=index, count=count), **told)
    return v1.Frame.FromString(made.SerializeToString())


def halves() -> list[Any]:
    """Two particles, one a piece."""
    return [piece(part(point, first=at), index=at, count=2) for at, point in enumerate(TWO_POINTS)]


def sheet(particles: int, **other: Any) -> Any:
    """A topology with two bodies, the first of one particle."""
    counts = [count for count in (min(particles, 1), particles - 1) if count > 0]
    bodies = [
        v1.BodyTopology(name=name, first_particle=first, particle_count=count)
        for name, first, count in zip(("bob", "sheet"), (0, 1), counts, strict=False)
    ]
    return v1.Topology(topology_id=7, particle_count=particles, bodies=bodies, **other)


def joiner(particles: int = 2) -> FrameJoiner:
    made = FrameJoiner()
    made.begin(read_topology(sheet(particles)))
    return made


def join(*pieces: Any, particles: int = 2) -> nappe.Frame:
    """The frame that comes with the last piece, and not before."""
    whole = joiner(particles)
    for before in pieces[:-1]:
        assert whole.add(before) is None
    frame = whole.add(pieces[-1])
    assert frame is not None
    return frame


def refusal(*pieces: Any, particles: int = 2) -> str:
    """What is said of the last piece."""
    whole = joiner(particles)
    for before in pieces[:-1]:
        assert whole.add(before) is None
    with pytest.raises(nappe.Error) as told:
        whole.add(pieces[-1])
    assert told.value.reason is None and not told.value.is_transient
    assert str(told.value).startswith(f"the server's stream does not decode: frame {pieces[0].frame}: ")
    return str(told.value)


def owner(array: Any) -> Any:
    """What holds the memory of an array."""
    held = array
    while isinstance(held, np.ndarray) and held.base is not None:
        held = held.base
    return held


def test_a_frame_in_two_pieces_comes_with_the_last() -> None:
    frame = join(*halves())
    assert (frame.number, frame.step, frame.time, frame.fields) == (3, 12, 0.5, ("positions",))
    assert frame.positions.tolist() == TWO_POINTS


def test_an_array_in_one_piece_is_not_copied_and_cannot_be_written() -> None:
    frame = join(piece(part(TWO_POINTS), part(TWO_POINTS, field="VELOCITIES", dtype="<f8")))
    for array, size in ((frame.positions, 24), (frame.velocities, 48)):
        assert type(owner(array)) is bytes and len(owner(array)) == size
        assert not array.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_an_array_in_several_pieces_is_copied_once_and_cannot_be_written() -> None:
    points = np.arange(3 * 80_000, dtype="<f4").reshape(-1, 3)
    pieces = [
        piece(part(points[at::][:10_000], first=at), index=at // 10_000, count=8) for at in range(0, 80_000, 10_000)
    ]
    tracemalloc.start()
    frame = join(*pieces, particles=80_000)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 1.5 * points.nbytes
    assert np.array_equal(frame.positions, points)
    held = owner(frame.positions)
    assert isinstance(held, np.ndarray) and held.nbytes == points.nbytes
    assert not frame.positions.flags.writeable and frame.positions.flags.c_contiguous


@pytest.mark.parametrize("dtype", ["<f4", "<f8"])
@pytest.mark.parametrize("cut", [None, 0, 1, 2, 3])
def test_arrays_of_both_precisions_come_back_bit_by_bit_however_they_are_cut(dtype: str, cut: int | None) -> None:
    points = np.array([[0.1, -2.5, 1e-30], [3e8, -0.0, math.pi], [1, 2, 3]], dtype)
    ratios, stresses = np.array([1.0, 0.97, 1e-3], dtype), np.array([0.0, 1e7, 0.1], dtype)
    sent = {"POSITIONS": points, "VELOCITIES": -points, "PLASTIC_RATIO": ratios, "STRESS_NORM": stresses}
    sent |= {"FORCES": 2 * points, "ACCELERATIONS": -3 * points}
    ends = [(0, 3)] if cut is None else [(0, cut), (cut, 3)]
    pieces = [
        piece(
            *(part(array[a:b], field=name, dtype=dtype, first=a) for name, array in sent.items()),
            index=at,
            count=len(ends),
        )
        for at, (a, b) in enumerate(ends)
    ]
    frame = join(*pieces, particles=3)
    assert frame.fields == ("positions", "velocities", "plastic_ratio", "stress", "force", "acceleration")
    for name, array in zip(frame.fields, sent.values(), strict=True):
        got = getattr(frame, name)
        assert (got.dtype, got.shape, got.tobytes()) == (np.dtype(dtype), array.shape, array.tobytes())
        assert not got.flags.writeable


def test_a_packing_that_is_not_told_is_that_of_32_bits() -> None:
    assert join(piece(part(TWO_POINTS, encoding=v1.ENCODING_UNSPECIFIED))).positions.dtype == np.dtype("<f4")


def test_an_array_that_was_not_asked_for_is_named_with_what_to_do() -> None:
    frame = join(piece(part(TWO_POINTS)))
    for name in ("velocities", "plastic_ratio", "stress", "force", "acceleration"):
        with pytest.raises(nappe.Error, match=rf"no {name}.*fields=\('{name}'"):
            getattr(frame, name)


def test_what_a_newer_server_adds_is_passed_over() -> None:
    frame = join(piece(part(TWO_POINTS), v1.FieldData(field=77, encoding=99, data=b"\1\2\3", first_particle=9)))
    assert frame.fields == ("positions",) and frame.positions.tolist() == TWO_POINTS
    # Field 1000 of the message, a number.
    newer = v1.Frame.FromString(piece(part(TWO_POINTS)).SerializeToString() + b"\xc0\x3e\x01")
    assert join(newer).positions.tolist() == TWO_POINTS


def test_a_packing_that_is_unknown_or_changes_within_a_frame_is_refused() -> None:
    assert "positions have encoding 99" in refusal(piece(part(TWO_POINTS, encoding=99)))
    point = TWO_POINTS[0]
    for other in (part(point, dtype="<f8", first=1), part([point, point], first=1, encoding=F64)):
        assert "positions" in refusal(piece(part(point), other), particles=3)


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        (
            [v1.FieldData(field=1, encoding=1, data=b"\0" * 13)],
            "13 bytes of its positions are no whole particles of 12",
        ),
        ([part(TWO_POINTS[0])], "positions cover 1 of 2 particles"),
        ([part([])], "positions cover 0 of 2 particles"),
        ([part(np.zeros(9))], "positions go on at particle 0 of 2, not at 0"),
        ([part(TWO_POINTS[0], first=1)], "positions go on at particle 1 of 2, not at 0"),
        ([part(TWO_POINTS[0]), part(TWO_POINTS[0])], "positions go on at particle 0 of 2, not at 1"),
        ([part(TWO_POINTS), part(TWO_POINTS[1], first=1)], "positions go on at particle 1 of 2, not at 2"),
        ([part(TWO_POINTS[1], first=1), part(TWO_POINTS[0])], "positions go on at particle 1 of 2, not at 0"),
        ([part(TWO_POINTS[0], first=2**32 - 1)], "positions go on at particle 4294967295 of 2, not at 0"),
        ([part(TWO_POINTS), part([1.0], field="STRESS_NORM")], "stress cover 1 of 2 particles"),
    ],
)
def test_arrays_of_a_wrong_size_are_refused(parts: list[Any], told: str) -> None:
    assert told in refusal(piece(*parts))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("dtype", ["<f4", "<f8"])
def test_values_that_are_not_finite_are_refused_with_their_particle(value: float, dtype: str) -> None:
    bad = part([0.0, value, 0.0], dtype=dtype, first=1)
    assert "the positions of particle 1 are not finite" in refusal(piece(part(TWO_POINTS[0], dtype=dtype), bad))
    later = piece(part([0.0, 0.0, value], dtype=dtype, first=1), index=1, count=2)
    assert "particle 1 " in refusal(piece(part(TWO_POINTS[0], dtype=dtype), count=2), later)
    stress = part([0.0, 0.0, value, value], dtype=dtype, field="STRESS_NORM")
    assert "the stress of particle 2 are not finite" in refusal(piece(part(np.zeros(12)), stress), particles=4)


@pytest.mark.parametrize("time", [math.nan, math.inf])
def test_a_time_that_is_not_finite_is_refused(time: float) -> None:
    assert "time" in refusal(piece(part(TWO_POINTS), time_seconds=time))


def test_pieces_out_of_order_are_refused() -> None:
    first, last = halves()
    assert "piece 1 of 2 came where piece 0 was next" in refusal(last)
    assert "piece 0 of 2 came where piece 1 was next" in refusal(first, first)
    assert "piece 1 of 3 came where piece 1 was next" in refusal(first, piece(index=1, count=3))
    assert "piece 2 of 3 came where piece 1 was next" in refusal(piece(count=3), piece(index=2, count=3))
    assert "piece 0 of 0 came" in refusal(piece(part(TWO_POINTS), count=0))
    assert "piece 4 of 2 came" in refusal(piece(part(TWO_POINTS), index=4, count=2))


def test_a_piece_that_comes_after_its_frame_is_refused() -> None:
    whole = joiner()
    first, last = halves()
    assert whole.add(first) is None and whole.add(last) is not None
    with pytest.raises(nappe.Error, match="piece 1 of 2 came where piece 0 was next"):
        whole.add(last)


def test_a_frame_that_breaks_off_is_named() -> None:
    whole = joiner()
    whole.add(halves()[0])
    with pytest.raises(nappe.Error, match="frame 3: it broke off after 1 pieces; frame 4 came"):
        whole.add(piece(part(TWO_POINTS), frame=4))


def test_a_stream_that_begins_anew_voids_the_frame_in_the_making() -> None:
    whole = joiner()
    whole.add(halves()[0])
    whole.begin(whole.topology)
    frame = whole.add(piece(part(TWO_POINTS), frame=4))
    assert frame is not None and frame.number == 4


def test_a_frame_needs_its_topology() -> None:
    with pytest.raises(nappe.Error, match="frame 3: it belongs to topology 7, which did not come"):
        FrameJoiner().add(piece(part(TWO_POINTS)))
    assert "topology 8, which did not come" in refusal(piece(part(TWO_POINTS), topology_id=8))


def test_a_frame_of_no_particles_is_a_frame() -> None:
    frame = join(piece(part([])), particles=0)
    assert frame.positions.shape == (0, 3) and "0 particles" in repr(frame)


def test_a_frame_tells_its_hash_what_was_dropped_and_its_diagnostics() -> None:
    bare = join(piece(part(TWO_POINTS)))
    assert (bare.state_hash, bare.dropped, bare.diagnostics, bare.grid) == (None, 0, None, None)
    known = {"state_hash": 2**64 - 1, "dropped_count": 4, "diagnostics": v1.Diagnostics(step=12, kinetic_energy=0.5)}
    told = join(piece(part(TWO_POINTS[0]), count=2, **known), piece(part(TWO_POINTS[1], first=1), index=1, count=2))
    assert (told.state_hash, told.dropped) == ("f" * 16, 4)
    assert told.diagnostics is not None and told.diagnostics.kinetic_energy == 0.5
    assert join(piece(part(TWO_POINTS), state_hash=10)).state_hash == "000000000000000a"
    assert repr(bare) == "<nappe.Frame 3: step 12, 0.5 s, 2 particles>" and "positions" in bare._repr_html_()


def test_the_arrays_of_a_body_are_views_of_those_of_the_frame() -> None:
    frame = join(piece(part(np.arange(12.0)), part(np.arange(4.0), field="STRESS_NORM")), particles=4)
    bob, cloth = frame.bodies
    assert (bob.name, cloth.name, cloth.fields) == ("bob", "sheet", ("positions", "stress"))
    assert bob.positions.tolist() == [[0, 1, 2]] and cloth.stress.tolist() == [1, 2, 3]
    assert np.array_equal(frame.body("sheet").positions, frame.positions[1:])
    for body in (bob, cloth, frame.body("sheet")):
        assert np.shares_memory(body.positions, frame.positions) and not body.positions.flags.writeable
    with pytest.raises(nappe.Error, match="no velocities"):
        _ = cloth.velocities


def test_a_body_that_does_not_exist_is_refused_with_those_that_do() -> None:
    frame = join(piece(part(TWO_POINTS)))
    for name in ("flag", "", "Sheet"):
        with pytest.raises(nappe.Error, match=re.escape(f"no body is called {name!r}; there are: 'bob', 'sheet'")):
            frame.body(name)


def test_a_frame_that_comes_with_a_step_has_no_topology_and_says_so() -> None:
    frame = read_frame([piece(part(TWO_POINTS))], 2)
    assert frame.positions.tolist() == TWO_POINTS
    with pytest.raises(nappe.Error, match="no topology"):
        _ = frame.topology
    with pytest.raises(nappe.Error, match="cover 2 of 3 particles"):
        read_frame([piece(part(TWO_POINTS))], 3)


def grid(nodes: int = 2, at: int = 0, **other: Any) -> Any:
    """Nodes `at`, `at + 1`, ... of a grid, as a piece of it."""
    numbers = np.arange(at, at + nodes)
    indices, speeds = np.column_stack([numbers, -numbers, 0 * numbers]), np.repeat(numbers / 2, 3)
    arrays = {"index_i32": indices.astype("<i4"), "mass_f32": numbers.astype("<f4")}
    arrays["velocity_f32"] = speeds.astype("<f4")
    packed = {name: array.tobytes() for name, array in arrays.items()}
    return v1.GridField(**{"cell": 0.25, "stride": 1, "node_count": 2, **packed, **other})


def with_grid(*grids: Any) -> list[Any]:
    """A frame whose pieces have these pieces of a grid; its positions are in the first."""
    count = len(grids)
    return [piece(*[part(TWO_POINTS)][at:], index=at, count=count, grid=part_of) for at, part_of in enumerate(grids)]


def test_a_grid_in_pieces_is_joined_and_cannot_be_written() -> None:
    for pieces in (
        [grid(3, node_count=3)],
        [grid(1, 0, node_count=3), grid(0, node_count=3), grid(2, 1, node_count=3)],
    ):
        nodes = join(*with_grid(*pieces)).grid
        assert nodes is not None and (nodes.cell, nodes.stride, nodes.node_count) == (0.25, 1, 3)
        assert nodes.indices.tolist() == [[0, 0, 0], [1, -1, 0], [2, -2, 0]]
        assert nodes.masses.tolist() == [0, 1, 2] and nodes.velocities.tolist() == [[0] * 3, [0.5] * 3, [1] * 3]
        assert nodes.positions.tolist() == [[0, 0, 0], [0.25, -0.25, 0], [0.5, -0.5, 0]]
        for array in (nodes.indices, nodes.masses, nodes.velocities):
            assert not array.flags.writeable


def test_a_grid_may_begin_in_a_later_piece_be_empty_or_be_thinned() -> None:
    later = [piece(part(TWO_POINTS), count=2), piece(index=1, count=2, grid=grid())]
    nodes = join(*later).grid
    assert nodes is not None and len(nodes.masses) == 2
    empty = join(*with_grid(grid(0, node_count=0))).grid
    assert empty is not None and empty.indices.shape == (0, 3) and empty.positions.shape == (0, 3)
    thinned = join(*with_grid(grid(2, stride=4, node_count=500))).grid
    assert thinned is not None and (thinned.stride, thinned.node_count, len(thinned.masses)) == (4, 500, 2)


@pytest.mark.parametrize(
    "other",
    [
        {"cell": 0.0},
        {"cell": -0.25},
        {"cell": math.nan},
        {"cell": math.inf},
        {"stride": 0},
        {"index_i32": b"\0" * 12},
        {"index_i32": b"\0" * 25},
        {"mass_f32": b"\0" * 4},
        {"mass_f32": b"\0" * 9},
        {"velocity_f32": b"\0" * 12},
        {"velocity_f32": b""},
        {"node_count": 1},
        {"node_count": 3},
        {"node_count": 1, "stride": 2},
        {"mass_f32": np.array([1, math.nan], "<f4").tobytes()},
        {"mass_f32": np.array([math.inf, 1], "<f4").tobytes()},
        {"mass_f32": np.array([1, -1], "<f4").tobytes()},
        {"velocity_f32": np.array([0, 0, 0, 0, 0, -math.inf], "<f4").tobytes()},
    ],
    ids=repr,
)
def test_a_grid_that_does_not_hold_together_is_refused(other: dict[str, Any]) -> None:
    assert "grid" in refusal(*with_grid(grid(**other)))


@pytest.mark.parametrize("other", [{"cell": 0.5}, {"stride": 2}, {"node_count": 5}])
def test_a_grid_whose_head_changes_within_a_frame_is_refused(other: dict[str, Any]) -> None:
    assert "different grids" in refusal(*with_grid(grid(1, node_count=4), grid(1, **{"node_count": 4, **other})))


def test_arrays_of_a_grid_that_fit_only_over_all_pieces_are_refused() -> None:
    one, two = grid(2, node_count=3), grid(1, 2, node_count=3)
    one.mass_f32, two.mass_f32 = one.mass_f32[:4], two.mass_f32 + one.mass_f32[:4]
    assert "different lengths" in refusal(*with_grid(one, two))


def test_forces_on_nodes_come_for_all_of_them_or_for_none() -> None:
    forces = np.arange(6, dtype="<f4")
    forced = join(*with_grid(grid(force_f32=forces.tobytes()))).grid
    assert forced is not None and forced.forces.tolist() == [[0, 1, 2], [3, 4, 5]]
    plain = join(*with_grid(grid())).grid
    assert plain is not None and plain.forces.shape == (0, 3)
    assert "12 bytes of forces" in refusal(*with_grid(grid(force_f32=forces[:3].tobytes())))
    forces[4] = math.nan
    assert "a force of its grid is not finite" in refusal(*with_grid(grid(force_f32=forces.tobytes())))


def test_a_grid_of_more_nodes_than_are_held_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _frames.MAX_GRID_NODES == 1 << 22
    monkeypatch.setattr(_frames, "MAX_GRID_NODES", 2)
    assert join(*with_grid(grid())).grid is not None
    assert "3 nodes" in refusal(*with_grid(grid(3, node_count=3)))
    assert "grid" in refusal(*with_grid(grid(3, stride=2, node_count=30)))


@pytest.mark.parametrize(
    "beyond",
    [piece(part(np.zeros(900)), count=9), piece(count=9, grid=grid(300, node_count=300))],
    ids=["array", "grid"],
)
def test_what_is_beyond_a_frame_is_refused_before_its_last_piece(beyond: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_frames, "_FRAME_BYTES", 0)
    with pytest.raises(nappe.Error, match=r"frame 3: more than \d+ bytes came"):
        joiner().add(beyond)

"""The example that makes a garment: its distance from the figure, its edges, its openings, and what a server says."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

import nappe
from nappe.examples import tunic

# Around the walker that comes with nappe, before it moves.
SCENE = """
version = 1
dt = 0.005

[contact]
friction = 0.3

[[body]]
name = "garment"
mesh = { file = "tunic.obj" }
mass = { density = 0.2 }
thickness = 0.004
springs = { stretch = { stiffness = 600, damping = 0.05 }, bend = { stiffness = 3, damping = 0.002 } }

[[figure]]
name = "walker"
mesh = { upload = "walker" }
thickness = 0.004
frames = { upload = "walker", rate = 30 }
start = 1.0
"""


def box(size: tuple[float, float, float]) -> tuple[tunic.Numbers, tunic.Indices]:
    """A box around the origin that stands on the ground, two triangles for each side."""
    points = np.array(list(product((0, 1), repeat=3)), float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))]
    return (points - [0.5, 0, 0.5]) * size, np.array(triangles)


def edges(faces: tunic.Indices) -> tuple[tunic.Indices, tunic.Indices]:
    """The edges of triangles, and how many triangles each has."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert len(np.unique(sides, axis=0)) == len(sides), "all triangles are turned the same way"
    found, counts = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    return found, counts


def test_distances_are_those_from_the_plane_an_edge_and_a_corner() -> None:
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    points = np.array([[0.2, 0.2, 0.5], [0.5, -2.0, 0.0], [4.0, 0.0, 4.0], [1.0, 1.0, 0.0]])
    np.testing.assert_allclose(tunic.distances(points, triangle), [0.5, 2.0, 5.0, np.sqrt(0.5)])


def test_a_garment_is_a_tube_that_lies_off_the_figure_and_has_no_short_edges() -> None:
    gap, cell = 0.016, 0.018
    points, triangles = box((0.3, 0.6, 0.2))
    places, faces = tunic.garment(points, triangles, gap, cell, (0.1, 0.5, 1.0))
    assert places[:, 1].min() > 0.1 and places[:, 1].max() < 0.5
    found, counts = edges(faces)
    assert set(counts.tolist()) == {1, 2}
    assert len(places) - len(found) + len(faces) == 0, "a tube has two openings"
    lengths = np.linalg.norm(places[found[:, 0]] - places[found[:, 1]], axis=1)
    assert lengths.min() > cell / 2 - 1e-12

    away = np.min([tunic.distances(places, corners) for corners in points[triangles]], axis=0)
    # A point is moved within its cell by a quarter of it along each axis at most.
    most = np.sqrt(3) * cell / 4
    assert away.min() > gap - most and away.max() < gap + most + 0.5 * cell
    middle = tunic.garment(points, triangles, gap, cell, (-1.0, 2.0, 1.0))
    assert set(edges(middle[1])[1].tolist()) == {2}, "nothing is cut"


def test_a_garment_around_the_walker_is_taken_by_a_server(server: nappe.Server, tmp_path: Path) -> None:
    assert server.process is not None
    out, token = str(tmp_path / "tunic.obj"), str(server.process.token_file)
    tunic.main(["--server", server.address, "--token-file", token, "--out", out])
    read, faces = tunic.read_obj(tmp_path / "tunic.obj")
    assert len(read) > 2000 and set(edges(faces)[1].tolist()) == {1, 2}
    (tmp_path / "scene.toml").write_text(SCENE)
    with server.create(tmp_path / "scene.toml") as session:
        frame = session.step(4, frame=True)
        assert frame.diagnostics is not None and frame.diagnostics.surface is not None
        assert frame.diagnostics.surface.failed == 0


def test_the_corners_of_a_figure_are_those_of_its_frames(server: nappe.Server, tmp_path: Path) -> None:
    tmp_path.joinpath("tunic.obj").write_text("v 5 0 0\nv 5.1 0 0\nv 5 0.1 0\nf 1 2 3\n")
    (tmp_path / "scene.toml").write_text(SCENE.replace("start = 1.0\n", ""))
    with server.create(tmp_path / "scene.toml", precision="f64") as session:
        run = session.trajectory(stop=20, precision="f64")
    figure = run.body("walker")
    assert [body.role for body in run.topology.bodies] == ["cloth", "figure"]
    np.testing.assert_allclose(run.time[[0, -1]], [0.0, 0.1])
    # The last one is three frames of the file later, which has binary32; the arms are lower there.
    first, last = figure.positions[0], figure.positions[-1]
    for places in (first, last):
        np.testing.assert_allclose(places, places.astype(np.float32), rtol=0, atol=1e-12)
    assert np.abs(last - first).max() > 0.01

"""Frames say where colliders are that keys or calls move; a page keeps it, and what no collider can have is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_frames import halves, join, refusal
from test_moving import TURN, quaternion
from test_requests import vector
from test_saving import elements, tetrahedron, trajectory

import nappe
from nappe import v1

# A sheet above a box that turns by 90 degrees about y and rises by 0.1 m in 20 frames, beside a ball that only moves.
SCENE = """
version = 1
dt = 0.01
frame_interval = 1
precision = "f64"

[[body]]
name = "sheet"
mesh = { grid = [6, 6], spacing = 0.1 }
mass = { density = 0.2 }
pins = ["top_left", "top_right"]
springs = { stretch = { stiffness = 50, damping = 0.02 }, shear = { stiffness = 20, damping = 0.01 } }

[[collider]]
name = "box"
box = { center = [0.25, -0.5, 0.3], size = [0.3, 0.1, 0.3] }

[[collider.key]]
time = 0.0
position = [0.25, -0.5, 0.3]

[[collider.key]]
time = 0.2
position = [0.25, -0.4, 0.3]
turn = [0, 1, 0, 1]

[[collider]]
name = "ball"
sphere = { center = [0, -2, 0], radius = 0.2 }
velocity = [0, 0, 0.5]
"""


def pose(name: str, x: float, turn: Any = TURN) -> Any:
    return v1.ColliderPose(name=name, position=vector(x, 2, 3), turn=quaternion(*turn))


def posed(*poses: Any) -> list[Any]:
    """A frame in two pieces, of which the first has poses."""
    first, last = halves()
    first.poses.extend(poses)
    return [first, last]


def test_poses_come_by_name_with_the_first_piece() -> None:
    assert join(*posed(pose("box", 1), pose("lid", 4))).poses == {"box": ((1, 2, 3), TURN), "lid": ((4, 2, 3), TURN)}
    assert join(*halves()).poses == {}


@pytest.mark.parametrize(
    ("poses", "told"),
    [
        ([pose("box", 1), pose("box", 1)], "twice"),
        ([pose("box", math.nan)], "not finite"),
        ([pose("box", 1, (0, 0, 0, 0))], "length 1"),
        ([pose("box", 1, (0, 0, 0, 1 + 2e-6))], "length 1"),
        ([pose("box", 1, (math.nan, 0, 0, 1))], "length 1"),
    ],
)
def test_a_pose_that_no_collider_can_have_is_refused(poses: list[Any], told: str) -> None:
    message = refusal(*posed(*poses))
    assert "'box'" in message and told in message


def test_a_page_has_the_poses_of_each_frame_and_the_point_about_which_a_mesh_turns() -> None:
    whole, mesh = trajectory(), tetrahedron("cow", 0.1)
    mesh = replace(mesh, shape={**mesh.shape, "origin": (0.5, 0.0, 0.25)})
    places = tuple({"cow": ((0.1 * at, 0.0, 0.0), TURN)} if at % 2 else {} for at in range(len(whole)))
    whole = replace(whole, poses=places, topology=replace(whole.topology, colliders=(mesh,)))
    found = elements(whole.show().text)
    assert found["head"][0]["colliders"][0]["shape"]["origin"] == [0.5, 0.0, 0.25]
    told = [frame["poses"] for block in found["block"] for frame in block["frames"]]
    assert told[:2] == [None, [{"name": "cow", "position": [0.1, 0.0, 0.0], "turn": list(TURN)}]]
    assert [frame is not None for frame in told] == [bool(places[at]) for at in range(len(whole))]


def test_an_archive_has_the_poses_of_each_frame(tmp_path: Path) -> None:
    whole = trajectory()
    box, lid = ((1.0, 2.0, 3.0), TURN), ((4.0, 5.0, 6.0), (0.0, 0.0, 0.0, 1.0))
    places = tuple({"box": box} if at < 3 else {"lid": lid, "box": box} for at in range(len(whole)))
    with np.load(replace(whole, poses=places).save(tmp_path / "run.npz")) as file:
        assert file["pose_names"].tolist() == ["box", "lid"]
        position, turn = file["pose_position"], file["pose_turn"]
        assert (position.shape, turn.shape) == ((len(whole), 2, 3), (len(whole), 2, 4))
        assert np.isnan(position[:3, 1]).all() and np.isnan(turn[:3, 1]).all()
        assert (position[:, 0] == box[0]).all() and (turn[:, 0] == box[1]).all()
        assert (position[3:, 1] == lid[0]).all() and (turn[3:, 1] == lid[1]).all()
    with np.load(whole.save(tmp_path / "run.npz")) as file:
        assert file["pose_names"].shape == (0,) and file["pose_turn"].shape == (len(whole), 0, 4)


def test_frames_of_a_server_have_a_turning_box_where_it_is(server: nappe.Server) -> None:
    with server.create(SCENE, step_limit=20) as session:
        frames = session.trajectory()
        assert frames.number.tolist() == list(range(21))
        for at in (0, 10, 20):
            assert frames.poses[at].keys() == {"box"}, "the ball has a velocity"
            position, turn = frames.poses[at]["box"]
            share = at / 20
            np.testing.assert_allclose(position, (0.25, -0.5 + 0.1 * share, 0.3), atol=1e-12)
            half = math.pi / 4 * share
            np.testing.assert_allclose(turn, (0, math.sin(half), 0, math.cos(half)), atol=1e-12)


def test_a_frame_has_the_poses_of_what_a_call_moves_until_a_reset(server: nappe.Server) -> None:
    with server.create(SCENE) as session:
        assert session.step(frame=True).poses.keys() == {"box"}
        session.update(colliders={"ball": ((0, -2, 0.1), TURN)}, duration=0.02)
        frame = session.step(4, frame=True)
        assert list(frame.poses) == ["box", "ball"]
        np.testing.assert_allclose(frame.poses["ball"][0], (0, -2, 0.1), atol=1e-12)
        np.testing.assert_allclose(frame.poses["ball"][1], TURN, atol=1e-12)
        # Poses of a frame are what an update takes.
        session.update(colliders=frame.poses)
        session.step(3)
        session.reset()
        assert session.step(frame=True).poses.keys() == {"box"}

"""Moves of colliders become messages, and come back as values; what is wrong is named before a byte is sent."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from test_requests import refusal, step, update, vector

import nappe
from nappe import ColliderPose, Parameters, v1
from nappe._wire._pending import read_pending
from nappe._wire._reading import read

TURN = (0.0, 0.6, 0.0, 0.8)

# A sheet that falls on a box.
SCENE = """
version = 1
dt = 0.002
precision = "f64"

[[body]]
name = "sheet"
mesh = { grid = [6, 6], spacing = 0.1 }
mass = { density = 0.2 }
pins = ["top_left", "top_right"]
springs = { stretch = { stiffness = 50, damping = 0.02 }, shear = { stiffness = 20, damping = 0.01 } }

[[collider]]
name = "box"
box = { center = [0.25, -0.3, 0.3], size = [0.3, 0.1, 0.3] }

[[collider]]
name = "ball"
sphere = { center = [0, -2, 0], radius = 0.2 }
velocity = [0, 0, 0.5]
"""


def quaternion(x: float, y: float, z: float, w: float) -> Any:
    return v1.Quaternion(x=x, y=y, z=z, w=w)


@pytest.mark.parametrize(
    ("given", "move"),
    [
        ((1, 2, 3), {"position": vector(1, 2, 3)}),
        ([1, 2, 3], {"position": vector(1, 2, 3)}),
        (np.array([1, 2, 3], np.float32), {"position": vector(1, 2, 3)}),
        (((1, 2, 3), TURN), {"position": vector(1, 2, 3), "turn": quaternion(*TURN)}),
        ((np.zeros(3), np.array(TURN)), {"position": vector(0, 0, 0), "turn": quaternion(*TURN)}),
        (((1, 2, 3), None), {"position": vector(1, 2, 3)}),
        ((None, (0, 0, 0, -1)), {"turn": quaternion(0, 0, 0, -1)}),
        ((None, (0, 0, 0, 1 + 0.9e-6)), {"turn": quaternion(0, 0, 0, 1 + 0.9e-6)}),
    ],
    ids=["tuple", "list", "array", "both", "arrays", "no turn", "turn", "nearly 1"],
)
def test_a_collider_goes_to_a_position_or_a_turn_or_both(given: Any, move: Any) -> None:
    expected = v1.ColliderUpdate(name="box", duration_seconds=0.5, **move)
    ids = {"session_id": "flag", "session_uid": "u-1"}
    made = update(7, colliders={"box": given}, duration=0.5).message
    assert made == v1.UpdateParametersRequest(**ids, at_step=7, colliders=[expected])
    assert step(changes={"colliders": {"box": given}, "duration": 0.5}).message.changes.colliders[0] == expected
    sent = made.colliders[0]
    assert (sent.HasField("position"), sent.HasField("turn")) == ("position" in move, "turn" in move)


def test_colliders_and_pins_take_the_same_duration_and_without_one_a_step() -> None:
    made = update(colliders={"b": (0, 0, 1), "a": (0, 0, 2)}, pins={3: (0, 0, 0)}, duration=2).message
    assert [move.name for move in made.colliders] == ["b", "a"]
    assert {move.duration_seconds for move in (*made.colliders, *made.pins)} == {2.0}
    assert update(colliders={"a": (0, 0, 1)}).message.colliders[0].duration_seconds == 0.0
    assert len(update(colliders={}).message.colliders) == 0


@pytest.mark.parametrize(
    ("colliders", "field", "told"),
    [
        (
            (0, 0, 0),
            "colliders",
            "colliders is (0, 0, 0); allowed: a dict of positions, or of tuples of a position and",
        ),
        ({"": (0, 0, 0)}, "colliders", "colliders is ''; allowed: the name of a collider"),
        ({5: (0, 0, 0)}, "colliders", "colliders is 5; allowed: the name of a collider"),
        ({"box": None}, "colliders['box']", "colliders['box'] has neither a position nor a turn; allowed: one of them"),
        ({"box": (None, None)}, "colliders['box']", "colliders['box'] has neither a position nor a turn"),
        ({"box": (0, 0, 0, 1)}, "colliders['box']", "colliders['box'] is of shape (4,); allowed: (3)"),
        ({"box": 1.0}, "colliders['box']", "colliders['box'] is of shape (); allowed: (3)"),
        ({"box": (0, math.nan, 0)}, "colliders['box']", "colliders['box'][1] is nan; allowed: a finite number"),
        ({"box": ((0, 0), TURN)}, "colliders['box'][0]", "colliders['box'][0] is of shape (2,); allowed: (3)"),
        ({"box": (None, (0, 0, 1))}, "colliders['box'][1]", "colliders['box'][1] is of shape (3,); allowed: (4)"),
        ({"box": (None, (0, 0, 0, math.inf))}, "colliders['box'][1]", "colliders['box'][1][3] is inf"),
        ({"box": (None, (0, 0, 0, 0))}, "colliders['box'][1]", "is of length 0; allowed: 1, within 1e-6"),
        ({"box": (None, (0, 0, 0, 1 + 2e-6))}, "colliders['box'][1]", "allowed: 1, within 1e-6"),
        ({"box": ("up", None)}, "colliders['box'][0]", "is an array of <U2; allowed: numbers"),
    ],
)
def test_a_move_that_cannot_be_is_named(colliders: Any, field: str, told: str) -> None:
    assert told in refusal(lambda: update(colliders=colliders), field)
    assert told in refusal(lambda: step(changes={"colliders": colliders}), field)


def test_moves_that_wait_are_told_as_they_were_given() -> None:
    given: Any = {"box": ((1, 2, 3), TURN), "lid": (0, 0, 1), "table": (None, TURN)}
    asked = update(colliders=given, duration=0.5).message
    path = asked.collider_paths.add(name="ball", times_seconds=[0.5, 1.0], positions=[0, 1, 2, 3, 4, 5])
    asked.collider_paths.add(name="disc", times_seconds=[0.5], turns=TURN)
    told = read_pending(v1.PendingChange(changes=asked)).changes
    assert set(told) == {"colliders", "collider_paths"}
    assert told["colliders"] == {
        "box": ((1, 2, 3), TURN, 0.5),
        "lid": ((0, 0, 1), None, 0.5),
        "table": (None, TURN, 0.5),
    }
    times, positions, turns = told["collider_paths"]["ball"]
    assert times.tolist() == list(path.times_seconds) and turns is None
    assert positions.tolist() == [[0, 1, 2], [3, 4, 5]]
    times, positions, turns = told["collider_paths"]["disc"]
    assert (times.tolist(), positions, turns.tolist()) == ([0.5], None, [list(TURN)])


def test_parameters_have_the_pose_of_each_collider() -> None:
    poses = [v1.ColliderPose(name="box", position=vector(1, 2, 3), turn=quaternion(*TURN)), v1.ColliderPose(name="lid")]
    box, lid = read(Parameters, v1.Parameters(collider_poses=poses)).collider_poses
    assert box == ColliderPose("box", (1, 2, 3), TURN)
    assert lid == ColliderPose("lid", (0, 0, 0), (0, 0, 0, 1))
    assert read(Parameters, v1.Parameters()).collider_poses == ()


def poses_of(session: nappe.Session) -> dict[str, ColliderPose]:
    assert session.parameters is not None
    return {pose.name: pose for pose in session.parameters.collider_poses}


def test_a_collider_of_a_server_goes_where_it_is_sent(server: nappe.Server) -> None:
    with server.create(SCENE) as session, server.create(SCENE) as other:
        assert poses_of(session)["box"] == ColliderPose("box", (0.25, -0.3, 0.3), (0.0, 0.0, 0.0, 1.0))
        session.update(colliders={"box": ((0.25, -0.2, 0.3), TURN)}, duration=0.02)
        assert list(session.pending()[0].changes["colliders"]) == ["box"]
        session.step(5)
        np.testing.assert_allclose(poses_of(session)["box"].position, (0.25, -0.25, 0.3), atol=1e-12)
        session.step(20)
        box, ball = poses_of(session)["box"], poses_of(session)["ball"]
        np.testing.assert_allclose(box.position, (0.25, -0.2, 0.3), atol=1e-12)
        np.testing.assert_allclose(box.turn, TURN, atol=1e-12)
        np.testing.assert_allclose(ball.position, (0, -2, 0.5 * session.time_seconds), atol=1e-12)

        # A step has the move of an update.
        other.step(changes={"colliders": {"box": ((0.25, -0.2, 0.3), TURN)}, "duration": 0.02})
        other.step(24)
        assert session.state_hash == other.state_hash is not None

        # What the server alone knows.
        wrong: list[tuple[Any, str]] = [({"lid": (0, 0, 0)}, "box, ball"), ({"box": (0, 2e6, 0)}, "position")]
        for bad, told in wrong:
            with pytest.raises(nappe.Refused, match=told) as refused:
                session.step(changes={"colliders": bad})
            assert refused.value.reason == "INVALID_CHANGE"
        with pytest.raises(nappe.Refused, match="duration"):
            session.update(colliders={"box": (0, 0, 0)}, duration=-1)
        assert session.refresh().steps_taken == 25

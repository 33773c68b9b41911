"""Where colliders are at the time of a frame, checked: finite positions, turns of length 1.

Enters: a frame of the wire, its first piece. Leaves: positions and turns by the name of the collider.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._wire._contract import Message
from nappe._wire._errors import Error
from nappe._wire._reading import read
from nappe._wire._reports import Quaternion, Vector
from nappe._wire._values import ColliderPose

# How far the length of a turn may be from 1.
_UNIT_TOLERANCE = 1e-6

FramePoses = dict[str, tuple[Vector, Quaternion]]
"""Position (m) and turn of colliders by their names."""


def read_poses(frame: Message) -> FramePoses:
    """The poses of a frame."""
    poses: FramePoses = {}
    for wire in frame.poses:
        pose = read(ColliderPose, wire)
        if pose.name in poses:
            raise _broken(frame, pose.name, "comes twice")
        if not all(map(math.isfinite, pose.position)):
            raise _broken(frame, pose.name, "has a position that is not finite")
        # What is not a number is near to nothing.
        if not abs(math.hypot(*pose.turn) - 1) <= _UNIT_TOLERANCE:
            raise _broken(frame, pose.name, "has a turn that is not of length 1")
        poses[pose.name] = (pose.position, pose.turn)
    return poses


def poses_arrays(frames: Sequence[FramePoses]) -> dict[str, NDArray[Any]]:
    """Poses of several frames, under the names that a saved file has; nan where a frame has no pose of a collider.

    `pose_names` (colliders,), `pose_position` (frames, colliders, 3) (m), `pose_turn` (frames, colliders, 4).
    """
    names = list(dict.fromkeys(name for poses in frames for name in poses))
    position, turn = (np.full((len(frames), len(names), width), np.nan) for width in (3, 4))
    for row, poses in enumerate(frames):
        for place, name in enumerate(names):
            if name in poses:
                position[row, place], turn[row, place] = poses[name]
    return {"pose_names": np.array(names, np.str_), "pose_position": position, "pose_turn": turn}


def _broken(frame: Message, name: str, what: str) -> Error:
    return Error(f"the server's stream does not decode: frame {frame.frame}: the pose of collider {name!r} {what}")

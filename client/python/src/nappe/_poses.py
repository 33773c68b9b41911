"""Where colliders are at the time of a frame, checked: finite positions, turns of length 1.

Enters: a frame of the wire, its first piece. Leaves: positions and turns by the name of the collider.
"""

from __future__ import annotations

import math

from nappe._contract import Message
from nappe._errors import Error
from nappe._reading import read
from nappe._reports import Quaternion, Vector
from nappe._values import ColliderPose

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


def _broken(frame: Message, name: str, what: str) -> Error:
    return Error(f"the server's stream does not decode: frame {frame.frame}: the pose of collider {name!r} {what}")

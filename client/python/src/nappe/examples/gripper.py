"""A gripper in a loop: two fingers take a sheet from a table and drop it, and decide by the forces that they feel.

    python -m nappe.examples.gripper --speed 0.5 --carry 0.25

Each call takes some steps: it carries the poses of both fingers, and answers with the loads on all colliders. Calls
replace the keys that the scene has for the fingers. Prints what the loads told, and when.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

import nappe
from nappe.examples import _server

FINGERS = ("lower", "upper")
"""Names of the fingers in the scene. The upper one closes."""

STEPS = 8
"""Steps of the scene in a call. They are short: 8 are 4 ms."""

MEAN_OF = 25
"""Calls over which loads are averaged: a cloth that swings pulls more and less than its weight."""

PRESS = 0.002
"""How far the upper finger goes on where it feels the sheet (m)."""

PATIENCE = 2.0
"""Simulated time (s) in which each part of the task must be done."""


class Gripper:
    """Two fingers that move as one: the middle between them, how far each is from it, and how they are turned."""

    def __init__(self, session: nappe.Session) -> None:
        """Takes the fingers of a session as they are."""
        if session.parameters is None:
            raise SystemExit("the session has no parameters yet")
        found = {pose.name: np.array(pose.position) for pose in session.parameters.collider_poses}
        lower, upper = (found[name] for name in FINGERS)
        self.session = session
        self.seconds = STEPS * session.dt_seconds
        self.middle: NDArray[np.float64] = (lower + upper) / 2
        self.arm = float(upper[1] - lower[1]) / 2
        self.angle = 0.0
        self.carried: deque[float] = deque(maxlen=MEAN_OF)

    def step(self) -> nappe.Frame:
        """One call: the fingers go where they are to be, and the frame tells what they felt on the way."""
        half = 0.5 * self.angle
        turn = (0.0, 0.0, np.sin(half), np.cos(half))
        out = self.arm * np.array([-np.sin(self.angle), np.cos(self.angle), 0.0])
        lower, upper = FINGERS
        changes: nappe.Changes = {
            "colliders": {lower: (self.middle - out, turn), upper: (self.middle + out, turn)},
            "duration": self.seconds,
        }
        frame = self.session.step(STEPS, changes=changes, frame=True)
        self.carried.append(-sum(frame.loads[name].force[1] for name in FINGERS))
        return frame

    def until(self, what: str, done: Callable[[nappe.Frame], bool], move: Callable[[float], None]) -> nappe.Frame:
        """Moves by `move`, which gets the seconds of a call, until `done` says so of a frame. Prints what was done."""
        for _ in range(round(PATIENCE / self.seconds)):
            move(self.seconds)
            frame = self.step()
            if done(frame):
                print(f"{frame.time:6.3f} s  {what}; the fingers carry {self.mean_carried:.3f} N")
                return frame
        raise SystemExit(f"after {PATIENCE} s it is not so that: {what}")

    @property
    def mean_carried(self) -> float:
        """What both fingers carried, over the last steps (N)."""
        return float(np.mean(self.carried))


def contacts(frame: nappe.Frame, *names: str) -> int:
    """How many contacts those colliders have together."""
    return sum(frame.loads[name].contacts for name in names)


def main(arguments: Sequence[str] | None = None) -> None:
    """Takes the sheet, turns it by 90 degrees, and lets it go."""
    parser = _server.parser(__doc__)
    parser.add_argument("--speed", type=float, default=0.5, help="speed of the fingers, in m/s")
    parser.add_argument("--carry", type=float, default=0.25, help="how far the sheet is carried away, in m")
    options = parser.parse_args(arguments)

    # With step_limit=0 the session does not end by itself: the loop decides.
    with _server.opened(options) as server, server.create("gripper", step_limit=0) as session:
        gripper = Gripper(session)
        task(gripper, options.speed, options.carry)


def task(gripper: Gripper, speed: float, carry: float) -> None:
    """What is done, one part after the other."""
    frames = [gripper.step() for _ in range(2 * MEAN_OF)]
    weight = -float(np.mean([sum(load.force[1] for load in frame.loads.values()) for frame in frames[MEAN_OF:]]))
    print(f"{frames[-1].time:6.3f} s  the sheet weighs {weight:.3f} N on what it lies on")

    def close(dt: float) -> None:
        # The upper finger alone goes, so that the middle goes half as far.
        gripper.arm -= 0.25 * speed * dt
        gripper.middle[1] -= 0.25 * speed * dt

    def lift(dt: float) -> None:
        gripper.middle[1] += speed * dt

    def rest(dt: float) -> None:
        pass

    turning = 0.5 * np.pi / (carry / speed)

    def turn(dt: float) -> None:
        part = min(dt, (gripper.angle + 0.5 * np.pi) / turning)
        gripper.angle -= turning * part
        gripper.middle[0] -= speed * part

    def part(dt: float) -> None:
        gripper.arm += speed * dt

    # Where it feels the sheet first it holds little: it closes a little more.
    gripper.until("the upper finger feels the sheet", lambda frame: contacts(frame, "upper") > 0, close)
    closed = gripper.arm - PRESS / 2
    held = gripper.until("it has closed", lambda _: gripper.arm <= closed, close)
    print(f"          it holds {contacts(held, 'upper')} particles")
    gripper.until("the table feels nothing", lambda frame: contacts(frame, "table") == 0, lift)
    gripper.until("it has turned", lambda _: gripper.angle <= -0.5 * np.pi + 1e-9, turn)
    gripper.until("the fingers carry its weight", lambda _: abs(gripper.mean_carried / weight - 1) < 0.02, rest)
    gripper.until("it has let go", lambda frame: contacts(frame, *FINGERS) == 0, part)
    gripper.until("the sheet lies on the floor", lambda frame: -frame.loads["floor"].force[1] > 0.95 * weight, rest)


if __name__ == "__main__":
    main()

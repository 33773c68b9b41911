"""An environment for Gymnasium: the pins of a hanging sheet move so that its lower edge reaches a target.

    python -m nappe.examples.gym_env --episodes 5

This example alone needs Gymnasium: pip install gymnasium. Whoever imports this module can make
`nappe/HangingSheet-v0` with `gymnasium.make`. A step is one call. An episode begins with a fork of a session in which
the sheet hangs at rest, and so with the same state to the bit. Prints, for each episode of a simple controller, how it
ended, and how long a reset and a step took.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np
from numpy.typing import NDArray

import nappe
from nappe.examples import _server

try:
    import gymnasium
except ImportError:
    raise ImportError("nappe.examples.gym_env needs Gymnasium: pip install gymnasium") from None

Vector = NDArray[np.float32]

NAME = "nappe/HangingSheet-v0"
SCENE = """
version = 1
title = "A sheet that is moved by its pins"
dt = 0.005
steps = 0

[[body]]
name = "sheet"
mesh = { grid = [10, 10], spacing = 0.05, plane = "upright" }
mass = { density = 0.2 }
pins = ["top_left", "top_right"]
drag = 1e-3

[body.springs]
stretch = { stiffness = 200, damping = 0.02 }
shear = { stiffness = 50, damping = 0.01 }
bend = { stiffness = 2, damping = 0.002 }
"""
"""A sheet of half a metre."""

STEPS_TO_REST = 400
STEPS_PER_ACTION = 4
"""Steps of the scene within a step of the environment: 0.02 s."""
SPEED = 1.0
"""Greatest speed of the pins along an axis (m/s)."""
REACH = 0.4
"""How far a target may be from where the lower edge hangs at rest, along each axis (m)."""
NEAR = 0.02
"""A target is reached from here on (m)."""
EPISODE = 200
"""Most steps of an episode, which `gymnasium.make` counts."""
FIELDS = ("positions", "velocities")


class HangingSheet(gymnasium.Env[Vector, Vector]):
    """A sheet that hangs by two pins. The middle of its lower edge is to reach a target.

    Action (3,): velocity of both pins along x, y and z as a share of the greatest, -1 to 1. Observation (9,): from the
    middle of the lower edge to the target (m), velocity of that middle (m/s), and how far the pins are from their start
    (m). Reward: minus the distance to the target (m). An episode ends where the target is reached.
    """

    def __init__(self, server: nappe.Server | None = None) -> None:
        """The sheet at rest, on a server that is given, which environments may share, or on a new one."""
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (9,), np.float32)
        self._opened = ExitStack()
        used = self._opened.enter_context(nappe.serve()) if server is None else server
        self._rest = self._opened.enter_context(used.create(SCENE, step_limit=0, thread_count=1))
        self._session: nappe.Session | None = None
        with self._rest.frames(every=True) as frames:
            first = next(frames)
        heights = first.positions[:, 1]
        self._edge = np.flatnonzero(heights < heights.min() + 1e-6)
        self._pins = {int(pin): first.positions[pin].astype(float) for pin in first.pins}
        self._start = self._rest.step(STEPS_TO_REST, frame=True, fields=FIELDS)
        self._target = self._moved = np.zeros(3)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Vector, dict[str, Any]]:
        """Begins an episode: the sheet at rest, and another target."""
        super().reset(seed=seed)
        self._end_episode()
        self._session = self._rest.fork()
        self._moved = np.zeros(3)
        self._target = self._middle(self._start.positions) + self.np_random.uniform(-REACH, REACH, 3)
        return self._observation(self._start), {}

    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Moves the pins for 0.02 s."""
        if self._session is None:
            raise gymnasium.error.ResetNeeded("reset() begins an episode")
        duration = STEPS_PER_ACTION * self._session.dt_seconds
        self._moved = self._moved + SPEED * duration * np.clip(np.asarray(action, float), -1.0, 1.0)
        pins = {pin: start + self._moved for pin, start in self._pins.items()}
        changes: nappe.Changes = {"pins": pins, "duration": duration}
        frame = self._session.step(STEPS_PER_ACTION, changes=changes, frame=True, fields=FIELDS)
        distance = float(np.linalg.norm(self._target - self._middle(frame.positions)))
        return self._observation(frame), -distance, distance < NEAR, False, {"distance": distance}

    def close(self) -> None:
        """Ends the sessions, and the server if it is an own one."""
        self._end_episode()
        self._opened.close()

    def _end_episode(self) -> None:
        if self._session is not None:
            self._session.delete()
            self._session = None

    def _middle(self, array: NDArray[Any]) -> NDArray[np.float64]:
        """The mean over the lower edge."""
        middle: NDArray[np.float64] = array[self._edge].mean(axis=0, dtype=np.float64)
        return middle

    def _observation(self, frame: nappe.Frame) -> Vector:
        parts = (self._target - self._middle(frame.positions), self._middle(frame.velocities), self._moved)
        return np.concatenate(parts).astype(np.float32)


if NAME not in gymnasium.registry:  # run as a program, this file is imported a second time
    gymnasium.register(NAME, entry_point="nappe.examples.gym_env:HangingSheet", max_episode_steps=EPISODE)


def controller(observation: Vector) -> Vector:
    """A simple controller: towards the target, and with the swing of the edge, which calms it."""
    return np.clip(1.5 * observation[:3] + 0.3 * observation[3:6], -1.0, 1.0).astype(np.float32)


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs some episodes."""
    parser = _server.parser(__doc__)
    parser.add_argument("--episodes", type=int, default=5, help="episodes to run")
    parser.add_argument("--seed", type=int, default=0, help="seed of the targets")
    options = parser.parse_args(arguments)

    with _server.opened(options) as server:
        environment: gymnasium.Env[Vector, Vector] = gymnasium.make(NAME, server=server)
        for episode in range(options.episodes):
            times = [time.perf_counter()]
            observation, told = environment.reset(seed=options.seed if episode == 0 else None)
            times.append(time.perf_counter())
            reached = is_late = False
            while not (reached or is_late):
                observation, _, reached, is_late, told = environment.step(controller(observation))
                times.append(time.perf_counter())

            reset, *steps = 1e3 * np.diff(times)
            outcome = "reached the target" if reached else f"missed the target by {told['distance']:.3f} m"
            count, each = len(steps), np.median(steps)
            print(f"episode {episode}: {outcome} after {count} steps of {each:.2f} ms; reset {reset:.2f} ms")
        environment.close()


if __name__ == "__main__":
    main()

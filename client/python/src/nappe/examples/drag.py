"""Drags a pinned corner of a cloth along a sine: the whole way is sent in one call of `Session.path`.

    python -m nappe.examples.drag --amplitude 0.1 --period 1

Prints, for each frame, how far the pin is from the sine (m), then the largest of these distances.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nappe.examples import _server

Z = np.array([0.0, 0.0, 1.0])
"""The direction in which the pin moves."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Drags the first pin of the scene."""
    parser = _server.parser(__doc__)
    parser.add_argument("--scene", default="hanging_sheet", help="a scene that has a pinned particle")
    parser.add_argument("--amplitude", type=float, default=0.1, help="amplitude of the sine along z, in m")
    parser.add_argument("--period", type=float, default=1.0, help="its period, in s")
    parser.add_argument("--steps", type=int, default=400, help="steps to take")
    options = parser.parse_args(arguments)

    def sine(times: ArrayLike) -> NDArray[np.float64]:
        """How far the pin is to be from its start (m) at simulated times (s)."""
        return np.asarray(options.amplitude * np.sin(2 * np.pi * np.asarray(times) / options.period))

    with (
        _server.opened(options) as server,
        server.create(options.scene, step_limit=options.steps, precision="f64") as session,
        session.frames(every=True, precision="f64") as frames,
    ):
        # Frame 0 is the initial state: its topology says which particles are pinned.
        first = next(frames)
        if len(first.pins) == 0:
            raise SystemExit(f"the scene {options.scene} has no pinned particle")
        pin = int(first.pins[0])
        start = first.positions[pin]

        # A point for the end of each step. Between two points the pin moves at constant speed.
        times = session.dt_seconds * np.arange(1, options.steps + 1)
        session.path(pin, times, start + np.outer(sine(times), Z))

        largest = 0.0
        session.play()
        for frame in frames:
            distance = float(np.linalg.norm(frame.positions[pin] - (start + sine(frame.time) * Z)))
            largest = max(largest, distance)
            print(f"{frame.time:7.3f} s  {distance:.3e} m")
        print(f"largest distance from the sine: {largest:.3e} m")


if __name__ == "__main__":
    main()

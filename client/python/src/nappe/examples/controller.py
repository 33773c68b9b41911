"""A controller in a loop: it moves the pins of a cloth until its centre is where it is wanted.

    python -m nappe.examples.controller --to 0.2 --gain 2

Each step is one call, which carries the new targets of the pins and answers with the state after the step. Prints how
far the centre is off, and how many milliseconds a call took.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

import nappe
from nappe.examples import _server


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the controller for some steps."""
    parser = _server.parser(__doc__)
    parser.add_argument("--scene", default="hanging_sheet", help="a scene that has pinned particles")
    parser.add_argument("--to", type=float, default=0.2, help="how far to move the centre along x, in m")
    parser.add_argument("--gain", type=float, default=2.0, help="speed of the pins per metre of error, in 1/s")
    parser.add_argument("--steps", type=int, default=600, help="steps to take")
    options = parser.parse_args(arguments)

    # With step_limit=0 the session does not end by itself: the loop decides.
    with _server.opened(options) as server, server.create(options.scene, step_limit=0) as session:
        # A frame of a stream has the topology, which says what is pinned. Frames of single steps have none.
        with session.frames(every=True) as frames:
            first = next(frames)
        if len(first.pins) == 0:
            raise SystemExit(f"the scene {options.scene} has no pinned particle")
        pins = {int(pin): first.positions[pin].astype(np.float64) for pin in first.pins}
        centre = first.positions.mean(axis=0, dtype=np.float64)
        wanted = centre[0] + options.to

        milliseconds = []
        for step in range(options.steps):
            error = wanted - centre[0]
            move = np.array([options.gain * error * session.dt_seconds, 0.0, 0.0])
            pins = {pin: place + move for pin, place in pins.items()}
            changes: nappe.Changes = {"pins": pins, "duration": session.dt_seconds}

            begin = time.perf_counter()
            frame = session.step(changes=changes, frame=True)
            milliseconds.append(1e3 * (time.perf_counter() - begin))

            centre = frame.positions.mean(axis=0, dtype=np.float64)
            if step % 50 == 0:
                print(f"{frame.time:6.3f} s  the centre was {error:+.4f} m off  {milliseconds[-1]:.2f} ms per call")

        median, slowest = np.median(milliseconds), np.max(milliseconds)
        print(f"{len(milliseconds)} calls: {median:.2f} ms in the median, {slowest:.2f} ms at most")


if __name__ == "__main__":
    main()

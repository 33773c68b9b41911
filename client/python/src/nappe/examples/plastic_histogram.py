"""Draws a histogram, as text, of how much snow was packed and torn when its scene has ended.

    python -m nappe.examples.plastic_histogram --scene two_snowballs

The plastic volume ratio J_P of a particle is 1 as the snow fell, below 1 where it was packed, above 1 where it came
apart. Ratios beyond `--low` and `--high` are counted in the first and in the last bar.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nappe.examples import _server

WIDTH = 60
"""Characters of the longest bar."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs a scene of snow to its end and draws the histogram."""
    parser = _server.parser(__doc__)
    parser.add_argument("--scene", default="two_snowballs", help="a scene of snow that the server ships")
    parser.add_argument("--steps", type=int, help="steps to take (default: as many as the scene says)")
    parser.add_argument("--low", type=float, default=0.6, help="where the first bar begins")
    parser.add_argument("--high", type=float, default=2.6, help="where the last bar ends")
    parser.add_argument("--bins", type=int, default=20, help="number of bars")
    options = parser.parse_args(arguments)

    ratio, time = np.ones(0, np.float32), 0.0
    with _server.opened(options) as server, server.create(options.scene, step_limit=options.steps) as session:
        session.play()
        # The newest frame, whenever this loop is ready for one; the last frame always comes.
        for frame in session.frames(fields=("plastic_ratio",)):
            # Particles of snow are the last ones; those of cloth have the ratio 1.
            ratio, time = frame.plastic_ratio[-session.snow_particle_count :], frame.time

    bounds = (options.low, options.high)
    counts, edges = np.histogram(np.clip(ratio, *bounds), options.bins, bounds)
    print(f"{len(ratio)} particles of snow after {time:.2f} s")
    print("   J_P from ... to   particles")
    for count, low, high in zip(counts, edges[:-1], edges[1:], strict=True):
        bar = "#" * round(WIDTH * int(count) / int(counts.max()))
        print(f"{low:9.3f} {high:9.3f} {count:9d}  {bar}")


if __name__ == "__main__":
    main()

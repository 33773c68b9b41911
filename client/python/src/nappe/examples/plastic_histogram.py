"""A histogram, as text, of how much snow was packed when its scene has ended.

    python -m nappe.examples.plastic_histogram --scene two_snowballs

The plastic volume ratio J_P of a particle is 1 as it fell, below 1 where it was packed, above 1 where it came apart.
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
    parser.add_argument(
        "--scene", default="two_snowballs", help="a scene of snow that the server ships (default: %(default)s)"
    )
    parser.add_argument("--bins", type=int, default=20, help="bars of the histogram (default: %(default)s)")
    options = parser.parse_args(arguments)

    with _server.opened(options) as server, server.create(options.scene) as session:
        ratio, time = np.ones(0, np.float32), 0.0
        session.play()
        # The newest frame, whenever this loop is ready for one; the last frame always comes.
        for frame in session.frames(fields=("plastic_ratio",)):
            # Particles of snow are the last ones; for particles of cloth the ratio is 1.
            ratio, time = frame.plastic_ratio[-session.snow_particle_count :], frame.time

    counts, edges = np.histogram(ratio, options.bins)
    print(f"{len(ratio)} particles of snow after {time:.2f} s")
    print("J_P from ... to    particles")
    for count, low, high in zip(counts, edges[:-1], edges[1:], strict=True):
        bar = "#" * int(np.ceil(WIDTH * count / counts.max()))
        print(f"{low:7.3f} {high:7.3f} {count:10d}  {bar}")


if __name__ == "__main__":
    main()

"""Saves a run: as .npz for numpy, as .html for any browser, or as a folder of PLY files.

    python -m nappe.examples.export --scene flag --steps 400 --out flag.html

The ending of `--out` says which; a name without an ending is a folder.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nappe.examples import _server


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs a scene and saves it."""
    parser = _server.parser(__doc__)
    parser.add_argument("--scene", default="demo", help="a scene that the server ships, or a file that ends in .toml")
    parser.add_argument("--steps", type=int, help="steps to take (default: as many as the scene says)")
    parser.add_argument("--every", type=int, default=1, help="keep one frame of so many")
    parser.add_argument("--out", type=Path, required=True, help="FILE.npz, FILE.html or FOLDER")
    options = parser.parse_args(arguments)
    if options.out.suffix.lower() not in ("", ".npz", ".html"):
        parser.error(f"--out is {options.out}; allowed: FILE.npz, FILE.html or FOLDER")

    with _server.opened(options) as server, server.create(options.scene) as session:
        # A page colours snow by its plastic volume ratio, if that was kept.
        fields = ("positions", "plastic_ratio") if session.snow_particle_count else ("positions",)
        trajectory = session.trajectory(stop=options.steps, every=options.every, fields=fields)

    print(trajectory)
    print(f"saved as {trajectory.save(options.out)}")


if __name__ == "__main__":
    main()

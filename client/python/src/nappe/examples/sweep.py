"""Sweeps the stretch stiffness of a hanging cloth, several sessions at once; a row of CSV per run.

    python -m nappe.examples.sweep --count 40 --at-once 4 --out sweep.csv

`max_stretch` is the largest of the whole run, the other numbers are those of its last frame. A run that diverges is a
row too: `outcome` says why.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import numpy as np

import nappe
from nappe.examples import _server

COLUMNS = ("stiffness_n_per_m", "steps", "max_stretch", "lowest_y_m", "kinetic_energy_j", "outcome")


def run(server: nappe.Server, scene: str, stiffness: float, steps: int) -> tuple[float | int | str, ...]:
    """The row of one run with one stiffness (N/m)."""
    outcome = "finished"
    stretches, lowest, energy = [0.0], 0.0, 0.0

    # One thread per session, since several run at once.
    with server.create(scene, step_limit=steps, thread_count=1) as session:
        session.update(stiffness={"stretch": stiffness})
        session.play()
        try:
            for frame in session.frames(every=True):
                lowest = float(frame.positions[:, 1].min())
                if frame.diagnostics is not None:
                    stretches.append(frame.diagnostics.max_stretch)
                    energy = frame.diagnostics.kinetic_energy
        except nappe.Diverged as error:
            outcome = error.reason or "diverged"
        taken = session.refresh().steps_taken

    return stiffness, taken, max(stretches), lowest, energy, outcome


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the sweep that the command line asks for."""
    parser = _server.parser(__doc__)
    parser.add_argument("--scene", default="hanging_sheet", help="a scene of cloth that the server ships")
    parser.add_argument("--count", type=int, default=40, help="number of runs")
    parser.add_argument("--least", type=float, default=0.1, help="smallest stiffness, in N/m")
    parser.add_argument("--most", type=float, default=1e5, help="largest stiffness, in N/m")
    parser.add_argument("--steps", type=int, default=200, help="steps of each run")
    parser.add_argument("--at-once", type=int, default=4, help="sessions that run at the same time")
    parser.add_argument("--out", metavar="FILE", type=Path, help="the file to write (default: the standard output)")
    options = parser.parse_args(arguments)

    values = np.geomspace(options.least, options.most, options.count).tolist()
    with _server.opened(options) as server, ThreadPoolExecutor(options.at_once) as pool:
        rows = pool.map(lambda value: run(server, options.scene, value, options.steps), values)
        with nullcontext(sys.stdout) if options.out is None else options.out.open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(COLUMNS)
            table.writerows(rows)


if __name__ == "__main__":
    main()

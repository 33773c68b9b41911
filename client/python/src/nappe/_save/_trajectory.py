"""A trajectory: frames of a session, stacked into arrays, to be computed with, saved and shown.

Enters: stacked frames. Leaves: numpy arrays; files; a page for a notebook.
"""

from __future__ import annotations

import html
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from nappe._save._html import Page, recording
from nappe._save._ply import write_folder
from nappe._save._stacked import StackedFrames
from nappe._save._vtk import write_vtk
from nappe._save._vtkhdf import h5py_for, write_vtkhdf
from nappe._wire._diagnostics import loads_arrays
from nappe._wire._errors import refused
from nappe._wire._poses import poses_arrays

_ENDINGS = ".npz (numpy), .html (a page), .pvd or .vtkhdf (ParaView), or no ending (a folder of PLY files)"


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(StackedFrames):
    """Frames of a session in the order of time. Arrays are stacked: the first axis is the frame."""

    def save(self, path: str | os.PathLike[str], *, color: str | None = None, max_error: float | None = None) -> Path:
        """Writes a file or a folder, and says where it is; what kind, the ending of `path` says.

        `.npz`: all arrays, to be read with `numpy.load`. `.html`: a page that any browser opens. `.pvd`: an index for
        ParaView, and beside it a folder of its name with a VTK file per frame. `.vtkhdf`: the particles of all frames
        in one file for ParaView and VTK, if the package h5py is installed. No ending: a folder with a PLY file per
        frame. A file that was there is replaced when the new one is whole; a folder that holds frames is refused.
        `color`, `max_error`: what a page shows, and how far a coordinate in it may be from what it was (m), as
        `show` has them.
        """
        path = Path(path)
        ending = path.suffix.lower()
        if ending == ".html":
            text = recording(self, color, max_error)
            with _replacing(path) as file:
                file.write(text.encode("utf-8"))
            return path
        for name, given in (("color", color), ("max_error", max_error)):
            if given is not None:
                raise refused(f"{name} belongs to an HTML file, and {path} is none", name)
        if ending == ".npz":
            arrays = self._npz()
            with _replacing(path) as file:
                np.savez_compressed(file, **arrays)
        elif ending == ".pvd":
            index = write_vtk(self, path.with_suffix(""))
            with _replacing(path) as file:
                file.write(index)
        elif ending == ".vtkhdf":
            h5py = h5py_for(path)
            with _beside(path) as new:
                write_vtkhdf(self, h5py, new)
        elif not ending or path.is_dir():
            write_folder(self, path)
        else:
            raise refused(f"{path} ends in {path.suffix!r}; allowed: {_ENDINGS}", "path")
        return path

    def show(self, *, height: int = 600, color: str | None = None, max_error: float | None = None) -> Page:
        """A page that plays the frames, which a notebook shows and keeps, frames included.

        `height`: how tall it is (CSS pixels).
        `color`: what the colour of snow shows, `plastic_ratio`, `speed`, `stress`, or `body` for one colour per body.
        By default the plastic ratio, if there is snow and it was kept.
        `max_error`: how far a coordinate may be from what it was (m); by default the extent of the first frame over
        16384.
        """
        return Page(recording(self, color, max_error), height)

    def __repr__(self) -> str:
        """What it is, in a line."""
        cells = self._cells()
        return f"<nappe.Trajectory {cells['session']!r}: {cells['frames']}, {cells['particles']}, {cells['arrays']}>"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><th>{name}</th><td>{html.escape(cell)}</td></tr>" for name, cell in self._cells().items())
        return f"<table>{rows}</table>"

    def _cells(self) -> dict[str, str]:
        """What it is, in words."""
        times = f", {self.time[0]:g} to {self.time[-1]:g} s" if len(self) else ""
        return {
            "session": self.info.title or self.info.session_id,
            "frames": f"{len(self)} frames{times}",
            "particles": f"{self.topology.particle_count} particles",
            "arrays": f"{', '.join(self.arrays) or 'no arrays'} ({self.nbytes / 1e6:.1f} MB)",
            "end": "goes on" if self.end is None else f"finished after {self.end.step} steps",
        }

    def _npz(self) -> dict[str, Any]:
        """What an .npz file holds."""
        bodies = self.topology.bodies
        return {
            **self.arrays,
            "number": self.number,
            "step": self.step,
            "time": self.time,
            "state_hash": np.array([value or "" for value in self.state_hash], "<U16"),
            "diagnostics": self.diagnostics,
            **loads_arrays(self.steps),
            **poses_arrays(self.poses or [{} for _ in range(len(self))]),
            "triangles": self.topology.triangles,
            "pins": self.topology.pins,
            "body_names": np.array([body.name for body in bodies], np.str_),
            "body_first": np.array([body.first_particle for body in bodies], np.int64),
            "body_count": np.array([body.particle_count for body in bodies], np.int64),
        }


@contextmanager
def _replacing(path: Path) -> Iterator[BinaryIO]:
    """A new file that takes the place of `path` when it is whole; until then, and on an error, nothing changes."""
    with _beside(path) as new, new.open("xb") as file:
        yield file


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    """Where a file has to be made that takes the place of `path` when it is whole."""
    # What a link names is replaced, not the link.
    target = Path(os.path.realpath(path))
    beside = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        yield beside
        beside.replace(target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise

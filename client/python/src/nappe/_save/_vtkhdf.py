"""A VTKHDF file: the particles of all frames in one file for ParaView and VTK, which the package h5py writes.

Enters: a trajectory. Leaves: a file in which triangles, springs and bodies stand once, and points and arrays of every
frame, with the bits that they have.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from nappe._save._stacked import StackedFrames
from nappe._save._vtk import NAMES, kinds_of
from nappe._wire._errors import refused

# The version of the format: the first that has polygons over time.
_VERSION = (2, 0)
_TYPE = "PolyData"
# Kinds of cells in the order of the format.
_KINDS = ("Vertices", "Lines", "Polygons", "Strips")


def h5py_for(path: Path) -> Any:
    """The package that writes HDF5."""
    try:
        return importlib.import_module("h5py")
    except ImportError:
        message = f"{path}: the package h5py writes .vtkhdf files, and is not installed: pip install h5py"
        raise refused(message, "path") from None


def write_vtkhdf(trajectory: StackedFrames, h5py: Any, file: Path) -> None:
    """Writes a new file."""
    positions = trajectory.positions
    frames, particles = positions.shape[:2]
    kinds, bodies = kinds_of(trajectory.topology.bodies)
    with h5py.File(file, "x") as whole:
        root = whole.create_group("VTKHDF", track_order=True)
        root.attrs["Version"] = np.array(_VERSION, np.int64)
        root.attrs.create("Type", _TYPE.encode("ascii"), dtype=h5py.string_dtype("ascii", len(_TYPE)))
        root["NumberOfPoints"] = np.array([particles], np.int64)
        root["Points"] = positions.reshape(-1, 3)
        for kind, cells in zip(_KINDS, (*kinds, np.zeros((0, 1), np.uint32)), strict=True):
            group = root.create_group(kind)
            group["NumberOfCells"] = np.array([len(cells)], np.int64)
            group["NumberOfConnectivityIds"] = np.array([cells.size], np.int64)
            group["Offsets"] = np.arange(len(cells) + 1, dtype=np.int64) * cells.shape[1]
            group["Connectivity"] = cells.astype(np.int64).reshape(-1)
        root.create_group("CellData")["body"] = bodies

        # Where each frame begins: its points follow those of the frame before, its cells are always the same.
        starts, still = np.arange(frames, dtype=np.int64) * particles, np.zeros((frames, len(_KINDS)), np.int64)
        steps, data = root.create_group("Steps"), root.create_group("PointData")
        steps.attrs["NSteps"] = np.int64(frames)
        steps["Values"] = trajectory.time
        steps["PartOffsets"] = np.zeros(frames, np.int64)
        steps["NumberOfParts"] = np.ones(frames, np.int64)
        steps["PointOffsets"] = starts
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = still
        steps.create_group("CellDataOffsets")["body"] = np.zeros(frames, np.int64)
        offsets = steps.create_group("PointDataOffsets")
        for key, name in NAMES.items():
            if key in trajectory.arrays:
                array = trajectory.arrays[key]
                data[name] = array.reshape(frames * particles, *array.shape[2:])
                offsets[name] = starts

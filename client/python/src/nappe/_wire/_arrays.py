"""Arrays over the particles, under their names: of a frame, of a trajectory, or of one body of either."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nappe._wire._errors import Error
from nappe._wire._topology import Body

FIELDS = {"positions": 3, "velocities": 3, "plastic_ratio": 1, "stress": 1, "force": 3, "acceleration": 3}
"""Arrays over the particles that frames can have, and how many numbers each has per particle."""

Array = NDArray[Any]
"""An array of float32 or float64, as it was asked for."""


class Arrays:
    """What has arrays over the particles. Those of a trajectory have the frames as their first axis."""

    arrays: dict[str, Array]

    @property
    def positions(self) -> Array:
        """Positions (..., n, 3) (m)."""
        return self._array("positions")

    @property
    def velocities(self) -> Array:
        """Velocities (..., n, 3) (m/s), if they were asked for."""
        return self._array("velocities")

    @property
    def plastic_ratio(self) -> Array:
        """Plastic volume ratio J_P of snow (..., n), 1 for particles of cloth, if it was asked for."""
        return self._array("plastic_ratio")

    @property
    def stress(self) -> Array:
        """Frobenius norm of the Cauchy stress of snow (..., n) (Pa), 0 for cloth, if it was asked for."""
        return self._array("stress")

    @property
    def force(self) -> Array:
        """What acts on each particle (..., n, 3) (N), contacts left out, if it was asked for; of a pin its load."""
        return self._array("force")

    @property
    def acceleration(self) -> Array:
        """The same over the mass of each particle (..., n, 3) (m/s²), 0 for pins, if it was asked for."""
        return self._array("acceleration")

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the arrays that there are."""
        return tuple(self.arrays)

    def _array(self, name: str) -> Array:
        if name not in self.arrays:
            raise Error(f"there is no {name} here: name it when you ask for frames, fields=({name!r}, ...)")
        return self.arrays[name]


class BodyArrays(Arrays):
    """One body of a frame or of a trajectory: its arrays are views."""

    def __init__(self, body: Body, arrays: dict[str, Array]) -> None:
        """The part of the arrays over all particles that belongs to the body."""
        particles = body.particles
        self.arrays = {
            name: array[..., particles, :] if FIELDS[name] > 1 else array[..., particles]
            for name, array in arrays.items()
        }
        self.topology = body
        """What does not change: triangles, pins, texture coordinates."""

    @property
    def name(self) -> str:
        """Its name in the scene."""
        return self.topology.name

    @property
    def triangles(self) -> NDArray[np.int64]:
        """Triangles (m, 3): indices of particles of these arrays, from 0."""
        return self.topology.triangles.astype(np.int64) - self.topology.first_particle

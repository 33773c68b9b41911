"""What keeps surfaces of cloth apart: in diagnostics, and as columns of tables."""

from __future__ import annotations

import numpy as np
import pytest

import nappe
from nappe import Diagnostics, SurfaceReport, v1
from nappe._wire._diagnostics import diagnostics_array, diagnostics_table
from nappe._wire._reading import read

# A sheet of 36 particles that falls flat.
SCENE = """
version = 1
dt = 0.002
contact = { surface = "count" }

[[body]]
name = "sheet"
mesh = { grid = [6, 6], spacing = 0.1 }
mass = { particle = 0.01 }
springs = { stretch = { stiffness = 50, damping = 0.02 }, shear = { stiffness = 20, damping = 0.01 } }
"""


def test_a_surface_report_is_a_value_with_columns() -> None:
    first = read(Diagnostics, v1.Diagnostics())
    near = v1.SurfaceReport(
        pairs=12, active=3, rounds=2, least_gap_m=0.0015, failed=1, yield_m=0.25, yielding=7, largest_push_n=2.5
    )
    told = read(Diagnostics, v1.Diagnostics(step=1, surface=near))
    far = read(Diagnostics, v1.Diagnostics(step=2, surface=v1.SurfaceReport(crossings=0)))
    assert first.surface is None
    assert told.surface == SurfaceReport(12, 3, 2, 0.0015, 1, None, 0.25, 7, 2.5)
    assert far.surface == SurfaceReport(0, 0, 0, None, 0, 0, 0.0, 0, 0.0)

    table = diagnostics_table([first, told, far])
    assert table["surface_pairs"].tolist() == [0, 12, 0] and table["surface_pairs"].dtype == np.int64
    assert table["surface_crossings"].tolist() == [-1, -1, 0] and table["surface_crossings"].dtype == np.int64
    np.testing.assert_array_equal(table["surface_least_gap_m"], [np.nan, 0.0015, np.nan])
    np.testing.assert_array_equal(table["surface_yield_m"], [np.nan, 0.25, 0.0])
    assert table["surface_yielding"].tolist() == [0, 7, 0]
    assert "surface_crossings" not in diagnostics_table([first, told])
    assert not any(name.startswith("surface") for name in diagnostics_table([first]))
    assert diagnostics_array([told])["surface_failed"].tolist() == [1]


def test_crossings_are_counted_where_a_scene_asks_for_it(server: nappe.Server) -> None:
    with server.create(SCENE) as session:
        diagnostics = session.step(3, frame=True).diagnostics
        assert diagnostics is not None and diagnostics.surface is not None
        assert diagnostics.surface.crossings == 0 and diagnostics.surface.least_gap_m is None


def test_a_thickness_that_does_not_fit_is_refused_with_its_key(server: nappe.Server) -> None:
    thick = SCENE.replace('name = "sheet"', 'name = "sheet"\nthickness = 0.06')
    with pytest.raises(nappe.Refused, match=r"thickness: is 0\.06 m, above half of the shortest edge"):
        server.create(thick)

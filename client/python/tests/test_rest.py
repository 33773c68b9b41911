"""How still cloth lies: in diagnostics, and as columns of tables."""

from __future__ import annotations

import numpy as np
import pytest

import nappe
from nappe import Diagnostics, RestReport, v1
from nappe._wire._diagnostics import diagnostics_table
from nappe._wire._reading import read

# Two sheets of 9 particles, without gravity and at rest; one of them goes by.
SCENE = """
version = 1
dt = 0.01
steps = 100
gravity = [0, 0, 0]
rest = { error = 1e-3 }

[[body]]
name = "lies"
mesh = { grid = [3, 3], spacing = 0.1 }
mass = { particle = 0.01 }
springs = { stretch = { stiffness = 50, damping = 0.02 } }

[[body]]
name = "goes"
mesh = { grid = [3, 3], spacing = 0.1 }
mass = { particle = 0.01 }
springs = { stretch = { stiffness = 50, damping = 0.02 } }
velocity = [1, 0, 0]
"""


def test_a_rest_report_is_a_value_with_columns() -> None:
    first = read(Diagnostics, v1.Diagnostics())
    still = v1.RestReport(calm_share=0.5, pieces=4, calm_pieces=2, way_m=0.25, change_m=0.125, awake_share=0.75)
    still.wake_cause = v1.WAKE_CAUSE_COLLIDER
    told = read(Diagnostics, v1.Diagnostics(step=1, rest=still))
    assert first.rest is None
    assert told.rest == RestReport(0.5, 4, 2, 0.25, 0.125, 0.75, 0, 0.0, 0, 0, "collider")

    table = diagnostics_table([first, told])
    assert table["rest_calm_pieces"].tolist() == [0, 2] and table["rest_calm_pieces"].dtype == np.int64
    np.testing.assert_array_equal(table["rest_calm_share"], [np.nan, 0.5])
    assert not any(name.startswith("rest") for name in diagnostics_table([first]))


def test_what_lies_still_is_calm_after_three_windows(server: nappe.Server) -> None:
    with server.create(SCENE) as session:
        before = session.step(23, frame=True).diagnostics
        after = session.step(1, frame=True).diagnostics
        assert before is not None and before.rest is not None and before.rest.calm_share == 0.0
        assert after is not None and after.rest is not None
        assert (after.rest.calm_share, after.rest.pieces, after.rest.calm_pieces) == (0.5, 2, 1)
        assert (before.rest.awake_share, after.rest.awake_share, after.rest.pieces_asleep) == (1.0, 0.5, 1)
        assert after.rest.way_m == pytest.approx(0.08, rel=1e-3)


def test_a_table_for_rest_without_a_time_is_refused_with_its_key(server: nappe.Server) -> None:
    with pytest.raises(nappe.Refused, match=r"rest\.within: is missing"):
        server.create(SCENE.replace("steps = 100", "steps = 0"))

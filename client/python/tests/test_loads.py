"""What colliders feel: in diagnostics, on frames by name, and as columns of tables."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_saving import trajectory

import nappe
from nappe import ColliderLoad, Diagnostics, v1
from nappe._wire._diagnostics import diagnostics_array, diagnostics_table
from nappe._wire._reading import read

# A sheet of 36 particles of 0.01 kg that lies on a floor.
SCENE = """
version = 1
dt = 0.002
precision = "f64"

[[body]]
name = "sheet"
mesh = { grid = [6, 6], spacing = 0.1 }
mass = { particle = 0.01 }
springs = { stretch = { stiffness = 50, damping = 0.02 }, shear = { stiffness = 20, damping = 0.01 } }

[[collider]]
name = "floor"
plane = { point = [0, -0.01, 0], normal = [0, 1, 0] }
margin = 0.01
friction = 0.5

[[collider]]
name = "ball"
sphere = { center = [0, -2, 0], radius = 0.2 }
"""
WEIGHT = 0.36 * 9.81


def test_a_load_is_a_value_under_the_name_of_its_collider() -> None:
    message = v1.ColliderLoad(name="floor", force=v1.Vector3(y=-2.0), torque=v1.Vector3(x=0.5), contacts=7)
    told = read(Diagnostics, v1.Diagnostics(step=1, loads=[message]))
    assert told.loads == (ColliderLoad("floor", (0, -2, 0), (0.5, 0, 0), 7),)
    first = read(Diagnostics, v1.Diagnostics())
    assert first.loads == ()

    table = diagnostics_table([first, told])
    assert table["load_floor_force_y"].tolist() == [0, -2] and table["load_floor_torque_x"].tolist() == [0, 0.5]
    assert table["load_floor_contacts"].tolist() == [0, 7] and table["load_floor_contacts"].dtype == np.int64
    assert not any(name.startswith("load") for name in diagnostics_table([first]))
    assert not any(name.startswith("load") for name in diagnostics_array([told]).dtype.names or ())


def test_an_archive_has_the_loads_of_each_frame(tmp_path: Path) -> None:
    whole = trajectory()
    empty = read(Diagnostics, v1.Diagnostics())
    floor, lid = ColliderLoad("floor", (0, -2, 0), (0.5, 0, 0), 7), ColliderLoad("lid", (1, 0, 0), (0, 0, 3), 1)
    told = replace(empty, loads=(floor, lid))
    steps = (None, empty, *[told] * (len(whole) - 2))
    with np.load(replace(whole, steps=steps).save(tmp_path / "run.npz")) as file:
        assert file["load_names"].tolist() == ["floor", "lid"]
        force, torque, contacts = file["load_force"], file["load_torque"], file["load_contacts"]
        assert force.shape == torque.shape == (len(whole), 2, 3) and contacts.shape == (len(whole), 2)
        assert not force[:2].any() and not torque[:2].any() and not contacts[:2].any()
        assert (force[2:, 0] == floor.force).all() and (torque[2:, 1] == lid.torque).all()
        assert (contacts[2:] == [7, 1]).all() and contacts.dtype == np.int64
    with np.load(whole.save(tmp_path / "run.npz")) as file:
        assert file["load_names"].shape == (0,) and file["load_force"].shape == (len(whole), 0, 3)


def test_a_floor_feels_the_weight_of_what_lies_on_it(server: nappe.Server) -> None:
    with server.create(SCENE) as session:
        frame = session.step(5, frame=True)
        assert list(frame.loads) == ["floor", "ball"]
        floor, ball = frame.loads["floor"], frame.loads["ball"]
        assert floor.force == pytest.approx((0, -WEIGHT, 0), abs=1e-3 * WEIGHT)
        assert floor.torque == pytest.approx((0.25 * WEIGHT, 0, -0.25 * WEIGHT), abs=1e-3 * WEIGHT)
        assert ball == ColliderLoad("ball", (0, 0, 0), (0, 0, 0), 0)
        assert session.info.diagnostics is not None and session.info.diagnostics.loads == (floor, ball)

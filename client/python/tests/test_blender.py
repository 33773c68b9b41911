"""A scene of USD that the command writes, in Blender, where its package for Python is installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_usd import written

import nappe


@pytest.mark.parametrize(("scene", "steps", "frame"), [("demo", 160, 40), ("two_snowballs", 72, 36)])
def test_blender_shows_bodies_and_colliders_where_they_are(
    server: nappe.Server, tmp_path: Path, scene: str, steps: int, frame: int
) -> None:
    bpy = pytest.importorskip("bpy", reason="Blender's package bpy is not installed, which this test needs alone")
    file = written(tmp_path, scene, steps)
    with server.create(scene, step_limit=steps) as session:
        whole = session.trajectory()
    assert len(whole) == frame + 1

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(file))
    bpy.context.scene.frame_set(frame)
    shown = bpy.context.evaluated_depsgraph_get()
    for name in (body.name for body in whole.topology.bodies):
        thing = bpy.data.objects[name].evaluated_get(shown)
        points = thing.data.vertices if hasattr(thing.data, "vertices") else thing.data.points
        found = np.array([list(thing.matrix_world @ point.co) for point in points])
        # Upright: y is up in nappe, and z in Blender.
        expected = whole.body(name).positions[frame][:, [0, 2, 1]] * (1.0, -1.0, 1.0)
        assert found.shape == expected.shape and np.abs(found - expected).max() < 1e-6, name
    if scene == "demo":
        at = bpy.data.objects["sphere"].evaluated_get(shown).matrix_world.translation
        assert np.allclose(list(at), (0.0, 0.0, 0.6), rtol=0, atol=1e-6)

"""A scene of USD that the command writes: usd-core reads the numbers of the same session, where it is installed."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import nappe
from nappe._server._launch import program

WHY = "usd-core is not installed, which this test needs alone"


@pytest.mark.parametrize(("scene", "steps"), [("demo", 80), ("two_snowballs", 8)])
def test_usd_core_reads_the_bits_of_the_session(server: nappe.Server, tmp_path: Path, scene: str, steps: int) -> None:
    usd = pytest.importorskip("pxr.Usd", reason=WHY)
    geom = pytest.importorskip("pxr.UsdGeom", reason=WHY)
    command = Path(program()).with_name("nappe")
    if not command.is_file():
        pytest.skip("the command is not beside the server, and this test needs it")
    file = tmp_path / "run.usda"
    run = [command, "run", scene, "--steps", str(steps), "--quiet", "--save", file]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
    with server.create(scene, step_limit=steps) as session:
        whole = session.trajectory(fields=("positions", "velocities"))

    stage = usd.Stage.Open(str(file))
    assert geom.GetStageUpAxis(stage) == "Y" and geom.GetStageMetersPerUnit(stage) == 1.0
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, len(whole) - 1.0)
    for name in (body.name for body in whole.topology.bodies):
        body, prim = whole.body(name), stage.GetPrimAtPath(f"/World/{name}")
        points = geom.PointBased(prim)
        for code, time in enumerate(whole.time):
            assert code / stage.GetTimeCodesPerSecond() == pytest.approx(time, abs=1e-9)
            read = [attribute.Get(float(code)) for attribute in (points.GetPointsAttr(), points.GetVelocitiesAttr())]
            assert np.array_equal(np.array(read[0], np.float32), body.positions[code])
            assert np.array_equal(np.array(read[1], np.float32), body.velocities[code])
        if len(body.triangles):
            corners = np.array(geom.Mesh(prim).GetFaceVertexIndicesAttr().Get())
            assert np.array_equal(corners.reshape(-1, 3), body.triangles)
    kinds = {str(collider.GetTypeName()) for collider in stage.GetPrimAtPath("/World/colliders").GetChildren()}
    assert kinds == ({"Sphere", "Mesh"} if scene == "demo" else {"Mesh"})

"""A scene of USD that the command writes: usd-core reads the numbers of the same session, where it is installed."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_vtk import GOLDEN, golden_positions

import nappe
from nappe._server._launch import program

WHY = "usd-core is not installed, which this test needs alone"
# Scenes, steps of each, and the kinds of their colliders; endless ones are meshes.
SCENES: dict[str, tuple[int, set[str]]] = {
    "demo": (80, {"Sphere", "Mesh"}),
    "flag": (8, set()),
    "gripper": (80, {"Mesh", "Cube"}),
    "five_sheets": (8, {"Sphere", "Mesh"}),
    "snow_and_cloth": (20, {"Sphere", "Mesh"}),
    "two_snowballs": (8, {"Mesh"}),
    "drap10": (16, set()),
}


def written(tmp_path: Path, scene: str, steps: int) -> Path:
    """The file that the command writes of a scene."""
    command = Path(program()).with_name("nappe")
    if not command.is_file():
        pytest.skip("the command is not beside the server, and this test needs it")
    file = tmp_path / "run.usda"
    run = [command, "run", scene, "--steps", str(steps), "--quiet", "--save", file]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
    return file


def called(prim: Any) -> dict[str, Any]:
    """The prims below one, by what the scene calls them."""
    below = {child.GetCustomDataByKey("name"): child for child in prim.GetChildren()}
    return {name: child for name, child in below.items() if name is not None}


@pytest.mark.parametrize("scene", SCENES)
def test_usd_core_reads_the_bits_of_the_session(server: nappe.Server, tmp_path: Path, scene: str) -> None:
    usd = pytest.importorskip("pxr.Usd", reason=WHY)
    geom = pytest.importorskip("pxr.UsdGeom", reason=WHY)
    steps, kinds = SCENES[scene]
    file = written(tmp_path, scene, steps)
    with server.create(scene, step_limit=steps) as session:
        whole = session.trajectory(fields=("positions", "velocities"))

    stage = usd.Stage.Open(str(file))
    assert geom.GetStageUpAxis(stage) == "Y" and geom.GetStageMetersPerUnit(stage) == 1.0
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, len(whole) - 1.0)
    rate = stage.GetTimeCodesPerSecond()
    bodies = called(stage.GetPrimAtPath("/World"))
    for name in (body.name for body in whole.topology.bodies):
        body, prim = whole.body(name), bodies[name]
        points = geom.PointBased(prim)
        for code, time in enumerate(whole.time):
            assert code / rate == pytest.approx(time, abs=1e-9)
            read = [attribute.Get(float(code)) for attribute in (points.GetPointsAttr(), points.GetVelocitiesAttr())]
            assert np.array_equal(np.array(read[0], np.float32), body.positions[code])
            assert np.array_equal(np.array(read[1], np.float32), body.velocities[code])
            low, high = np.array(points.GetExtentAttr().Get(float(code)), np.float32)
            assert (low <= body.positions[code]).all() and (body.positions[code] <= high).all()
        if len(body.triangles):
            corners = np.array(geom.Mesh(prim).GetFaceVertexIndicesAttr().Get())
            assert np.array_equal(corners.reshape(-1, 3), body.triangles)

    colliders = called(stage.GetPrimAtPath("/World/colliders"))
    assert {str(collider.GetTypeName()) for collider in colliders.values()} == kinds
    assert colliders.keys() == {collider.name for collider in whole.topology.colliders}
    for code, poses in enumerate(whole.poses):
        for name, (position, (x, y, z, w)) in poses.items():
            placed = geom.Xformable(colliders[name])
            still, matrix = (np.array(placed.GetLocalTransformation(at)) for at in (0.0, float(code)))
            assert matrix[3, :3].tolist() == list(position), name
            # Its axes, a row each, are turned as the pose says.
            across = 2 * np.cross((x, y, z), still[:3, :3])
            turned = still[:3, :3] + w * across + np.cross((x, y, z), across)
            assert np.allclose(matrix[:3, :3], turned, rtol=0, atol=1e-7), name


def test_usd_core_reads_the_committed_scene() -> None:
    usd = pytest.importorskip("pxr.Usd", reason=WHY)
    geom = pytest.importorskip("pxr.UsdGeom", reason=WHY)
    stage = usd.Stage.Open(str(GOLDEN / "two.usda"))
    bodies = called(stage.GetPrimAtPath("/World"))
    kinds = {"sheet": "Mesh", '12 <&> "é"': "Points", "rope": "BasisCurves"}
    assert {name: str(prim.GetTypeName()) for name, prim in bodies.items()} == kinds
    own = {"sheet": slice(0, 4), '12 <&> "é"': slice(4, 6), "rope": slice(6, 8)}
    for code in (0, 1):
        positions = golden_positions(code).astype(np.float32)
        velocities = (golden_positions(code) / 3).astype(np.float32)
        for name, prim in bodies.items():
            points = geom.PointBased(prim)
            assert np.array_equal(np.array(points.GetPointsAttr().Get(float(code))), positions[own[name]])
            assert np.array_equal(np.array(points.GetVelocitiesAttr().Get(float(code))), velocities[own[name]])
    colliders = called(stage.GetPrimAtPath("/World/colliders"))
    places = {name: geom.Xformable(prim).GetLocalTransformation(1.0) for name, prim in colliders.items()}
    at = {name: list(place.ExtractTranslation()) for name, place in places.items()}
    assert at == {"ball": [0, -0.99, 0], "box": [2, 0.25, 0], "floor": [0, -1.5, 0]}
    # Half of its height is along its second axis, which was x and is turned about z, with a cosine of 0.28.
    assert np.allclose(np.array(places["box"])[1, :3], (0.28, 0.96, 0.0), rtol=0, atol=1e-12)
    assert complaints(GOLDEN / "two.usda") == []


def complaints(file: Path) -> list[str]:
    """What the validators of usd-core say of a file; older versions have them as a checker."""
    usd = pytest.importorskip("pxr.Usd", reason=WHY)
    try:
        from pxr import UsdValidation
    except ImportError:
        from pxr import UsdUtils

        checker = UsdUtils.ComplianceChecker(arkit=False, skipARKitRootLayerCheck=True)
        checker.CheckCompliance(str(file))
        return [*checker.GetErrors(), *checker.GetFailedChecks()]
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(usd.Stage.Open(str(file)))
    return [error.GetErrorAsString() for error in found]


@pytest.mark.parametrize("scene", ["demo", "gripper", "snow_and_cloth"])
def test_the_validators_of_usd_core_report_nothing(tmp_path: Path, scene: str) -> None:
    pytest.importorskip("pxr.Usd", reason=WHY)
    assert complaints(written(tmp_path, scene, 4)) == []

"""Files for ParaView: what is written reads back as what it was, without VTK, and with it where it is installed."""

from __future__ import annotations

import re
import subprocess
import sys
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_saving import FRAMES, HASH, SHEET, SNOW, tetrahedron, trajectory
from test_topology import SHAPES

import nappe
from nappe import v1
from nappe._save._solids import reference, scene_around, surface
from nappe._save._trajectory import Trajectory
from nappe._server._launch import program
from nappe._wire._colliders import Collider
from nappe._wire._errors import Error
from nappe._wire._reports import ColliderLoad

MARK = b'<AppendedData encoding="raw">\n_'
TYPES = {"Float32": "<f4", "Float64": "<f8", "Int32": "<i4"}
NO_TURN = (0.0, 0.0, 0.0, 1.0)
# Two frames as the command saves them, which its own tests compare byte by byte.
GOLDEN = Path(__file__).parents[2] / "cli" / "tests" / "golden"


def golden_positions(frame: int) -> np.ndarray[Any, Any]:
    """The positions of a committed frame; velocities are a third of them per second."""
    return (0.1 * np.arange(24) - 0.7 + 0.02 * frame).reshape(-1, 3)


class Vtp:
    """A .vtp file: its elements, and its appended arrays."""

    def __init__(self, path: Path) -> None:
        head, self._data = path.read_bytes().split(MARK, 1)
        assert self._data.endswith(b"\n</AppendedData>\n</VTKFile>\n")
        self.head = head.decode("utf-8")

    def fact(self, name: str) -> list[str]:
        found = re.search(f' Name="{name}"[^>]*>([^<]*)<', self.head)
        assert found, name
        return found[1].split(" ")

    def numbers(self, name: str) -> list[float]:
        return [float(word) for word in self.fact(name)]

    def texts(self, name: str) -> list[str]:
        texts = bytes(map(int, self.fact(name))).split(b"\0")
        assert texts.pop() == b""
        return [text.decode("utf-8") for text in texts]

    def array(self, section: str, name: str) -> np.ndarray[Any, Any]:
        within = self.head.split(f"<{section}>\n", 1)[1].split(f"</{section}>", 1)[0]
        pattern = f'type="(.*?)" Name="{name}" NumberOfComponents="(.*?)" format="appended" offset="(.*?)"'
        found = re.search(pattern, within)
        assert found, name
        kind, components, offset = found[1], int(found[2]), int(found[3])
        count, block, _ = np.frombuffer(self._data, "<u4", 3, offset).tolist()
        sizes = np.frombuffer(self._data, "<u4", count, offset + 12).tolist()
        place, data = offset + 12 + 4 * count, b""
        for number, size in enumerate(sizes):
            data += zlib.decompress(self._data[place : place + size])
            assert number + 1 == count or len(data) == (number + 1) * block
            place += size
        array = np.frombuffer(data, TYPES[kind])
        return array.reshape(-1, components) if components > 1 else array


def listed(path: Path, part: str) -> list[tuple[float, str]]:
    """Times and names of the files that an index lists."""
    rows = re.findall(f'<DataSet timestep="(.*?)" part=".*?" name="{part}" file="(.*?)"/>', path.read_text("utf-8"))
    return [(float(time), file) for time, file in rows]


def felt() -> Trajectory:
    """A trajectory in which a collider felt something, and keys moved another one."""
    whole = trajectory(np.float64)
    load = ColliderLoad("ball", (1.0, -2.5, 1e21), (0.0, 1e-7, 0.0), 4)
    steps = (None, *(replace(step, loads=(load,)) for step in whole.steps[1:] if step is not None))
    floor = Collider("floor", "plane", (0.0, 0.0, 0.0), {"point": (0.0, -1.0, 0.0), "normal": (0.0, 1.0, 0.0)})
    topology = replace(whole.topology, colliders=(*whole.topology.colliders, floor))
    turned = ((0.0, -2.0, 0.0), (0.0, 0.0, 0.6, 0.8))
    poses = tuple({"floor": turned if number > 1 else ((0.0, -1.0, 0.0), NO_TURN)} for number in range(FRAMES))
    return replace(whole, steps=steps, topology=topology, poses=poses)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_array_has_the_bits_of_the_trajectory(tmp_path: Path, dtype: type[Any]) -> None:
    whole = trajectory(dtype)
    more = {"force": 3 * whole.velocities, "acceleration": -whole.velocities}
    whole = replace(whole, arrays={**whole.arrays, **more})
    path = whole.save(tmp_path / "run.pvd")
    frames = listed(path, "particles")
    assert [time for time, _ in frames] == whole.time.tolist()
    names = {"velocities": "velocity", "plastic_ratio": "plastic_ratio", "stress": "stress_norm"}
    names |= {name: name for name in more}
    for index, (_, file) in enumerate(frames):
        assert file == f"run/frame-{index:06}.vtp"
        vtp = Vtp(tmp_path / file)
        points = vtp.array("Points", "Points")
        assert points.dtype == whole.positions.dtype and np.array_equal(points, whole.positions[index])
        for key, name in names.items():
            assert np.array_equal(vtp.array("PointData", name), whole.arrays[key][index])
        assert vtp.numbers("TimeValue") == [whole.time[index]]
        assert (vtp.numbers("step"), vtp.numbers("frame")) == ([whole.step[index]], [index])
        assert vtp.texts("body_names") == ["sheet", "snow"]
        assert (' Name="state_hash"' in vtp.head) == (index % 2 == 0)
        assert (' Name="kinetic_energy"' in vtp.head) == (index > 0)
    vtp = Vtp(tmp_path / frames[2][1])
    assert vtp.texts("state_hash") == [HASH]
    assert (vtp.numbers("kinetic_energy"), vtp.numbers("max_stretch")) == ([10.0], [0.0])
    # Snow as vertices, the sheet as triangles: each cell has the number of its body.
    assert f'NumberOfVerts="{SNOW}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="6"' in vtp.head
    assert vtp.array("CellData", "body").tolist() == [1] * SNOW + [0] * 6
    assert vtp.array("Verts", "connectivity").tolist() == list(range(SHEET, SHEET + SNOW))
    assert np.array_equal(vtp.array("Polys", "connectivity").reshape(-1, 3), whole.topology.triangles)
    assert vtp.array("Polys", "offsets").tolist() == [3, 6, 9, 12, 15, 18]


def test_colliders_are_written_where_they_are_whenever_one_has_moved(tmp_path: Path) -> None:
    whole = felt()
    whole = replace(whole, topology=replace(whole.topology, colliders=(whole.topology.colliders[1],)))
    path = whole.save(tmp_path / "run.pvd")
    written = [file for _, file in listed(path, "colliders")]
    assert written == ["run/colliders-000000.vtp"] * 2 + ["run/colliders-000002.vtp"] * (FRAMES - 2)
    before, after = (Vtp(tmp_path / file) for file in (written[0], written[-1]))
    assert before.texts("collider_names") == ["floor"]
    assert (before.numbers("collider_position"), after.numbers("collider_position")) == ([0, -1, 0], [0, -2, 0])
    assert after.numbers("collider_turn") == [0.0, 0.0, 0.6, 0.8]
    assert np.allclose(before.array("Points", "Points")[:, 1], -1.0, atol=1e-12)
    # Turned about z: what was along x leans up with a sine of 0.96.
    points = after.array("Points", "Points") - (0.0, -2.0, 0.0)
    assert np.allclose(points @ (-0.96, 0.28, 0.0), 0.0, atol=1e-12)
    assert after.array("CellData", "collider").tolist() == [0, 0]

    other = felt()
    moving = listed(other.save(tmp_path / "other.pvd"), "colliders")
    assert len({file for _, file in moving}) == FRAMES, "the ball goes up in each frame"
    frame = Vtp(tmp_path / listed(tmp_path / "other.pvd", "particles")[3][1])
    assert (frame.texts("load_names"), frame.fact("load_force")) == (["ball"], ["1", "-2.5", "1" + "0" * 21])
    assert (frame.numbers("load_torque"), frame.numbers("load_contacts")) == ([0, 1e-7, 0], [4])


def volume(points: np.ndarray[Any, Any], triangles: np.ndarray[Any, Any]) -> float:
    """Volume within a closed surface, above 0 if it is turned outwards."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def test_solids_have_the_volumes_of_their_shapes_and_are_turned_outwards() -> None:
    radius, still = 0.5, (0.0, 0.0, 0.0)
    ends: dict[str, Any] = {"start": (0.0, 1.0, 0.0), "end": (2.0, 1.0, 1.0), "radius": radius}
    box: dict[str, Any] = {"center": (1.0, 0.0, 0.0), "half_extent": (0.5, 1.0, 1.5)}
    box |= {"axis_x": (0.0, 0.6, 0.8), "axis_y": (1.0, 0.0, 0.0)}
    ball, rod = 4 / 3 * np.pi * radius**3, np.pi * radius**2 * np.sqrt(5)
    scene = scene_around(np.zeros((0, 3)))
    for kind, shape, expected in (
        ("sphere", {"center": (1.0, 2.0, 3.0), "radius": radius}, ball),
        ("capsule", ends, ball + rod),
        ("cylinder", ends, rod),
        ("box", box, 6.0),
        ("mesh", tetrahedron("mesh", 0.5).shape, 1 / 6),
    ):
        found = volume(*surface(Collider("it", kind, still, shape), scene))
        assert 0.99 * expected < found <= expected * (1 + 1e-12), kind
    trough: dict[str, Any] = {"point": (0.0, 0.0, 7.0), "axis": (0.0, 0.0, 1.0), "up": (0.0, 1.0, 0.0), "radius": 1.0}
    points, triangles = surface(Collider("it", "half_pipe", still, trough), scene)
    assert (points[:, 1].min(), np.abs(points[:, 2]).max()) == (pytest.approx(-1.0), pytest.approx(1.4))
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    free = (0.0, 1.0, 0.0) - (a + b + c) / 3 * (1.0, 1.0, 0.0)
    assert (np.cross(b - a, c - a) * free).sum(axis=1).min() > 0


def test_every_shape_of_the_contract_has_a_surface_and_a_reference_point() -> None:
    shapes: dict[str, dict[str, Any]] = {kind: numbers for kind, (_, numbers) in SHAPES.items()}
    shapes["mesh"] = {**tetrahedron("mesh", 0.5).shape, "origin": (1.0, 2.0, 3.0)}
    assert shapes.keys() == {field.name for field in v1.ColliderShape.DESCRIPTOR.oneofs_by_name["shape"].fields}
    for kind, shape in shapes.items():
        collider = Collider("it", kind, (0.0, 0.0, 0.0), shape)
        points, triangles = surface(collider, scene_around(np.zeros((0, 3))))
        assert np.isfinite(points).all() and len(triangles) > 0 and triangles.max() < len(points), kind
        assert reference(collider).any(), kind


def test_a_folder_with_frames_is_refused_and_an_index_is_replaced(tmp_path: Path) -> None:
    trajectory().save(tmp_path / "run.pvd")
    before = (tmp_path / "run.pvd").read_bytes()
    with pytest.raises(Error, match=r"holds frames already \(colliders-000000.vtp\)"):
        trajectory(np.float32, "positions").save(tmp_path / "run.pvd")
    with pytest.raises(Error, match="holds frames already"):
        trajectory().save(tmp_path / "run")
    with pytest.raises(Error, match=r"fields=\('positions'"):
        trajectory(np.float32, "stress").save(tmp_path / "new.pvd")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["run", "run.pvd"]
    assert (tmp_path / "run.pvd").read_bytes() == before
    for entry in (tmp_path / "run").iterdir():
        entry.unlink()
    trajectory(np.float64, "positions").save(tmp_path / "run.pvd")
    assert Vtp(tmp_path / "run" / "frame-000003.vtp").array("Points", "Points").dtype == np.float64


def test_vtk_reads_the_numbers_that_were_written(tmp_path: Path) -> None:
    pytest.importorskip("vtkmodules", reason="VTK is not installed, which this test needs alone")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    whole = felt()
    path = whole.save(tmp_path / "run.pvd")
    for part in ("particles", "colliders"):
        for index, (time, file) in enumerate(listed(path, part)):
            reader = vtkXMLPolyDataReader()
            reader.SetFileName(str(tmp_path / file))
            reader.Update()
            data, own = reader.GetOutput(), Vtp(tmp_path / file)
            assert np.array_equal(vtk_to_numpy(data.GetPoints().GetData()), own.array("Points", "Points"))
            corners = vtk_to_numpy(data.GetPolys().GetConnectivityArray())
            assert np.array_equal(corners, own.array("Polys", "connectivity"))
            assert vtk_to_numpy(data.GetFieldData().GetArray("TimeValue")).tolist() == [time]
            if part == "particles":
                assert np.array_equal(vtk_to_numpy(data.GetPointData().GetArray("velocity")), whole.velocities[index])
                assert np.array_equal(vtk_to_numpy(data.GetCellData().GetArray("body")), own.array("CellData", "body"))
                names = data.GetFieldData().GetAbstractArray("body_names")
                assert [names.GetValue(at) for at in range(names.GetNumberOfValues())] == ["sheet", "snow"]


def test_the_committed_files_hold_the_numbers_of_their_frames() -> None:
    frames = listed(GOLDEN / "two.pvd", "particles")
    assert [time for time, _ in frames] == [0.0, 0.02]
    for index, (time, file) in enumerate(frames):
        vtp, positions = Vtp(GOLDEN / file), golden_positions(index)
        assert np.array_equal(vtp.array("Points", "Points"), positions)
        assert np.array_equal(vtp.array("PointData", "velocity"), positions / 3)
        assert vtp.texts("body_names") == ["sheet", '12 <&> "é"', "rope"]
        assert (vtp.numbers("TimeValue"), vtp.numbers("step")) == ([time], [2 * index])
        assert vtp.array("CellData", "body").tolist() == [1, 1, 2, 0, 0]
        assert vtp.array("Lines", "connectivity").tolist() == [6, 7]
    last = Vtp(GOLDEN / frames[1][1])
    assert (last.numbers("kinetic_energy"), last.numbers("load_force")) == ([0.1 + 0.2], [0.1, -2.5, 1e21])
    poses = [Vtp(GOLDEN / file) for _, file in listed(GOLDEN / "two.pvd", "colliders")]
    assert poses[0].numbers("collider_position") == [0, -1, 0, 2, 0, 0, 0, -1.5, 0]
    assert poses[1].numbers("collider_position") == [0, -0.99, 0, 2, 0.25, 0, 0, -1.5, 0]


def test_vtk_reads_the_committed_files() -> None:
    pytest.importorskip("vtkmodules", reason="VTK is not installed, which this test needs alone")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    for index, (time, file) in enumerate(listed(GOLDEN / "two.pvd", "particles")):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(GOLDEN / file))
        reader.Update()
        data = reader.GetOutput()
        assert np.array_equal(vtk_to_numpy(data.GetPoints().GetData()), golden_positions(index))
        assert (data.GetNumberOfVerts(), data.GetNumberOfLines(), data.GetNumberOfPolys()) == (2, 1, 2)
        names = data.GetFieldData().GetAbstractArray("body_names")
        assert [names.GetValue(at) for at in range(names.GetNumberOfValues())] == ["sheet", '12 <&> "é"', "rope"]
        assert vtk_to_numpy(data.GetFieldData().GetArray("TimeValue")).tolist() == [time]


@pytest.mark.parametrize("precision", ["f32", "f64"])
@pytest.mark.parametrize(
    ("scene", "steps"),
    [("demo", 40), ("flag", 8), ("gripper", 80), ("five_sheets", 8), ("snow_and_cloth", 20), ("two_snowballs", 4)],
)
def test_vtk_reads_the_files_of_the_command_as_the_session_has_them(
    server: nappe.Server, tmp_path: Path, scene: str, steps: int, precision: str
) -> None:
    pytest.importorskip("vtkmodules", reason="VTK is not installed, which this test needs alone")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    command = Path(program()).with_name("nappe")
    if not command.is_file():
        pytest.skip("the command is not beside the server, and this test needs it")
    path = tmp_path / "run.pvd"
    run = [command, "run", scene, "--steps", str(steps), "--precision", precision, "--fields", "velocity"]
    subprocess.run([*run, "--quiet", "--save", path], check=True, stdout=subprocess.DEVNULL)
    with server.create(scene, step_limit=steps, precision=precision) as session:
        whole = session.trajectory(fields=("positions", "velocities"), precision=precision)
    frames = listed(path, "particles")
    assert [time for time, _ in frames] == whole.time.tolist()
    for index, (time, file) in enumerate(frames):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(tmp_path / file))
        reader.Update()
        data = reader.GetOutput()
        points = vtk_to_numpy(data.GetPoints().GetData())
        assert points.dtype == whole.positions.dtype and np.array_equal(points, whole.positions[index])
        assert np.array_equal(vtk_to_numpy(data.GetPointData().GetArray("velocity")), whole.velocities[index])
        assert vtk_to_numpy(data.GetFieldData().GetArray("TimeValue")).tolist() == [time]
        if len(whole.topology.triangles):
            corners = vtk_to_numpy(data.GetPolys().GetConnectivityArray())
            assert np.array_equal(corners.reshape(-1, 3), whole.topology.triangles)
    if not whole.topology.colliders:
        return
    for (_, file), poses in zip(listed(path, "colliders"), whole.poses, strict=True):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(tmp_path / file))
        reader.Update()
        told = reader.GetOutput().GetFieldData()
        names = told.GetAbstractArray("collider_names")
        at = {names.GetValue(number): number for number in range(names.GetNumberOfValues())}
        for name, (position, turn) in poses.items():
            # As the file of the frame in which a collider moved last has them.
            assert vtk_to_numpy(told.GetArray("collider_position"))[at[name]].tolist() == list(position)
            assert np.allclose(vtk_to_numpy(told.GetArray("collider_turn"))[at[name]], turn, atol=1e-7)


def test_a_vtkhdf_file_needs_h5py_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(Error, match=r"run.vtkhdf: the package h5py writes .vtkhdf files.*pip install h5py"):
        trajectory().save(tmp_path / "run.vtkhdf")
    with pytest.raises(Error, match=r"run.vtk ends in '.vtk'; allowed: .*\.pvd or \.vtkhdf"):
        trajectory().save(tmp_path / "run.vtk")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_vtkhdf_file_has_the_bits_of_the_trajectory(tmp_path: Path, dtype: type[Any]) -> None:
    h5py = pytest.importorskip("h5py", reason="h5py is not installed, which this test needs alone")
    whole = trajectory(dtype)
    (tmp_path / "run.vtkhdf").write_bytes(b"old")
    path = whole.save(tmp_path / "run.vtkhdf")
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.vtkhdf"]
    particles = SHEET + SNOW
    with h5py.File(path, "r") as file:
        root = file["VTKHDF"]
        assert (root.attrs["Type"], list(root.attrs["Version"])) == (b"PolyData", [2, 0])
        assert root["Points"].dtype == whole.positions.dtype
        assert np.array_equal(root["Points"][:], whole.positions.reshape(-1, 3))
        assert np.array_equal(root["PointData/velocity"][:], whole.velocities.reshape(-1, 3))
        assert np.array_equal(root["PointData/stress_norm"][:], whole.arrays["stress"].reshape(-1))
        assert root["Steps/Values"][:].tolist() == whole.time.tolist()
        assert root["Steps/PointOffsets"][:].tolist() == [particles * number for number in range(FRAMES)]
        assert root["Polygons/Connectivity"][:].tolist() == whole.topology.triangles.reshape(-1).tolist()
        assert root["Vertices/Offsets"][:].tolist() == list(range(SNOW + 1))
        assert (root["Lines/Offsets"][:].tolist(), root["Strips/Connectivity"].shape) == ([0], (0,))
        assert root["CellData/body"][:].tolist() == [1] * SNOW + [0] * 6


def test_vtk_reads_a_vtkhdf_file_frame_by_frame(tmp_path: Path) -> None:
    pytest.importorskip("h5py", reason="h5py is not installed, which this test needs, with VTK")
    pytest.importorskip("vtkmodules", reason="VTK is not installed, which this test needs, with h5py")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    whole = trajectory(np.float64)
    reader = vtkHDFReader()
    reader.SetFileName(str(whole.save(tmp_path / "run.vtkhdf")))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == FRAMES
    for index in (0, 1, FRAMES - 1):
        reader.SetStep(index)
        reader.Update()
        data = reader.GetOutput()
        assert np.array_equal(vtk_to_numpy(data.GetPoints().GetData()), whole.positions[index])
        assert np.array_equal(vtk_to_numpy(data.GetPointData().GetArray("velocity")), whole.velocities[index])
        assert (data.GetNumberOfVerts(), data.GetNumberOfPolys()) == (SNOW, 6)
        corners = vtk_to_numpy(data.GetPolys().GetConnectivityArray())
        assert np.array_equal(corners.reshape(-1, 3), whole.topology.triangles)
        assert vtk_to_numpy(data.GetCellData().GetArray("body")).tolist() == [1] * SNOW + [0] * 6

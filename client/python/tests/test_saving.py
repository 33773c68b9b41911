"""Trajectories in files and notebooks: what is written reads back as what it was."""

from __future__ import annotations

import base64
import html
import json
import re
import struct
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nappe._save._trajectory import Trajectory
from nappe._wire._colliders import Collider
from nappe._wire._diagnostics import diagnostics_array
from nappe._wire._errors import Error, Refused
from nappe._wire._packed import restore, unpack
from nappe._wire._reports import (
    ClothSteps,
    Diagnostics,
    Notices,
    RestReport,
    SnowDiagnostics,
    SolveReport,
    SurfaceReport,
)
from nappe._wire._topology import Body, Topology
from nappe._wire._values import Failure, SessionEnd, SessionInfo

FRAMES, SHEET, SNOW = 40, 12, 8
ELEMENT = re.compile(r'<script type="application/json" class="nappe-(head|block|end)">(.*?)</script>\n', re.DOTALL)
HASH = "fedcba9876543210"


def made(kind: type[Any], **known: Any) -> Any:
    """A value of a dataclass; its other fields are 0."""
    return kind(**{**dict.fromkeys((field.name for field in fields(kind)), 0), **known})


def diagnostics_of(step: int) -> Diagnostics:
    """Snow and cloth in all steps but each third; a solve that converged."""
    cloth = made(ClothSteps, dt_seconds=0.002, bound="accuracy", bound_particle=None, preconditioner=None)
    snow = made(
        SnowDiagnostics, dt_seconds=0.001, bound="speed", bound_particle=7, mass=2.5, angular_momentum=(1, 2, 3)
    )
    return made(
        Diagnostics,
        step=step,
        kinetic_energy=0.5 * step,
        momentum=(1.0, -2.0, step),
        max_stretch=1.25 if step % 2 else 0.0,
        solve=SolveReport("converged", 9, 1e-7),
        stages={"forces": 0.5},
        loads=(),
        snow=None if step % 3 == 0 else snow,
        notices=Notices(1, 2, 3, 4, 5, 6, 7, None, None),
        cloth=None if step % 3 == 0 else cloth,
        surface=None if step % 3 == 0 else made(SurfaceReport, pairs=12, least_gap_m=0.0015, crossings=None),
        rest=None
        if step % 3 == 0
        else made(RestReport, calm_share=0.25, pieces=4, change_m=0.0001, wake_cause="motion"),
    )


def bodies() -> tuple[Body, ...]:
    corners = [at for row in (0, 4) for at in range(row, row + 3)]
    triangles = np.array([(at, at + 1, at + 4) for at in corners], np.uint32)
    pins, none = np.array([0, 3], np.uint32), np.zeros(0, np.uint32)
    uv = np.zeros((0, 2), np.float32)
    sheet = Body("sheet", 0, SHEET, triangles, none.reshape(0, 2), pins, uv)
    return sheet, Body("snow", SHEET, SNOW, none.reshape(0, 3), none.reshape(0, 2), none, uv)


def trajectory(dtype: type[Any] = np.float32, *names: str, **changed: Any) -> Trajectory:
    """40 frames of a sheet and of snow, with the arrays that are named, or with all."""
    random = np.random.default_rng(7)
    start = random.uniform(-1.0, 1.0, (SHEET + SNOW, 3))
    number = np.arange(FRAMES, dtype=np.uint64)
    time = np.arange(FRAMES) * 0.01
    speed = random.uniform(-2.0, 2.0, start.shape)
    shape = (FRAMES, SHEET + SNOW)
    arrays = {
        "positions": (start + time[:, None, None] * speed).astype(dtype),
        "velocities": np.broadcast_to(speed, (*shape, 3)).astype(dtype),
        "plastic_ratio": random.uniform(0.8, 1.5, shape).astype(dtype),
        "stress": (10.0 ** random.uniform(-3.0, 6.0, shape)).astype(dtype),
    }
    info = made(SessionInfo, session_id="s-1", title="a <b> & </script>", dt_seconds=0.001, precision="f32")
    sphere = Collider("ball", "sphere", (0.0, 1.0, 0.0), {"center": (0.0, 0.5, 0.0), "radius": 0.25})
    given: dict[str, Any] = {
        "info": replace(info, snow_particle_count=SNOW),
        "topology": Topology(1, SHEET + SNOW, bodies(), (sphere,)),
        "number": number,
        "step": 10 * number,
        "time": time,
        "state_hash": (HASH, None) * (FRAMES // 2),
        "arrays": {name: arrays[name] for name in names or arrays},
        "steps": (None, *(diagnostics_of(10 * at) for at in range(1, FRAMES))),
        "end": SessionEnd(FRAMES - 1, 395, HASH),
        "scene": 'title = "a <b>"\n',
    }
    return Trajectory(**{**given, **changed})


def tetrahedron(name: str, at: float) -> Collider:
    """A mesh collider with a corner at so much along x, and edges of 1 m along the axes."""
    points = np.array([(at, 0, 0), (at + 1, 0, 0), (at, 1, 0), (at, 0, 1)], np.float32)
    triangles = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], np.uint32)
    return Collider(name, "mesh", (0.0, 0.0, 2.0), {"points": points, "triangles": triangles})


def elements(text: str) -> dict[str, list[Any]]:
    """The elements of data of a recording, after its page."""
    data = text[text.index('<script type="application/json"') :]
    found = ELEMENT.findall(data)
    assert ELEMENT.sub("", data) == "", "nothing but elements follows the page"
    assert "<" not in "".join(content for _, content in found)
    return {name: [json.loads(content) for kind, content in found if kind == name] for name in ("head", "block", "end")}


def decoded(block: dict[str, Any], key: str, components: int) -> list[Any]:
    """An array of each frame of a block: whole numbers, each a delta to the frame before."""
    arrays: list[Any] = []
    for frame in block["frames"]:
        data = base64.b64decode(frame[key], validate=True)
        arrays.append(unpack(data, SHEET + SNOW, components, arrays[-1] if arrays else None))
    return arrays


def positions_of(blocks: list[dict[str, Any]]) -> np.ndarray[Any, Any]:
    return np.stack([restore(at, block["step"]) for block in blocks for at in decoded(block, "positions", 3)])


def test_npz_holds_everything(tmp_path: Path) -> None:
    whole = trajectory(np.float64)
    path = whole.save(str(tmp_path / "run.npz"))
    assert path == tmp_path / "run.npz"
    with np.load(path) as file:
        assert set(whole.arrays) <= set(file)
        for name, array in {**whole.arrays, "number": whole.number, "step": whole.step, "time": whole.time}.items():
            assert file[name].dtype == array.dtype
            assert np.array_equal(file[name], array)
        assert file["state_hash"].tolist() == [HASH, ""] * (FRAMES // 2)
        assert file["diagnostics"].dtype == whole.diagnostics.dtype
        assert file["diagnostics"]["kinetic_energy"][3] == 15.0
        assert np.array_equal(file["triangles"], whole.topology.triangles)
        assert file["pins"].tolist() == [0, 3]
        assert file["body_names"].tolist() == ["sheet", "snow"]
        assert (file["body_first"].tolist(), file["body_count"].tolist()) == ([0, SHEET], [SHEET, SNOW])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_an_html_file_holds_positions_within_its_bound(tmp_path: Path, dtype: type[Any]) -> None:
    whole = trajectory(dtype)
    text = whole.save(tmp_path / "run.html").read_bytes().decode("utf-8")
    assert text.startswith("<!doctype html>")
    found = elements(text)
    (head,), blocks, (end,) = found.values()
    assert [len(block["frames"]) for block in blocks] == [32, 8]
    extent = float(np.ptp(whole.positions[0], axis=0).max())
    assert extent / 32768 < head["bound"] <= extent / 16384
    assert {(block["step"], block["bound"]) for block in blocks} == {(2 * head["bound"], head["bound"])}
    errors = np.abs(whole.positions.astype(np.float64) - positions_of(blocks))
    assert head["bound"] / 2 < errors.max() <= head["bound"]
    assert end == {"frames": FRAMES, "steps": 395, "hash": HASH, "finished": True}

    rows = [frame for block in blocks for frame in block["frames"]]
    assert [row["frame"] for row in rows] == whole.number.tolist()
    assert [row["step"] for row in rows] == whole.step.tolist()
    assert [row["time"] for row in rows] == whole.time.tolist()
    plotted = [tuple(row[name] for name in ("kinetic", "elastic", "stretch", "dt")) for row in rows[:4]]
    # Steps 0, 10, 20, 30: none; an even step without stretch; the shorter of two lengths; neither cloth nor snow.
    assert plotted == [(None,) * 4, (5.0, 0, None, 0.001), (10.0, 0, None, 0.001), (15.0, 0, None, None)]


def test_the_head_tells_the_scene(tmp_path: Path) -> None:
    whole = trajectory()
    (head,) = elements(whole.save(tmp_path / "run.html").read_text("utf-8"))["head"]
    assert (head["format"], head["particles"], head["dt_seconds"], head["precision"]) == (1, 20, 0.001, "f32")
    assert (head["title"], head["scene"], head["color"]) == ("a <b> & </script>", 'title = "a <b>"\n', "plastic_ratio")
    assert head["program"].startswith("nappe (Python)")
    sheet, snow = head["bodies"]
    triangles = unpack(base64.b64decode(sheet["triangles"]["data"]), sheet["triangles"]["count"], 3)
    assert np.array_equal(triangles, whole.topology.triangles)
    assert (sheet["name"], sheet["first_particle"], sheet["particle_count"], sheet["pins"]) == (
        "sheet",
        0,
        SHEET,
        [0, 3],
    )
    assert (snow["first_particle"], snow["triangles"], snow["springs"], snow["pins"]) == (SHEET, None, None, [])
    shape = {"kind": "sphere", "center": [0.0, 0.5, 0.0], "radius": 0.25}
    assert head["colliders"] == [{"name": "ball", "velocity": [0.0, 1.0, 0.0], "shape": shape}]


@pytest.mark.parametrize("color", [None, "speed", "stress", "body"])
def test_the_colour_is_what_was_asked_for(color: str | None) -> None:
    whole = trajectory()
    found = elements(whole.show(color=color).text)
    shown, blocks = found["head"][0]["color"], found["block"]
    if color == "body":
        assert shown is None
        assert {frame["scalar"] for block in blocks for frame in block["frames"]} == {None}
        return
    assert shown == (color or "plastic_ratio")
    wanted = {
        "plastic_ratio": whole.plastic_ratio,
        "speed": np.linalg.norm(whole.velocities, axis=2),
        "stress": np.log10(np.maximum(whole.stress, 1.0)),
    }[shown]
    step = blocks[0]["scalar_step"]
    scalars = np.stack([restore(at, step)[:, 0] for block in blocks for at in decoded(block, "scalar", 1)])
    assert np.abs(scalars - wanted).max() <= step / 2 + 1e-6


def test_a_colour_beyond_its_reach_is_shown_as_the_farthest() -> None:
    whole = trajectory()
    whole.velocities[5, 3] = (1e30, 1e30, 0.0)
    whole.velocities[5, 4] = np.nan
    block = elements(whole.show(color="speed").text)["block"][0]
    scalars = decoded(block, "scalar", 1)[5]
    assert scalars[3:5, 0].tolist() == [1 << 22, 0]


def test_a_particle_out_of_reach_makes_the_steps_that_follow_coarser(tmp_path: Path) -> None:
    whole = trajectory()
    whole.positions[5:7, 2, 1] = 5000.0
    found = elements(whole.save(tmp_path / "far.html", max_error=1e-4).read_text("utf-8"))
    blocks = found["block"]
    fine, coarse = 2.0**-13, 2.0**-10
    assert found["head"][0]["bound"] == fine / 2
    assert [(len(block["frames"]), block["step"]) for block in blocks] == [(5, fine), (32, coarse), (3, coarse)]
    errors = np.abs(whole.positions.astype(np.float64) - positions_of(blocks)).max(axis=(1, 2))
    assert errors[:5].max() <= fine / 2 < errors[5:].max() <= coarse / 2
    whole.positions[9, 2, 1] = 3e38
    with pytest.raises(Error, match="farther away"):
        whole.show()


def test_a_trajectory_without_frames_or_without_an_end_is_written() -> None:
    none = trajectory(
        number=np.zeros(0, np.uint64), arrays={"positions": np.zeros((0, 20, 3))}, steps=(), state_hash=()
    )
    found = elements(none.show().text)
    assert (len(found["head"]), found["block"], found["end"][0]["frames"]) == (1, [], 0)
    (end,) = elements(trajectory(end=None).show().text)["end"]
    assert end == {"frames": FRAMES, "steps": 390, "hash": None, "finished": False}


def test_a_page_says_why_its_session_failed_where_its_frames_end_there() -> None:
    failure = Failure("NOT_FINITE", "particle 3 became nan", 391, 0.391, 3, float("nan"))
    info = replace(trajectory().info, failure=failure, frame=FRAMES - 1)
    (end,) = elements(trajectory(end=None, info=info).show().text)["end"]
    assert (end["finished"], end["hash"]) == (False, None)
    assert end["failure"] == {
        "reason": "NOT_FINITE",
        "message": "particle 3 became nan",
        "diverged": True,
        "step": 391,
        "time": 0.391,
        "particle": 3,
        "value": None,
    }
    later = replace(info, frame=FRAMES + 5)
    (end,) = elements(trajectory(end=None, info=later).show().text)["end"]
    assert "failure" not in end


def test_a_notebook_gets_the_whole_page_in_a_frame() -> None:
    page = trajectory().show(height=432)
    shown = page._repr_html_()
    srcdoc, rest = re.fullmatch(r'<iframe srcdoc="([^"]*)"( [^<>]*)></iframe>', shown).groups()  # type: ignore[union-attr]
    assert not set("<>'") & set(srcdoc)
    assert html.unescape(srcdoc) == page.text
    assert len(elements(page.text)["block"]) == 2
    assert 'sandbox="allow-scripts allow-forms allow-downloads"' in rest
    assert "allow-same-origin" not in rest
    assert "height: 432px" in rest
    with pytest.raises(Refused, match="height"):
        trajectory().show(height=0)


def test_a_folder_holds_the_bytes_that_the_command_writes(tmp_path: Path) -> None:
    whole = trajectory(
        np.float32, "positions", "stress", "velocities", number=np.arange(0, 2 * FRAMES, 2, dtype=np.uint64)
    )
    whole = replace(whole, arrays={**whole.arrays, "acceleration": -whole.velocities, "force": 2 * whole.velocities})
    folder = whole.save(tmp_path / "run")
    names = sorted(path.name for path in folder.iterdir())
    assert (len(names), names[0], names[-1]) == (FRAMES, "frame-000000.ply", "frame-000078.ply")
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment step 30\ncomment time_seconds 0.03\nelement vertex 20\n"
        "property float x\nproperty float y\nproperty float z\nproperty float vx\nproperty float vy\n"
        "property float vz\nproperty float stress_norm\nproperty float fx\nproperty float fy\nproperty float fz\n"
        "property float ax\nproperty float ay\nproperty float az\nelement face 6\n"
        "property list uchar uint vertex_indices\nend_header\n"
    )
    rows = zip(whole.positions[3], whole.velocities[3], whole.stress[3], whole.force[3], strict=True)
    particles = b"".join(
        struct.pack("<13f", *position, *velocity, stress, *force, *-velocity)
        for position, velocity, stress, force in rows
    )
    faces = b"".join(struct.pack("<B3I", 3, *corners) for corners in whole.topology.triangles)
    assert (folder / "frame-000006.ply").read_bytes() == header.encode() + particles + faces


def test_a_folder_holds_the_mesh_colliders_once_as_the_command_writes_them(tmp_path: Path) -> None:
    whole = trajectory()
    colliders = (tetrahedron("left", -3.0), *whole.topology.colliders, tetrahedron("right", 0.1))
    whole = replace(whole, topology=replace(whole.topology, colliders=colliders))
    folder = whole.save(tmp_path / "run")
    assert len(list(folder.iterdir())) == FRAMES + 1
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment step 0\ncomment time_seconds 0\nelement vertex 8\n"
        "property float x\nproperty float y\nproperty float z\nelement face 8\n"
        "property list uchar uint vertex_indices\nend_header\n"
    )
    points = b"".join(
        struct.pack("<3f", *point) for mesh in (colliders[0], colliders[2]) for point in mesh.shape["points"]
    )
    corners = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2), (4, 6, 5), (4, 5, 7), (5, 6, 7), (4, 7, 6)]
    faces = b"".join(struct.pack("<B3I", 3, *triangle) for triangle in corners)
    assert (folder / "colliders.ply").read_bytes() == header.encode() + points + faces

    for path in folder.glob("frame-*"):
        path.unlink()
    with pytest.raises(Error, match=r"holds frames already \(colliders.ply\)"):
        whole.save(folder)


def test_a_page_holds_the_arrays_of_a_mesh_collider() -> None:
    whole, mesh = trajectory(), tetrahedron("cow", 0.1)
    whole = replace(whole, topology=replace(whole.topology, colliders=(mesh,)))
    (collider,) = elements(whole.show().text)["head"][0]["colliders"]
    shape = collider.pop("shape")
    assert collider == {"name": "cow", "velocity": [0.0, 0.0, 2.0]}
    assert (shape.keys(), shape["kind"]) == ({"kind", "points", "triangles"}, "mesh")
    points = np.frombuffer(base64.b64decode(shape["points"], validate=True), "<f4")
    assert points.tolist() == mesh.shape["points"].reshape(-1).tolist()
    packed = base64.b64decode(shape["triangles"]["data"], validate=True)
    assert shape["triangles"]["count"] == 4
    assert restore(unpack(packed, 4, 3, None), 1.0).astype(int).tolist() == mesh.shape["triangles"].tolist()


def test_numbers_in_float64_are_written_as_they_are(tmp_path: Path) -> None:
    whole = trajectory(np.float64, "positions", "velocities")
    folder = whole.save(tmp_path / "run")
    header, body = (folder / "frame-000003.ply").read_bytes().split(b"end_header\n", 1)
    assert header.count(b"property double ") == 6 and b"property float " not in header
    rows = zip(whole.positions[3], whole.velocities[3], strict=True)
    assert body.startswith(b"".join(struct.pack("<6d", *position, *velocity) for position, velocity in rows))


def test_times_in_a_folder_are_written_as_the_command_does(tmp_path: Path) -> None:
    time = np.full(FRAMES, 0.1)
    time[:4] = 0.0, 1e-7, 2.0, 1e21
    folder = trajectory(np.float64, "positions", time=time).save(tmp_path / "run")
    written = [path.read_bytes().split(b"\n")[3].decode() for path in sorted(folder.iterdir())[:5]]
    shown = [line.removeprefix("comment time_seconds ") for line in written]
    assert shown == ["0", "0.0000001", "2", "1000000000000000000000", "0.1"]


def test_a_folder_with_frames_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.txt").touch()
    trajectory().save(tmp_path)
    before = (tmp_path / "frame-000001.ply").read_bytes()
    with pytest.raises(Error, match="holds frames already"):
        trajectory(np.float32, "positions").save(tmp_path)
    assert (tmp_path / "frame-000001.ply").read_bytes() == before


@pytest.mark.parametrize("name", ["run.rrd", "run.ply", "run.npy", "run.html.gz"])
def test_another_ending_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(Refused, match=r"allowed: \.npz .*\.html .*folder"):
        trajectory().save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_what_a_page_cannot_show_is_refused(tmp_path: Path) -> None:
    bare = trajectory(np.float32, "positions")
    assert elements(bare.show().text)["head"][0]["color"] is None
    for color, needed in (("speed", "velocities"), ("stress", "stress"), ("plastic_ratio", "plastic_ratio")):
        with pytest.raises(Refused, match=f"fields=\\('{needed}'"):
            bare.show(color=color)
    with pytest.raises(Refused, match="'plastic_ratio', 'speed', 'stress', 'body'"):
        bare.show(color="red")
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(Refused, match="max_error"):
            bare.save(tmp_path / "run.html", max_error=wrong)
    for name in ("run.npz", "run"):
        with pytest.raises(Refused, match="color belongs to an HTML file"):
            bare.save(tmp_path / name, color="body")
    with pytest.raises(Error, match=r"fields=\('positions'"):
        trajectory(np.float32, "stress").save(tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_an_error_leaves_the_file_that_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.npz"
    path.write_bytes(b"precious")

    def full(file: Any, **_: Any) -> None:
        file.write(b"half")
        raise OSError("no space left")

    with monkeypatch.context() as broken:
        broken.setattr(np, "savez_compressed", full)
        with pytest.raises(OSError, match="no space left"):
            trajectory().save(path)
    assert [entry.read_bytes() for entry in tmp_path.iterdir()] == [b"precious"]
    trajectory().save(path)
    assert [entry.read_bytes()[:2] for entry in tmp_path.iterdir()] == [b"PK"]


def test_diagnostics_are_columns_with_nothing_where_nothing_is() -> None:
    rows = trajectory().diagnostics
    assert (rows.shape, rows["momentum"].shape, rows["snow_angular_momentum"].shape) == ((40,), (40, 3), (40, 3))
    numbers = [name for name in rows.dtype.names if rows.dtype[name].base.kind != "U"]
    words = {"solve_outcome", "snow_bound", "cloth_bound", "cloth_preconditioner", "rest_wake_cause"}
    assert words == set(rows.dtype.names) - set(numbers)
    assert {rows.dtype[name].base for name in numbers} == {np.dtype(np.float64)}
    assert not any("stages" in name for name in rows.dtype.names)
    # Frame 0 has none at all; frame 3 neither cloth nor snow.
    assert all(np.isnan(rows[name][0]).all() for name in numbers)
    assert all(rows[name][0] == "" for name in words)
    assert rows["step"][1:4].tolist() == [10, 20, 30]
    assert rows["momentum"][2].tolist() == [1.0, -2.0, 20.0]
    solved = rows[["solve_outcome", "solve_iterations", "notices_passed_particles"]][3]
    assert solved.tolist() == ("converged", 9, 3)
    assert (rows["snow_bound"][1], rows["snow_bound_particle"][1], rows["snow_mass"][1]) == ("speed", 7, 2.5)
    assert (rows["snow_bound"][3], rows["cloth_bound"][1], rows["cloth_preconditioner"][1]) == ("", "accuracy", "")
    assert np.isnan([rows["snow_mass"][3], rows["cloth_substeps"][3], rows["cloth_bound_particle"][1]]).all()
    assert (rows["surface_pairs"][1], rows["surface_least_gap_m"][1]) == (12, 0.0015)
    assert (rows["rest_calm_share"][1], rows["rest_pieces"][1], rows["rest_change_m"][1]) == (0.25, 4, 0.0001)
    assert np.isnan([rows["surface_pairs"][3], rows["surface_crossings"][1]]).all()
    assert diagnostics_array([]).shape == (0,)


def test_a_trajectory_says_what_it_is() -> None:
    whole = trajectory(np.float32, "positions", "stress")
    assert len(whole) == FRAMES
    assert whole.nbytes == 4 * FRAMES * 20 * 4
    snow = whole.body("snow")
    assert {name: array.shape for name, array in snow.arrays.items()} == {"positions": (40, 8, 3), "stress": (40, 8)}
    assert np.shares_memory(snow.positions, whole.positions)
    assert np.array_equal(snow.stress, whole.stress[:, SHEET:])
    assert whole.diagnostics is whole.diagnostics
    with pytest.raises(Error, match=r"no velocities.*fields=\('velocities'"):
        _ = whole.velocities
    with pytest.raises(Error, match="'sheet', 'snow'"):
        whole.body("sail")
    assert "40 frames" in repr(whole)
    assert "\n" not in repr(whole)
    assert "<td>a &lt;b&gt; &amp; &lt;/script&gt;</td>" in whole._repr_html_()

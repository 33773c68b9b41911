"""Meshes to send: the header says what follows, pieces are small, and scenes name uploads in place of files."""

from __future__ import annotations

import errno
import math
import pickle
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nappe
from nappe import v1
from nappe._ask._uploads import Mesh, from_arrays, from_file, read_scene

MEBIBYTE = 1 << 20
POINTS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
SCENE = """
[world]
gravity = [0, -9.81, 0] # file = "gravity.obj"

[[body]]
name = "cow"
mesh = { file = "cow.obj" }  # file = "old.obj"

[[body]]
name = "calf"
mesh = { file = 'herd/calf.ply' }

[[body]]
# mesh = { file = "commented.obj" }
[body.mesh]
file="cow.obj"

[[body]]
name = "sheet"
mesh = { grid = [2, 2], spacing = 0.1 }

[[collider]]
name = "post"
mesh = { file = "cow.obj", close_holes = true }
"""


def mesh(points: Any = POINTS, triangles: Any = ((0, 1, 2),), masses: Any = None, uv: Any = None) -> Mesh:
    return from_arrays(points, triangles, masses, uv, "tri")


def sent(upload: Mesh) -> tuple[Any, list[bytes]]:
    """The header, which comes first and once, and the pieces that follow."""
    first, *rest = upload.messages()
    kind = first.WhichOneof("part")
    assert kind in ("header", "file") and all(message.WhichOneof("part") == "data" for message in rest)
    return getattr(first, kind), [message.data for message in rest]


def refusal(field: str, **given: Any) -> str:
    with pytest.raises(nappe.Refused) as told:
        mesh(**given)
    assert told.value.field == field
    return told.value.message


def test_arrays_are_packed_little_endian_in_the_order_of_the_header() -> None:
    header, pieces = sent(mesh(POINTS, [(0, 1, 2), (2, 1, 0)], [0.0, 0.5, 1.0], [[0, 0], [1, 0], [0.25, 0.5]]))
    expected = v1.MeshHeader(name="tri", point_count=3, triangle_count=2, mass_count=3, uv_count=3)
    assert header == expected and len(pieces) == 1
    data = struct.pack("<9d", 0, 0, 0, 1, 0, 0, 0, 0, 1) + struct.pack("<6I", 0, 1, 2, 2, 1, 0)
    assert pieces[0] == data + struct.pack("<3d", 0, 0.5, 1) + struct.pack("<6f", 0, 0, 1, 0, 0.25, 0.5)


def test_what_is_not_given_is_not_announced() -> None:
    header, pieces = sent(mesh(triangles=[]))
    assert header == v1.MeshHeader(name="tri", point_count=3) and len(b"".join(pieces)) == 72
    assert sent(mesh(triangles=np.zeros((0, 3), np.uint32)))[0] == header
    header, pieces = sent(mesh(masses=[1, 2, 3]))
    assert (header.triangle_count, header.mass_count, header.uv_count) == (1, 3, 0)
    assert len(b"".join(pieces)) == 72 + 12 + 24


@pytest.mark.parametrize("kind", [">f8", "<f4", np.int16])
def test_arrays_of_any_type_order_and_layout_are_packed_the_same(kind: Any) -> None:
    points = np.asfortranarray(np.array(POINTS, kind))
    corners = np.array([[0, 9, 1, 9, 2, 9]], ">i2")[:, ::2]
    given = mesh(points, corners, np.array([1, 0, 2, 0, 3, 0], kind)[::2], points[:, :2])
    assert sent(given) == sent(mesh(masses=[1, 2, 3], uv=[[0, 0], [1, 0], [0, 0]]))


@pytest.mark.parametrize(("points", "last"), [(32_768, MEBIBYTE), (32_769, 32), (100_000, 54_272)])
def test_pieces_are_of_at_most_one_mebibyte(points: int, last: int) -> None:
    where = np.arange(3.0 * points).reshape(-1, 3)
    header, pieces = sent(mesh(where, [], np.arange(points)))
    assert [len(piece) for piece in pieces[:-1]] == [MEBIBYTE] * (len(pieces) - 1) and len(pieces[-1]) == last
    assert (header.point_count, header.mass_count) == (points, points)
    assert b"".join(pieces) == where.tobytes() + np.arange(points, dtype="<f8").tobytes()


def test_the_messages_of_an_upload_can_be_sent_again() -> None:
    upload = mesh()
    assert list(upload.messages()) == list(upload.messages())


@pytest.mark.parametrize(
    ("given", "field", "told"),
    [
        ({"points": []}, "points", "points is of shape (0,); allowed: (n, 3)"),
        ({"points": np.zeros((0, 3))}, "points", "points is empty; allowed: at least one point"),
        ({"points": np.zeros((3, 2))}, "points", "points is of shape (3, 2); allowed: (n, 3)"),
        ({"points": [[0, 0, 0], [0, 0]]}, "points", "points is no array"),
        ({"points": [[0, 0, 0], [0, math.nan, 0]]}, "points", "points[1][1] is nan; allowed: a finite number"),
        ({"points": [["0", "0", "0"]]}, "points", "points is an array of <U1; allowed: numbers"),
        ({"triangles": [[0.0, 1.0, 2.0]]}, "triangles", "triangles is an array of float64; allowed: whole numbers"),
        ({"triangles": [[False, True, True]]}, "triangles", "triangles is an array of bool; allowed: whole numbers"),
        ({"triangles": [0, 1, 2]}, "triangles", "triangles is of shape (3,); allowed: (n, 3)"),
        ({"triangles": [[0, 1]]}, "triangles", "triangles is of shape (1, 2); allowed: (n, 3)"),
        ({"triangles": [[0, 1, 2], [0, 1]]}, "triangles", "triangles is no array"),
        ({"triangles": [[0, 1, 2], [2, 3, 0]]}, "triangles", "triangles[1][1] is 3; allowed: 0 to 2"),
        ({"triangles": [[0, 1, -1]]}, "triangles", "triangles[0][2] is -1; allowed: 0 to 2"),
        ({"triangles": np.array([[0, 1, 2**64 - 1]], np.uint64)}, "triangles", "triangles[0][2] is"),
        ({"triangles": [[0, 1, 2**32]]}, "triangles", "triangles[0][2] is 4294967296"),
        ({"masses": [1, 2]}, "masses", "masses is of shape (2,); allowed: (3)"),
        ({"masses": [0, -0.5, 1]}, "masses", "masses[1] is -0.5 kg; allowed: 0 (pinned) or more"),
        ({"masses": [1, 1, math.inf]}, "masses", "masses[2] is inf; allowed: a finite number"),
        ({"masses": 1.0}, "masses", "masses is of shape (); allowed: (3)"),
        ({"uv": np.zeros((2, 2))}, "uv", "uv is of shape (2, 2); allowed: (3, 2)"),
        ({"uv": np.zeros((3, 3))}, "uv", "uv is of shape (3, 3); allowed: (3, 2)"),
        ({"uv": [[0, 0], [0, 0], [0, math.nan]]}, "uv", "uv[2][1] is nan"),
        ({"uv": [[0, 0], [0, 0], [1e300, 0]]}, "uv", "uv[2][0] is 1e+300"),
    ],
)
def test_a_mesh_that_cannot_be_is_named(given: Any, field: str, told: str) -> None:
    assert told in refusal(field, **given)


@pytest.mark.parametrize("ending", ["obj", "off", "ply", "stl", "OBJ", "Ply"])
def test_a_file_is_sent_as_it_is_and_its_ending_says_what_it_is(tmp_path: Path, ending: str) -> None:
    data = bytes(range(256)) * 5000
    (tmp_path / f"cow.v2.{ending}").write_bytes(data)
    header, pieces = sent(from_file(tmp_path / f"cow.v2.{ending}"))
    kind = getattr(v1, f"FILE_FORMAT_{ending.upper()}")
    assert header == v1.FileHeader(name=f"cow.v2.{ending}", format=kind, byte_count=len(data))
    assert b"".join(pieces) == data and [len(piece) for piece in pieces] == [MEBIBYTE, len(data) - MEBIBYTE]


@pytest.mark.parametrize("name", ["cow.glb", "cow", ".obj", "cow.obj.gz"])
def test_an_ending_that_is_no_format_is_refused_with_those_that_are(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"solid")
    with pytest.raises(nappe.Refused) as told:
        from_file(tmp_path / name)
    assert told.value.field == "path" and ".obj, .off, .ply, .stl, .pc2, points.eti or its folder" in str(told.value)
    assert str(tmp_path / name) in str(told.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "cow.obj", tmp_path / "points.eti", tmp_path, tmp_path / "scene.toml"):
        read = read_scene if path.suffix == ".toml" else from_file
        with pytest.raises(FileNotFoundError, match="there is no file") as told:
            read(path)
        error = told.value
        assert isinstance(error, nappe.FileNotFound) and isinstance(error, nappe.NotFound) and error.reason is None
        named = path / "points.eti" if path == tmp_path else path
        assert (error.filename, error.errno) == (str(named), errno.ENOENT) and str(named) in error.message
        again = pickle.loads(pickle.dumps(error))
        assert (str(again), again.filename, again.errno) == (str(error), error.filename, error.errno)


def test_a_missing_scene_is_told_as_python_tells_a_missing_file(
    server: nappe.Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for scene in ("flag.toml", Path("flag"), tmp_path / "flag.toml"):
        with pytest.raises(FileNotFoundError) as told:
            server.create(scene)
        assert str(scene) in str(told.value) and str(tmp_path) in str(told.value)
    with pytest.raises(nappe.FileNotFound, match="named without an ending, such as 'flag'"):
        server.create("flag.toml")
    Path("mine.toml").write_text(SCENE)
    with pytest.raises(FileNotFoundError, match=r"cow\.obj"):
        server.create("mine.toml")
    Path("cow.toml").mkdir()
    with pytest.raises(nappe.Error, match="cannot be read: Is a directory") as other:
        server.create("cow.toml")
    assert not isinstance(other.value, OSError)


def course_set(folder: Path, **files: bytes) -> Path:
    folder.mkdir()
    for name, data in files.items():
        (folder / f"{name}.eti").write_bytes(data)
    return folder


def test_a_set_of_the_course_is_one_header_and_its_files_in_order(tmp_path: Path) -> None:
    parts = {"points": b"1\n0 0 0\n", "faceset": b"0 0 0\n", "masses": b"0.5\n", "texcoord": b"0 1\n0 1\n0 1\n"}
    folder = course_set(tmp_path / "rag", **parts)
    for path in (folder, folder / "points.eti", folder / "POINTS.ETI", folder / "masses.eti"):
        header, pieces = sent(from_file(path))
        sizes = {"byte_count": 8, "faceset_byte_count": 6, "masses_byte_count": 4, "texcoord_byte_count": 12}
        assert header == v1.FileHeader(name="rag", format=v1.FILE_FORMAT_ETI, **sizes)
        assert pieces == list(parts.values()) and not header.HasField("missing_mass")


def test_a_set_may_lack_all_but_its_points_and_have_a_mass_for_those_left_out(tmp_path: Path) -> None:
    folder = course_set(tmp_path / "rag", points=b"1\n0 0 0\n", masses=b"\n" * (MEBIBYTE + 1))
    header, pieces = sent(from_file(folder, missing_mass=0))
    assert (header.byte_count, header.faceset_byte_count, header.texcoord_byte_count) == (8, 0, 0)
    assert (header.masses_byte_count, header.HasField("missing_mass"), header.missing_mass) == (MEBIBYTE + 1, True, 0)
    assert [len(piece) for piece in pieces] == [8, MEBIBYTE, 1]
    with pytest.raises(nappe.Refused, match="missing_mass is nan"):
        from_file(folder, missing_mass=math.nan)


@pytest.mark.parametrize("scene", ["flag", "snow_and_cloth", "scene.tom", "toml"])
def test_a_word_is_the_name_of_a_shipped_scene(scene: str) -> None:
    read = read_scene(scene)
    assert (read.name, read.text, read.meshes) == (scene, None, {})


@pytest.mark.parametrize("scene", ["[world]\n", "title = 'a'", "# scene.toml\n", "a=b.toml"])
def test_a_text_is_a_scene_by_itself(scene: str) -> None:
    read = read_scene(scene)
    assert (read.name, read.text, read.meshes) == (None, scene, {}) and read.with_uploads({}) == scene


def test_a_text_that_names_a_mesh_file_is_left_for_the_server_to_refuse() -> None:
    read = read_scene(SCENE)
    assert read.meshes == {} and read.with_uploads({}) == SCENE


def test_a_path_is_a_scene_file_with_the_meshes_beside_it(tmp_path: Path) -> None:
    file = tmp_path / "herd.toml"
    file.write_bytes(SCENE.encode())
    for scene in (file, str(file)):
        read = read_scene(scene)
        assert (read.name, read.text) == (None, SCENE)
        assert read.meshes == {"cow.obj": tmp_path / "cow.obj", "herd/calf.ply": tmp_path / "herd/calf.ply"}
    other = tmp_path / "herd.scene"
    other.write_bytes(SCENE.encode())
    assert read_scene(other).text == SCENE
    elsewhere = tmp_path / "far.toml"
    elsewhere.write_text('mesh = { file = "/meshes/cow.obj" }')
    assert read_scene(elsewhere).meshes == {"/meshes/cow.obj": Path("/meshes/cow.obj")}


def test_uploads_stand_in_place_of_files_and_lines_stay_where_they_are(tmp_path: Path) -> None:
    file = tmp_path / "herd.toml"
    file.write_bytes(SCENE.encode())
    replaced = read_scene(file).with_uploads({"cow.obj": "m-1", "herd/calf.ply": "m-2"})
    changed = [
        (before, after)
        for before, after in zip(SCENE.split("\n"), replaced.split("\n"), strict=True)
        if before != after
    ]
    assert changed == [
        ('mesh = { file = "cow.obj" }  # file = "old.obj"', 'mesh = { upload = "m-1" }  # file = "old.obj"'),
        ("mesh = { file = 'herd/calf.ply' }", 'mesh = { upload = "m-2" }'),
        ('file="cow.obj"', 'upload = "m-1"'),
        ('mesh = { file = "cow.obj", close_holes = true }', 'mesh = { upload = "m-1", close_holes = true }'),
    ]


def written(tmp_path: Path, text: str) -> nappe._ask._uploads.Scene:
    (tmp_path / "scene.toml").write_bytes(text.encode())
    return read_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('mesh = {file="a.obj"}', 'mesh = {upload = "m-1"}'),
        ("mesh.file = 'a.obj'", 'mesh.upload = "m-1"'),
        ('  file    =     "a.obj"   # that one', '  upload = "m-1"   # that one'),
        ('\tmesh = {\tfile = "a.obj"\t}', '\tmesh = {\tupload = "m-1"\t}'),
        ('mesh = { file = "a.obj" }\r\n# file = "b.obj"\r\n', 'mesh = { upload = "m-1" }\r\n# file = "b.obj"\r\n'),
        ('file\t= "a.obj"', 'upload = "m-1"'),
        ("""title = 'say "'\nfile = "a.obj" # "x\n""", """title = 'say "'\nupload = "m-1" # "x\n"""),
        ('file =\t"a.obj"', 'upload = "m-1"'),
        (
            'body = [{ name = "# 1", mesh = { file = "a.obj" } }]',
            'body = [{ name = "# 1", mesh = { upload = "m-1" } }]',
        ),
    ],
)
def test_a_mesh_is_found_however_it_is_written(tmp_path: Path, line: str, expected: str) -> None:
    read = written(tmp_path, line)
    assert read.meshes == {"a.obj": tmp_path / "a.obj"}
    assert read.with_uploads({"a.obj": "m-1"}) == expected


def test_two_meshes_on_one_line_are_both_found(tmp_path: Path) -> None:
    read = written(tmp_path, 'body = [{ mesh = { file = "a.obj" } }, { mesh = { file = "b.obj" } }]')
    assert set(read.meshes) == {"a.obj", "b.obj"}
    replaced = read.with_uploads({"a.obj": "m-1", "b.obj": "m-2"})
    assert replaced == 'body = [{ mesh = { upload = "m-1" } }, { mesh = { upload = "m-2" } }]'


@pytest.mark.parametrize(
    "line",
    ['# file = "a.obj"', '#mesh={file="a.obj"}', 'profile = "a.obj"', "file = 3", "file = ''", "file = \"a.obj'"],
)
def test_what_only_looks_like_a_mesh_is_left_as_it_is(tmp_path: Path, line: str) -> None:
    read = written(tmp_path, line)
    assert read.meshes == {} and read.with_uploads({}) == line

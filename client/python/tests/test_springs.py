"""Springs of a table: sent with their mesh as one PLY, and refused with file, line and column."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import nappe
from nappe._ask._springs import read_springs, with_springs
from nappe._ask._uploads import read_scene

HEADER = "particle_a,particle_b,stiffness,damping,rest_length,kind"
ROWS = ["0,1,10,0.1,,", "0,2,10,0.1,,", "0,3,10,0.1,,", "1,2,10,0.1,,", "2,3,10,0.1,,"]
POINTS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 1.0), (0.0, 0.0, 1.0)]
SCENE = """version = 1
dt = 0.01
[[body]]
name = "a"
mesh = { file = "a.ply" }
mass = { particle = 0.1 }
pins = [0]
springs = { file = "springs.csv" }
"""


def table(*rows: str) -> bytes:
    return "\n".join([HEADER, *rows, ""]).encode()


def ply(encoding: str) -> bytes:
    """A square of two triangles."""
    head = f"ply\nformat {encoding} 1.0\nelement vertex 4\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    faces = [(3, 0, 1, 2), (3, 0, 2, 3)]
    if encoding == "ascii":
        lines = [" ".join(map(str, row)) for row in [*POINTS, *faces]]
        return (head + "\n".join(lines)).encode()
    order = "<" if "little" in encoding else ">"
    body = b"".join(struct.pack(f"{order}3d", *point) for point in POINTS)
    return head.encode() + body + b"".join(struct.pack(f"{order}B3i", *face) for face in faces)


def test_springs_stand_in_any_order_of_columns_and_what_is_empty_has_its_default() -> None:
    text = b"kind, stiffness,particle_b,particle_a,damping\r\nshear,10, 1, 0, 0.5\r\n\r\n, 1e1,3,2,\r\n"
    found = read_springs(text, "a.csv", 4)
    assert [spring[:4] + spring[5:] for spring in found] == [(0, 1, 10.0, 0.5, 1), (2, 3, 10.0, 0.0, 0)]
    assert all(spring[4] != spring[4] for spring in found)
    assert read_springs(table("0,1,5,0,2.5,bend"), "a.csv", 2) == [(0, 1, 5.0, 0.0, 2.5, 2)]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (b"", "a.csv:1: is empty; allowed: a line such as particle_a,"),
        (table(), "a.csv:1:1: names columns, and no springs follow; allowed: a line for each spring"),
        (HEADER.replace(",", ";").encode(), "a.csv:1:1: has other marks than commas"),
        (b"particle_a,particle_b,stifness\n", "a.csv:1:23: has no meaning for a column 'stifness'; allowed"),
        (b"particle_a,stiffness\n", "a.csv:1:1: has no column 'particle_b'"),
        (b"particle_a,particle_a\n", "a.csv:1:12: has the column 'particle_a' a second time"),
        (table("0,1,5,,,", "1,2"), "a.csv:3:1: has 2 values; allowed: 6, one for each column"),
        (table("4,2,5,,,"), "a.csv:2:1: names point '4'; allowed: 0 to 3, the points of the mesh"),
        (table("1, -2,5,,,"), "a.csv:2:4: names point '-2'; allowed: 0 to 3"),
        (table("2,2,5,,,"), "a.csv:2:3: joins point 2 to itself; allowed: two points"),
        (table("1,2,nan,,,"), "a.csv:2:5: has the stiffness nan; allowed: a finite number, 0 or more"),
        (table("1,2,,,,"), "a.csv:2:5: has ''; allowed: a number, with a point for fractions"),
        (table("1,2,-5,,,"), "a.csv:2:5: has the stiffness -5; allowed: a finite number, 0 or more"),
        (table("1,2,5,-1,,"), "a.csv:2:7: has the damping -1; allowed"),
        (table("1,2,5,,0,"), "a.csv:2:8: has the rest length 0; allowed: a finite number above 0"),
        (table("1,2,5,,x,"), "a.csv:2:8: has 'x'; allowed: a number"),
        (table("1,2,5,,,twist"), "a.csv:2:9: is of the kind 'twist'; allowed: stretch, shear, bend"),
        (table("0,1,5,,,", "", "1,0,5,,,"), "a.csv:4:1: joins the points 1 and 0, as line 2 does; allowed: one spring"),
        (b"particle_a,particle_b,stiffness\n0,1,\xff\n", "a.csv:2: is no text in UTF-8"),
    ],
)
def test_an_error_names_file_line_column_and_what_is_allowed(text: bytes, told: str) -> None:
    with pytest.raises(nappe.Refused) as refused:
        read_springs(text, "a.csv", 4)
    assert refused.value.message.startswith(told), refused.value.message


def test_more_pairs_than_a_cloth_holds_are_told_where_they_begin() -> None:
    rows = [f"{i},{i + 1},{i},,," for i in range(65_535)]
    assert len(read_springs(table(*rows[:-1]), "a.csv", 65_536)) == 65_534
    with pytest.raises(nappe.Refused, match=r"a\.csv:65536:1: has one more pair .* allowed: 65534 different pairs"):
        read_springs(table(*rows), "a.csv", 65_536)


def test_a_mesh_that_takes_no_springs_is_refused() -> None:
    springs = table(*ROWS)
    sprung = with_springs(ply("ascii"), "a.ply", springs, "a.csv")
    for mesh, told in [
        (b"v 0 0 0\n", "a.ply is no PLY"),
        (sprung, "a.ply has edges of its own; allowed beside a table of springs: a PLY without"),
        (b"ply\nformat ascii 2.0 x\nend_header\n", "a.ply has the format none; allowed: ascii, binary_little_endian"),
        (b"ply\nformat ascii 1.0\nend_header\n", "a.ply announces no points"),
    ]:
        with pytest.raises(nappe.Refused) as refused:
            with_springs(mesh, "a.ply", springs, "a.csv")
        assert refused.value.message.startswith(told), refused.value.message


def test_a_table_goes_with_the_one_mesh_of_its_body(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    other = '[[body]]\nname = "b"\nmesh = { file = "b.obj" }\n'
    file.write_text(SCENE + "[[body.force]]\non = 1\nforce = [0, 0, 0]\n" + other)
    read = read_scene(file)
    assert read.meshes == {"a.ply": tmp_path / "a.ply", "b.obj": tmp_path / "b.obj"}
    assert read.tables == {"a.ply": "springs.csv"}
    replaced = read.with_uploads({"a.ply": "m-1", "b.obj": "m-2"})
    assert 'mesh = { upload = "m-1" }' in replaced and 'springs = { pattern = "file" }' in replaced
    assert 'mesh = { upload = "m-2" }' in replaced and ".csv" not in replaced

    for wrong, told in [
        (SCENE.replace('file = "a.ply"', "grid = [2, 2], spacing = 1"), "it is not clear of which mesh"),
        (SCENE + '[[body]]\nmesh = { file = "a.ply" }\n', "takes the mesh a.ply with different springs"),
    ]:
        file.write_text(wrong)
        with pytest.raises(nappe.Refused, match=told):
            read_scene(file)

    file.write_text(SCENE.replace("a.ply", "a.obj"))
    with pytest.raises(nappe.Refused, match=r"allowed here: a mesh that ends in \.ply"):
        read_scene(file).mesh("a.obj")


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_table_is_the_springs_of_a_body_as_a_law_of_the_same_is(
    server: nappe.Server, tmp_path: Path, encoding: str
) -> None:
    (tmp_path / "a.ply").write_bytes(ply(encoding))
    (tmp_path / "springs.csv").write_bytes(table(*ROWS))
    by_table, by_law = tmp_path / "table.toml", tmp_path / "law.toml"
    by_table.write_text(SCENE)
    by_law.write_text(SCENE.replace('file = "springs.csv"', "stretch = { stiffness = 10, damping = 0.1 }"))
    found = []
    for scene in (by_table, by_law):
        with server.create(scene, precision="f64") as session:
            found.append(session.step(20, frame=True, precision="f64").positions)
    assert np.array_equal(found[0], found[1]) and not np.array_equal(found[0], POINTS)

    (tmp_path / "springs.csv").write_bytes(table(*ROWS, "3,4,10,,,"))
    with pytest.raises(nappe.Refused, match=r"springs\.csv:7:3: names point '4'; allowed: 0 to 3"):
        server.create(by_table)

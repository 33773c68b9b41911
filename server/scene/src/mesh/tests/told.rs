//! What readers of OBJ and OFF tell, refuse and keep: whole messages.

use crate::mesh::{MeshFile, read_obj, read_off};

#[test]
fn what_an_obj_holds_beside_its_mesh_is_told_once_with_its_first_line() {
    let lines = "a.obj:4: the elements 'l' (1, the first here) are ignored: lines give no springs. A row of particles \
                 that springs join is written in the scene as mesh = { chain = n, spacing = s }";
    let others = "a.obj:3: the elements 'p' (1), 'curv' (3) are ignored (the first here): a mesh is made from 'v', 'vt' \
                  and 'f'";
    let unknown = "a.obj:2: lines that begin with no keyword of OBJ are ignored (2, the first here, with 'vx'): is it \
                   misspelt?";
    let escape = "a.obj:2: lines that begin with no keyword of OBJ are ignored (1, the first here, with '\\u{1a}'): is it \
                  misspelt?";
    let crossing = "a.obj:4: polygons that cross themselves or have no area (2, the first here): each becomes a fan of \
                    triangles from its first corner, which may overlap; cut them into triangles in the program that made \
                    the file";
    let seam = "a.obj:7: corners that give a point another texture coordinate (2, the first here): each point keeps its \
                first one";
    let cases: [(&str, usize, &[&str]); 7] = [
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3\n", 0, &[lines]),
        ("v 0 0 0\nvn 0 0 1\ncurv 0 1 1\ncurv 0 1 1\np 1\ncurv 0 1 1\nend\n", 0, &[others]),
        ("v 0 0 0\nvx 1 0 0\nface 1 1 1\nf 1 1 1\n", 1, &[unknown]),
        ("v 0 0 0\n\u{1a}", 0, &[escape]),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 1 3\nv 0 1 0\nf 1 2 4 3\nf 1 2 3 4\n", 6, &[crossing]),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 1\nf 1/1 2/2 3/1\nf 1/2 2/2 3/2\n", 2, &[seam]),
        ("# nothing is odd\nv 0 0 0\n", 0, &[]),
    ];
    for (text, triangles, wanted) in cases {
        let loaded = read_obj(text, "a.obj").expect("a mesh");
        assert_eq!(loaded.mesh.triangles.len(), triangles, "{text}");
        assert_eq!(loaded.warnings, wanted, "{text}");
    }
}

#[test]
fn a_file_that_is_no_text_is_refused_with_its_line() {
    let cases: [(&[u8], &str); 4] = [
        (
            b"\n\x7fELF\x02\x01\x01\0\0\0",
            "a.obj:2: begins with '\\u{7f}ELF\\u{2}\\u{1}\\u{1}\\u{0}\\u{0}\\u{0}', which is not text: this may be a \
             binary file; allowed: an OBJ, which is text",
        ),
        (
            b"\x89PNG\r\n\x1a\n",
            "a.obj:1: begins with '\u{fffd}PNG', which is not text: this may be a binary file; allowed: an OBJ, which is \
             text",
        ),
        (
            b"v\0 \x000\0",
            "a.obj:1: is text in UTF-16; allowed: UTF-8, of which ASCII is a part. Save it as UTF-8",
        ),
        (b"solid x\n", "a.obj: holds no vertices ('v x y z')"),
    ];
    for (bytes, wanted) in cases {
        let error = MeshFile::Obj(bytes).read("a.obj").expect_err("it is no OBJ");
        assert_eq!(error.to_string(), wanted);
    }
}

#[test]
fn kinds_of_off_without_a_mesh_in_space_are_refused_by_name() {
    let next = "allowed: OFF, with ST, C and N before it";
    let wide = |kind: &str| {
        format!(
            "a.off:1: is {kind}, whose points have other than three coordinates; {next}. Write it as OFF, OBJ or PLY \
             with another program"
        )
    };
    let unknown = |word: &str| format!("a.off:1: begins with '{word}'; {next}");
    for (text, wanted) in [
        ("4OFF\n1 0 0\n0 0 0 1\n", wide("4OFF")),
        ("C4OFF 1 0 0\n", wide("C4OFF")),
        ("nOFF\n5\n1 0 0\n", wide("nOFF")),
        ("STCN4nOFF\n5\n1 0 0\n", wide("STCN4nOFF")),
        ("XOFF\n1 0 0\n", unknown("XOFF")),
        ("OFFX\n1 0 0\n", unknown("OFFX")),
        ("off\n1 0 0\n", unknown("off")),
        ("1 0\n", unknown("1")),
        ("OFF BINARY\n", "a.off:1: is a binary OFF; allowed: text. Save it as text, or as PLY".to_owned()),
        ("CNOFF BINARY\n", "a.off:1: is a binary OFF; allowed: text. Save it as text, or as PLY".to_owned()),
        (
            "STNOFF\n1 0 0\n0 0 0 0 0\n",
            "a.off:3: a point has 5 numbers; allowed: 8 or more, of which the last two are texture coordinates"
                .to_owned(),
        ),
        ("STOFF\n1 0 0\n0 0 0 0 nan\n", "a.off:3: a texture coordinate is 'nan'; allowed: a finite number".to_owned()),
    ] {
        assert_eq!(read_off(text, "a.off").expect_err("it is refused").to_string(), wanted);
    }
}

#[test]
fn faces_without_a_triangle_are_told_by_off_and_refused_by_obj() {
    let twogon = b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n2 0 1\n";
    let loaded = MeshFile::Off(twogon).read("twogon.off").expect("a mesh");
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(
        loaded.warnings,
        ["twogon.off:8: faces of two corners or fewer (1, the first here): they give no triangle"]
    );
    let loaded = read_off("OFF\n1 3 0\n0 0 0\n0\n1 0\n2 0 0\nleft over", "a.off").expect("a mesh");
    let wanted = [
        "a.off:4: faces of two corners or fewer (3, the first here): they give no triangle",
        "a.off:6: polygons that name a corner twice in a row (1, the first here): it is taken once",
        "a.off:7: lines after the last face are ignored",
    ];
    assert_eq!(loaded.warnings, wanted);
    assert!(loaded.mesh.triangles.is_empty());
    let error = read_obj("v 0 0 0\nv 1 0 0\nf 1 2\n", "a.obj").expect_err("an edge is no face").to_string();
    assert_eq!(error, "a.obj:3: a face has 2 corners; allowed: 3 or more");
}

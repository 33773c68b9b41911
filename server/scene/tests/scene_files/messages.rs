//! Messages of errors: where, what was found, what is allowed; several errors of one text.

use nappe_scene::{ErrorKind, SceneErrors};

use crate::{SMALL, build, message, parse};

/// What is replaced in the small scene, by what, and how the message then begins.
const ERRORS: &[(&str, &str, &str)] = &[
    ("dt = 0.01", "dt = 2", "scene.toml:2:6: dt: is 2; allowed: a number, 1e-9 to 1"),
    ("dt = 0.01", "dt = nan", "scene.toml:2:6: dt: is nan; allowed: a number, 1e-9 to 1"),
    ("dt = 0.01", "dt = \"x\"", "scene.toml:2:6: dt: is 'x'; allowed: a number, 1e-9 to 1"),
    ("dt = 0.01", "", "scene.toml:1:1: dt: is missing: time step of the scene's clock (a number, 1e-9 to 1)"),
    ("version = 1", "version = 2", "scene.toml:1:11: version: is 2; allowed: 1"),
    (
        "dt = 0.01",
        "dt = 0.01\ngravty = [0, 0, 0]",
        "scene.toml:3:1: gravty: scene has no key 'gravty'; did you mean 'gravity'?",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\ngravity = [0, 0]",
        "scene.toml:3:11: gravity: is an array of 2; allowed: three numbers, each at most 10000 in size",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\ngravity = [0, true, 0]",
        "scene.toml:3:15: gravity[1]: is true; allowed: a number, -10000 to 10000",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\nprecision = \"f16\"",
        "scene.toml:3:13: precision: is 'f16'; allowed: f32, f64",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nintegrator = \"implicit_eular\"",
        "scene.toml:8:14: body[0].integrator: is 'implicit_eular'; did you mean 'implicit_euler'?",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\nsteps = -1",
        "scene.toml:3:9: steps: is -1; allowed: a whole number, 0 to 1000000000000",
    ),
    ("dt = 0.01", "dt = = 1", "scene.toml:2:6: is not TOML: "),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { grid = [3, 2] }",
        "scene.toml:6:8: body[0].mesh.spacing: is missing: it is needed with 'grid'",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { grid = [3, 2], chain = 4, spacing = 0.1 }",
        "scene.toml:6:8: body[0].mesh: has grid and chain of grid, chain, course_grid, upload, file: exactly one is needed",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { spacing = 0.1 }",
        "scene.toml:6:8: body[0].mesh: has none of grid, chain, course_grid, upload, file: exactly one is needed",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { course_grid = 4, spacing = 0.1 }",
        "scene.toml:6:37: body[0].mesh.spacing: does not go with 'course_grid'",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { upload = \"m1\" }",
        "scene.toml:6:19: body[0].mesh.upload: no mesh with the id 'm1' was uploaded, or it is no longer kept",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { file = \"a.obj\" }",
        "a.obj: scenes may not name files here: upload the mesh",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { grid = [100000, 100000], spacing = 0.1 }",
        "scene.toml:6:8: body[0].mesh: this body has 10000000000 particles; allowed: at most 4000000",
    ),
    (
        "stiffness = 10",
        "stifness = 10",
        "scene.toml:8:25: body[0].springs.stretch.stifness: body.springs.stretch, .shear, .bend has no key 'stifness'; did you mean 'stiffness'?",
    ),
    (
        "mass = { particle = 0.01 }",
        "",
        "scene.toml:4:1: body[0].mass: is missing: this mesh carries no masses; allowed: { particle = kg }, { total = kg } or { density = kg/m^2 }",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\npins = [6]",
        "scene.toml:8:9: body[0].pins[0]: is 6; allowed: 0 to 5, the particles of this body",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\npins = [\"top_leftt\"]",
        "scene.toml:8:9: body[0].pins[0]: is 'top_leftt'; did you mean 'top_left'?",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\npins = [\"middle of nowhere\"]",
        "scene.toml:8:9: body[0].pins[0]: is 'middle of nowhere'; allowed: top_left, top_right, bottom_left, bottom_right, top, bottom, left, right",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nblock_size = 100",
        "scene.toml:8:14: body[0].block_size: is 100; allowed: a power of two, 32 to 4096",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\ngrain = 100",
        "scene.toml:8:9: body[0].block_size: is 100; allowed: a power of two, 32 to 4096",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nblock_size = 64\ngrain = 64",
        "scene.toml:9:1: body[0].grain: the key is now called 'block_size', which is here too: only one of them may be given",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nsolver = { fixed_iterations = 3, tolerance = 0.1 }",
        "scene.toml:8:46: body[0].solver.tolerance: does not go with fixed_iterations",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nsolver = { fixed_iterations = 3, max_iterations = 1 }",
        "scene.toml:8:51: body[0].solver.max_iterations: does not go with fixed_iterations",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\ntransform = { rotate = { axis = [0, 0, 0], degrees = 1 } }",
        "scene.toml:8:33: body[0].transform.rotate.axis: is zero: an axis needs a direction",
    ),
    ("name = \"cloth\"", "name = \" \"", "scene.toml:5:8: body[0].name: is empty: a name is needed"),
    ("[[body]]", "body = 1", "scene.toml:4:8: body: is 1; allowed: an array of tables, at most 1000"),
    (
        "[[body]]",
        "[body]",
        "scene.toml:4:1: body: is a table; allowed: an array of tables, at most 1000: write [[body]], in double brackets",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\n[collider]\nname = \"a\"",
        "scene.toml:3:1: collider: is a table; allowed: an array of tables, at most 1000: write [[collider]], in double brackets",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\n[collider]\nname = \"a\"\n[collider]\nname = \"b\"",
        "scene.toml:5:2: is not TOML: duplicate key; write [[collider]], in double brackets, for each of several",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\n[snow]\ncell = 0.1\n[snow.object]\nname = \"a\"",
        "scene.toml:5:1: snow.object: is a table; allowed: an array of tables, at most 1000: write [[snow.object]], in double brackets",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nlaw = { name = \"area\" }",
        "scene.toml:8:7: body[0].law: is a table; allowed: an array of tables, at most 100: write [[body.law]], in double brackets",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\n[[snow]]\ncell = 0.1",
        "scene.toml:3:1: snow: is an array of tables; allowed: a table: write [snow], in single brackets",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\ntransform = { rotate = [0, 90, 0] }",
        "scene.toml:8:24: body[0].transform.rotate: is an array of 3; allowed: a table, such as rotate = { axis = [0, 1, 0], degrees = 90 }",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = \"cow.obj\"",
        "scene.toml:6:8: body[0].mesh: is 'cow.obj'; allowed: a table, such as mesh = { grid = [2, 2], spacing = 1 }",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = 0.01",
        "scene.toml:7:8: body[0].mass: is 0.01; allowed: a table, such as mass = { particle = 1 }",
    ),
];

#[test]
fn a_message_names_file_line_column_field_finding_and_range() {
    for (old, new, wanted) in ERRORS {
        let text = SMALL.replace(old, new);
        assert_ne!(&text, SMALL, "the case changes the scene: {old}");
        let found = message(&text);
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn an_error_points_at_a_line_that_the_file_has() {
    let broken = ["gravity = [0,", "title = \"\"\"", "[[collider", "dt =", "wind = {", "unknown = 1", ""];
    for text in broken
        .iter()
        .flat_map(|end| ["", "\n", "\r\n", "\n\n\n"].map(|last| format!("version = 1\n{end}{last}")))
    {
        for error in &build(&text).expect_err("no scene") {
            assert!(
                (1..=text.lines().count()).contains(&error.line),
                "line {} of {text:?}: {error}",
                error.line
            );
        }
    }
}

#[test]
fn a_scene_with_the_mark_of_utf_8_is_read_and_its_columns_are_those_that_one_sees() {
    let marked = format!("\u{feff}{SMALL}");
    assert_eq!(parse(&marked).unwrap(), parse(SMALL).unwrap());
    let error = parse(&marked.replace("version = 1", "version = 2")).unwrap_err();
    assert_eq!((error.first().line, error.first().column), (1, 11));
}

#[test]
fn every_error_of_a_scene_is_named_in_the_order_of_the_text() {
    let text = SMALL
        .replace("dt = 0.01", "dt = 2\ngravty = [0, 0, 0]")
        .replace("particle = 0.01", "particle = true")
        .replace("stiffness = 10", "stiffness = -1, dampng = 1");
    let errors = parse(&text).expect_err("the scene has five errors");
    let found: Vec<_> = errors.iter().map(|error| (error.line, error.key.as_str(), error.kind)).collect();
    assert_eq!(
        found,
        [
            (2, "dt", ErrorKind::OutOfRange),
            (3, "gravty", ErrorKind::UnknownField),
            (8, "body[0].mass.particle", ErrorKind::WrongType),
            (9, "body[0].springs.stretch.stiffness", ErrorKind::OutOfRange),
            (9, "body[0].springs.stretch.dampng", ErrorKind::UnknownField),
        ]
    );
    let message = errors.to_string();
    assert_eq!(message.lines().count(), 5, "one line per error:\n{message}");
    assert!(message.starts_with("scene.toml:2:6: dt: is 2; allowed: a number, 1e-9 to 1\n"), "{message}");
    assert!(message.ends_with("has no key 'dampng'; did you mean 'damping'?"), "{message}");
}

#[test]
fn errors_of_several_bodies_and_colliders_are_named_together() {
    let second = SMALL[SMALL.find("[[body]]").unwrap()..].replace("\"cloth\"", "\"other\"");
    let text = format!(
        "{SMALL}pins = [6]\n{second}transform = {{ rotate = {{ axis = [0, 0, 0], degrees = 1 }} }}\n[[collider]]\nname = \"\"\nplane = {{ point = [0, 0, 0], normal = [0, 0, 0] }}\n"
    );
    let keys: Vec<_> = build(&text).expect_err("four errors").iter().map(|e| e.key.clone()).collect();
    assert_eq!(
        keys,
        ["body[0].pins[0]", "body[1].transform.rotate.axis", "collider[0].name", "collider[0].plane.normal"]
    );
}

#[test]
fn a_misspelt_key_is_not_also_missing() {
    let errors = parse(&SMALL.replace("stretch =", "strech =")).expect_err("one error");
    assert_eq!(errors.iter().count(), 1, "{errors}");
    let errors = parse(&SMALL.replace("grid =", "gird =")).expect_err("one error");
    assert_eq!(errors.iter().count(), 1, "{errors}");
}

#[test]
fn of_many_errors_the_first_are_named_and_the_others_counted() {
    let many = (0..50).map(|i| format!("unknown_{i:02} = 1\n")).collect::<Vec<_>>().concat();
    let errors = parse(&SMALL.replace("dt = 0.01\n", &format!("dt = 0.01\n{many}"))).expect_err("50 errors");
    assert_eq!((errors.iter().count(), errors.omitted()), (SceneErrors::LIMIT, 50 - SceneErrors::LIMIT));
    assert!(errors.iter().zip(3..).all(|(error, line)| error.line == line), "{errors}");
    assert!(errors.to_string().ends_with("\n30 more"), "{errors}");
}

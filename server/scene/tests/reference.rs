//! docs/scenes.md is what the schema says, its example runs, and written defaults are the real ones.

use std::{env, fs, path::PathBuf, sync::Arc};

use nappe_scene::{MeshSource, Scene, SceneError, SceneLimits, reference_page};
use nappe_sim::mesh::TriangleMesh;

const MARK: &str =
    "(`cargo test -p nappe-scene` checks it against the code; `cargo xtask bless pages` rewrites it).\n";

fn page_file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/scenes.md")
}

#[test]
fn the_reference_in_the_docs_is_written_from_the_schema() {
    let text = fs::read_to_string(page_file()).unwrap();
    let (head, reference) = text.split_once(MARK).expect("docs/scenes.md has its mark");
    let wanted = reference_page();
    if env::var_os("NAPPE_BLESS").is_some() {
        fs::write(page_file(), format!("{head}{MARK}{wanted}")).unwrap();
        return;
    }
    assert!(reference == wanted, "run `cargo xtask bless pages` and look at the change");
}

#[test]
fn the_examples_in_the_docs_build() {
    let text = fs::read_to_string(page_file()).unwrap();
    let examples: Vec<&str> =
        text.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert_eq!(examples.len(), 4);
    for example in examples {
        let scene = Scene::parse(example, "docs/scenes.md").unwrap_or_else(|error| panic!("{error}"));
        scene.build(&Figure, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// The mesh that the example of snow names.
struct Figure;

impl MeshSource for Figure {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        None
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        assert_eq!(path, "figure.obj");
        Ok(TriangleMesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..TriangleMesh::default()
        })
    }
}

/// Sections with the text before and after a field of theirs, behind a scene of one body.
const PLACES: [(&str, &str, &str); 9] = [
    ("body", "", ""),
    (
        "body.transform, figure.transform, snow.object.transform, collider.mesh.transform",
        "transform = { ",
        " }",
    ),
    ("body.solver", "solver = { ", " }"),
    ("collider", "[[collider]]\nname = \"s\"\nsphere = { center = [0, 0, 0], radius = 1 }\n", ""),
    (
        "collider.key",
        "[[collider]]\nname = \"s\"\nsphere = { center = [0, 0, 0], radius = 1 }\n[[collider.key]]\ntime = 0\nposition = [0, 0, 0]\n",
        "",
    ),
    ("collider.mesh", "[[collider]]\nname = \"s\"\n[collider.mesh]\nfile = \"a.obj\"\n", ""),
    ("snow", "[snow]\ncell = 0.1\n", SNOW),
    ("snow.solver", "[snow]\ncell = 0.1\nbeta = 1\nsolver = { ", SNOW_OF_BRACE),
    (
        "snow.object",
        "[snow]\ncell = 0.1\n[[snow.object]]\nname = \"s\"\nsphere = { center = [0, 0, 0], radius = 1 }\n",
        "",
    ),
];

const SNOW: &str = "\n[[snow.object]]\nname = \"s\"\nsphere = { center = [0, 0, 0], radius = 1 }\n";
const SNOW_OF_BRACE: &str =
    " }\n[[snow.object]]\nname = \"s\"\nsphere = { center = [0, 0, 0], radius = 1 }\n";

#[test]
fn a_default_written_out_changes_nothing() {
    let page = reference_page();
    let mut count = 0;
    let head = "version = 1\ndt = 0.01\n";
    let body = "[[body]]\nname = \"a\"\nmesh = { course_grid = 3 }\n";
    let inner =
        PLACES.map(|(section, before, after)| (section, format!("{head}{body}{before}"), after.to_owned()));
    let root = ("scene", head.to_owned(), format!("\n{body}"));
    for (section, before, after) in [root].into_iter().chain(inner) {
        let plain =
            Scene::parse(&format!("{before}{after}"), section).unwrap_or_else(|error| panic!("{error}"));
        let rows = page.split("\n### ").find(|part| part.starts_with(&format!("{section}\n"))).unwrap();
        for row in rows.lines().filter(|row| row.starts_with("| ") && row.contains("| `")) {
            let cells: Vec<&str> = row.split(" | ").collect();
            let (name, default) = (cells[0].trim_start_matches("| "), cells[2].trim_matches('`'));
            if ["body", "collider", "law", "moving_pin"].contains(&name) {
                continue; // arrays of tables are absent by default
            }
            let text = format!("{before}{name} = {default}{after}");
            let with = Scene::parse(&text, section).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(with, plain, "{section}.{name} = {default}");
            count += 1;
        }
    }
    assert!(count >= 20, "only {count} defaults were found on the page");
}

#[test]
fn the_solver_defaults_on_the_page_are_those_of_the_simulation() {
    use nappe_sim::linalg::{SolverSettings, Stop};
    let Stop::Residual { tolerance, max_iterations } = SolverSettings::default().stop else {
        panic!("the default stops by its residual")
    };
    let page = reference_page();
    assert!(page.contains(&format!("| tolerance |  | {tolerance:e}, unless")), "{tolerance:e}");
    assert!(page.contains(&format!("| {max_iterations}, unless")));
}

//! What is wrong with snow in a scene file, and what each error is called.

use nappe_scene::{Built, NoMeshes, Scene, SceneErrors, SceneLimits};

const SMALL: &str = r#"version = 1
dt = 0.01

[snow]
cell = 0.1

[[snow.object]]
name = "ball"
sphere = { center = [0, 1, 0], radius = 0.3 }
"#;

fn build(text: &str) -> Result<Built, SceneErrors> {
    Scene::parse(text, "scene.toml")?.build(&NoMeshes, &SceneLimits::default())
}

/// What is replaced in the small scene, by what, and the whole message.
const ERRORS: &[(&str, &str, &str)] = &[
    (
        "cell = 0.1",
        "cell = 0.1\nkernel = \"linear\"",
        "scene.toml:6:10: snow.kernel: is 'linear', which works only with transfer = \"pic_flip\" and is there to show how it fails; allowed here: quadratic, cubic",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\nkernel = \"linear\"\ntransfer = \"pic_flip\"\nbeta = 1",
        "scene.toml:8:8: snow.beta: does not go with kernel = \"linear\"; allowed here: 0",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\nbeta = 0.49",
        "scene.toml:6:8: snow.beta: is 0.49; allowed: 0, or 0.5 to 1: below 0.5 elastic waves bound the step as they bound an explicit one",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\nflip = 0.9",
        "scene.toml:6:8: snow.flip: works only with transfer = \"pic_flip\"; the transfer here is \"mls\"",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\ntransfer = \"apic\"\nflip_time = 0.9",
        "scene.toml:7:13: snow.flip_time: works only with transfer = \"pic_flip\"; the transfer here is \"apic\"",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\nadvection = \"grid\"",
        "scene.toml:6:13: snow.advection: works only with transfer = \"pic_flip\"; the transfer here is \"mls\"",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\ntransfer = \"pic_flip\"\nflip = 1\nflip_time = 0.1",
        "scene.toml:8:13: snow.flip_time: does not go with flip: one of them is needed",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\nsubstep = 1e-4\nsafety = 0.5",
        "scene.toml:7:10: snow.safety: does not go with substep: a fixed step takes no share of the bound",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\nunchecked = true",
        "scene.toml:6:13: snow.unchecked: is for a fixed step: give its length, substep = seconds",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\nsolver = { tolerance = 1e-6 }",
        "scene.toml:6:10: snow.solver: is for a semi-implicit step: give beta, 0.5 to 1",
    ),
    (
        "cell = 0.1",
        "cell = 0.1\ntransfer = \"flip\"",
        "scene.toml:6:12: snow.transfer: is 'flip'; allowed: pic_flip, apic, mls",
    ),
    (
        "cell = 0.1",
        "",
        "scene.toml:4:1: snow.cell: is missing: side of a cell of the grid, which follows the snow wherever it goes (a number, 1e-6 to 1000000)",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nmaterial = { preset = \"stomakin\" }",
        "scene.toml:9:23: snow.object[0].material.preset: is 'stomakin'; did you mean 'stomakhin'?",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nmaterial = { preset = \"elastic\", hardening = 3 }",
        "scene.toml:9:46: snow.object[0].material.hardening: does not go with the preset 'elastic', which has no yield",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nmaterial = { preset = \"elastic\", plastic = true }",
        "scene.toml:9:44: snow.object[0].material.plastic: is true, and the preset 'elastic' has no yield; take another preset",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nmaterial = { plastic = false, plastic_ratio_range = [0.5, 2] }",
        "scene.toml:9:53: snow.object[0].material.plastic_ratio_range: does not go with plastic = false",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nmaterial = { plastic_ratio_range = [1.5, 2] }",
        "scene.toml:9:36: snow.object[0].material.plastic_ratio_range: the range of J_P is 1.5 to 2: a lower end above 0 and at most 1, and an upper from 1 to 1000 are needed",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nmaterial = { plastic_ratio_range = [0.5] }",
        "scene.toml:9:36: snow.object[0].material.plastic_ratio_range: is an array of 1; allowed: two numbers, each 1e-6 to 1000",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nparticles = 10\nparticles_per_cell = 4",
        "scene.toml:9:13: snow.object[0].particles: does not go with particles_per_cell: one of them is needed",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nsampling = \"poisson\"\njitter = 0.1",
        "scene.toml:10:10: snow.object[0].jitter: works only with sampling = \"jittered\"",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nbox = { min = [0, 0, 0], max = [1, 1, 1] }",
        "scene.toml:7:1: snow.object[0]: has box and sphere of box, sphere, mesh: exactly one is needed",
    ),
    (
        "sphere = { center = [0, 1, 0], radius = 0.3 }",
        "box = { min = [0, 0, 0], max = [1, 0, 1] }",
        "scene.toml:9:32: snow.object[0].box.max: is 0 along y, and min is 0: a box needs max above min along each axis",
    ),
    (
        "sphere = { center = [0, 1, 0], radius = 0.3 }",
        "box = { min = [0, 0, 0], size = [1, 1, 1] }",
        "scene.toml:9:7: snow.object[0].box.max: is missing: it is needed with 'min'\nscene.toml:9:33: snow.object[0].box.size: does not go with 'min'",
    ),
    (
        "sphere = { center = [0, 1, 0], radius = 0.3 }",
        "mesh = { upload = \"m1\" }",
        "scene.toml:9:19: snow.object[0].mesh.upload: no mesh with the id 'm1' was uploaded, or it is no longer kept",
    ),
    (
        "sphere = { center = [0, 1, 0], radius = 0.3 }",
        "mesh = { grid = [3, 3], spacing = 1 }",
        "scene.toml:9:10: snow.object[0].mesh.grid: snow.object.mesh has no key 'grid'; allowed: upload, file\nscene.toml:9:25: snow.object[0].mesh.spacing: snow.object.mesh has no key 'spacing'; allowed: upload, file",
    ),
    (
        "radius = 0.3",
        "radius = 1e-6",
        "scene.toml:9:10: snow.object[0].sphere: holds no particle: it is smaller than the distance between particles; allowed: a larger object, a smaller cell, or more particles",
    ),
    (
        "radius = 0.3",
        "radius = 1000",
        "scene.toml:9:10: snow.object[0].sphere: this object has 33510321638291 particles; allowed: at most 4000000",
    ),
    (
        "name = \"ball\"",
        "name = \"ball\"\nparticles = 4000001",
        "scene.toml:9:13: snow.object[0].particles: this object has 4000001 particles; allowed: at most 4000000",
    ),
    (
        "radius = 0.3 }",
        "radius = 1e-6 }\nparticles = 4000000",
        "scene.toml:10:13: snow.object[0].particles: is 4000000, and a cell of the grid holds 4000000 of them; allowed: at most 16777 in a cell, since a node adds up their masses in binary32: fewer particles, a larger object, or a smaller cell",
    ),
    ("name = \"ball\"", "name = \"\"", "scene.toml:8:8: snow.object[0].name: is empty: a name is needed"),
];

#[test]
fn as_many_particles_as_a_cell_may_hold_are_accepted() {
    let text = SMALL.replace("radius = 0.3 }", "radius = 1e-6 }\nparticles = 16777");
    build(&text).expect("a cell may hold so many");
    build(&text.replace("16777", "16778")).expect_err("one too many");
}

#[test]
fn a_message_names_file_line_column_field_finding_and_what_is_allowed() {
    for (old, new, wanted) in ERRORS {
        let text = SMALL.replace(old, new);
        assert_ne!(&text, SMALL, "the case changes the scene: {old}");
        let found = build(&text).expect_err("the scene has an error").to_string();
        assert_eq!(&found, wanted);
    }
}

#[test]
fn a_scene_holds_a_body_or_snow() {
    let error = build("version = 1\ndt = 0.01\n").expect_err("nothing is in it");
    assert_eq!(
        error.to_string(),
        "scene.toml:1:1: body: is missing, and so is snow: a scene has a body, `[[body]]`, or snow, `[snow]` with `[[snow.object]]`"
    );
    let bare = build("version = 1\ndt = 0.01\n[snow]\ncell = 0.1\n").expect_err("no object");
    assert_eq!(
        bare.to_string(),
        "scene.toml:3:1: snow.object: is missing: objects, at least one: `[[snow.object]]` (an array of tables, at most 1000)"
    );
}

#[test]
fn names_are_unique_among_bodies_and_objects() {
    let body = "[[body]]\nname = \"ball\"\nmesh = { course_grid = 3 }\n";
    let error = build(&format!("{SMALL}{body}")).expect_err("one name for two").to_string();
    assert_eq!(
        error,
        "scene.toml:8:8: snow.object[0].name: 'ball' is the name of a body: a name may be used once"
    );
    let twice = format!(
        "{SMALL}\n[[snow.object]]\nname = \"ball\"\nsphere = {{ center = [0, 3, 0], radius = 0.3 }}\n"
    );
    let error = build(&twice).expect_err("one name for two").to_string();
    assert_eq!(
        error,
        "scene.toml:12:8: snow.object[1].name: 'ball' is the name of another object of snow: a name may be used once"
    );
}

//! Figures of scenes: where their frames come from, what is built of them, and what is refused.

use std::sync::Arc;

use nappe_scene::{
    Built, FramesSource, MeshSource, Scene, SceneError, SceneErrors, SceneLimits, SceneSize,
    mesh::PointFrames,
};
use nappe_sim::{cloth::Repeat, math::Precision, mesh::TriangleMesh, world::Simulation};

const TEXT: &str = "version = 1\ndt = 0.01\n[[body]]\nname = \"sheet\"\nmesh = { grid = [3, 3], spacing = 0.1 }\n\
    mass = { particle = 0.01 }\nthickness = 0.01\n[[figure]]\nname = \"walker\"\nmesh = { upload = \"m\" }\nthickness = 0.02\n\
    frames = { upload = \"f\", rate = 25 }\n";

/// One mesh and some frames, each under one id.
struct Uploads(PointFrames);

impl Uploads {
    /// Two frames of a level square of four points, 1 m apart in height.
    fn sound() -> Self {
        let frame = |height: f32| {
            TriangleMesh::grid(2, 2, 0.5)
                .points
                .into_iter()
                .map(move |[x, _, z]| [x as f32, height, z as f32])
        };
        Self(PointFrames { points: 4, places: frame(-1.0).chain(frame(-2.0)).collect() })
    }
}

impl MeshSource for Uploads {
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        (id == "m").then(|| Arc::new(TriangleMesh::grid(2, 2, 0.5)))
    }

    fn file(&self, _: &str) -> Result<TriangleMesh, SceneError> {
        Ok(TriangleMesh::grid(2, 2, 0.5))
    }

    fn uploaded_frames(&self, id: &str) -> Option<PointFrames> {
        (id == "f").then(|| self.0.clone())
    }
}

fn built(text: &str, uploads: &Uploads) -> Result<Built, SceneErrors> {
    Scene::parse(text, "scene.toml")?.build(uploads, &SceneLimits::default())
}

fn message(text: &str, uploads: &Uploads) -> String {
    built(text, uploads).expect_err("the scene has an error").first().to_string()
}

#[test]
fn a_figure_is_a_body_without_springs_that_its_frames_lead() {
    let text = TEXT.replace("rate = 25", "rate = 25, repeat = \"loop\"") + "start = 0.5\n";
    let scene = Scene::parse(&text, "scene.toml").expect("a scene");
    assert_eq!(scene.figures[0].frames.source, FramesSource::Upload("f".to_owned()));
    let again = Scene::parse(&scene.to_toml(), "again.toml").expect("a scene");
    assert_eq!(again.figures, scene.figures);

    let built = built(&text, &Uploads::sound()).expect("it can be built");
    assert!(built.warnings.iter().all(|warning| !warning.contains("walker")), "{:?}", built.warnings);
    let [sheet, walker] = &built.setup.bodies[..] else { panic!("two bodies") };
    let network = &walker.network;
    assert_eq!((walker.name.as_str(), network.thickness, network.springs.len()), ("walker", 0.02, 0));
    assert_eq!(walker.settings, sheet.settings);
    assert_eq!((network.x.len(), network.x[3], network.triangles.len()), (4, [0.5, -1.0, 0.5], 2));
    assert!(network.masses.iter().all(|mass| *mass == 0.0));
    let weighs = |built: &Built| {
        let frames = built.setup.bodies[1].network.frames.as_ref().expect("frames lead it");
        frames.masses.iter().sum::<f64>()
    };
    // A square of 0.5 m, in steps of 0.01 s.
    let soft = self::built(&format!("{text}firmness = 2e3\n"), &Uploads::sound()).expect("it can be built");
    let off = [weighs(&built) - 1e6 * 0.25 * 1e-4, weighs(&soft) - 2e3 * 0.25 * 1e-4];
    assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
    let frames = network.frames.as_ref().expect("frames lead it");
    assert_eq!((frames.count(), frames.rate, frames.start, frames.repeat), (2, 25.0, 0.5, Repeat::Loop));
    Simulation::new(&built.setup, Precision::F32).expect("it can be simulated");
}

#[test]
fn a_transform_moves_all_frames() {
    let text = TEXT.to_owned() + "transform = { scale = 2, translate = [1, 0, 0] }\n";
    let built = built(&text, &Uploads::sound()).expect("it can be built");
    let network = &built.setup.bodies[1].network;
    assert_eq!(network.x[3], [2.0, -2.0, 1.0]);
    let frames = network.frames.as_ref().expect("frames lead it");
    assert_eq!(frames.frame(1)[3], [2.0, -4.0, 1.0]);
}

#[test]
fn what_a_figure_asks_for_is_counted() {
    let text = TEXT.to_owned() + "transform = { scale = 2 }\n";
    let scene = Scene::parse(&text, "scene.toml").expect("a scene");
    let size = scene.size(&Uploads::sound());
    let built = built(&text, &Uploads::sound()).expect("it can be built");
    assert_eq!((size.cloth_particles, size.triangles_apart, size.frame_bytes), (13, 10, 96));
    let of_setup = SceneSize::of_setup(&built.setup, &built.initial_changes);
    assert_eq!(of_setup, SceneSize { mesh_springs: 0, ..size });
    let plain = Scene::parse(TEXT, "scene.toml").expect("a scene");
    assert_eq!(plain.size(&Uploads::sound()).frame_bytes, 0, "uploaded frames are shared");
}

#[test]
fn what_is_wrong_with_a_figure_is_told_at_its_key() {
    let sound = Uploads::sound();
    let change = |change: fn(&mut Vec<[f32; 3]>)| {
        let mut places = sound.0.places.to_vec();
        change(&mut places);
        Uploads(PointFrames { points: 4, places: places.into() })
    };
    let three = Uploads(PointFrames { points: 3, places: [[0.0_f32; 3]; 6].into() });
    for (from, to, uploads, words) in [
        ("thickness = 0.01\n", "", &sound, "figure[0]: is a figure, and no body has a thickness"),
        ("thickness = 0.02\n", "", &sound, "figure[0].thickness: is missing"),
        ("thickness = 0.02\n", "thickness = 0.02\nfirmness = 10\n", &sound, "figure[0].firmness: is 10"),
        ("rate = 25", "rate = 0", &sound, "figure[0].frames.rate: is 0"),
        ("rate = 25", "rate = 25, repeat = \"swing\"", &sound, "figure[0].frames.repeat"),
        ("upload = \"f\", ", "", &sound, "figure[0].frames"),
        (
            "{ upload = \"f\"",
            "{ upload = \"other\"",
            &sound,
            "figure[0].frames.upload: no frames with the id 'other'",
        ),
        ("{ upload = \"f\"", "{ file = \"walk.pc2\"", &sound, "upload 'walk.pc2'"),
        (
            "{ upload = \"m\"",
            "{ upload = \"other\"",
            &sound,
            "figure[0].mesh.upload: no mesh with the id 'other'",
        ),
        ("{ upload = \"m\"", "{ grid = [2, 2], spacing = 1.0", &sound, "figure[0].mesh"),
        ("name = \"walker\"", "name = \"sheet\"", &sound, "'sheet' is the name of a body"),
        ("", "", &three, "figure[0].frames: have 3 points each, and the mesh has 4"),
        ("", "", &change(|places| places[5][1] = 1e3), "lead point 1 at"),
        ("", "", &change(|places| places[6][2] = f32::INFINITY), "frame 1, point 2"),
    ] {
        let text = if from.is_empty() { TEXT.to_owned() } else { TEXT.replace(from, to) };
        let told = message(&text, uploads);
        assert!(told.contains(words), "{told}, not {words}");
    }
}

#[test]
fn a_figure_does_not_meet_colliders_and_its_scene_says_so() {
    let text = TEXT.to_owned()
        + "[[collider]]\nname = \"ball\"\nsphere = { center = [0, -9, 0], radius = 1 }\nmargin = 0.1\n";
    let built = built(&text, &Uploads::sound()).expect("it can be built");
    let told = "figure 'walker': it passes through colliders, which it does not meet";
    assert!(built.warnings.iter().any(|warning| warning == told), "{:?}", built.warnings);
}

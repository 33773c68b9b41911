//! A recording of snow holds its points and colours, its grid, its diagnostics and the bound on its step; and a number
//! that is none is in no row.

use nappe_client::{Body, Collider, Frame, GridFrame, Scalars, Shape, Topology, Vectors, v1};
use nappe_rerun::{ColorBy, Recorder, RerunError, Sink};

use crate::recorded::{Recorded, TIMELINES, file};

const SIDE: usize = 6;
const COUNT: usize = SIDE * SIDE * SIDE;
const FRAMES: u64 = 6;

/// A block of snow above a trough, beside one of each solid; the capsule moves.
fn scene() -> Topology {
    let block = Body {
        name: "block".to_owned(),
        first_particle: 0,
        particle_count: COUNT,
        triangles: Vec::new(),
        springs: Vec::new(),
        pins: Vec::new(),
        uv: Vec::new(),
        color: None,
        masses: Vec::new(),
        volumes: Vec::new(),
    };
    let vector = |[x, y, z]: [f64; 3]| Some(v1::Vector3 { x, y, z });
    let (start, end, radius) = (vector([1.0, 0.0, 0.0]), vector([1.0, 1.0, 0.0]), 0.2);
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(vector);
    let half_extent = vector([9.0, 0.1, 9.0]);
    let shapes = [
        ("capsule", Shape::Capsule(v1::CapsuleShape { start, end, radius })),
        ("box", Shape::Box(v1::BoxShape { center: start, half_extent, axis_x: x, axis_y: y })),
        ("cylinder", Shape::Cylinder(v1::CylinderShape { start, end, radius })),
        ("pipe", Shape::HalfPipe(v1::HalfPipeShape { point: None, axis: z, up: y, radius: 3.0 })),
        ("pyramid", Shape::Mesh(pyramid())),
        ("floor", Shape::Plane(v1::PlaneShape { point: vector([0.0, -1.0, 0.0]), normal: y })),
    ];
    let collider = |(name, shape): (&str, Shape)| {
        let velocity = if name == "capsule" { [0.0, 0.0, 1.0] } else { [0.0; 3] };
        Collider { name: name.to_owned(), shape: Some(shape), velocity }
    };
    let colliders = shapes.map(collider).to_vec();
    Topology { id: 1, particle_count: COUNT, bodies: vec![block], colliders }
}

/// Four triangles over four points.
fn pyramid() -> v1::MeshShape {
    let points = [[2.0_f32, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 0.0, 1.0]];
    let triangles = [[0_u32, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let points = points.into_iter().flatten().flat_map(f32::to_le_bytes);
    let triangles = triangles.into_iter().flatten().flat_map(u32::to_le_bytes);
    let (points_f32, triangles_u32) = (points.collect::<Vec<u8>>(), triangles.collect::<Vec<u8>>());
    v1::MeshShape { points_f32: points_f32.into(), triangles_u32: triangles_u32.into(), origin: None }
}

/// Two rows of nodes, one above the other in every second frame, side by side, as in a slice, in the others.
fn grid(number: u64) -> GridFrame {
    let is_slice = number.is_multiple_of(2);
    let index = |i| if is_slice { [i % 4, 0, i / 4] } else { [i % 4, i / 4, i / 4] };
    let masses = (0..8).map(|i| i as f32 * 1e-3).collect();
    let velocities = vec![[0.0, -1.0, 0.5]; 8];
    GridFrame {
        cell: 0.1,
        indices: (0..8).map(index).collect(),
        masses,
        velocities,
        forces: Vec::new(),
        stride: 1,
        node_count: 8,
    }
}

/// The elastic wave binds in the first half, a particle's speed in the second.
fn diagnostics(number: u64) -> v1::Diagnostics {
    let mut snow = v1::SnowDiagnostics { substeps: 4, dt_seconds: 1e-4, ..v1::SnowDiagnostics::default() };
    let bound = if number < FRAMES / 2 { v1::TimeBound::ElasticWave } else { v1::TimeBound::ParticleSpeed };
    snow.set_bound(bound);
    // The bound of a step that nothing limits is no number: that row is left out.
    snow.bound_seconds = if number == 0 { f64::INFINITY } else { 2e-4 };
    let stage = v1::StageTime { stage: "sort".to_owned(), seconds: 1e-3 };
    v1::Diagnostics { snow: Some(snow), stages: vec![stage], ..v1::Diagnostics::default() }
}

fn frame(number: u64) -> Frame {
    let drop = 0.01 * number as f32;
    let position = |p: usize| [p % SIDE, p / SIDE % SIDE, p / SIDE / SIDE].map(|i| 0.05 * i as f32 - drop);
    Frame {
        frame: number,
        step: number,
        time: 0.02 * number as f64,
        state_hash: None,
        positions: Vectors::F32((0..COUNT).flat_map(position).collect()),
        velocities: Some(Vectors::F32(vec![1.0; 3 * COUNT])),
        plastic_ratios: Some(Scalars::F32((0..COUNT).map(|p| 0.7 + p as f32 * 1e-3).collect())),
        stress_norms: Some(Scalars::F64(vec![100.0; COUNT])),
        forces: Some(Vectors::F64(vec![0.5; 3 * COUNT])),
        accelerations: None,
        grid: Some(grid(number)),
        dropped_count: 0,
        diagnostics: Some(diagnostics(number)),
        poses: Vec::new(),
        carried: None,
    }
}

fn record(test: &str, by: ColorBy, frames: impl IntoIterator<Item = Frame>) -> Result<Recorded, RerunError> {
    let path = file(test);
    let mut recorder = Recorder::open("snow", Sink::Save(path.clone()), by)?;
    recorder.topology(&scene())?;
    for frame in frames {
        recorder.frame(&frame)?;
    }
    recorder.finish()?;
    Ok(Recorded::read(&path))
}

#[test]
fn a_file_holds_snow_its_grid_and_its_diagnostics_on_both_timelines() {
    let recorded = record("snow", ColorBy::PlasticRatio, (0..FRAMES).map(frame)).expect("records");
    let every = [
        "/world/bodies/0_block",
        "/world/grid/mass",
        "/world/grid/velocity",
        "/world/particles/force",
        "/world/colliders/0_capsule",
        "/plots/snow_substeps",
        "/plots/snow_counts",
        "/plots/snow_plastic_ratio",
        "/plots/snow_mass",
        "/plots/snow_stages",
    ];
    for entity in every {
        for timeline in TIMELINES {
            assert_eq!(recorded.count(entity, timeline), FRAMES as usize, "{entity} on {timeline}");
        }
    }
    for timeline in TIMELINES {
        let rows = recorded.count("/plots/snow_dt", timeline);
        assert_eq!(rows, FRAMES as usize - 1, "a bound that is no number has no row");
        for entity in ["/states/time_bound", "/logs/time_bound"] {
            assert_eq!(recorded.count(entity, timeline), 2, "{entity}: two bounds bind");
        }
    }
    for still in ["1_box", "2_cylinder", "3_pipe", "4_pyramid", "5_floor"] {
        let entity = format!("/world/colliders/{still}");
        assert_eq!((recorded.count(&entity, ""), recorded.count(&entity, "step")), (1, 1), "{entity}");
    }
    for part in ["vertex_positions", "vertex_normals", "triangle_indices", "albedo_factor"] {
        let component = ("/world/colliders/4_pyramid".to_owned(), format!("Mesh3D:{part}"), true);
        assert!(recorded.components.contains(&component), "{part} of a mesh");
    }
    let cloth = recorded.rows.keys().find(|(entity, _)| entity == "/plots/stretch");
    assert_eq!(cloth, None, "there is no cloth");
    assert_eq!(recorded.count("/world/particles/acceleration", "step"), 0, "frames have none");
}

#[test]
fn colours_come_with_each_frame_or_once() {
    for by in [ColorBy::PlasticRatio, ColorBy::Speed, ColorBy::Stress, ColorBy::Body] {
        let recorded = record(&format!("color_{by:?}"), by, (0..2).map(frame)).expect("records");
        let block = "/world/bodies/0_block";
        let moving = recorded.components.contains(&(block.to_owned(), "Points3D:colors".to_owned(), false));
        let still = recorded.components.contains(&(block.to_owned(), "Points3D:colors".to_owned(), true));
        assert_eq!((moving, still), (by != ColorBy::Body, by == ColorBy::Body), "{by:?}");
        assert!(recorded.components.contains(&(block.to_owned(), "Points3D:radii".to_owned(), true)));
    }
}

#[test]
fn snow_has_its_own_plots_in_the_layout() {
    let recorded = record("layout_snow", ColorBy::default(), [frame(0)]).expect("records");
    let legends = recorded.blueprint_entities.iter().filter(|entity| entity.ends_with("/PlotLegend")).count();
    // Five of any scene, the forces on colliders among them, eight of snow; a camera is there once, so the layout was sent once.
    assert_eq!(legends, 13, "{:?}", recorded.blueprint_entities);
    let cameras = recorded.blueprint_entities.iter().filter(|entity| entity.ends_with("/EyeControls3D"));
    assert_eq!(cameras.count(), 1);
}

#[test]
fn a_position_that_is_not_finite_is_refused_with_its_particle() {
    let mut flat = vec![0.0_f32; 3 * COUNT];
    flat[3 * 7 + 1] = f32::NAN;
    let wrong = Frame { positions: Vectors::F32(flat), ..frame(3) };
    let refused = record("not_finite", ColorBy::default(), [wrong]).err().expect("not finite");
    assert!(matches!(refused, RerunError::NotFinite { frame: 3, particle: 7 }), "{refused}");
}

#[test]
fn frames_without_the_array_of_the_colour_are_drawn_all_the_same() {
    let plain = |number| Frame { plastic_ratios: None, grid: None, ..frame(number) };
    let recorded = record("plain", ColorBy::PlasticRatio, (0..3).map(plain)).expect("records");
    assert_eq!(recorded.count("/world/bodies/0_block", "step"), 3);
    assert_eq!(recorded.count("/world/grid/mass", "step"), 0);
}

//! Snow that shares space: parts of one mesh, and objects of one scene; told, or counted once.

use std::sync::Arc;

use nappe_scene::{Built, SceneLimits};
use nappe_sim::mesh::TriangleMesh;

use crate::{Uploaded, parse};

/// A box: its lower corner, its edges, and whether it is turned inside out.
type Block = ([f64; 3], [f64; 3], bool);

/// Boxes, as the parts of one mesh.
fn mesh(blocks: &[Block]) -> TriangleMesh {
    let quads: [[u32; 4]; 6] =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let mut mesh = TriangleMesh::default();
    for (low, size, is_turned) in blocks {
        let first = mesh.points.len() as u32;
        let at = |i: u32, c: usize| low[c] + f64::from(i >> (2 - c) & 1) * size[c];
        mesh.points.extend((0..8).map(|i| [0, 1, 2].map(|c| at(i, c))));
        for [a, b, c, d] in quads.map(|quad| quad.map(|i| first + i)) {
            let faces = if *is_turned { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
            mesh.triangles.extend(faces);
        }
    }
    mesh
}

/// Objects of snow of 400 kg/m^3, on cells of this side (m).
fn scene(cell: f64, objects: &[(&str, &str)], blocks: &[Block]) -> Result<Built, String> {
    let mut text = format!("version = 1\ndt = 0.001\n[snow]\ncell = {cell}\n");
    for (name, lines) in objects {
        let object =
            format!("[[snow.object]]\nname = \"{name}\"\nmaterial = {{ preset = \"elastic\" }}\n{lines}\n");
        text.push_str(&object);
    }
    let scene = parse(&text).map_err(|error| error.to_string())?;
    let uploaded = Uploaded(Arc::new(mesh(blocks)));
    scene.build(&uploaded, &SceneLimits::default()).map_err(|error| error.to_string())
}

fn built(cell: f64, objects: &[(&str, &str)], blocks: &[Block]) -> Built {
    scene(cell, objects, blocks).unwrap_or_else(|error| panic!("{error}"))
}

fn mass(built: &Built) -> f64 {
    let objects = built.setup.snow.iter().flat_map(|snow| &snow.objects);
    objects.flat_map(|object| &object.mass).sum()
}

/// Whether two numbers agree to within a share of the second.
fn near(value: f64, expected: f64, share: f64) -> bool {
    (value / expected - 1.0).abs() < share
}

const UNIT: Block = ([0.0; 3], [1.0; 3], false);
const PARTS: &str = "mesh = { upload = \"m\" }";
const PARTS_ONCE: &str = "mesh = { upload = \"m\" }\noverlap = \"drop\"";

#[test]
fn parts_of_a_mesh_that_overlap_are_told_with_volume_and_mass_and_counted_once_if_asked() {
    for (offset, shared, in_words) in [
        ([0.5, 0.3, 0.2], 0.28, "0.28 m^3: 112 kg"),
        ([-0.5, 0.3, -0.2], 0.28, "0.28 m^3: 112 kg"),
        ([0.9, 0.0, 0.0], 0.1, "0.1 m^3: 40 kg"),
        ([0.0, 0.0, 0.985], 0.015, "0.015 m^3: 6 kg"),
    ] {
        let blocks = [UNIT, (offset, [1.0; 3], false)];
        let kept = built(0.25, &[("m", PARTS)], &blocks);
        let expected = format!(
            "snow 'm': the parts of its mesh that begin with triangles 0 and 12 overlap by {in_words} count twice; join \
             them, or count them once by overlap = \"drop\""
        );
        assert_eq!(kept.warnings, [expected], "{offset:?}");
        assert!(near(mass(&kept), 800.0, 1e-9));

        let once = built(0.25, &[("m", PARTS_ONCE)], &blocks);
        assert!(near(mass(&once), 400.0 * (2.0 - shared), 1e-6), "{offset:?}: {}", mass(&once));
        assert!(once.warnings.len() == 1 && once.warnings[0].ends_with("which counts once"), "{offset:?}");
    }
}

#[test]
fn parts_that_touch_or_are_holes_or_hardly_overlap_are_not_told() {
    let large = ([0.0; 3], [3.0; 3], false);
    let hole = ([0.5; 3], [2.0; 3], true);
    let turned = [([0.0; 3], [3.0; 3], true), ([0.5; 3], [2.0; 3], false)];
    let cases: [(&[Block], f64); 6] = [
        (&[UNIT, ([1.0, 0.25, 0.1], [1.0; 3], false)], 2.0),
        (&[UNIT, ([0.995, 0.0, 0.0], [1.0; 3], false)], 2.0),
        (&[UNIT, ([0.5, 2.0, 0.5], [1.0; 3], false)], 2.0),
        (&[large, hole], 19.0),
        (&[large, hole, ([1.0; 3], [1.0; 3], false)], 20.0),
        // All of it inside out is the same solid.
        (&turned, 19.0),
    ];
    for (blocks, volume) in cases {
        let built = built(0.4, &[("m", PARTS)], blocks);
        assert!(built.warnings.is_empty(), "{blocks:?}: {:?}", built.warnings);
        assert!(near(mass(&built), 400.0 * volume, 1e-9), "{blocks:?}");
    }
}

#[test]
fn a_part_within_another_counts_once_and_several_parts_are_told_together() {
    let within = [([0.0; 3], [3.0; 3], false), ([1.0; 3], [1.0; 3], false)];
    let told = built(0.4, &[("m", PARTS)], &within);
    assert!(told.warnings[0].contains("overlap by 1 m^3: 400 kg"), "{:?}", told.warnings);
    assert!(near(mass(&built(0.4, &[("m", PARTS_ONCE)], &within)), 27.0 * 400.0, 1e-6));

    // Of three blocks in a row 0.5 m is in all, and neighbours share 0.1 m more: together they are 0.9 m long.
    let three = [0.0, 0.1, 0.2].map(|x| ([x, 0.01 * x, 0.0], [0.7, 1.0, 1.0], false));
    let told = built(0.25, &[("m", PARTS)], &three);
    assert!(
        told.warnings[0].starts_with("snow 'm': 3 pairs of parts of its mesh overlap"),
        "{:?}",
        told.warnings
    );
    let once = built(0.25, &[("m", PARTS_ONCE)], &three);
    assert!(near(mass(&once), 400.0 * 0.9, 0.02), "{}", mass(&once));
}

#[test]
fn objects_that_overlap_are_told_and_the_later_one_gives_way_if_asked() {
    let cube = "box = { min = [0, 0, 0], max = [1, 1, 1] }";
    let skew = "box = { min = [0.5, 0.3, 0.2], max = [1.5, 1.3, 1.2] }\nstiffness_noise = 0.1";
    let kept = built(0.1, &[("a", cube), ("b", skew)], &[]);
    assert_eq!(
        kept.warnings,
        [
            "snow 'b': overlaps 'a' by 0.28 m^3: 112 kg are there twice; move it, or leave out its particles there by overlap \
          = \"drop\""
        ]
    );
    assert!(near(mass(&kept), 800.0, 1e-9));

    let skew = format!("{skew}\noverlap = \"drop\"");
    let gave_way = built(0.1, &[("a", cube), ("b", skew.as_str())], &[]);
    assert!(near(mass(&gave_way), 688.0, 0.02), "{}", mass(&gave_way));
    let objects = &gave_way.setup.snow.as_ref().expect("snow").objects;
    let left = objects[1].x.len();
    assert_eq!(
        gave_way.warnings,
        [format!(
            "snow 'b': overlap = \"drop\" leaves out {} of 8000 particles, which lie in earlier objects",
            8000 - left
        )]
    );
    let is_in_cube = |x: &[f64; 3]| x.iter().all(|c| (0.0..=1.0).contains(c));
    assert!(objects[0].x.len() == 8000 && !objects[1].x.iter().any(is_in_cube));
    let lengths =
        [objects[1].v.len(), objects[1].mass.len(), objects[1].volume.len(), objects[1].stiffness.len()];
    assert_eq!(lengths, [left; 4]);
}

#[test]
fn objects_of_all_shapes_are_compared_where_they_stand() {
    let ball = "sphere = { center = [0, 0, 0], radius = 0.5 }";
    let raised = "sphere = { center = [0, 0.3, 0], radius = 0.5 }";
    let slab = "box = { center = [0, 0, 0], size = [4, 0.4, 4] }\n\
                transform = { rotate = { axis = [0, 0, 1], degrees = 45 }, translate = [0.3, 0, 0] }";
    let warnings = built(0.2, &[("ball", raised), ("slab", slab)], &[]).warnings;
    let volume: f64 = warnings[0]
        .strip_prefix("snow 'slab': overlaps 'ball' by ")
        .and_then(|rest| rest.split_once(" m^3"))
        .and_then(|(volume, _)| volume.parse().ok())
        .unwrap_or_else(|| panic!("{warnings:?}"));
    // The slab's middle is 0.6 / sqrt(2) from the ball's centre: it cuts off a cap that begins 0.2 before that.
    let begin = 0.6 / 2.0_f64.sqrt() - 0.2;
    let cap = std::f64::consts::PI * (0.25 * (0.5 - begin) - (0.125 - begin.powi(3)) / 3.0);
    assert!((volume - cap).abs() < 0.01, "{volume} {cap}");

    let inner = "mesh = { upload = \"m\" }\ntransform = { translate = [-0.1, -0.1, -0.1] }";
    let small = [([0.0; 3], [0.2; 3], false)];
    let told = built(0.05, &[("ball", ball), ("cube", inner)], &small).warnings;
    assert_eq!(told.len(), 1);
    assert!(told[0].starts_with("snow 'cube': overlaps 'ball' by 0.008 m^3: 3.2 kg"), "{told:?}");
    let all_of_it = format!("{inner}\noverlap = \"drop\"");
    let error = scene(0.05, &[("ball", ball), ("cube", all_of_it.as_str())], &small);
    assert!(
        error.is_err_and(|error| error.contains("snow.object[1].overlap: is \"drop\", and all particles"))
    );

    let cube = |x: f64| format!("box = {{ min = [{x}, 0, 0], max = [{}, 1, 1] }}", x + 1.0);
    let row = [cube(0.0), cube(1.0), cube(1.5), cube(0.5)];
    let objects: Vec<(&str, &str)> =
        ["a", "b", "c", "d"].into_iter().zip(row.iter().map(String::as_str)).collect();
    let told = built(0.25, &objects, &[]).warnings;
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].starts_with("snow 'c': overlaps 'b' by 0.5 m^3: 200 kg"), "{told:?}");
    assert!(
        told[1].starts_with("snow 'd': overlaps 2 earlier objects, 'a' most, by 1 m^3: 400 kg"),
        "{told:?}"
    );
}

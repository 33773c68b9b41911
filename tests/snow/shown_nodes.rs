//! Nodes of the grid that frames show, as smoke and on slices: they stand where the snow is.

use nappe_scene::{NoMeshes, Scene, SceneLimits, shipped_scenes};
use nappe_sim::{field::Field, math::Precision, report::NoStopwatch, snow::Kernel, world::Simulation};

/// A cell as a number: those along z follow one another.
fn key(cell: [i32; 3]) -> i64 {
    cell.iter().fold(0, |key, c| (key << 20) + i64::from(*c))
}

/// The first of the three nodes along each axis that the quadratic kernel of a particle reaches, in cells of `h` (m).
fn first_node(x: &[f64; 3], h: f64) -> [i32; 3] {
    x.map(|c| (c / h - 0.5).floor() as i32)
}

/// Whether any particle reaches a node, or one beside it along each axis; `first` are keys of first nodes, sorted.
fn is_near(node: [i32; 3], first: &[i64]) -> bool {
    let [x, y, z] = node;
    [-1, 0, -2, 1, -3].into_iter().any(|dx| {
        [-1, 0, -2, 1, -3].into_iter().any(|dy| {
            let lowest = key([x + dx, y + dy, z - 3]);
            let at = first.partition_point(|key| *key < lowest);
            first.get(at).is_some_and(|key| *key <= lowest + 4)
        })
    })
}

#[test]
fn every_node_that_a_frame_of_two_snowballs_shows_has_a_particle_near() {
    let (_, text) =
        shipped_scenes().iter().find(|(name, _)| *name == "two_snowballs").expect("it is shipped");
    let scene = Scene::parse(text, "two_snowballs").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let snow = built.setup.snow.as_ref().expect("there is snow");
    assert_eq!(snow.settings.kernel, Kernel::Quadratic);
    let h = snow.settings.cell;
    let mass: f64 = snow.objects.iter().flat_map(|object| &object.mass).sum();
    let (mut simulation, _) = Simulation::new(&built.setup, Precision::F32).expect("a scene that is shipped");

    let mut nodes = Vec::new();
    let mut places = vec![[0.0; 3]; simulation.particle_count()];
    for frame in 1..=12 {
        for _ in 0..2 {
            simulation.step(&mut NoStopwatch).unwrap_or_else(|error| panic!("{error}"));
        }
        simulation.grid_nodes(&mut nodes);
        simulation.read::<f64>(Field::Positions, places.as_flattened_mut());
        let mut first: Vec<i64> = places.iter().map(|x| key(first_node(x, h))).collect();
        first.sort_unstable();
        first.dedup();

        let shown: f64 = nodes.iter().map(|node| node.mass).sum();
        assert!((shown / mass - 1.0).abs() < 1e-5, "frame {frame}: nodes of {shown} kg, snow of {mass} kg");
        let alone: f64 = nodes.iter().filter(|n| !is_near(n.index, &first)).map(|n| n.mass).sum();
        assert_eq!(
            alone,
            0.0,
            "frame {frame}: {:.1} % of the mass has no particle near",
            100.0 * alone / mass
        );
    }
}

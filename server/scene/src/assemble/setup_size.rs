//! How much a world asks for of which the setup is there already, in the counts of a scene.
//!
//! Reads a [`WorldSetup`] of which nothing was checked yet, and the changes with which it begins; gives numbers. Errors are left to
//! whoever builds the world.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Integrator, Minimizer, Network, SurfaceCheck, wall_bytes},
    collide::{
        Collider, LOAD_BYTES, Shape,
        shape::{MeshSolid, NEAR_BYTES},
    },
    linalg::{AtCap, PreconditionerKind},
    math::Precision,
    snow::{BLOCK_SIDE, SnowObject, grid_bytes},
    time_step::TimeStep,
    world::{BodySetup, Change, WorldSetup},
};

use super::{
    estimate::SceneSize,
    pins::{FORCED_BYTES, MOVED_BYTES},
};
use crate::way::KEY_BYTES;

impl SceneSize {
    /// What a world of this setup asks for that begins with these changes. What is made of meshes of colliders is there already.
    pub fn of_setup(setup: &WorldSetup, initial: &[Change]) -> Self {
        let (mut size, mut load_blocks) = (Self::default(), 0_u64);
        for body in &setup.bodies {
            size.add_setup(body, setup);
            let particles = body.network.x.len() as u64;
            load_blocks =
                load_blocks.saturating_add(particles.div_ceil(body.settings.block_size.max(1) as u64));
            let walls = wall_bytes(particles, body.network.thickness, setup.colliders.len());
            size.collider_bytes = size.collider_bytes.saturating_add(walls);
        }
        let thin = setup.bodies.iter().filter(|body| body.network.thickness == 0.0).count();
        size.bodies = setup.bodies.len() as u64;
        size.cloths = thin as u64 + u64::from(thin < setup.bodies.len());
        for collider in &setup.colliders {
            size.add_made_collider(collider);
        }
        let listed: usize = initial.iter().map(Change::bytes).sum();
        size.named_bytes =
            size.named_bytes.saturating_add(listed as u64 + MOVED_BYTES * initial.len() as u64);

        if let Some(snow) = &setup.snow {
            size.snow_particles = snow.objects.iter().map(|object| object.x.len() as u64).sum();
            let blocks = blocks(&snow.objects, BLOCK_SIDE as f64 * snow.settings.cell);
            size.snow_grid_bytes =
                Precision::ALL.map(|precision| grid_bytes(&snow.settings, precision, blocks));
            load_blocks = load_blocks.saturating_add(blocks[0] as u64);
        }
        let loads = LOAD_BYTES.saturating_mul(load_blocks).saturating_mul(setup.colliders.len() as u64);
        size.collider_bytes = size.collider_bytes.saturating_add(loads);
        size
    }

    fn add_setup(&mut self, body: &BodySetup, setup: &WorldSetup) {
        let BodySetup { network, settings, forces, .. } = body;
        let (points, triangles) = (network.x.len() as u64, network.triangles.len() as u64);
        self.cloth_particles += points;
        self.triangles += triangles;
        if settings.rest.is_some() {
            self.watched_particles += points;
        }
        // An element counts as a spring, that of a plate as three, that of a membrane as four.
        let as_springs = |list: &ElementList| match list.kind {
            ElementKind::QuadraticBending => list.corner_count() / 3,
            ElementKind::Plate => list.corner_count() / 2,
            ElementKind::Membrane => list.corner_count() / 3 * 4,
        };
        let frames = network.frames.as_ref().map_or(0, |frames| size_of_val(&*frames.places) as u64);
        self.frame_bytes = self.frame_bytes.saturating_add(frames);
        let elements: usize = network.elements.iter().map(as_springs).sum();
        self.springs += (network.springs.len() + elements) as u64;
        let named: usize = forces.iter().map(|force| force.particles.len()).sum();
        self.named_bytes += FORCED_BYTES * named as u64;
        if settings.integrator.is_implicit() {
            self.add_solves(body, setup);
        }
        // A step that is not judged, and as long as that of the world, is never divided.
        if !matches!(settings.time_step, TimeStep::Unchecked(length) if length >= setup.dt) {
            self.divided_particles += points;
        }
        if network.thickness > 0.0 || settings.contact.surface == SurfaceCheck::Count {
            self.triangles_apart += triangles;
        }
        if network.air.is_some() {
            self.triangles_in_air += triangles;
        }
    }

    /// What implicit steps of a body ask for.
    fn add_solves(&mut self, body: &BodySetup, setup: &WorldSetup) {
        let BodySetup { network, settings, .. } = body;
        let points = network.x.len() as u64;
        self.implicit_particles += points;
        let solves_once = matches!(settings.minimizer, Minimizer::Auto { .. } | Minimizer::OneStep);
        if !(solves_once && settings.integrator == Integrator::ImplicitEuler) {
            self.iterated_particles += points;
        } else if matches!(settings.minimizer, Minimizer::Auto { .. }) {
            self.tried_particles += points;
        }
        let [is_coarse, may_switch] = match settings.solver.preconditioner {
            PreconditionerKind::TwoLevel => [true, false],
            PreconditionerKind::Auto => is_stiff(body, setup),
            _ => [false; 2],
        };
        if is_coarse {
            self.coarse_blocks += points.div_ceil(settings.block_size.max(1) as u64);
        }
        if may_switch {
            self.switching_particles += points;
        }
        if settings.solver.preconditioner == PreconditionerKind::Patches {
            self.patched_particles += points;
        }
    }

    fn add_made_collider(&mut self, collider: &Collider) {
        let keys = collider.way.as_ref().map_or(0, |way| way.keys.len() as u64);
        self.collider_bytes = self.collider_bytes.saturating_add(KEY_BYTES * keys);
        if let Shape::Mesh(solid) = &collider.shape {
            let bytes = MeshSolid::bytes(solid.points().len() as u64, solid.triangles().len() as u64);
            let kept = NEAR_BYTES.saturating_mul(self.cloth_particles);
            self.collider_bytes = self.collider_bytes.saturating_add(bytes).saturating_add(kept);
        }
    }
}

/// Whether the preconditioner `auto` of a body is `two_level`, and whether its solves may come to patches.
fn is_stiff(body: &BodySetup, setup: &WorldSetup) -> [bool; 2] {
    let BodySetup { network, settings, .. } = body;
    let springs = network.springs.iter().map(|spring| [spring.law.stiffness, spring.law.damping]);
    let laws = springs.chain(network.elements.iter().map(ElementList::as_springs));
    let sums = laws.fold([0.0; 2], |[k, nu], [stiffness, damping]| [k + stiffness, nu + damping]);
    let pinned: f64 = network.pins.iter().filter_map(|pin| network.masses.get(*pin as usize)).sum();
    let mass = network.masses.iter().sum::<f64>() - pinned;
    // Bodies with a thickness are one cloth, which may have more particles than a block where none of them has.
    let is_thick = |network: &Network| network.thickness > 0.0;
    let thick = setup.bodies.iter().filter(|body| is_thick(&body.network)).count();
    let particles = if is_thick(network) && thick > 1 { u64::MAX } else { network.x.len() as u64 };
    let may_switch = settings.solver.at_cap == AtCap::Patches
        && !is_thick(network)
        && settings.has_stiff_springs(mass, sums, setup.dt);
    [settings.is_stiff(particles, mass, sums, setup.dt), may_switch]
}

/// Blocks of a grid, of this side (m), in which particles are, and blocks of nodes that these reach.
fn blocks(objects: &[SnowObject], side: f64) -> [usize; 2] {
    let place = |x: &[f64; 3]| x.map(|c| (c / side).floor() as i32);
    let mut blocks: Vec<[i32; 3]> = objects.iter().flat_map(|object| &object.x).map(place).collect();
    blocks.sort_unstable();
    blocks.dedup();
    // Each reaches eight.
    let reached = |block: &[i32; 3]| {
        let [x, y, z] = *block;
        (0..8).map(move |corner| {
            let [right, up, behind] = [corner & 1, (corner >> 1) & 1, (corner >> 2) & 1];
            [x.saturating_add(right), y.saturating_add(up), z.saturating_add(behind)]
        })
    };
    let mut nodes: Vec<[i32; 3]> = blocks.iter().flat_map(reached).collect();
    nodes.sort_unstable();
    nodes.dedup();
    [blocks.len(), nodes.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{NoMeshes, Scene, SceneLimits};

    /// What a scene asks for by its text, and by the setup that is built of it.
    fn sizes(text: &str) -> [SceneSize; 2] {
        let scene = Scene::parse(text, "test").expect("a scene");
        let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("it can be built");
        [scene.size(&NoMeshes), SceneSize::of_setup(&built.setup, &built.initial_changes)]
    }

    fn sheet(more: &str) -> String {
        format!(
            "version = 1\ndt = 0.005\n[[body]]\nname = \"b\"\nmesh = {{ grid = [40, 50], spacing = 0.1 }}\n\
             mass = {{ particle = 0.1 }}\n{more}\n[body.springs]\nstretch = {{ stiffness = 10.0 }}\n\
             bend = {{ stiffness = 1.0 }}\n"
        )
    }

    #[test]
    fn the_counts_of_a_setup_are_those_of_its_scene() {
        let stiff = sheet("").replace("10.0", "1e9");
        let air = sheet("air = { lift = 1.0 }");
        let explicit = sheet("integrator = \"symplectic_euler\"\nunchecked = true");
        let scenes = [
            sheet(""),
            stiff,
            air,
            explicit,
            sheet("minimizer = \"newton\""),
            sheet("solver = { preconditioner = \"two_level\" }"),
            sheet("solver = { preconditioner = \"patches\" }"),
        ];
        for text in scenes {
            let [scene, setup] = sizes(&text);
            assert_eq!(setup, SceneSize { mesh_springs: 0, ..scene }, "{text}");
        }
    }

    #[test]
    fn particles_with_a_thickness_count_where_there_are_colliders() {
        let floor = "[[collider]]\nname = \"floor\"\nplane = { point = [0, -100, 0], normal = [0, 1, 0] }\n";
        let thick = sheet("thickness = 0.01\nminimizer = \"one_step\"");
        let texts = [sheet("") + floor, thick.clone() + floor, thick];
        let [thin, thick, alone] = texts.map(|text| sizes(&text).map(|size| size.collider_bytes));
        for way in 0..2 {
            assert!(thick[way] - thin[way] >= 100 * 2000, "{} and {}", thick[way], thin[way]);
            assert_eq!(alone[way], 0);
        }
        assert_eq!(thick[0], thick[1]);
    }

    #[test]
    fn a_fabric_counts_as_much_by_its_name_as_by_its_laws() {
        let text = "version = 1\ndt = 0.005\n[[body]]\nname = \"b\"\nmesh = { grid = [40, 50], spacing = 0.01 }\n\
                    material = { preset = \"wool\" }\nsolver = { preconditioner = \"two_level\" }\n";
        let [scene, setup] = sizes(text);
        assert_eq!(setup.springs, 7 * 2 * 39 * 49);
        assert_eq!(setup, SceneSize { mesh_springs: 0, ..scene });
    }

    #[test]
    fn snow_takes_the_blocks_in_which_it_is() {
        let text = "version = 1\ndt = 0.001\n[snow]\ncell = 0.2\n[[snow.object]]\nname = \"a\"\n\
                    box = { center = [0, 0, 0], size = [3, 2, 4] }\n";
        let [scene, setup] = sizes(text);
        assert!(setup.snow_particles > 1000);
        for (estimated, found) in scene.snow_grid_bytes.into_iter().zip(setup.snow_grid_bytes) {
            let share = found as f64 / estimated as f64;
            assert!((0.4..1.6).contains(&share), "{share}: {scene:?} and {setup:?}");
        }
    }
}

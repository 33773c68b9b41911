//! How much a scene asks for, before anything is made: counts that its memory and its time follow from.
//!
//! Reads a scene and the sizes of its meshes; gives numbers, nearly. Errors are left to [`Scene::build`].

use nappe_sim::{
    cloth::{ClothSettings, Integrator, Minimizer, MinimizerKind, SurfaceCheck, wall_bytes},
    collide::{
        LOAD_BYTES,
        shape::{MeshSolid, NEAR_BYTES},
    },
    linalg::{PreconditionerKind, Stop},
    math::Precision,
    snow::{BLOCK_SIDE, grid_bytes},
    time_step::TimeStep,
};

use super::{
    elements,
    meshes::{MeshSource, uploaded},
    pins::named_bytes,
    size::{area, lattice_springs, mesh_springs, volume},
    snow::{Plan, particles_per_volume, settings},
    springs::{own_springs, wanted},
};
use crate::{
    body::{Body, Mass, Mesh, Pattern},
    collider::{ColliderMesh, ColliderText},
    fill::met_blocks,
    location::Location,
    scene::Scene,
    snow::{SnowBody, SnowSource},
    way::KEY_BYTES,
};

/// Counts of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneSize {
    /// Bodies of cloth.
    pub bodies: u64,
    /// Cloths that are stepped by themselves: bodies without a thickness, and all others as one.
    pub cloths: u64,
    /// Particles of cloth.
    pub cloth_particles: u64,
    /// Of these, particles whose steps solve a linear system.
    pub implicit_particles: u64,
    /// Of these, particles whose steps evaluate other states than those that they lead to.
    pub iterated_particles: u64,
    /// Of these, particles whose steps do so only where one linear solve is not enough.
    pub tried_particles: u64,
    /// Particles of cloth whose steps may be divided.
    pub divided_particles: u64,
    /// Particles of cloth that are watched for rest.
    pub watched_particles: u64,
    /// Blocks of particles whose preconditioner has a coarse space.
    pub coarse_blocks: u64,
    /// Particles whose solves are preconditioned with patches.
    pub patched_particles: u64,
    /// Particles whose solves may come to patches.
    pub switching_particles: u64,
    /// Springs of cloth.
    pub springs: u64,
    /// Of these, springs of bodies whose springs follow from a mesh, which is sorted for them.
    pub mesh_springs: u64,
    /// Triangles of cloth.
    pub triangles: u64,
    /// Of these, triangles that are kept from crossing each other, or whose crossings are counted.
    pub triangles_apart: u64,
    /// Of these, triangles that air acts on.
    pub triangles_in_air: u64,
    /// Particles of snow.
    pub snow_particles: u64,
    /// Triangles of the two largest meshes that are filled with snow: both are there while it is seen whether they overlap.
    pub solid_triangles: u64,
    /// Points of meshes that are colliders.
    pub collider_points: u64,
    /// Triangles of meshes that are colliders.
    pub collider_triangles: u64,
    /// Bytes of the solids that are made of them, of what particles of cloth keep of colliders, and of keys and loads of colliders.
    pub collider_bytes: u64,
    /// Bytes of frames of figures that a transform moves.
    pub frame_bytes: u64,
    /// Bytes of the particles that forces and moving pins name.
    pub named_bytes: u64,
    /// Bytes of the snow's grid, in binary32 and in binary64.
    pub snow_grid_bytes: [u64; 2],
}

impl Scene {
    /// What the scene asks for. Numbers are exact for formulas; for springs of a mesh whose kinds need its edges, and
    /// for particles at curved surfaces, they are near.
    pub fn size(&self, meshes: &dyn MeshSource) -> SceneSize {
        let (mut size, mut load_blocks) = (SceneSize::default(), 0_u64);
        for body in &self.bodies {
            let before = size.cloth_particles;
            size.add_body(body, self, meshes);
            let particles = size.cloth_particles - before;
            load_blocks = load_blocks.saturating_add(particles.div_ceil(body.block_size.max(1) as u64));
            let walls = wall_bytes(particles, body.thickness, self.colliders.len());
            size.collider_bytes = size.collider_bytes.saturating_add(walls);
        }
        for figure in &self.figures {
            size.add_figure(figure, self, meshes);
        }
        if self.rest.is_some() {
            size.watched_particles = size.cloth_particles;
        }
        let thin = self.bodies.iter().filter(|body| body.thickness == 0.0).count();
        size.bodies = (self.bodies.len() + self.figures.len()) as u64;
        size.cloths = thin as u64 + u64::from(thin < self.bodies.len());
        for mesh in self.colliders.iter().filter_map(ColliderText::mesh) {
            size.add_collider(mesh, meshes);
        }
        let keys = self.colliders.iter().map(|collider| collider.keys.len() as u64).sum::<u64>();
        size.collider_bytes = size.collider_bytes.saturating_add(KEY_BYTES * keys);
        let at = Location::root(&self.source).key("snow");
        if let Some(snow) = &self.snow {
            size.solid_triangles = solid_triangles(&snow.objects, meshes);
            let (list, side) = (at.key("object"), BLOCK_SIDE as f64 * snow.cell);
            let mut blocks = [0.0; 2];
            for (i, object) in snow.objects.iter().enumerate() {
                let own = size.add_snow(object, snow.cell, &list.index(i), meshes, side);
                blocks = [blocks[0] + own[0], blocks[1] + own[1]];
            }
            load_blocks = load_blocks.saturating_add(blocks.into_iter().sum::<f64>() as u64);
            if let Ok(settings) = settings(snow, &at) {
                size.snow_grid_bytes = Precision::ALL
                    .map(|precision| grid_bytes(&settings, precision, blocks.map(|n| n as usize)));
            }
        }
        let loads = LOAD_BYTES.saturating_mul(load_blocks).saturating_mul(self.colliders.len() as u64);
        size.collider_bytes = size.collider_bytes.saturating_add(loads);
        size
    }
}

impl SceneSize {
    fn add_body(&mut self, body: &Body, scene: &Scene, meshes: &dyn MeshSource) {
        let springs = body.springs.as_ref();
        let (points, triangles, lattice) = match &body.mesh {
            &Mesh::Grid { grid: [columns, rows], .. } => grid(columns.into(), rows.into()),
            &Mesh::CourseGrid { course_grid: side } => grid(side.into(), side.into()),
            &Mesh::Chain { chain, .. } => {
                let chain = u64::from(chain);
                (chain, 0, [chain, 0, chain])
            }
            Mesh::Upload { upload, .. } => match uploaded(upload, meshes) {
                Some(mesh) => (mesh.points.len() as u64, mesh.triangles.len() as u64, [0; 3]),
                None => return,
            },
            Mesh::File { .. } => return,
        };

        let by_formula = match (springs.and_then(|springs| springs.pattern), &body.mesh) {
            (_, Mesh::Chain { .. }) | (Some(Pattern::Lattice), _) => true,
            (None, mesh) => matches!(mesh, Mesh::Grid { .. }),
            (Some(Pattern::Edges | Pattern::File), _) => false,
        };
        let kinds = if by_formula { lattice } else { mesh_springs(points, triangles) };
        let own = own_springs(body, meshes);
        let count =
            own.map_or_else(|| springs.map_or(0, |springs| wanted(springs, kinds)), |(count, _)| count);
        self.cloth_particles = self.cloth_particles.saturating_add(points);
        self.named_bytes = self.named_bytes.saturating_add(named_bytes(body, points));
        let (integrator, preconditioner) = (body.integrator, body.solver.preconditioner);
        if integrator.is_implicit() {
            self.implicit_particles = self.implicit_particles.saturating_add(points);
        }
        let solves_once = matches!(body.minimizer, MinimizerKind::Auto | MinimizerKind::OneStep);
        if integrator.is_implicit() && !(solves_once && integrator == Integrator::ImplicitEuler) {
            self.iterated_particles = self.iterated_particles.saturating_add(points);
        } else if integrator.is_implicit() && body.minimizer == MinimizerKind::Auto {
            self.tried_particles = self.tried_particles.saturating_add(points);
        }
        let [is_coarse, may_switch] = match preconditioner {
            PreconditionerKind::TwoLevel => [true, false],
            PreconditionerKind::Auto => {
                let of_springs = (kinds, own.map(|(_, sums)| sums));
                is_stiff(body, [points, triangles], of_springs, scene)
            }
            _ => [false; 2],
        };
        if integrator.is_implicit() && preconditioner == PreconditionerKind::Patches {
            self.patched_particles = self.patched_particles.saturating_add(points);
        }
        if integrator.is_implicit() && may_switch {
            self.switching_particles = self.switching_particles.saturating_add(points);
        }
        if integrator.is_implicit() && is_coarse {
            let blocks = points.div_ceil(body.block_size.max(1) as u64);
            self.coarse_blocks = self.coarse_blocks.saturating_add(blocks);
        }
        if !body.unchecked || body.substeps.is_some_and(|count| count > 1) || body.substep.is_some() {
            self.divided_particles = self.divided_particles.saturating_add(points);
        }
        self.triangles = self.triangles.saturating_add(triangles);
        if body.thickness > 0.0 || scene.contact.unwrap_or_default().surface == SurfaceCheck::Count {
            self.triangles_apart = self.triangles_apart.saturating_add(triangles);
        }
        if body.air.is_some() {
            self.triangles_in_air = self.triangles_in_air.saturating_add(triangles);
        }
        // Elements are looked for in the mesh. One of two triangles counts as a spring, and there is one for each edge between
        // two; one of a triangle and its neighbours keeps as much as three springs.
        let elements = triangles.saturating_mul(elements::springs_per_pair(&body.laws_of_all())) / 2;
        self.springs = self.springs.saturating_add(count).saturating_add(elements);
        self.mesh_springs = self.mesh_springs.saturating_add(elements);
        if !by_formula {
            self.mesh_springs = self.mesh_springs.saturating_add(count);
        }
    }

    fn add_collider(&mut self, text: &ColliderMesh, meshes: &dyn MeshSource) {
        let Mesh::Upload { upload, .. } = &text.mesh else { return };
        let Some(mesh) = uploaded(upload, meshes) else { return };
        let (points, triangles) = (mesh.points.len() as u64, mesh.triangles.len() as u64);
        // Nothing is made of a mesh that is refused.
        if self.collider_triangles.saturating_add(triangles) > ColliderMesh::MOST_TRIANGLES {
            return;
        }
        self.collider_points = self.collider_points.saturating_add(points);
        self.collider_triangles += triangles;
        let bytes = MeshSolid::bytes(points.min(3 * triangles), triangles);
        let kept = NEAR_BYTES.saturating_mul(self.cloth_particles);
        self.collider_bytes = self.collider_bytes.saturating_add(bytes).saturating_add(kept);
    }

    /// Gives the blocks of the grid, of this side (m), that the object takes, and its blocks of nodes.
    fn add_snow(
        &mut self,
        object: &SnowBody,
        cell: f64,
        at: &Location<'_>,
        meshes: &dyn MeshSource,
        side: f64,
    ) -> [f64; 2] {
        let (count, [blocks, node_blocks]) = if let SnowSource::Mesh(mesh) = &object.source {
            // A plan of a mesh would take memory: its volume and its surface do not.
            let Mesh::Upload { upload, .. } = mesh else { return [0.0; 2] };
            let Some(mesh) = uploaded(upload, meshes) else { return [0.0; 2] };
            let scale = object.transform.scale;
            let (volume, area) = (volume(&mesh) * scale.powi(3), area(&mesh) * scale * scale);
            let by_volume = || (volume * particles_per_volume(object, cell)).max(1.0) as u64;
            let blocks = [area, 2.0 * area].map(|area| met_blocks(volume, area, side));
            (object.particles.map_or_else(by_volume, u64::from), blocks)
        } else {
            match Plan::new(object, at, cell, None) {
                Ok(plan) => (plan.estimate(), plan.blocks(side)),
                Err(_refused_when_built) => return [0.0; 2],
            }
        };

        // Each particle is in one block, and reaches eight.
        self.snow_particles = self.snow_particles.saturating_add(count);
        [blocks.min(count as f64), node_blocks.min(8.0 * count as f64)]
    }
}

/// Triangles of the two largest uploaded meshes that are filled.
fn solid_triangles(objects: &[SnowBody], meshes: &dyn MeshSource) -> u64 {
    let uploads = objects.iter().filter_map(|object| match object.mesh()? {
        Mesh::Upload { upload, .. } => uploaded(upload, meshes),
        _ => None,
    });
    let [first, second] = uploads.fold([0; 2], |[first, second], mesh| {
        let count = mesh.triangles.len() as u64;
        if count > first { [count, first] } else { [first, second.max(count)] }
    });
    first + second
}

/// Whether the preconditioner `auto` is `two_level`, and whether solves may come to patches: where the mass is not known before
/// the mesh is, both may be.
fn is_stiff(
    body: &Body,
    [points, triangles]: [u64; 2],
    (kinds, own): ([u64; 3], Option<[f64; 2]>),
    scene: &Scene,
) -> [bool; 2] {
    let Body { integrator, minimizer, solver, substep, substeps, block_size, thickness, .. } = body;
    let minimizer = match minimizer {
        MinimizerKind::VertexBlockDescent => Minimizer::VertexBlockDescent { sweeps: 1 },
        MinimizerKind::Auto | MinimizerKind::OneStep | MinimizerKind::Newton => Minimizer::OneStep,
    };
    let mut settings = ClothSettings {
        integrator: *integrator,
        minimizer,
        time_step: TimeStep::Fixed(substep.unwrap_or(scene.dt / f64::from(substeps.unwrap_or(1)))),
        block_size: *block_size,
        ..ClothSettings::default()
    };
    if let Some(count) = solver.fixed_iterations {
        settings.solver.stop = Stop::Iterations(count);
    }
    // Pins have no part in it, and of a mesh the springs are counted nearly.
    let mass = match body.mass_of_all() {
        Some(Mass::Particle(mass)) => 0.8 * mass * points as f64,
        Some(Mass::Total(mass)) => 0.8 * mass,
        Some(Mass::Density(_)) | None => 0.0,
    };
    let laws = body
        .springs
        .iter()
        .flat_map(|springs| [springs.stretch, springs.shear, springs.bend].into_iter().zip(kinds));
    let by_law = laws.fold([0.0; 2], |[k, nu], (law, count)| {
        let count = count as f64;
        law.map_or([k, nu], |law| [k + count * law.stiffness, nu + count * law.damping])
    });
    let ([k, nu], [more, slower]) =
        (own.unwrap_or(by_law), elements::as_springs(&body.laws_of_all(), triangles));
    let sums = [k + more, nu + slower];
    // Bodies with a thickness are one cloth, which may have more particles than a block where none of them has.
    let is_thick = |body: &&Body| body.thickness > 0.0;
    let is_joined = is_thick(&body) && scene.bodies.iter().filter(is_thick).count() + scene.figures.len() > 1;
    let may_switch = *thickness == 0.0 && settings.has_stiff_springs(mass, sums, scene.dt);
    [settings.is_stiff(if is_joined { u64::MAX } else { points }, mass, sums, scene.dt), may_switch]
}

/// Points, triangles and springs of each kind of a grid.
fn grid(columns: u64, rows: u64) -> (u64, u64, [u64; 3]) {
    let cells = columns.saturating_sub(1).saturating_mul(rows.saturating_sub(1));
    (columns.saturating_mul(rows), cells.saturating_mul(2), lattice_springs(columns, rows))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nappe_sim::mesh::TriangleMesh;

    use super::*;
    use crate::{SceneError, SceneLimits};

    /// One mesh under every id.
    struct One(Arc<TriangleMesh>);

    impl MeshSource for One {
        fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
            Some(Arc::clone(&self.0))
        }

        fn file(&self, _: &str) -> Result<TriangleMesh, SceneError> {
            unreachable!("the scene names no file")
        }
    }

    /// Estimated and found: particles of cloth, springs, triangles, particles of snow.
    fn sizes(text: &str) -> [[u64; 4]; 2] {
        let meshes = One(Arc::new(TriangleMesh::grid(40, 50, 0.1)));
        let scene = Scene::parse(text, "test").expect("a scene");
        let size = scene.size(&meshes);
        let setup = scene.build(&meshes, &SceneLimits::default()).expect("it can be built").setup;
        let of = |count: fn(&nappe_sim::cloth::Network) -> usize| {
            setup.bodies.iter().map(|body| count(&body.network)).sum::<usize>() as u64
        };
        let snow = setup.snow.iter().flat_map(|snow| &snow.objects).map(|object| object.x.len() as u64).sum();
        let found = [of(|n| n.x.len()), of(|n| n.springs.len()), of(|n| n.triangles.len()), snow];
        [[size.cloth_particles, size.springs, size.triangles, size.snow_particles], found]
    }

    fn body(mesh: &str, springs: &str) -> String {
        format!(
            "version = 1\ndt = 0.001\n[[body]]\nname = \"b\"\nmesh = {{ {mesh} }}\nmass = {{ particle = 0.1 }}\n\
             springs = {{ {springs} }}\n"
        )
    }

    #[test]
    fn formulas_are_counted_exactly_and_meshes_nearly() {
        let law = "{ stiffness = 1.0 }";
        let all = format!("stretch = {law}, shear = {law}, bend = {law}");
        for mesh in ["grid = [40, 50], spacing = 0.1", "grid = [1, 70], spacing = 0.1"] {
            let [size, found] = sizes(&body(mesh, &all));
            assert_eq!(size, found, "{mesh}");
        }

        let edges = format!("pattern = \"edges\", {all}");
        let cases = [
            body("grid = [40, 50], spacing = 0.1", &edges),
            body("upload = \"m\"", &all),
            body("upload = \"m\"", &format!("stretch = {law}")),
            body("chain = 50, spacing = 0.1", &format!("stretch = {law}, bend = {law}")),
            "version = 1\ndt = 0.001\n[snow]\ncell = 0.1\n[[snow.object]]\nname = \"a\"\n\
             box = { center = [0, 0, 0], size = [1, 2, 1] }\n[[snow.object]]\nname = \"s\"\n\
             sphere = { center = [5, 0, 0], radius = 1 }\nparticles_per_cell = 4\ntransform = { scale = 1.5 }\n\
             [[snow.object]]\nname = \"n\"\nsphere = { center = [9, 0, 0], radius = 1 }\nparticles = 1234\n"
                .to_owned(),
        ];
        for text in cases {
            let [size, found] = sizes(&text);
            for (estimated, found) in size.into_iter().zip(found) {
                let (estimated, found) = (estimated as f64, found as f64);
                assert!(
                    estimated >= found * 0.97 && estimated <= found * 1.1 + 2.0,
                    "{size:?}: {found}\n{text}"
                );
            }
        }
    }
}

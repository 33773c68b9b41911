//! Counts particles, springs and triangles of colliders against limits, before memory is taken for them; volumes and areas that
//! counts follow from.

use nappe_sim::{
    math::array::{cross, length, minus},
    mesh::TriangleMesh,
};

use crate::{
    collider::ColliderMesh,
    error::{ErrorKind, SceneError},
    location::Location,
};

/// What a caller lets one scene hold, checked before memory is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneLimits {
    /// Particles of all bodies and of snow.
    pub max_particles: u64,
    /// Springs of all bodies.
    pub max_springs: u64,
}

impl Default for SceneLimits {
    /// 4 million particles and 32 million springs: about 3 GiB in f64.
    fn default() -> Self {
        Self { max_particles: 4_000_000, max_springs: 32_000_000 }
    }
}

/// Who takes memory.
pub(super) struct Owner<'a> {
    pub(super) at: &'a Location<'a>,
    /// What it calls itself in messages.
    pub(super) noun: &'static str,
}

/// What the bodies and the colliders so far hold.
pub(super) struct Size<'a> {
    limits: &'a SceneLimits,
    particles: u64,
    springs: u64,
    collider_triangles: u64,
}

impl<'a> Size<'a> {
    pub(super) fn new(limits: &'a SceneLimits) -> Self {
        Self { limits, particles: 0, springs: 0, collider_triangles: 0 }
    }

    pub(super) fn particles(&self) -> u64 {
        self.particles
    }

    /// Particles that are there, or are about to be; `key` says where they come from.
    pub(super) fn add_particles(
        &mut self,
        owner: &Owner<'_>,
        key: &str,
        count: u64,
    ) -> Result<(), SceneError> {
        self.check_particles(owner, key, count)?;
        self.particles += count;
        Ok(())
    }

    /// Checks particles against the limit without adding them: for an estimate.
    pub(super) fn check_particles(&self, owner: &Owner<'_>, key: &str, count: u64) -> Result<(), SceneError> {
        // A particle's index has 32 bits.
        let allowed = self.limits.max_particles.min(u64::from(u32::MAX / 4));
        check(owner, [key, "particles"], count, self.particles.saturating_add(count), allowed)
    }

    /// Springs that are sure to come, or have come: called with a bound first, and the rest later.
    pub(super) fn add_springs(&mut self, owner: &Owner<'_>, count: u64) -> Result<(), SceneError> {
        self.springs = self.springs.saturating_add(count);
        check(owner, ["springs", "springs"], count, self.springs, self.limits.max_springs)
    }

    /// Triangles of a collider that are there, or are about to be.
    pub(super) fn add_collider_triangles(&mut self, owner: &Owner<'_>, count: u64) -> Result<(), SceneError> {
        self.check_collider_triangles(owner, count)?;
        self.collider_triangles += count;
        Ok(())
    }

    /// Checks triangles of a collider against the limit without adding them.
    pub(super) fn check_collider_triangles(&self, owner: &Owner<'_>, count: u64) -> Result<(), SceneError> {
        let total = self.collider_triangles.saturating_add(count);
        check(owner, ["mesh", "triangles"], count, total, ColliderMesh::MOST_TRIANGLES)
    }
}

fn check(
    owner: &Owner<'_>,
    [key, what]: [&str; 2],
    here: u64,
    total: u64,
    allowed: u64,
) -> Result<(), SceneError> {
    if total <= allowed {
        return Ok(());
    }
    let noun = owner.noun;
    let with = if here == total {
        String::new()
    } else {
        format!(", {total} with the {before} before it", before = plural(noun))
    };
    let message = format!("this {noun} has {here} {what}{with}; allowed: at most {allowed}");
    Err(owner.at.key(key).error(ErrorKind::TooLarge, message))
}

fn plural(noun: &str) -> &'static str {
    match noun {
        "body" => "bodies",
        "figure" => "bodies and figures",
        "collider" => "colliders",
        _ => "bodies and objects",
    }
}

/// Springs of a lattice of `columns` x `rows`: stretch, shear, bend.
pub(super) fn lattice_springs(columns: u64, rows: u64) -> [u64; 3] {
    let (c, r) = (columns, rows);
    [
        c * r.saturating_sub(1) + r * c.saturating_sub(1),
        2 * c.saturating_sub(1) * r.saturating_sub(1),
        c * r.saturating_sub(2) + r * c.saturating_sub(2),
    ]
}

/// Springs of each kind on a mesh: by Euler's formula a surface has as many edges as points and triangles together;
/// edges and pairs of triangles are three per triangle; each edge has about one continuation.
pub(super) fn mesh_springs(points: u64, triangles: u64) -> [u64; 3] {
    let sides = triangles.saturating_mul(3);
    let edges = sides.min(points.saturating_add(triangles));
    [edges, sides - edges, edges]
}

/// The volume (m³) that a mesh encloses.
pub(super) fn volume(mesh: &TriangleMesh) -> f64 {
    let determinant = |t: &[u32; 3]| {
        let corner = |i: usize| mesh.points.get(t[i] as usize).copied().unwrap_or_default();
        let [a, b, c] = [corner(0), corner(1), corner(2)];
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    mesh.triangles.iter().map(determinant).sum::<f64>().abs() / 6.0
}

/// The surface (m²) of a mesh.
pub(super) fn area(mesh: &TriangleMesh) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.points.get(i as usize).copied().unwrap_or_default());
        0.5 * length(cross(minus(b, a), minus(c, a)))
    };
    mesh.triangles.iter().map(of).sum()
}

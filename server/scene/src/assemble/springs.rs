//! Springs of a body: by rows and columns, by triangles, in a row, or those that its mesh carries.

use nappe_sim::{
    cloth::{self, Network, Spring, SpringKind, SpringRules},
    mesh::{MeshSpring, TriangleMesh},
};

use super::{
    meshes::{MeshSource, uploaded},
    pins::Layout,
    size::{self, Owner, Size},
};
use crate::{
    body::{Body, Mesh, Pattern, SpringLaw, Springs},
    error::{ErrorKind, SceneError},
    location::Location,
};

/// Springs as a body has them written, with its mesh, and where the body stands.
pub(super) struct SpringsText<'a> {
    pub(super) springs: Option<&'a Springs>,
    pub(super) mesh: &'a Mesh,
    pub(super) at: &'a Location<'a>,
}

impl SpringsText<'_> {
    /// The particles of a mesh with its springs; masses are in the mesh by now.
    pub(super) fn network(
        &self,
        mesh: &TriangleMesh,
        layout: Layout,
        size: &mut Size<'_>,
    ) -> Result<Network, SceneError> {
        let Some(springs) = self.springs else { return Ok(particles(mesh)) };
        if springs.file.is_some() || springs.pattern == Some(Pattern::File) {
            return self.of_mesh(springs, mesh, layout, size);
        }
        let owner = Owner { at: self.at, noun: "body" };
        let pattern = match (springs.pattern, layout, self.mesh) {
            (Some(Pattern::Lattice), Layout::Chain | Layout::Free, _) => {
                let message = "is 'lattice': only grids have rows and columns; allowed here: edges";
                return self.at.key("springs").key("pattern").inconsistent(message);
            }
            (Some(pattern), ..) => pattern,
            (None, _, Mesh::Grid { .. }) => Pattern::Lattice,
            (None, ..) => Pattern::Edges,
        };
        let Some(stretch) = springs.stretch else {
            let message = "is missing: springs that resist change of length; only `file` and pattern = \"file\" go without them";
            return Err(self.at.key("springs").key("stretch").error(ErrorKind::Missing, message));
        };

        let rules =
            SpringRules { stretch: law(stretch), shear: springs.shear.map(law), bend: springs.bend.map(law) };

        match (layout, pattern) {
            (Layout::Chain, _) => self.chain(springs, mesh, size),
            (Layout::Grid { columns, rows }, Pattern::Lattice) => {
                let [stretch, shear, bend] = size::lattice_springs(u64::from(columns), u64::from(rows));
                let wanted = stretch + rules.shear.map_or(0, |_| shear) + rules.bend.map_or(0, |_| bend);
                size.add_springs(&owner, wanted)?;
                // Masses are in the mesh by now: no particle takes the default.
                Ok(Network::from_lattice(mesh, [columns as usize, rows as usize], &rules, 0.0))
            }
            _ => {
                let network = Network::from_mesh(mesh, &rules, 0.0);
                size.add_springs(&owner, network.springs.len() as u64)?;
                Ok(network)
            }
        }
    }

    /// The springs that the mesh carries, and no others.
    fn of_mesh(
        &self,
        springs: &Springs,
        mesh: &TriangleMesh,
        layout: Layout,
        size: &mut Size<'_>,
    ) -> Result<Network, SceneError> {
        let at = self.at.key("springs");
        let given = [("stretch", springs.stretch), ("shear", springs.shear), ("bend", springs.bend)];
        if let Some((key, _)) = given.into_iter().find(|(_, law)| law.is_some()) {
            let message = "does not go with pattern = \"file\": each spring of the mesh has a stiffness and a damping of its own";
            return at.key(key).inconsistent(message);
        }
        if layout != Layout::Free {
            let message =
                "is 'file': a mesh by formula carries no springs; allowed here: edges, and lattice for grids";
            return at.key("pattern").inconsistent(message);
        }
        if mesh.springs.is_empty() {
            let message = "is 'file', and the mesh carries no springs: a PLY has them as the element `edge` with vertex1, vertex2 and \
                           stiffness, and perhaps damping, rest_length and kind; allowed here: edges";
            return at.key("pattern").inconsistent(message);
        }
        size.add_springs(&Owner { at: self.at, noun: "body" }, mesh.springs.len() as u64)?;
        Ok(Network::from_springs(mesh, 0.0))
    }

    /// Springs from each particle to the next, and with `bend` to the one after it.
    fn chain(
        &self,
        springs: &Springs,
        mesh: &TriangleMesh,
        size: &mut Size<'_>,
    ) -> Result<Network, SceneError> {
        if springs.shear.is_some() {
            let message = "does not go with a chain: it has no cells; allowed: stretch and bend";
            return self.at.key("springs").key("shear").inconsistent(message);
        }

        let mut network = particles(mesh);
        let count = mesh.points.len() as u32;
        let kinds = [(SpringKind::Stretch, 1, springs.stretch), (SpringKind::Bend, 2, springs.bend)];
        for (kind, apart, made_of) in kinds {
            let Some(made_of) = made_of else { continue };
            let owner = Owner { at: self.at, noun: "body" };
            size.add_springs(&owner, u64::from(count.saturating_sub(apart)))?;
            for a in 0..count.saturating_sub(apart) {
                let b = a + apart;
                let (p, q) = (mesh.points[a as usize], mesh.points[b as usize]);
                let rest_length = [0, 1, 2].iter().map(|&i| (q[i] - p[i]).powi(2)).sum::<f64>().sqrt();
                network.springs.push(Spring { particles: [a, b], kind, rest_length, law: law(made_of) });
            }
        }

        Ok(network)
    }
}

fn particles(mesh: &TriangleMesh) -> Network {
    let count = mesh.points.len();
    Network {
        x: mesh.points.clone(),
        v: vec![[0.0; 3]; count],
        masses: mesh.masses.clone(),
        triangles: mesh.triangles.clone(),
        uv: mesh.uv.clone(),
        ..Network::default()
    }
}

fn law(law: SpringLaw) -> cloth::SpringLaw {
    cloth::SpringLaw { stiffness: law.stiffness, damping: law.damping }
}

/// The springs that an uploaded mesh brings to a body which takes them: how many, and the sums of stiffness and damping.
pub(super) fn own_springs(body: &Body, meshes: &dyn MeshSource) -> Option<(u64, [f64; 2])> {
    body.springs.as_ref().filter(|springs| springs.pattern == Some(Pattern::File))?;
    let Mesh::Upload { upload, .. } = &body.mesh else { return None };
    let mesh = uploaded(upload, meshes)?;
    let add = |[k, nu]: [f64; 2], spring: &MeshSpring| [k + spring.stiffness, nu + spring.damping];
    Some((mesh.springs.len() as u64, mesh.springs.iter().fold([0.0; 2], add)))
}

/// How many of so many springs of each kind a body asks for.
pub(super) fn wanted(springs: &Springs, [stretch, shear, bend]: [u64; 3]) -> u64 {
    let of = |is_wanted: bool, count: u64| if is_wanted { count } else { 0 };
    stretch
        .saturating_add(of(springs.shear.is_some(), shear))
        .saturating_add(of(springs.bend.is_some(), bend))
}

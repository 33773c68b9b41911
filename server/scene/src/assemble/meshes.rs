//! Where the meshes of a scene come from: formulas stand in the scene, one comes with nappe, others are brought by the
//! caller.

use std::sync::Arc;

use nappe_sim::mesh::TriangleMesh;

use crate::{
    body::Mesh,
    error::{ErrorKind, SceneError},
    location::Location,
    mesh::shipped_torus,
};

/// Where a scene's meshes come from.
pub trait MeshSource {
    /// The uploaded mesh with this id.
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>>;

    /// The mesh in the file that a scene names.
    ///
    /// # Errors
    /// When files are not allowed here, or this one cannot be read as a mesh.
    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError>;
}

/// No uploads and no files: scenes by formula only.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMeshes;

impl MeshSource for NoMeshes {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        None
    }

    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        let message = "scenes may not name files here: upload the mesh";
        Err(SceneError::new(ErrorKind::MeshNotFound, path, message))
    }
}

/// The name under which scenes find the mesh that comes with nappe among the uploads.
const TORUS: &str = "torus";

/// The uploaded mesh with this id, or the one that comes with nappe.
pub(super) fn uploaded(id: &str, meshes: &dyn MeshSource) -> Option<Arc<TriangleMesh>> {
    meshes.upload(id).or_else(|| (id == TORUS).then(|| Arc::new(shipped_torus())))
}

/// A mesh that came from outside; one by formula is an error. `at` is where the scene names it.
pub(super) fn load(
    mesh: &Mesh,
    meshes: &dyn MeshSource,
    at: &Location<'_>,
) -> Result<Arc<TriangleMesh>, SceneError> {
    match mesh {
        Mesh::Upload { upload, .. } => uploaded(upload, meshes).ok_or_else(|| {
            let message = format!("no mesh with the id '{upload}' was uploaded, or it is no longer kept");
            at.key("upload").error(ErrorKind::MeshNotFound, message)
        }),
        Mesh::File { file, .. } => meshes.file(file).map(Arc::new),
        Mesh::Grid { .. } | Mesh::Chain { .. } | Mesh::CourseGrid { .. } => {
            at.inconsistent("is a formula; allowed here: { file = \"...\" } or { upload = \"...\" }")
        }
    }
}

//! Where the meshes and frames of a scene come from: formulas stand in the scene, some come with nappe, others are brought by
//! the caller.

use std::sync::Arc;

use nappe_sim::mesh::{MeshSpring, TriangleMesh};

use crate::{
    body::Mesh,
    error::{ErrorKind, SceneError},
    figure::FramesSource,
    location::Location,
    mesh::{PointFrames, shipped_torus, shipped_tunic, shipped_walk, shipped_walker},
    scene::Scene,
};

/// Where a scene's meshes and frames come from.
pub trait MeshSource {
    /// The uploaded mesh with this id.
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>>;

    /// The mesh in the file that a scene names.
    ///
    /// # Errors
    /// When files are not allowed here, or this one cannot be read as a mesh.
    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError>;

    /// The uploaded frames with this id; who keeps none has none.
    fn uploaded_frames(&self, _id: &str) -> Option<PointFrames> {
        None
    }

    /// The frames in the file that a scene names.
    ///
    /// # Errors
    /// When files are not allowed here, or this one cannot be read as frames.
    fn frames_file(&self, path: &str) -> Result<PointFrames, SceneError> {
        let message = format!(
            "no files of frames are opened here: upload '{path}' and name it as {{ upload = \"ID\" }}"
        );
        Err(SceneError::new(ErrorKind::MeshNotFound, "", message))
    }

    /// The springs in the table that a scene names for a mesh of so many points.
    ///
    /// # Errors
    /// When files are not allowed here, or this one cannot be read as springs.
    fn springs_file(&self, path: &str, _points: usize) -> Result<Vec<MeshSpring>, SceneError> {
        let message = format!(
            "no tables of springs are opened here: upload the mesh with the springs of '{path}' as a PLY, and take them by \
             springs = {{ pattern = \"file\" }}"
        );
        Err(SceneError::new(ErrorKind::MeshNotFound, "", message))
    }
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

/// The name under which scenes find the frames that come with nappe among the uploads, and the mesh that they lead.
const WALKER: &str = "walker";

/// The uploaded mesh with this id, or one that comes with nappe.
pub(super) fn uploaded(id: &str, meshes: &dyn MeshSource) -> Option<Arc<TriangleMesh>> {
    meshes.upload(id).or_else(|| {
        let shipped = match id {
            "torus" => shipped_torus(),
            "tunic" => shipped_tunic(),
            WALKER => shipped_walker(),
            _ => return None,
        };
        Some(Arc::new(shipped))
    })
}

/// The uploaded frames with this id, or those that come with nappe.
pub(super) fn uploaded_frames(id: &str, meshes: &dyn MeshSource) -> Option<PointFrames> {
    meshes.uploaded_frames(id).or_else(|| (id == WALKER).then(shipped_walk))
}

/// The error of a file: one that cannot be opened stands where the scene names it. `at` is the mesh, or what else has it, there.
fn named_at(at: &Location<'_>, error: SceneError) -> SceneError {
    if error.kind != ErrorKind::Io {
        return error;
    }
    at.key("file")
        .error(ErrorKind::Io, format!("names {}, which cannot be read: {}", error.file, error.message))
}

impl Scene {
    /// The error of a mesh file of the scene: one that cannot be opened stands where the scene first names it.
    #[must_use]
    pub fn error_of_mesh_file(&self, file: &str, error: SceneError) -> SceneError {
        let is_it = |mesh: &Mesh| matches!(mesh, Mesh::File { file: named, .. } if named == file);
        let root = Location::root(&self.source);
        let objects = self.snow.as_ref().map_or(&[][..], |snow| snow.objects.as_slice());
        let body = self.bodies.iter().position(|body| is_it(&body.mesh));
        let object = objects.iter().position(|object| object.mesh().is_some_and(is_it));
        let figure = self.figures.iter().position(|figure| is_it(&figure.mesh));
        let collider =
            self.colliders.iter().position(|text| text.mesh().is_some_and(|mesh| is_it(&mesh.mesh)));
        let places = [
            body.map(|i| root.key("body").index(i)),
            figure.map(|i| root.key("figure").index(i)),
            object.map(|i| root.key("snow").key("object").index(i)),
            collider.map(|i| root.key("collider").index(i)),
        ];
        match places.into_iter().flatten().next() {
            Some(owner) => named_at(&owner.key("mesh"), error),
            None => error,
        }
    }

    /// The same for a table of springs of the scene.
    #[must_use]
    pub fn error_of_springs_file(&self, file: &str, error: SceneError) -> SceneError {
        match self.bodies.iter().position(|body| body.springs_file() == Some(file)) {
            Some(i) => named_at(&Location::root(&self.source).key("body").index(i).key("springs"), error),
            None => error,
        }
    }
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
        Mesh::File { file, .. } => meshes.file(file).map(Arc::new).map_err(|error| named_at(at, error)),
        Mesh::Grid { .. } | Mesh::Chain { .. } | Mesh::CourseGrid { .. } => {
            at.inconsistent("is a formula; allowed here: { file = \"...\" } or { upload = \"...\" }")
        }
    }
}

/// The springs in a table that a body names for a mesh of so many points; `at` is where it has its springs.
pub(super) fn load_springs(
    table: &str,
    points: usize,
    meshes: &dyn MeshSource,
    at: &Location<'_>,
) -> Result<Vec<MeshSpring>, SceneError> {
    meshes.springs_file(table, points).map_err(|error| named_at(at, error))
}

/// The frames that a figure names; `at` is where it names them.
pub(super) fn load_frames(
    source: &FramesSource,
    meshes: &dyn MeshSource,
    at: &Location<'_>,
) -> Result<PointFrames, SceneError> {
    match source {
        FramesSource::Upload(id) => uploaded_frames(id, meshes).ok_or_else(|| {
            let message = format!("no frames with the id '{id}' were uploaded, or they are no longer kept");
            at.key("upload").error(ErrorKind::MeshNotFound, message)
        }),
        FramesSource::File(file) => meshes.frames_file(file).map_err(|error| named_at(at, error)),
    }
}

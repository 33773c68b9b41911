//! What a session was made from: its setup, which no step needs, is made of it again when the session is saved.
//!
//! Enters: the request for a scene with its meshes, or the file of a session. Leaves: the section of a file that the setup is in.

use nappe_proto::v1::{self, create_session_request::Scene as Asked};

use super::{
    assemble::{Parts, assemble_again},
    shipped::shipped_scene,
};
use crate::{
    config::Limits,
    error::ServiceError,
    memory::Claim,
    state::{FileError, bytes_of_setup, setup_section},
};

/// What a session was made from, which its copies share.
#[derive(Debug)]
pub(crate) struct Origin {
    /// The request that made it, or the session of which it is a copy; none where a file does not say it.
    pub request: Option<v1::CreateSessionRequest>,
    /// What was odd about its scene.
    pub warnings: Vec<String>,
    pub source: Source,
}

/// What a setup is made of again.
#[derive(Debug)]
pub(crate) enum Source {
    /// The scene of the request.
    Scene(Parts),
    /// The section of a file, whose memory is counted as long as it is there.
    Section { section: Vec<u8>, _memory: Claim },
}

impl Source {
    /// The section of a file, whose memory `memory` counts.
    ///
    /// # Errors
    /// If there is no memory for it.
    pub(crate) fn of_section(section: &[u8], memory: Claim) -> Result<Self, ServiceError> {
        memory.grow(section.len() as u64)?;
        Ok(Self::Section { section: section.to_vec(), _memory: memory })
    }
}

impl Origin {
    /// The section of a file that the setup is in, whose memory is taken from `memory`.
    ///
    /// # Errors
    /// If there is no memory for it.
    pub(crate) fn setup_section(&self, limits: &Limits, memory: &Claim) -> Result<Vec<u8>, ServiceError> {
        let parts = match &self.source {
            Source::Section { section, .. } => {
                memory.grow(section.len() as u64)?;
                return Ok(section.clone());
            }
            Source::Scene(parts) => parts,
        };
        let building = memory.another();
        let setup = assemble_again(self.scene()?, parts, limits, &building)?;
        let refused =
            |error: FileError| ServiceError::internal(format!("the setup cannot be written: {error}"));
        memory.grow(bytes_of_setup(&setup).map_err(refused)?)?;
        setup_section(&setup).map_err(refused)
    }

    /// The text of the scene, and what it is called in messages.
    fn scene(&self) -> Result<(&str, &str), ServiceError> {
        match self.request.as_ref().and_then(|request| request.scene.as_ref()) {
            Some(Asked::SceneText(text)) => Ok((text.as_str(), "scene")),
            Some(Asked::SceneName(name)) => Ok((shipped_scene(name)?, name.as_str())),
            Some(Asked::CheckpointId(_)) | None => {
                Err(ServiceError::internal("the session has no scene that its setup could be made of again"))
            }
        }
    }
}

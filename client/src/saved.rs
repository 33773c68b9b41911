//! Sessions as files: fetched from a server, and sent to the one that is to go on with them.
//!
//! Enters: the id of a session, or the bytes of a file. Leaves: the pieces of a file, or the id that a session is made from.

use std::sync::Arc;

use bytes::Bytes;
use nappe_proto::v1;
use tonic::{Request, Streaming};

use crate::{
    client::{Client, NO_LIMIT},
    error::ClientError,
    mesh_file::MeshFile,
};

/// The file of a session on its way, in pieces.
#[derive(Debug)]
pub struct SavedSession {
    stream: Streaming<v1::SaveSessionResponse>,
    session_id: String,
    endpoint: Arc<str>,
    /// Bytes that are to come; none before the first piece.
    left: Option<u64>,
}

impl SavedSession {
    /// The next piece, in order; none after the last.
    ///
    /// # Errors
    /// If the stream breaks, or ends before the whole file came.
    pub async fn next(&mut self) -> Result<Option<Bytes>, ClientError> {
        let piece = self.stream.message().await;
        let piece = piece.map_err(|status| ClientError::from_status(&status, &self.endpoint))?;
        let left = self.left.unwrap_or_else(|| piece.as_ref().map_or(u64::MAX, |piece| piece.byte_count));
        match piece {
            Some(v1::SaveSessionResponse { data, .. }) => {
                self.left = Some(left.saturating_sub(data.len() as u64));
                Ok(Some(data))
            }
            None if left == 0 => Ok(None),
            None => Err(ClientError::Truncated { session_id: self.session_id.clone() }),
        }
    }

    /// The whole file.
    ///
    /// # Errors
    /// As [`Self::next`].
    pub async fn whole(mut self) -> Result<Vec<u8>, ClientError> {
        let mut file = Vec::new();
        while let Some(piece) = self.next().await? {
            file.extend_from_slice(&piece);
        }
        Ok(file)
    }
}

impl Client {
    /// Saves a session as it stands between two of its steps, as a file: what this or another server of the same version needs to go
    /// on with it. The session goes on.
    ///
    /// # Errors
    /// If there is no such session, it failed or stands within a step that was given up, or the server has no memory for the file.
    pub async fn save(&self, session_id: &str) -> Result<SavedSession, ClientError> {
        let request = Request::new(v1::SaveSessionRequest::of(session_id));
        let stream = self
            .call("SaveSession", NO_LIMIT, request, async |mut calls, r| calls.save_session(r).await)
            .await?;
        let (session_id, endpoint) = (session_id.to_owned(), Arc::clone(&self.endpoint));
        Ok(SavedSession { stream, session_id, endpoint, left: None })
    }

    /// Sends the file of a session that was saved, in pieces of at most 1 MiB; returns the id that [`crate::Scene::Checkpoint`] names.
    ///
    /// # Errors
    /// If the file was cut or altered, is larger than the server allows, or is of another version.
    pub async fn upload_saved(&self, file: impl Into<Bytes> + Send) -> Result<String, ClientError> {
        let file = MeshFile {
            name: String::new(),
            format: v1::FileFormat::Checkpoint,
            file: file.into(),
            others: Default::default(),
            missing_mass: None,
        };
        Ok(self.upload_file(&file).await?.mesh_id)
    }
}

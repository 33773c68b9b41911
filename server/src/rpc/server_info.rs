//! What the server tells of itself.

use nappe_proto::v1;

use crate::{
    config::{Limits, core_count},
    scenes::scene_names,
};

/// Version, limits and shipped scenes.
pub(super) fn server_info(limits: &Limits) -> v1::GetServerInfoResponse {
    v1::GetServerInfoResponse {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        thread_count: core_count(),
        limits: Some(limits_message(limits)),
        scenes: scene_names(),
    }
}

fn limits_message(limits: &Limits) -> v1::Limits {
    v1::Limits {
        max_sessions: limits.max_sessions,
        idle_session_seconds: limits.idle_session_seconds,
        max_held_bytes: limits.max_held_bytes,
        max_watchers_per_session: limits.max_watchers_per_session,
        max_particles: limits.max_particles,
        max_springs: limits.max_springs,
        max_mesh_bytes: limits.max_mesh_bytes,
        max_scene_bytes: limits.max_scene_bytes,
        max_meshes: limits.max_meshes,
        max_threads_per_session: limits.thread_limit(),
        max_steps_per_call: limits.max_steps_per_call,
        history_bytes_per_session: limits.history_bytes_per_session,
        max_message_bytes: limits.max_message_bytes,
        max_connections: limits.max_connections,
        max_uploads: limits.max_uploads,
        max_streams_per_connection: limits.max_streams_per_connection,
        max_pending_changes: limits.max_pending_changes,
        max_mesh_store_bytes: limits.max_mesh_store_bytes,
        max_grid_nodes: limits.max_grid_nodes,
        max_changes_per_call: limits.max_changes_per_call,
        max_connections_per_address: limits.max_connections_per_address,
        max_request_bytes: limits.max_request_bytes,
        upload_seconds: limits.upload_seconds,
        min_upload_rate: limits.min_upload_rate,
        max_server_bytes: limits.server_bytes(),
        max_build_seconds: limits.max_build_seconds,
        max_pulls: limits.max_pulls,
    }
}

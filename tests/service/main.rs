//! The service as a client meets it: the real server on a free loopback port, real gRPC.

#![allow(clippy::print_stdout, reason = "measurements and messages are shown when a test fails")]

mod frames;
mod harness;
mod proxy;
mod simulation;
mod cloth_scenes;
mod snow_scenes;
mod session_lifecycle;
mod session_identity;
mod create_session;
mod upload_mesh;
mod unary_uploads;
mod watch_frames;
mod snow_sessions;
mod grid_nodes;
mod resuming_watchers;
mod watch_journal;
mod watch_contract;
mod state_changes;
mod bad_input;
mod limits;
mod update_parameters;
mod controllers;
mod forks;
mod abandoned_creates;
mod memory_growth;
mod failed_sessions;
mod stalled_watchers;
mod crowded;
mod long_steps;
mod hung_ranks;
mod shared_control;
mod waiting_calls;
mod waiting_model;
mod waiting_at_random;
mod shutdown;
mod grpc_web;
mod idle_connections;
mod refused_requests;
mod tokens;
mod health_and_reflection;
mod client_library;
mod errors_page;
mod raw_calls;
mod refusals_page;

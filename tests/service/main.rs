//! The service as a client meets it: the real server on a free loopback port, real gRPC.

#![allow(clippy::print_stdout, reason = "figures and messages are shown when a test fails")]

mod harness;
mod scenes;
mod lifecycle;
mod create;
mod upload;
mod watch;
mod snow;
mod grid;
mod resume;
mod errors;
mod limits;
mod updates;
mod isolation;
mod stalled;
mod drain;
mod web;
mod discovery;
mod library;
mod pages;

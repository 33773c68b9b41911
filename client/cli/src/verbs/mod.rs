//! The verbs of the command, one file each: options in, `run` out.

pub(crate) mod completions;
pub(crate) mod create;
pub(crate) mod delete;
pub(crate) mod demo;
pub(crate) mod list;
pub(crate) mod mecasim;
pub(crate) mod mesh;
pub(crate) mod pause;
pub(crate) mod play;
pub(crate) mod run;
pub(crate) mod scenes;
pub(crate) mod serve;
pub(crate) mod step;
pub(crate) mod stop;
pub(crate) mod update;
pub(crate) mod view;
pub(crate) mod watch;

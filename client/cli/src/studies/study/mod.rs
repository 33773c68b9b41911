//! What studies of a scene share: what is studied, for how long, the threads that compute, and files.
//!
//! Enters: arguments of `nappe chart`, `nappe stability` and `nappe plan`. Leaves: a case and a subject, a result within the budget, files.

pub(crate) mod units;
pub(crate) mod measure;
pub(crate) mod asked;
mod look;
pub(crate) mod csv;
pub(crate) mod files;
mod subject;
mod source;
mod coarser;
mod drive;

pub(crate) use self::{
    coarser::{CoarserCopy, fitted, unfit},
    drive::{compute, interrupted},
    files::{Contents, Folder},
    look::LookArgs,
    source::Source,
    subject::{HASH_OF, Subject, threads},
};

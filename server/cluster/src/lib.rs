//! Ranks of a cluster that step a simulation for a server: the messages between both, and either end.
//!
//! The server keeps a simulation that does not step, and looks at what it fetches into it. Rank 0 connects to the server,
//! and hands on to the other ranks what it is told. Modules in reading order:

mod message;
mod place;
mod link;
mod timed;
mod cluster;
mod counted;
mod signs;
mod rank;
mod remote;
mod meeting;
#[cfg(feature = "mpi")]
mod mpi;

pub use cluster::Cluster;
pub use link::LinkError;
pub use meeting::Meeting;
pub use message::{Asked, Hello, Stepped, Token, VERSION};
#[cfg(feature = "mpi")]
pub use mpi::{Mpi, abort};
pub use place::{LINK, Link, SHARED_FOLDER};
pub use rank::{follow, lead};
pub use remote::{Orders, Remote, RemoteError};

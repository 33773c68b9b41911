//! The built command, from outside: what it prints, and the code it ends with.

mod support;
mod help;
#[cfg(unix)]
mod completions;
#[cfg(target_arch = "x86_64")]
mod version;
mod run;
mod html;
mod kept;
mod ply_frames;
mod going_on;
mod refused_frames;
mod summary;
mod colliders;
mod mesh;
mod springs_file;
mod mesh_frames;
mod check;
mod coarser;
mod mecasim;
mod service;
#[cfg(target_os = "linux")]
mod unwritable;
mod disturbed;
#[cfg(unix)]
mod viewer;
mod ranks;
mod ranks_lost;
mod ranks_hung;
mod ranks_stopped;
mod ranks_hosts;
mod ranks_kept;
mod links;
#[cfg(unix)]
mod class;
mod tokens;
mod connect;
mod bench;
mod chart;
mod pictures;
mod plan;
mod stability;
mod numbers;
mod names;
mod moved_colliders;
mod loads;
mod surfaces;
mod rest;
mod sweep;
mod sweep_files;
mod sweep_parts;
mod snow;
#[cfg(unix)]
mod jobs;
mod vtk;
mod usd;
mod table;
mod saved;
#[cfg(unix)]
mod drawn;

//! `nappe run`: computes a scene from its start to its end.

use clap::Args;

use crate::{
    args::{ComputeArgs, OtherServerArgs},
    compute::{self, Server},
    error::Result,
    output::OutputArgs,
    remote,
    scene::Input,
};

/// Compute a scene from its start to its end
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe run flag                                 a shipped scene; `nappe scenes` lists them
  nappe run flag --save flag.html                with every frame in a page that any browser opens
  nappe run flag --save flag.rrd                 with a Rerun recording of every frame
  nappe run my.toml --save frames --steps 200    a scene file, PLY files in the folder frames
  nappe run my.toml --threads 1 --precision f64 --json
  nappe run snow.toml --save snow.rrd --color speed --grid smoke
  nappe run snow.toml --save frames --fields velocity,plastic_ratio,stress

Without --server the scene is computed by a server inside this command; --server does it on another
one and removes the session afterwards. A scene without an end runs until Ctrl-C.

With --json the last line is one object: scene, steps, time (s), seconds (wall clock spent stepping),
state_hash (16 hexadecimal digits), energy (J), max_stretch, external_work (J, of air and given forces in
the last step), cloth (null, or substeps, rejected, dt_seconds, bound, bound_particle, bound_seconds,
error_rms, error_largest, preconditioner and solve_error_m of the last step), surface (null, or pairs, active,
rounds, least_gap_m, failed and crossings of the last step), snow (null, or substeps, dt_seconds, bound,
plastic_count and the other diagnostics of the snow's last step), loads (name, force in N, torque in N m and
contacts of each collider in the last step), poses (name, position in m and turn of each
collider at the end, the turn a quaternion x, y, z, w), notices (counts of what makes the results doubtful),
diverged (null, or step, particle, cause), and interrupted, particles, springs, threads, precision, dt, frames,
saved.")]
pub(crate) struct RunArgs {
    /// A shipped scene's name, or a scene file (.toml); meshes beside the file are uploaded
    scene: String,
    #[command(flatten)]
    compute: ComputeArgs,
    #[command(flatten)]
    server: OtherServerArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe run`.
///
/// # Errors
/// When the scene cannot be read or is refused, the simulation fails, a frame cannot be saved, or
/// the user ends it.
pub(crate) fn run(args: &RunArgs) -> Result<()> {
    let server = Server::new(&args.server);
    let scene = Input::read(&args.scene, server.names())?;
    remote::block_on(compute::compute(&scene, &args.compute, server, args.output.format()))
}

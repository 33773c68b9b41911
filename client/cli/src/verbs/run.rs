//! `nappe run`: computes a scene from its start to its end.

use clap::Args;

use crate::{
    compute::{self, Server},
    options::args::{ComputeArgs, JobArgs, OtherServerArgs},
    outside::remote,
    scenes::scene::Input,
    words::{error::Result, output::OutputArgs},
};

/// Compute a scene from its start to its end
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe run flag                                 a shipped scene; `nappe scenes` lists them
  nappe run flag --save flag.html                with every frame in a page that any browser opens
  nappe run flag --save flag.rrd                 with a Rerun recording of every frame
  nappe run flag --save flag.pvd --fields velocity   for ParaView: an index, and the folder flag with a file per frame
  nappe run flag --save flag.usda                for Blender, Houdini and Omniverse
  nappe run flag --save flag.html --table flag.csv   with a row per frame in a table, too
  nappe run flag --save flag.png --at 2.5 --size 800x600   a picture of the page at 2.5 s, drawn by a browser
  nappe run flag --save flag.mp4 --theme dark    a film, by a browser and ffmpeg
  nappe run my.toml --save frames --steps 200    a scene file, PLY files in the folder frames
  nappe run flag --set 'wind=[4,0,0]' --set dt=0.01   with other values of its keys
  nappe run my.toml --save frames --fields velocity   PLY files from which a run can go on
  nappe run my.toml --resume frames              that run goes on from its last frame; Ctrl-C prints this line
  nappe run my.toml --save frames --state-dir states   the same line goes on, also after a kill
  nappe run my.toml --start frames/frame-000012.ply --save other   another run begins at one of its frames
  nappe run my.toml --threads 1 --precision f64 --json
  nappe run snow.toml --save snow.rrd --color speed --grid smoke
  nappe run snow.toml --save frames --fields velocity,plastic_ratio,stress

A picture and a film are drawn by the browser that NAPPE_BROWSER names [default: Chromium, Chrome or Edge, on PATH].

Without --server the scene is computed by a server inside this command; --server does it on another
one and removes the session afterwards. A scene without an end runs until Ctrl-C.

With --json the last line is one object: scene, steps, time (s), seconds (wall clock spent stepping),
state_hash (16 hexadecimal digits). Over the run: max_stretch (the largest) and max_stretch_time (s, when it
was), notices_over_run (counts of what makes the results doubtful). At the end, of the last state or step:
energy_at_end (J), external_work_at_end (J, of air and given forces), cloth_at_end (null, or substeps, rejected,
dt_seconds, bound, bound_particle, bound_seconds, error_rms, error_largest, preconditioner, solve_error_m and solves),
surface_at_end (null, or the numbers that docs/laws/surfaces.md lists), rest_at_end (null, or
calm_share, pieces, calm_pieces, way_m, change_m, awake_share, pieces_asleep, told_m, long_steps, wakes and
wake_cause, which is null where nothing has woken), snow_at_end (null, or substeps, dt_seconds, bound,
plastic_count and the other diagnostics of the snow), loads_at_end (name, force in N, torque in N m and contacts
of each collider), poses_at_end (name, position in m and turn of each collider, the turn a quaternion x, y, z,
w). Then diverged (null, or step, particle, cause), and interrupted, particles,
springs, threads, precision, dt, frames, saved. Where a run began at a saved frame, steps and time count from
the start of the scene, and seconds, max_stretch, notices_over_run and frames from that frame. --resume of a
run that has ended prints ended, steps and saved; so does --state-dir.")]
pub(crate) struct RunArgs {
    /// A shipped scene's name, or a scene file (.toml); meshes beside the file are uploaded
    scene: String,
    /// A key of the scene and the value that it takes, as in `nappe sweep`
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = set)]
    sets: Vec<(String, String)>,
    #[command(flatten)]
    compute: ComputeArgs,
    #[command(flatten)]
    job: JobArgs,
    #[command(flatten)]
    server: OtherServerArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// `KEY=VALUE`.
fn set(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
        Some((key, value)) if !key.is_empty() && !value.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err(format!("'{text}' is no KEY=VALUE")),
    }
}

/// Runs `nappe run`.
///
/// # Errors
/// When the scene cannot be read or is refused, the simulation fails, a frame cannot be saved, or
/// the user ends it.
pub(crate) fn run(args: &RunArgs) -> Result<()> {
    let server = Server::new(&args.server);
    let scene = if args.sets.is_empty() {
        Input::read(&args.scene, server.names())?
    } else {
        Input::with_values(&args.scene, &args.sets)?
    };
    remote::block_on(compute::compute(&scene, &args.compute, &args.job, server, args.output.format()))
}

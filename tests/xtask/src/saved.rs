//! Files for other programs as the command that was built leaves them: of runs that are killed at random, and over 2 000 frames.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::{
    drill::Random,
    shell::{Failure, Shell},
};

/// How many runs of each form are killed, at most so many frames after their start, and what these are drawn with.
const KILLED: usize = 20;
const LAST_FRAME: usize = 150;
const SEED: u64 = 20_261_201;
/// Over how many frames memory is watched, and from which one on.
const FRAMES: u64 = 2_000;
const BEGUN: u64 = 200;
/// How much memory may grow meanwhile (kB): half of what is written into a form with particles, or less.
const GROWTH_KB: u64 = 24_000;
/// Whatever takes this long hangs.
const PATIENCE: Duration = Duration::from_mins(10);
/// The last bytes of a file of VTK.
const VTP_END: &[u8] = b"\n</AppendedData>\n</VTKFile>\n";
const PVD_END: &str = "</Collection>\n</VTKFile>\n";

/// A sheet of 1 600 particles that swings without an end, a frame each step.
const SCENE: &str = r#"
version = 1
dt = 0.005

[[body]]
name = "sheet"
mesh = { grid = [40, 40], spacing = 0.025 }
mass = { density = 0.25 }
pins = ["top_left", "top_right"]
springs = { stretch = { stiffness = 200.0, damping = 0.01 }, shear = { stiffness = 100.0 } }

[[collider]]
name = "ball"
sphere = { center = [0, -5, 0], radius = 0.5 }
velocity = [0, -0.01, 0]
"#;

/// Kills runs, and watches the memory of others.
pub(crate) fn run(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("saved files of killed runs", |shell| {
        let place = Place::new(shell)?;
        let mut random = Random::new(SEED);
        for number in 0..KILLED {
            place.kills(&format!("vtk-{number}"), 1 + random.below(LAST_FRAME))?;
            place.kills_text(&format!("text-{number}"), 1 + random.below(LAST_FRAME))?;
        }
        println!("{KILLED} runs of each form left whole files");
        Ok(())
    })?;
    if !Path::new("/proc/self/status").exists() {
        shell.skip("memory of runs that are saved", "this system does not tell it in /proc");
        return Ok(());
    }
    shell.step("memory of runs that are saved", |shell| {
        let place = Place::new(shell)?;
        for save in ["run.pvd", "run.usda", "run.csv"] {
            place.stays_flat(save)?;
        }
        Ok(())
    })
}

fn failure(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure(format!("{}: {error}", path.display()))
}

/// The command, and a folder of this proof alone, which goes when it has ended.
struct Place {
    program: PathBuf,
    folder: PathBuf,
}

/// A run, which ends with this value.
struct Run(Child);

impl Drop for Run {
    fn drop(&mut self) {
        // It may have ended already; then there is nothing to kill.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Place {
    fn new(shell: &Shell) -> Result<Self, Failure> {
        let folder = shell.target().join(format!("saved-{}", std::process::id()));
        fs::create_dir_all(&folder).map_err(|error| failure(&folder, &error))?;
        let scene = folder.join("scene.toml");
        fs::write(&scene, SCENE).map_err(|error| failure(&scene, &error))?;
        Ok(Self { program: shell.target().join("release/nappe"), folder })
    }

    /// Starts a run without an end in a new folder.
    fn starts(&self, name: &str, save: &[&str]) -> Result<(Run, PathBuf), Failure> {
        let here = self.folder.join(name);
        fs::create_dir(&here).map_err(|error| failure(&here, &error))?;
        let mut command = Command::new(&self.program);
        command.current_dir(&here).args(["run", "../scene.toml", "--frame-interval", "1"]).args(save);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let run = command.spawn().map_err(|error| failure(&self.program, &error))?;
        Ok((Run(run), here))
    }

    /// Kills a run once a frame is there: its index lists whole files, and every file that has its name is whole.
    fn kills(&self, name: &str, frame: usize) -> Result<(), Failure> {
        let (run, here) = self.starts(name, &["--save", "run.pvd", "--table", "beside.csv"])?;
        until(&here.join(format!("run/frame-{frame:06}.vtp")), 1)?;
        drop(run);
        let index = here.join("run.pvd");
        let text = fs::read_to_string(&index).map_err(|error| failure(&index, &error))?;
        let mut listed = 0;
        for row in text.lines().filter(|row| row.starts_with("<DataSet")) {
            let file =
                row.split("file=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap_or_default();
            is_whole(&here.join(file))?;
            listed += usize::from(row.contains(" name=\"particles\""));
        }
        // It is written again with every 32nd frame, and the next one may have been on its way.
        if !text.ends_with(PVD_END) || listed % 32 != 1 || listed + 32 < frame {
            return Err(failure(&index, &format!("{listed} files are listed after frame {frame}")));
        }
        let folder = here.join("run");
        for entry in fs::read_dir(&folder).map_err(|error| failure(&folder, &error))? {
            let path = entry.map_err(|error| failure(&folder, &error))?.path();
            if path.extension().is_some_and(|ending| ending == "vtp") {
                is_whole(&path)?;
            }
        }
        self.leaves(&here, &["beside.csv"])
    }

    /// Kills runs into a scene of USD and a table: nothing has their names.
    fn kills_text(&self, name: &str, frame: usize) -> Result<(), Failure> {
        let (run, here) = self.starts(name, &["--save", "run.usda", "--table", "beside.csv"])?;
        until(&here.join("run.usda.new.samples"), 100_000 * frame as u64)?;
        drop(run);
        self.leaves(&here, &["run.usda", "beside.csv"])
    }

    /// Checks that nothing has these names, and removes what is there.
    fn leaves(&self, here: &Path, names: &[&str]) -> Result<(), Failure> {
        if let Some(half) = names.iter().map(|name| here.join(name)).find(|path| path.exists()) {
            return Err(failure(&half, &"a killed run has given it its name"));
        }
        fs::remove_dir_all(here).map_err(|error| failure(&self.folder, &error))
    }

    /// Watches the memory of a run over many frames.
    fn stays_flat(&self, save: &str) -> Result<(), Failure> {
        let (run, here) = self.starts(save, &["--save", save])?;
        let grown = |frames: u64| match save {
            "run.pvd" => until(&here.join(format!("run/frame-{frames:06}.vtp")), 1),
            "run.usda" => until(&here.join("run.usda.new.samples"), 100_000 * frames),
            _ => until(&here.join("run.csv.new"), 400 * frames),
        };
        grown(BEGUN)?;
        let before = peak_kb(run.0.id())?;
        grown(BEGUN + FRAMES)?;
        let growth = peak_kb(run.0.id())?.saturating_sub(before);
        drop(run);
        println!("{save}: {growth} kB more than {before} after {FRAMES} more frames");
        if growth > GROWTH_KB {
            return Err(failure(&here, &format!("memory has grown by {growth} kB, more than {GROWTH_KB}")));
        }
        fs::remove_dir_all(&here).map_err(|error| failure(&here, &error))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // What is left of a proof that failed is in nobody's way.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Waits until a file has so many bytes.
fn until(path: &Path, bytes: u64) -> Result<(), Failure> {
    let begin = Instant::now();
    while !fs::metadata(path).is_ok_and(|file| file.len() >= bytes) {
        if begin.elapsed() > PATIENCE {
            return Err(failure(path, &format!("it has no {bytes} bytes within {} s", PATIENCE.as_secs())));
        }
        thread::sleep(Duration::from_millis(2));
    }
    Ok(())
}

/// Checks the end of a file of VTK.
fn is_whole(path: &Path) -> Result<(), Failure> {
    let bytes = fs::read(path).map_err(|error| failure(path, &error))?;
    if bytes.ends_with(VTP_END) { Ok(()) } else { Err(failure(path, &"it is not whole")) }
}

/// The most memory that a process has had (kB).
fn peak_kb(process: u32) -> Result<u64, Failure> {
    let path = PathBuf::from(format!("/proc/{process}/status"));
    let status = fs::read_to_string(&path).map_err(|error| failure(&path, &error))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = line.and_then(|rest| rest.split_whitespace().next()?.parse().ok());
    number.ok_or_else(|| failure(&path, &"it does not tell VmHWM"))
}

//! Runs of all shipped scenes and of scenes with everything timed by the command that was built, which go on from their saved frames:
//! cloth to the bits of the run that was never cut, in both precisions; snow is refused by name.

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use crate::{
    drill::{Random, hash},
    shell::{Failure, Shell},
    timed::SCENES,
};

/// The precisions in which each scene is run.
const PRECISIONS: [&str; 2] = ["f32", "f64"];
/// At how many frames a run is cut, and what they are drawn with.
const CUT_COUNT: usize = 3;
const SEED: u64 = 20_261_129;
/// The last line of the header of a frame.
const HEADER_END: &[u8] = b"end_header\n";

/// Cuts every scene.
pub(crate) fn run(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("going on from saved frames", |shell| {
        let folder = shell.target().join(format!("going-on-{}", std::process::id()));
        fs::create_dir_all(&folder).map_err(|error| failure(&folder, &error))?;
        let place = Place { program: shell.target().join("release/nappe"), folder };
        place.all(&shell.root().join("server/scenes"))
    })
}

/// What a folder holds, in the order of names.
fn sorted(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()?;
    paths.sort();
    Ok(paths)
}

/// Frames at which a run with so many is cut: neither the first, which is the start, nor the last, after which nothing comes.
fn cuts(frames: usize, random: &mut Random) -> BTreeSet<usize> {
    let inner = frames.saturating_sub(2);
    let mut cuts = BTreeSet::new();
    while cuts.len() < CUT_COUNT.min(inner) {
        cuts.insert(1 + random.below(inner));
    }
    cuts
}

fn failure(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure(format!("{}: {error}", path.display()))
}

/// The command, and a folder of this proof alone, which goes when it has ended.
struct Place {
    program: PathBuf,
    folder: PathBuf,
}

impl Place {
    fn all(&self, scenes: &Path) -> Result<(), Failure> {
        let (mut cloth, mut snow) = (0, 0);
        let mut random = Random::new(SEED);
        for path in sorted(scenes).map_err(|error| failure(scenes, &error))? {
            let scene = fs::read_to_string(&path).map_err(|error| failure(&path, &error))?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            if scene.contains("\n[snow]") {
                self.refuses(&name)?;
                snow += 1;
            } else {
                self.goes_on(&name, &mut random)?;
                cloth += 1;
            }
        }
        for scene in &SCENES {
            let name = format!("{}.toml", scene.name);
            let path = self.folder.join(&name);
            fs::write(&path, scene.text()).map_err(|error| failure(&path, &error))?;
            self.goes_on(&name, &mut random)?;
        }
        let timed = SCENES.len();
        println!(
            "{cloth} shipped scenes and {timed} timed ones go on from their frames, {snow} of snow are refused"
        );
        if cloth == 0 || snow == 0 {
            return Err(failure(scenes, &"scenes of cloth and of snow are needed"));
        }
        Ok(())
    }

    /// Has a scene of cloth go on from frames of its run.
    fn goes_on(&self, scene: &str, random: &mut Random) -> Result<(), Failure> {
        for precision in PRECISIONS {
            let options =
                ["run", scene, "--quiet", "--json", "--fields", "velocity", "--precision", precision];
            let end = self.succeeds(&[&options[..], &["--save", "whole"]].concat())?;
            let whole = self.frames("whole")?;
            let cuts = cuts(whole.len(), random);
            if cuts.len() < CUT_COUNT {
                return Err(Failure(format!("{}: {} frames are too few", options.join(" "), whole.len())));
            }
            for at in cuts {
                let start = format!("whole/frame-{at:06}.ply");
                let rest = self.succeeds(&[&options[..], &["--save", "rest", "--start", &start]].concat())?;
                let fails = |how: &str| Failure(format!("{}, cut at {start}: {how}", options.join(" ")));
                if text(&rest.stderr).contains("may differ") {
                    return Err(fails(&text(&rest.stderr)));
                }
                let hashes = [&end, &rest].map(|output| hash(&text(&output.stdout)).map(str::to_owned));
                if hashes[0].is_none() || hashes[0] != hashes[1] {
                    return Err(fails(&format!("the hashes of the ends are {hashes:?}")));
                }
                if self.frames("rest")? != whole[at..] {
                    return Err(fails("its frames are others than those of the run that was never cut"));
                }
                self.remove("rest")?;
            }
            self.remove("whole")?;
        }
        Ok(())
    }

    /// Has a scene with snow refused to go on from a frame.
    fn refuses(&self, scene: &str) -> Result<(), Failure> {
        let options =
            ["run", scene, "--quiet", "--fields", "velocity", "--steps", "2", "--frame-interval", "1"];
        self.succeeds(&[&options[..], &["--save", "whole"]].concat())?;
        let start = ["--save", "rest", "--start", "whole/frame-000001.ply"];
        let refused = self.nappe(&[&options[..], &start].concat())?;
        let told = text(&refused.stderr);
        if refused.status.code() != Some(1) || !told.contains("is snow") || self.folder.join("rest").exists()
        {
            return Err(Failure(format!(
                "{scene} goes on from a frame, or is refused for another reason: {told}"
            )));
        }
        self.remove("whole")
    }

    /// The numbers of the frames in a folder, in their order.
    fn frames(&self, folder: &str) -> Result<Vec<Vec<u8>>, Failure> {
        let mut frames = Vec::new();
        loop {
            let path = self.folder.join(folder).join(format!("frame-{:06}.ply", frames.len()));
            if !path.exists() {
                return Ok(frames);
            }
            let bytes = fs::read(&path).map_err(|error| failure(&path, &error))?;
            let end = bytes.windows(HEADER_END.len()).position(|window| window == HEADER_END);
            let end = end.ok_or_else(|| failure(&path, &"it has no header"))?;
            frames.push(bytes[end..].to_vec());
        }
    }

    fn remove(&self, name: &str) -> Result<(), Failure> {
        let path = self.folder.join(name);
        fs::remove_dir_all(&path).map_err(|error| failure(&path, &error))
    }

    fn nappe(&self, arguments: &[&str]) -> Result<Output, Failure> {
        let output = Command::new(&self.program).args(arguments).current_dir(&self.folder).output();
        output.map_err(|error| failure(&self.program, &error))
    }

    fn succeeds(&self, arguments: &[&str]) -> Result<Output, Failure> {
        let output = self.nappe(arguments)?;
        if output.status.success() {
            return Ok(output);
        }
        Err(Failure(format!("nappe {} fails: {}", arguments.join(" "), text(&output.stderr))))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // What is left of a proof that failed is in nobody's way.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn cuts_are_within_the_run_and_as_many_as_it_has_room_for() {
    let mut random = Random::new(SEED);
    for (frames, count) in [(0, 0), (2, 0), (3, 1), (5, 3), (400, 3)] {
        let cuts = cuts(frames, &mut random);
        assert_eq!(cuts.len(), count, "{frames}");
        assert!(cuts.iter().all(|at| (1..frames - 1).contains(at)), "{cuts:?} of {frames}");
    }
}

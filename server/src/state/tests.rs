//! Sessions that were written and read again: the same bits; and files that are cut, altered or forged: refused.

use std::{env, fs, path::PathBuf, sync::Arc};

use nappe_proto::v1;
use nappe_scene::{NoMeshes, Scene, SceneLimits};
use nappe_sim::{
    field::Field,
    math::Precision,
    report::NoStopwatch,
    world::{Change, Forces, Simulation},
};

use super::{
    FORMAT, FileError, Opened, PendingGroup, SavedSession, Section, Waiting,
    format::altered::{FRONT, forged, with_format, with_number},
    read, restore, write,
};

/// A sheet in air that two corners hold, and a ball of snow, above a floor.
const SCENE: &str = r#"
version = 1
title = "A sheet and a ball"
dt = 0.005
steps = 400
wind = [2, 0, 1]

[[body]]
name = "sheet"
mesh = { grid = [6, 5], spacing = 0.05, plane = "upright" }
mass = { density = 0.3 }
pins = ["left"]
air = { lift = 1.0 }

[body.springs]
stretch = { stiffness = 100, damping = 0.02 }
shear = { stiffness = 30, damping = 0.01 }
bend = { stiffness = 0.1, damping = 0.001 }

[snow]
cell = 0.06

[[snow.object]]
name = "ball"
sphere = { center = [2, 0.2, 0], radius = 0.1 }
velocity = [1, -1, 0]
seed = 1

[[collider]]
name = "floor"
plane = { point = [0, -3, 0], normal = [0, 1, 0] }
friction = 0.8
"#;

/// A session after some steps and calls, with a change that waits; and its simulation.
pub(super) fn example(precision: Precision) -> (SavedSession, Simulation) {
    let scene = Scene::parse(SCENE, "scene").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (mut simulation, warnings) = Simulation::new(&built.setup, precision).expect("a good scene");
    simulation.apply(&built.initial_changes).expect("changes of the scene");
    advance(&mut simulation, 3);
    let force = |body: &str, force: [f64; 3]| {
        let forces = Forces::One(force);
        Change::Force { body: body.to_owned(), particles: Arc::default(), forces }
    };
    let pin = |particle: u32| Change::Pin { particle, target: [0.0, 0.1, 0.02], duration: 1.0 };
    let pinned = (0..30).find(|particle| simulation.rules().check(&[pin(*particle)]).is_ok());
    let calls = [force("sheet", [0.0, 0.01, 0.0]), force("ball", [0.0, 0.1, 0.0])];
    simulation.apply(&calls).expect("good forces");
    simulation.apply(&[pin(pinned.expect("a pin"))]).expect("a pin may move");
    advance(&mut simulation, 4);

    let (step, count) = (simulation.step_count(), simulation.particle_count());
    let mut numbers = vec![0.0_f32; 3 * count];
    simulation.read(Field::Positions, &mut numbers);
    let session = v1::Session {
        session_id: "kept".to_owned(),
        step,
        frame_interval_steps: 2,
        particle_count: count as u64,
        snow_particle_count: simulation.snow_particle_count() as u64,
        spring_count: simulation.spring_count() as u64,
        ..v1::Session::default()
    };
    let group = PendingGroup { step: step + 2, order: 3, changes: vec![Change::Gravity([0.0, -5.0, 0.0])] };
    let request =
        v1::CreateSessionRequest { session_id: "kept".to_owned(), ..v1::CreateSessionRequest::default() };
    let saved = SavedSession {
        session: v1::CreateSessionResponse { session: Some(session), warnings },
        request: Some(request),
        setup: built.setup,
        initial: built.initial_changes,
        state: simulation.take(),
        pending: Waiting { groups: vec![group], last_order: 3 },
        frame: v1::Frame {
            frame: 3,
            step,
            time_seconds: simulation.time(),
            diagnostics: Some(v1::Diagnostics::default()),
            ..v1::Frame::default()
        },
        positions: numbers.iter().flat_map(|number| number.to_le_bytes()).collect(),
        state_hash: simulation.state_hash(),
        hash_interval: 1,
        colors: vec![("sheet".to_owned(), 0x00ff_8000)],
    };
    (saved, simulation)
}

fn advance(simulation: &mut Simulation, steps: u64) {
    for _ in 0..steps {
        simulation.step(&mut NoStopwatch).expect("it is stable");
    }
}

fn file(precision: Precision) -> Vec<u8> {
    write(&example(precision).0).expect("it can be written")
}

/// The simulation of a file, or why there is none.
fn restored(file: &[u8]) -> Result<Simulation, FileError> {
    Ok(restore(&read(&Opened::of(file)?)?)?.0)
}

/// Numbers without an order, the same in every run.
fn random(seed: u64) -> impl Iterator<Item = u64> {
    let next = |state: &u64| {
        let state = state ^ (state << 13);
        let state = state ^ (state >> 7);
        Some(state ^ (state << 17))
    };
    std::iter::successors(Some(seed | 1), next)
}

#[test]
fn a_session_that_was_written_and_read_is_the_same_and_goes_on_with_the_same_bits() {
    for precision in Precision::ALL {
        let (saved, mut simulation) = example(precision);
        let file = write(&saved).expect("it can be written");
        let opened = Opened::of(&file).expect("a good file");
        assert!(opened.has_own_bits() && opened.version() == env!("CARGO_PKG_VERSION"));
        assert!(opened.bytes_to_read() > file.len() as u64 / 2, "{}", opened.bytes_to_read());
        let read = read(&opened).expect("good sections");
        assert_eq!(read, saved);
        let (mut after, _) = restore(&read).expect("a good session");
        assert_eq!(after.state_hash(), saved.state_hash);
        for simulation in [&mut simulation, &mut after] {
            simulation.apply(&saved.pending.groups[0].changes).expect("good changes");
            advance(simulation, 40);
        }
        assert_eq!(after.state_hash(), simulation.state_hash(), "{precision}, 40 steps later");
        for simulation in [&mut simulation, &mut after] {
            simulation.apply(&[Change::Reset]).expect("a reset");
            advance(simulation, 2);
        }
        assert_eq!(after.state_hash(), simulation.state_hash(), "{precision}, after a reset");
    }
}

#[test]
fn a_file_that_was_cut_or_has_more_is_refused() {
    let file = file(Precision::F32);
    let opened = Opened::of(&file).expect("a good file");
    let lengths = Section::ALL.map(|section| opened.section(section).len());
    let ends = lengths.iter().scan(FRONT, |end, length| {
        *end += length;
        Some(*end)
    });
    let ends: Vec<usize> = [0, 7, 8, 11, 12, 40, FRONT - 1, FRONT].into_iter().chain(ends).collect();
    assert_eq!(ends.last(), Some(&file.len()));
    for end in ends.into_iter().flat_map(|end| [end, end + 1]).filter(|end| *end < file.len()) {
        assert!(Opened::of(&file[..end]).is_err(), "cut after {end} bytes");
    }
    let more = [&file[..], &[0]].concat();
    assert!(matches!(Opened::of(&more), Err(FileError::Length { .. })));
}

#[test]
fn a_file_with_a_flipped_bit_is_refused_and_names_the_section() {
    let file = file(Precision::F64);
    for at in 0..FRONT {
        let mut flipped = file.clone();
        flipped[at] ^= 1 << (at % 8);
        assert!(Opened::of(&flipped).is_err(), "byte {at} of the front");
    }
    let opened = Opened::of(&file).expect("a good file");
    let mut begin = FRONT;
    for section in Section::ALL {
        let length = opened.section(section).len();
        assert!(length > 0, "{section} is empty");
        for at in [begin, begin + length / 2, begin + length - 1] {
            let mut flipped = file.clone();
            flipped[at] ^= 0x10;
            let refused = Opened::of(&flipped).expect_err("it was altered").to_string();
            assert!(refused.contains(&format!("'{section}'")), "{refused}");
        }
        begin += length;
    }
}

#[test]
fn tables_that_no_file_has_are_refused() {
    let file = file(Precision::F32);
    for section in Section::ALL {
        for (column, number) in [(1, 0), (1, FRONT as u64 - 1), (1, 1 << 60), (2, 1 << 60), (2, u64::MAX)] {
            let refused = Opened::of(&with_number(&file, section, column, number)).expect_err("it is forged");
            let of_section = matches!(refused, FileError::Section { section: found, .. } if found == section);
            assert!(of_section, "{section}, {column}, {number}: {refused}");
        }
        // One byte more of a section overlaps the next one, or is not there.
        let length = Opened::of(&file).expect("a good file").section(section).len() as u64;
        assert!(Opened::of(&with_number(&file, section, 2, length + 1)).is_err(), "{section}");
        assert!(Opened::of(&with_number(&file, section, 2, length - 1)).is_err(), "{section}");
    }
    for format in [0, 99, FORMAT + 1] {
        let refused = Opened::of(&with_format(&file, format)).expect_err("another format");
        assert_eq!(refused, FileError::Format { found: format });
    }
    let picture = Opened::of(b"\x89PNG\r\n\x1a\n and more").expect_err("no session");
    assert_eq!(picture, FileError::Kind);
}

#[test]
fn what_no_session_says_is_refused_by_the_name_of_its_section() {
    type Spoil = fn(&mut SavedSession);
    let spoiled: [(Spoil, Section); 16] = [
        (|s| s.session.session = None, Section::Session),
        (|s| s.session.session.as_mut().expect("one").particle_count += 1, Section::Session),
        (|s| s.session.session.as_mut().expect("one").step = 1 << 60, Section::Session),
        (|s| s.setup.bodies[0].network.springs[0].particles[0] = u32::MAX, Section::Setup),
        (|s| s.setup.bodies[0].network.x[0][0] = f64::NAN, Section::Setup),
        (|s| s.setup.bodies[0].network.triangles[0][0] = u32::MAX, Section::Setup),
        (|s| s.setup.bodies[0].network.uv = vec![[0.0; 2]], Section::Setup),
        (|s| s.initial.push(Change::Drag(f64::NAN)), Section::Initial),
        (|s| s.setup.snow = None, Section::Session),
        (|s| s.pending.groups[0].changes = vec![Change::Drag(-1.0)], Section::Pending),
        (|s| s.pending.groups[0].step = 0, Section::Pending),
        (|s| s.pending.last_order = 2, Section::Pending),
        (|s| s.pending.groups.push(s.pending.groups[0].clone()), Section::Pending),
        (|s| s.frame.step += 1, Section::Frame),
        (|s| s.positions.truncate(12), Section::Positions),
        (|s| s.state_hash += 1, Section::Hash),
    ];
    for (spoil, section) in spoiled {
        let (mut saved, _) = example(Precision::F64);
        spoil(&mut saved);
        let file = write(&saved).expect("it can be written");
        let refused = restored(&file).expect_err("it is spoiled");
        assert!(
            matches!(refused, FileError::Section { section: found, .. } if found == section),
            "{refused}"
        );
    }
}

#[test]
fn the_state_of_another_setup_is_refused() {
    let [(narrow, _), (wide, _)] = Precision::ALL.map(example);
    let mut other = wide.clone();
    let body = &mut other.setup.bodies[0];
    body.network.masses[7] *= 2.0;
    // Masses of cloth are no part of the state, and its setup says them; lengths and snow are.
    assert!(restore(&other).is_ok());
    let mut other = wide.clone();
    other.setup.snow.as_mut().expect("snow").objects[0].mass[0] *= 2.0;
    let refused = restore(&other).expect_err("other snow").to_string();
    assert!(refused.contains("'state'") && refused.contains("never change"), "{refused}");
    let mixed = SavedSession { setup: narrow.setup, state_hash: narrow.state_hash, ..wide };
    let refused = restore(&mixed).expect_err("the hash of another one").to_string();
    assert!(refused.contains("'hash'"), "{refused}");
}

/// Alters bytes of a section in a file of which all hashes are made anew. What is then still taken can be stepped, but with
/// another setup, which may ask for steps that take for ever.
fn forge(section: Section, count: usize) {
    let file = file(Precision::F32);
    let numbers: Vec<u64> = random(section as u64 + 7).take(2 * count).collect();
    let mut refused = 0;
    for pair in numbers.chunks_exact(2) {
        let forged = forged(&file, section, pair[0] as usize >> 8, 1 << (pair[1] >> 11 & 7));
        match restored(&forged) {
            // A step may fail, and says so.
            Ok(mut simulation) if section != Section::Setup => drop(simulation.step(&mut NoStopwatch)),
            Ok(_) => {}
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 0, "{section}: none of {count} was refused");
}

#[test]
fn forged_states_are_refused_or_can_be_stepped() {
    forge(Section::State, 300);
}

#[test]
fn forged_setups_are_refused_or_built() {
    forge(Section::Setup, 300);
}

#[test]
fn forged_changes_frames_and_hashes_are_refused_or_taken() {
    for section in
        [Section::Session, Section::Initial, Section::Pending, Section::Frame, Section::Hash, Section::Colors]
    {
        forge(section, 40);
    }
}

/// The committed file.
fn committed() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/session.bin")
}

#[test]
fn the_committed_file_is_what_this_version_writes_and_is_taken() {
    let file = file(Precision::F32);
    if env::var_os("NAPPE_BLESS").is_some_and(|value| value == "1") {
        fs::write(committed(), &file).expect("tests/golden/session.bin can be written");
    }
    let committed =
        fs::read(committed()).expect("tests/golden/session.bin: `cargo xtask bless hashes` writes it");
    assert!(
        committed == file,
        "a section holds something else than before: give the format another number (server/src/state/format.rs), and \
         write the file anew by `cargo xtask bless hashes`"
    );
    restored(&committed).expect("a good session");
}

//! A simulation that goes on from a saved session, once all that the session says was checked.
//!
//! Enters: a session as it was read. Leaves: a simulation with the hash of the file, or which section cannot be.

use nappe_proto::v1;
use nappe_scene::printable;
use nappe_sim::{
    cloth::Network,
    linalg::PreconditionerKind,
    report::Stage,
    world::{ChangeRules, Simulation},
};

use super::{
    format::{FileError, Section},
    write::{PendingGroup, SavedSession, Waiting},
};

/// Bytes of the position of a particle in a frame.
const POSITION_BYTES: usize = 12;

/// Frames and calls so far, at most: both are counted on.
const MOST_COUNTED: u64 = 1 << 53;

/// Builds the simulation of a saved session, which stands where that stood. It is as large as its setup says: its memory is to be
/// counted before. The strings are warnings of its setup. Runs on the rayon pool that the caller installed.
///
/// # Errors
/// The first section that no session of this version can have.
pub fn restore(saved: &SavedSession) -> Result<(Simulation, Vec<String>), FileError> {
    for body in &saved.setup.bodies {
        let drawn = check_drawn(&body.network);
        drawn.map_err(|message| FileError::of(Section::Setup, format!("body '{}': {message}", body.name)))?;
    }
    let (mut simulation, warnings) = Simulation::new(&saved.setup, saved.state.precision())
        .map_err(|error| FileError::of(Section::Setup, error))?;
    check_told(saved, &simulation)?;
    let rules = simulation.rules();
    rules.check(&saved.initial).map_err(|error| FileError::of(Section::Initial, error))?;
    saved.state.check(&simulation).map_err(|error| FileError::of(Section::State, error))?;
    check_waiting(&saved.pending, rules, saved.state.step_count())?;
    check_frame(saved, &simulation)?;

    simulation.put(&saved.state);
    let hash = simulation.state_hash();
    if hash == saved.state_hash {
        return Ok((simulation, warnings));
    }
    let message = format!("the state has the hash {hash:016x}, and the file says {:016x}", saved.state_hash);
    Err(FileError::of(Section::Hash, message))
}

/// What only viewers look at: triangles of particles, and texture coordinates for each.
fn check_drawn(network: &Network) -> Result<(), String> {
    let count = network.x.len();
    if let Some(corner) = network.triangles.as_flattened().iter().find(|corner| **corner as usize >= count) {
        return Err(format!("a triangle names particle {corner}: there are {count}, from 0"));
    }
    if ![0, count].contains(&network.uv.len()) {
        return Err(format!("{} texture coordinates: none, or {count}, are needed", network.uv.len()));
    }
    Ok(())
}

/// What the session says of itself.
fn check_told(saved: &SavedSession, simulation: &Simulation) -> Result<(), FileError> {
    let refused = |message: String| Err(FileError::of(Section::Session, message));
    let Some(session) = &saved.session.session else {
        return refused("it describes no session".to_owned());
    };
    let counts = [
        ("particles", session.particle_count, simulation.particle_count()),
        ("particles of snow", session.snow_particle_count, simulation.snow_particle_count()),
        ("springs", session.spring_count, simulation.spring_count()),
    ];
    for (what, told, built) in counts {
        if told != built as u64 {
            return refused(format!("it has {told} {what}, and its setup has {built}"));
        }
    }
    if session.step != saved.state.step_count() {
        let taken = saved.state.step_count();
        return refused(format!("it has taken {} steps, and its state {taken}", session.step));
    }
    if session.frame_interval_steps == 0 {
        return refused("no steps lie between its frames: 1 or more are needed".to_owned());
    }
    let mut bodies = saved.setup.bodies.iter();
    if let Some((name, _)) = saved.colors.iter().find(|(name, _)| !bodies.any(|body| body.name == *name)) {
        let name = printable(name);
        let message =
            format!("it has a colour for '{name}': no body of its setup, or one that is out of order");
        return Err(FileError::of(Section::Colors, message));
    }
    if let Some((name, color)) = saved.colors.iter().find(|(_, color)| *color > 0x00ff_ffff) {
        let message =
            format!("the colour of body '{}' is {color:#x}; allowed: at most 0xffffff", printable(name));
        return Err(FileError::of(Section::Colors, message));
    }
    if saved.hash_interval == 0 {
        let message = "no frames lie between those with a hash: 1 or more are needed";
        return Err(FileError::of(Section::Hash, message));
    }
    session.diagnostics.iter().try_for_each(|found| check_found(Section::Session, found, simulation))
}

/// Lists of what a step found are those of a step of this simulation: they are told to everybody who lists sessions.
fn check_found(section: Section, found: &v1::Diagnostics, simulation: &Simulation) -> Result<(), FileError> {
    let colliders = simulation.colliders();
    let has_names = found.loads.iter().zip(colliders).all(|(load, collider)| load.name == collider.name);
    if found.loads.len() > colliders.len() || !has_names {
        return Err(FileError::of(section, "it has loads on other colliders than its setup"));
    }
    let is_stage = |told: &v1::StageTime| Stage::ALL.iter().any(|stage| stage.name() == told.stage);
    if found.stages.len() > Stage::ALL.len() || !found.stages.iter().all(is_stage) {
        return Err(FileError::of(section, "it has times of stages that no step has"));
    }
    let solved_with = found.cloth.iter().find_map(|cloth| cloth.preconditioner.as_deref());
    if solved_with.is_some_and(|name| PreconditionerKind::ALL.iter().all(|kind| kind.name() != name)) {
        return Err(FileError::of(section, "it names a preconditioner that there is not"));
    }
    Ok(())
}

/// Groups in the order in which they take effect, none of which is due already, of changes that the session accepts.
fn check_waiting(waiting: &Waiting, rules: &ChangeRules, taken: u64) -> Result<(), FileError> {
    let refused = |message: String| Err(FileError::of(Section::Pending, message));
    let place = |group: &PendingGroup| (group.step, group.order);
    if let Some(pair) = waiting.groups.windows(2).find(|pair| place(&pair[0]) >= place(&pair[1])) {
        return refused(format!(
            "call {} is listed after call {}, out of order",
            pair[1].order, pair[0].order
        ));
    }
    if waiting.last_order > MOST_COUNTED {
        return refused(format!(
            "{} calls were made: at most {MOST_COUNTED} are allowed",
            waiting.last_order
        ));
    }
    let mut orders: Vec<u64> = waiting.groups.iter().map(|group| group.order).collect();
    orders.sort_unstable();
    if let Some([order, _]) = orders.windows(2).find(|pair| pair[0] == pair[1]) {
        return refused(format!("call {order} is listed twice"));
    }
    for PendingGroup { step, order, changes } in &waiting.groups {
        if *order == 0 || *order > waiting.last_order {
            return refused(format!("call {order} is listed: 1 to {} are there", waiting.last_order));
        }
        if *step < taken {
            return refused(format!("call {order} waits for step {step}: {taken} steps were taken"));
        }
        rules
            .check(changes)
            .map_err(|error| FileError::of(Section::Pending, format!("call {order}: {error}")))?;
    }
    Ok(())
}

/// The newest frame: not beyond the state, with a position for each particle and no other field.
fn check_frame(saved: &SavedSession, simulation: &Simulation) -> Result<(), FileError> {
    let SavedSession { frame, positions, .. } = saved;
    let refused = |message: String| Err(FileError::of(Section::Frame, message));
    if frame.step > saved.state.step_count() {
        let taken = saved.state.step_count();
        return refused(format!("it is of step {}, and the state of step {taken}", frame.step));
    }
    if frame.frame > MOST_COUNTED {
        return refused(format!("it has number {}: at most {MOST_COUNTED} is allowed", frame.frame));
    }
    let found = frame.diagnostics.as_ref().filter(|_| frame.time_seconds.is_finite());
    let Some(found) = found else {
        return refused("it has no finite time, or no diagnostics".to_owned());
    };
    check_found(Section::Frame, found, simulation)?;
    let mut colliders = simulation.colliders().iter();
    if !frame.poses.iter().all(|pose| colliders.any(|collider| collider.name == pose.name)) {
        return refused("it has places of other colliders than its setup".to_owned());
    }
    if !frame.fields.is_empty() || frame.grid.is_some() || frame.chunk.is_some() {
        return refused("it has fields: its positions alone are kept, in a section of their own".to_owned());
    }
    let count = simulation.particle_count();
    if positions.len() != count * POSITION_BYTES {
        let message = format!(
            "it has {} bytes: {count} particles of {POSITION_BYTES} bytes are needed",
            positions.len()
        );
        return Err(FileError::of(Section::Positions, message));
    }
    let is_finite = |number: &[u8; 4]| f32::from_le_bytes(*number).is_finite();
    match positions.as_chunks::<4>().0.iter().position(|number| !is_finite(number)) {
        Some(at) => {
            Err(FileError::of(Section::Positions, format!("that of particle {} is not finite", at / 3)))
        }
        None => Ok(()),
    }
}

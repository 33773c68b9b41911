//! What VTK files tell of a whole frame: its time, its step, its hash, energies, and what colliders felt.
//!
//! Enters: a frame. Leaves: facts, under names that stay.

use nappe_client::{ColliderPose, Frame, components, v1};
use nappe_scene::{
    mesh::{VtpFact, VtpTold},
    printable,
};

use crate::words::output;

/// What the file of the particles tells; with the names of the bodies, in the order of their numbers.
pub(super) fn of_frame(frame: &Frame, bodies: &[String]) -> Vec<VtpFact> {
    let mut facts = of_instant(frame);
    facts.push(texts("body_names", bodies.to_vec()));
    if let Some(hash) = frame.state_hash {
        facts.push(texts("state_hash", vec![output::hash(hash)]));
    }
    if let Some(diagnostics) = &frame.diagnostics {
        facts.extend(of_step(diagnostics));
    }
    facts
}

/// What every file tells: the time (s), the step, the number of the frame.
pub(super) fn of_instant(frame: &Frame) -> Vec<VtpFact> {
    vec![
        // Readers know this name.
        number("TimeValue", frame.time),
        counts("step", vec![frame.step]),
        counts("frame", vec![frame.frame]),
    ]
}

/// What the file of the colliders tells: their names, where their reference points are (m), and how they are turned.
pub(super) fn of_poses(frame: &Frame, poses: &[ColliderPose]) -> Vec<VtpFact> {
    let names = poses.iter().map(|pose| printable(&pose.name).into_owned()).collect();
    let positions = poses.iter().flat_map(|pose| pose.position).collect();
    let turns = poses.iter().flat_map(|pose| pose.turn).collect();
    let mut facts = of_instant(frame);
    facts.push(texts("collider_names", names));
    facts.push(vectors("collider_position", 3, positions));
    facts.push(vectors("collider_turn", 4, turns));
    facts
}

/// What a step reported: energies (J), the largest stretch, contacts, and loads of colliders (N, N m).
fn of_step(diagnostics: &v1::Diagnostics) -> Vec<VtpFact> {
    let mut facts = vec![
        number("kinetic_energy", diagnostics.kinetic_energy),
        number("elastic_energy", diagnostics.elastic_energy),
        number("gravitational_energy", diagnostics.gravitational_energy),
        number("external_work", diagnostics.external_work),
        number("max_stretch", diagnostics.max_stretch),
        counts("contact_count", vec![diagnostics.contact_count]),
    ];
    let loads = &diagnostics.loads;
    if !loads.is_empty() {
        let names = loads.iter().map(|load| printable(&load.name).into_owned()).collect();
        let forces = loads.iter().flat_map(|load| components(load.force)).collect();
        let torques = loads.iter().flat_map(|load| components(load.torque)).collect();
        facts.push(texts("load_names", names));
        facts.push(vectors("load_force", 3, forces));
        facts.push(vectors("load_torque", 3, torques));
        facts.push(counts("load_contacts", loads.iter().map(|load| load.contacts).collect()));
    }
    facts
}

fn number(name: &str, number: f64) -> VtpFact {
    vectors(name, 1, vec![number])
}

fn vectors(name: &str, components: usize, numbers: Vec<f64>) -> VtpFact {
    VtpFact { name: name.to_owned(), told: VtpTold::Numbers(components, numbers) }
}

fn counts(name: &str, counts: Vec<u64>) -> VtpFact {
    VtpFact { name: name.to_owned(), told: VtpTold::Counts(counts) }
}

fn texts(name: &str, texts: Vec<String>) -> VtpFact {
    VtpFact { name: name.to_owned(), told: VtpTold::Texts(texts) }
}

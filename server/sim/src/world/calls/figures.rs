//! What calls do not move: the figures of a world, which frames lead and which go by the time; and snow that is attached to a
//! collider, with that.

use std::ops::Range;

use super::changes::{Change, ChangeError};
use crate::{
    math::{Padded, Real, vec3},
    world::{
        body::{Body, cloth::Cloth},
        setup::{BodySetup, SetupError, pulls::Pull},
    },
};

/// What calls do not move.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Figures {
    /// Names of the figures of a world, and their corners among all particles.
    all: Vec<(String, Range<u32>)>,
    /// Names of objects of snow, each with that of the collider that it is attached to.
    attached: Vec<[String; 2]>,
}

impl Figures {
    /// Those among the bodies of a world.
    pub(crate) fn of<R: Real>(bodies: &[Body<R>]) -> Self {
        let parts = bodies.iter().filter_map(Body::as_cloth).flat_map(|cloth| cloth.parts.iter());
        let figures = parts.filter(|part| part.is_figure());
        let all = figures.map(|part| (part.name.clone(), part.of_all_bodies())).collect();
        let snow = bodies.iter().filter_map(Body::as_snow);
        let attached = snow.flat_map(|body| body.snow.attached().iter().cloned()).collect();
        Self { all, attached }
    }

    /// Refuses changes of figures, and of what is attached.
    ///
    /// # Errors
    /// The first of them.
    pub(crate) fn check(&self, changes: &[Change]) -> Result<(), ChangeError> {
        changes
            .iter()
            .try_for_each(|change| self.check_one(change).and_then(|()| self.check_attached(change)))
    }

    /// Refuses to move an object of snow, or a collider, that another one holds or is held by.
    fn check_attached(&self, change: &Change) -> Result<(), ChangeError> {
        let (place, name) = match change {
            Change::State { body, .. } => (0, body),
            Change::Collider(asked) => (1, &asked.collider),
            _ => return Ok(()),
        };
        match self.attached.iter().find(|names| names[place] == *name) {
            Some([object, collider]) => {
                Err(ChangeError::Attached { object: object.clone(), collider: collider.clone() })
            }
            None => Ok(()),
        }
    }

    fn check_one(&self, change: &Change) -> Result<(), ChangeError> {
        let (figure, what) = match change {
            Change::State { body, .. } => (self.named(body), "it is not put elsewhere"),
            Change::Force { body, .. } => (self.named(body), "no force acts on it"),
            Change::Pull(Pull { body, .. }) => (self.named(body), "nothing pulls at it"),
            Change::Pin { particle, .. } | Change::PinPath { particle, .. } => {
                (self.with(*particle), "its corners are no pins that calls move")
            }
            _ => return Ok(()),
        };
        match figure {
            Some(figure) => Err(ChangeError::OnFigure { figure: figure.clone(), what }),
            None => Ok(()),
        }
    }

    /// The name of a figure, if it is that of one.
    fn named(&self, name: &str) -> Option<&String> {
        self.all.iter().map(|(figure, _)| figure).find(|figure| *figure == name)
    }

    /// The figure of which a particle over all bodies is a corner.
    fn with(&self, particle: u32) -> Option<&String> {
        self.all.iter().find(|(_, corners)| corners.contains(&particle)).map(|(figure, _)| figure)
    }
}

impl<R: Real> Cloth<R> {
    /// Lets the frames of its figures begin at a time (s).
    pub(crate) fn lead_from(&mut self, time: f64) {
        if !self.model.figures.is_empty() {
            self.state.led_since = time;
        }
    }

    /// Gives the corners of its figures the velocities (m/s) that they have then, of those of all particles.
    pub(crate) fn go_on_with_figures(&mut self, velocities: &[[f64; 3]]) {
        let Self { state, model, parts, .. } = self;
        for part in parts.iter().filter(|part| part.is_figure()) {
            let all = &velocities[part.first_particle as usize..];
            for (own, velocity) in part.own.clone().zip(all) {
                state.v[model.place[own as usize] as usize] = Padded::new(&vec3(*velocity));
            }
        }
    }
}

/// Refuses figures that cannot lead what they have, or that no cloth meets.
///
/// # Errors
/// The first of them, and why.
pub(crate) fn check(bodies: &[BodySetup]) -> Result<(), SetupError> {
    let is_met = bodies.iter().any(|body| !body.network.is_figure() && body.network.thickness > 0.0);
    for BodySetup { name, network, .. } in bodies {
        let Some(frames) = &network.frames else { continue };
        let refused = |message: String| Err(SetupError::Body { body: name.clone(), message });
        if let Some(message) = frames.invalid(network.x.len()) {
            return refused(format!("its frames {message}"));
        }
        if network.thickness == 0.0 {
            return refused("it is a figure and has no thickness: one above 0 is needed".to_owned());
        }
        if !network.springs.is_empty() || !network.elements.is_empty() {
            return refused("it is a figure and has springs or elements: none are allowed".to_owned());
        }
        if network.masses.iter().any(|mass| *mass != 0.0) {
            return refused(
                "it is a figure and has a mass: 0 is needed, since its frames have masses".to_owned(),
            );
        }
        if !is_met {
            return refused(
                "it is a figure, and no body has a thickness: only such bodies meet it".to_owned(),
            );
        }
    }
    Ok(())
}

//! Which changes a world accepts. Bodies, kinds of springs and pins never change, so that changes can be checked while the
//! world steps.

use std::cell::LazyCell;

use super::{
    changes::{Change, ChangeError, allowed},
    collider_move::{Departure, MoveError},
    figures::Figures,
    ranges::{check_bodies_put, check_keys, check_path, check_pull_numbers, within},
};
use crate::{
    cloth::{Air, SpringKind},
    collide::{Bounds, Collider},
    math::Real,
    parallel::Ranks,
    world::{
        body::Body,
        setup::{
            forces::Forces,
            pulls::{Pull, PullError},
        },
    },
};

/// Bounds (m) that hold every place.
const EVERYWHERE: Bounds = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];

/// Which changes a world accepts.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeRules {
    particle_count: usize,
    /// Pinned particles over all bodies, in order.
    pinned: Vec<u32>,
    cloths: Vec<ClothRules>,
    figures: Figures,
    /// Names of the objects of snow, and how many particles each has.
    snows: Vec<(String, usize)>,
    /// How far from the origin (m) their grid reaches.
    snow_reach: f64,
    /// Names of the colliders.
    colliders: Vec<String>,
    /// How far (m) from its reference point each of them may meet a particle.
    reaches: Vec<f64>,
    /// Time step of the world (s).
    dt: f64,
    /// Whether several ranks step the world.
    over_ranks: bool,
    /// Particles that changes which are checked together may pull at.
    most_pulled: usize,
}

/// What changes of springs a cloth accepts.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ClothRules {
    name: String,
    first_particle: u32,
    particle_count: usize,
    /// Kinds of its springs.
    kinds: Vec<SpringKind>,
    feels_air: bool,
    /// Whether its surface keeps apart from others.
    is_thick: bool,
    /// What those are called that it shares its air with.
    beside: String,
}

impl ClothRules {
    fn has_springs(&self, kind: Option<SpringKind>) -> bool {
        kind.map_or(!self.kinds.is_empty(), |kind| self.kinds.contains(&kind))
    }
}

impl ChangeRules {
    /// The rules of a world of these bodies and colliders.
    pub(crate) fn of<R: Real>(
        bodies: &[Body<R>],
        colliders: &[Collider],
        dt: f64,
        ranks: Option<&Ranks>,
    ) -> Self {
        let mut rules = Self {
            particle_count: 0,
            pinned: Vec::new(),
            cloths: Vec::new(),
            figures: Figures::of(bodies),
            snows: Vec::new(),
            snow_reach: f64::INFINITY,
            colliders: colliders.iter().map(|collider| collider.name.clone()).collect(),
            reaches: colliders.iter().map(Collider::reach).collect(),
            dt,
            over_ranks: ranks.is_some(),
            most_pulled: usize::MAX,
        };
        for body in bodies {
            rules.particle_count += body.particle_count();
            match body {
                Body::Cloth(cloth) => {
                    let own = 0..cloth.particle_count() as u32;
                    let pinned = own.filter(|own| cloth.is_pinned(*own));
                    rules.pinned.extend(pinned.map(|own| cloth.parts.of_all(own)));
                    for part in cloth.parts.iter() {
                        let kinds = SpringKind::ALL.into_iter().filter(|kind| cloth.has_springs(part, *kind));
                        rules.cloths.push(ClothRules {
                            name: part.name.clone(),
                            first_particle: part.first_particle,
                            particle_count: part.count(),
                            kinds: kinds.collect(),
                            feels_air: cloth.feels_air() && !part.is_figure(),
                            is_thick: cloth.model.thick_surface().is_some(),
                            beside: cloth.parts.beside(&part.name),
                        });
                    }
                }
                Body::Snow(snow) => {
                    rules.snow_reach = snow.snow.reach();
                    let objects = snow.snow.objects();
                    rules.snows.extend(objects.map(|(object, count)| (object.to_owned(), count)));
                }
            }
        }
        // Other bodies may stand between those of one cloth.
        rules.pinned.sort_unstable();
        rules.cloths.sort_by_key(|cloth| cloth.first_particle);
        rules
    }

    /// The same rules where several ranks step the world.
    #[must_use]
    pub fn over_ranks(&self) -> Self {
        Self { over_ranks: true, ..self.clone() }
    }

    /// The same rules where changes that are checked together may pull at so many particles.
    #[must_use]
    pub fn with_most_pulled(&self, most_pulled: usize) -> Self {
        Self { most_pulled, ..self.clone() }
    }

    /// Checks changes without applying them.
    ///
    /// # Errors
    /// The first change that would be refused.
    pub fn check(&self, changes: &[Change]) -> Result<(), ChangeError> {
        self.figures.check(changes)?;
        self.check_but_for_figures(changes)
    }

    /// The same, where figures are put somewhere too.
    pub(crate) fn check_but_for_figures(&self, changes: &[Change]) -> Result<(), ChangeError> {
        check_bodies_put(changes)?;
        changes.iter().try_for_each(|change| self.check_one(change))?;
        self.check_pulled(changes)?;
        let moves = changes.iter().filter_map(|change| match change {
            Change::Collider(asked) => Some(&asked.collider),
            _ => None,
        });
        let mut moved: Vec<&String> = moves.collect();
        moved.sort_unstable();
        match moved.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(MoveError::ColliderTwice { name: pair[0].clone() }.into()),
            None => Ok(()),
        }
    }

    /// Whether changes put a surface somewhere that keeps apart from others: whether it may be there only the places of all say.
    pub fn puts_surfaces(&self, changes: &[Change]) -> bool {
        let is_thick = |name: &String| self.cloths.iter().any(|cloth| cloth.is_thick && cloth.name == *name);
        changes.iter().any(|change| matches!(change, Change::State { body, .. } if is_thick(body)))
    }

    /// Checks how fast the surfaces of colliders are that changes move, where particles can meet them. `departure` says from
    /// where one sets out; one of which it says nothing is not checked. `particles` gives the bounds (m) of all particles as they
    /// are now; it is asked only where the size of a shape does not tell.
    ///
    /// # Errors
    /// The first move whose surface would be faster than 1e4 m/s.
    pub fn check_speeds(
        &self,
        changes: &[Change],
        departure: impl Fn(&str) -> Option<Departure>,
        particles: impl FnOnce() -> Bounds,
    ) -> Result<(), ChangeError> {
        let particles = LazyCell::new(particles);
        for change in changes {
            let Change::Collider(asked) = change else { continue };
            let mut known = self.colliders.iter().zip(&self.reaches);
            let Some((name, reach)) = known.find(|(name, _)| **name == asked.collider) else { continue };
            let Some(start) = departure(name) else { continue };
            if asked.check_speed(start, *reach, self.dt, EVERYWHERE).is_err() {
                asked.check_speed(start, *reach, self.dt, *particles)?;
            }
        }
        Ok(())
    }

    fn check_one(&self, change: &Change) -> Result<(), ChangeError> {
        match change {
            Change::Gravity(value) => within("gravity", value, allowed::GRAVITY),
            Change::Wind(value) => within("wind", value, allowed::SPEED),
            Change::Drag(value) => within("drag", &[*value], allowed::DRAG),
            Change::Air { body, density, normal, lift, tangential } => {
                within("density", density.as_slice(), Air::DENSITY)?;
                for (name, number) in [("normal", normal), ("lift", lift), ("tangential", tangential)] {
                    within(name, number.as_slice(), Air::COEFFICIENT)?;
                }
                self.check_air(body.as_deref())
            }
            Change::Springs { body, kind, stiffness, damping } => {
                within("stiffness", stiffness.as_slice(), allowed::STIFFNESS)?;
                within("damping", damping.as_slice(), allowed::DAMPING)?;
                self.check_springs(body.as_deref(), *kind)
            }
            Change::Pin { particle, target, duration } => {
                within("target", target, allowed::LENGTH)?;
                within("duration", &[*duration], allowed::DURATION)?;
                self.check_pin(*particle)
            }
            Change::PinPath { particle, points } => {
                check_path(*particle, points)?;
                self.check_pin(*particle)
            }
            Change::Collider(asked) => {
                check_keys(asked)?;
                asked.check(&self.colliders).map_err(ChangeError::from)
            }
            Change::Force { body, particles, forces } => self.check_force(body, particles, forces),
            Change::Pull(asked) => {
                check_pull_numbers(asked, self.dt)?;
                self.check_pull(asked)
            }
            Change::State { body, positions, velocities } => {
                self.check_state(body, positions, velocities.as_deref())
            }
            Change::Reset => match self.snows.first() {
                Some((body, _)) if self.over_ranks => Err(ChangeError::SnowOverRanks { body: body.clone() }),
                _ => Ok(()),
            },
        }
    }

    fn check_pin(&self, particle: u32) -> Result<(), ChangeError> {
        let count = self.particle_count;
        if particle as usize >= count {
            return Err(ChangeError::NoSuchParticle { particle, count });
        }

        let is_pinned = self.pinned.binary_search(&particle).is_ok();
        if is_pinned { Ok(()) } else { Err(ChangeError::NotPinned { particle }) }
    }

    fn check_air(&self, name: Option<&str>) -> Result<(), ChangeError> {
        let Some(name) = name else {
            let any = self.cloths.iter().any(|cloth| cloth.feels_air);
            return if any { Ok(()) } else { Err(ChangeError::NoneFeelsAir) };
        };
        match self.cloths.iter().find(|cloth| cloth.name == name) {
            Some(cloth) if cloth.feels_air && cloth.beside.is_empty() => Ok(()),
            Some(cloth) if cloth.feels_air => {
                Err(ChangeError::SharedAir { body: name.into(), others: cloth.beside.clone() })
            }
            Some(_) => Err(ChangeError::NoAir { body: name.into() }),
            None if self.is_snow(name) => Err(ChangeError::NoAir { body: name.into() }),
            None => Err(self.unknown_body(name)),
        }
    }

    fn unknown_body(&self, name: &str) -> ChangeError {
        let known = self.cloths.iter().map(|cloth| cloth.name.as_str()).collect::<Vec<_>>().join(", ");
        ChangeError::UnknownBody { name: name.into(), known }
    }

    fn is_snow(&self, name: &str) -> bool {
        self.snows.iter().any(|(object, _)| object == name)
    }

    /// The number of the first particle of a cloth over all bodies, none for snow, and how many particles there are.
    fn particles_of(&self, body: &str) -> Result<(Option<u32>, usize), ChangeError> {
        if let Some(cloth) = self.cloths.iter().find(|cloth| cloth.name == body) {
            return Ok((Some(cloth.first_particle), cloth.particle_count));
        }
        match self.snows.iter().find(|(object, _)| object == body) {
            Some(_) if self.over_ranks => Err(ChangeError::SnowOverRanks { body: body.into() }),
            Some((_, count)) => Ok((None, *count)),
            None => {
                let cloths = self.cloths.iter().map(|cloth| cloth.name.as_str());
                let known: Vec<_> =
                    cloths.chain(self.snows.iter().map(|(object, _)| object.as_str())).collect();
                Err(ChangeError::UnknownBody { name: body.into(), known: known.join(", ") })
            }
        }
    }

    fn check_force(&self, body: &str, particles: &[u32], forces: &Forces) -> Result<(), ChangeError> {
        let (first, count) = self.particles_of(body)?;
        let needed = if particles.is_empty() { count } else { particles.len() };
        if let Forces::Each(forces) = forces
            && forces.len() != needed
        {
            return Err(ChangeError::ForceCount { body: body.into(), found: forces.len(), needed });
        }
        within("force", forces.all().as_flattened(), allowed::FORCE)?;
        for &particle in particles {
            if particle as usize >= count {
                return Err(ChangeError::NotInBody { body: body.into(), particle, count });
            }
            if first.is_some_and(|first| self.pinned.binary_search(&(first + particle)).is_ok()) {
                return Err(ChangeError::ForceOnPin { body: body.into(), particle });
            }
        }
        Ok(())
    }

    fn check_pull(&self, Pull { body, particles, points, .. }: &Pull) -> Result<(), ChangeError> {
        if self.is_snow(body) {
            return Err(PullError::OnSnow { body: body.clone() }.into());
        }
        let found = self.cloths.iter().find(|cloth| cloth.name == *body);
        let ClothRules { first_particle, particle_count: count, .. } =
            *found.ok_or_else(|| self.unknown_body(body))?;
        let needed = if particles.is_empty() { count } else { particles.len() };
        if !points.is_empty() && points.len() != needed {
            return Err(PullError::Count { body: body.clone(), found: points.len(), needed }.into());
        }
        for &particle in particles.iter() {
            if particle as usize >= count {
                return Err(PullError::NotInBody { body: body.clone(), particle, count }.into());
            }
            if self.pinned.binary_search(&(first_particle + particle)).is_ok() {
                return Err(PullError::OnPin { body: body.clone(), particle }.into());
            }
        }
        Ok(())
    }

    /// Checks at how many particles changes pull together.
    fn check_pulled(&self, changes: &[Change]) -> Result<(), ChangeError> {
        let pulled = changes.iter().map(|change| match change {
            Change::Pull(asked) => asked.points.len(),
            _ => 0,
        });
        let (found, allowed) = (pulled.sum::<usize>(), self.most_pulled);
        if found > allowed { Err(PullError::TooMany { found, allowed }.into()) } else { Ok(()) }
    }

    fn check_state(
        &self,
        body: &str,
        positions: &[[f64; 3]],
        velocities: Option<&[[f64; 3]]>,
    ) -> Result<(), ChangeError> {
        let (first, needed) = self.particles_of(body)?;
        let lists = [("positions", positions, allowed::LENGTH)];
        let velocities = velocities.map(|velocities| ("velocities", velocities, allowed::SPEED));
        for (what, values, allowed) in lists.into_iter().chain(velocities) {
            if values.len() != needed {
                return Err(ChangeError::WrongCount { body: body.into(), what, found: values.len(), needed });
            }
            let [low, high] = allowed;
            let mut numbers = values.as_flattened().iter();
            if let Some(at) = numbers.position(|value| !(low..=high).contains(value)) {
                let (particle, value) = (at / 3, values.as_flattened()[at]);
                return Err(ChangeError::StateRange { body: body.into(), what, particle, value, allowed });
            }
        }
        // Cloth has a number for each particle, and snow has none.
        if first.is_some() {
            return Ok(());
        }
        let (numbers, reach) = (positions.as_flattened(), self.snow_reach);
        match numbers.iter().position(|value| value.abs() > reach) {
            Some(at) => {
                let (particle, value) = (at / 3, numbers[at]);
                Err(ChangeError::BeyondGrid { body: body.into(), particle, value, reach })
            }
            None => Ok(()),
        }
    }

    fn check_springs(&self, name: Option<&str>, kind: Option<SpringKind>) -> Result<(), ChangeError> {
        if let Some(name) = name.filter(|name| self.is_snow(name)) {
            return Err(ChangeError::SnowHasNoSprings { name: name.into() });
        }
        if self.cloths.is_empty() {
            return Err(ChangeError::NoCloth);
        }

        let named = |cloth: &&ClothRules| name.is_none_or(|name| cloth.name == name);
        let mut found = self.cloths.iter().filter(named).peekable();
        if found.peek().is_none() {
            return Err(self.unknown_body(name.unwrap_or_default()));
        }

        if found.any(|cloth| cloth.has_springs(kind)) {
            return Ok(());
        }
        let kind = kind.map_or("any", SpringKind::name);
        Err(ChangeError::NoSuchSprings { body: name.unwrap_or("any").into(), kind })
    }
}

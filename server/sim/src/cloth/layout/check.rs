//! What a network and its settings have to be for a model to be laid out.

use crate::{
    cloth::{
        laws::Air,
        network::{ElementList, Network, SpringLaw},
        settings::{ClothSettings, SurfaceCheck, SurfaceSettings},
    },
    time_step::TimeStep,
};

/// How steps are divided.
fn check_steps(settings: &ClothSettings) -> Result<(), String> {
    match settings.time_step {
        TimeStep::Certified { safety } if !(safety > 0.0 && safety <= 1.0) => {
            return Err(format!("the safety of the step is {safety}: a number above 0, up to 1 is needed"));
        }
        TimeStep::Fixed(length) | TimeStep::Unchecked(length) if length.is_nan() || length <= 0.0 => {
            return Err(format!("the length of sub-steps is {length} s: a number above 0 is needed"));
        }
        _ => {}
    }
    match settings.tolerance {
        Some(tolerance) if tolerance.is_nan() || tolerance <= 0.0 => {
            Err(format!("the tolerance of the step is {tolerance} m: a number above 0 is needed"))
        }
        Some(_) if settings.time_step.is_unchecked() => {
            Err("a tolerance does not go with unchecked steps".into())
        }
        _ => Ok(()),
    }
}

/// What the air acts on, and how.
fn check_air(network: &Network) -> Result<(), String> {
    let Some(air) = network.air else { return Ok(()) };
    for (name, value) in air.numbers() {
        let [least, most] = Air::allowed(name);
        if !(least..=most).contains(&value) {
            return Err(format!("the {name} of air is {value}: allowed are {least} to {most}"));
        }
    }
    if network.triangles.is_empty() {
        return Err("it has no triangles for air to act on".into());
    }
    Ok(())
}

/// What the air acts on, and what keeps a thickness.
fn check_triangles(network: &Network, settings: &ClothSettings) -> Result<(), String> {
    check_air(network)?;
    let friction = settings.contact.friction;
    if !friction.is_finite() || friction < 0.0 {
        return Err(format!("the friction of its surface is {friction}: a finite number from 0 is needed"));
    }
    let recovery = settings.contact.recovery;
    if !(0.0..=SurfaceSettings::MOST_RECOVERY).contains(&recovery) {
        return Err(format!(
            "the recovery of its surface is {recovery}: 0 to {} are allowed",
            SurfaceSettings::MOST_RECOVERY
        ));
    }
    if let Some(message) = network.invalid_thickness(settings) {
        return Err(format!("its thickness {message}"));
    }
    if network.air.is_none() && network.thickness == 0.0 && settings.contact.surface == SurfaceCheck::Off {
        return Ok(());
    }
    let corners = network.triangles.as_flattened();
    match corners.iter().find(|corner| **corner as usize >= network.x.len()) {
        Some(corner) => {
            Err(format!("a triangle names particle {corner}: there are {}, from 0", network.x.len()))
        }
        None => Ok(()),
    }
}

/// Elements of particles of so many, each with its numbers.
fn check_elements(list: &ElementList, count: usize) -> Result<(), String> {
    let ElementList { kind, law, particles, rest, bending, threads } = list;
    let name = kind.name();
    for (what, value) in [("stiffness", law.stiffness), ("damping", law.damping)] {
        if !value.is_finite() || value < 0.0 {
            return Err(format!("the {what} of {name} is {value}: a finite number from 0 is needed"));
        }
    }
    let (corners, numbers) = (kind.particles(), kind.rest_numbers());
    let is_whole =
        particles.len().is_multiple_of(corners) && rest.len() == particles.len() / corners * numbers;
    if !is_whole || rest.iter().any(|number| !number.is_finite()) {
        return Err(format!(
            "{name} has {} particles and {} numbers: {corners} and {numbers} finite ones per element are needed",
            particles.len(),
            rest.len()
        ));
    }
    if bending.is_some_and(|told| !told.factor.is_finite() || told.factor <= 0.0 || !told.poisson.is_finite())
    {
        return Err(format!("what the mesh makes of {name} is no finite share above 0"));
    }
    if let Some(share) = threads.shares.iter().find(|share| !share.is_finite() || **share < 0.0) {
        return Err(format!(
            "a share of the stiffness of {name} is {share}: a finite number from 0 is needed"
        ));
    }
    match particles.iter().find(|end| **end as usize >= count) {
        Some(end) => Err(format!("{name} names particle {end}: there are {count}, from 0")),
        None => Ok(()),
    }
}

/// What is wrong with a network or its settings, as a sentence.
pub(crate) fn check_network(network: &Network, settings: &ClothSettings) -> Result<(), String> {
    let count = network.x.len();
    if count == 0 {
        return Err("it has no particles".into());
    }
    if !settings.block_size.is_power_of_two() || !(32..=4096).contains(&settings.block_size) {
        return Err(format!(
            "the block size is {}: a power of two from 32 to 4096 is needed",
            settings.block_size
        ));
    }
    check_steps(settings)?;

    if network.v.len() != count || network.masses.len() != count {
        return Err(format!(
            "{count} positions, {} velocities and {} masses: one of each per particle is needed",
            network.v.len(),
            network.masses.len()
        ));
    }

    for (what, values) in [("position", &network.x), ("velocity", &network.v)] {
        if let Some(i) = values.iter().position(|v| v.iter().any(|c| !c.is_finite())) {
            return Err(format!("the {what} of particle {i} is not finite: {:?}", values[i]));
        }
    }

    if let Some(i) = network.masses.iter().position(|m| !m.is_finite() || *m < 0.0) {
        return Err(format!(
            "the mass of particle {i} is {}: a finite number from 0 is needed",
            network.masses[i]
        ));
    }

    if let Some(pin) = network.pins.iter().find(|pin| **pin as usize >= count) {
        return Err(format!("pin {pin} is no particle: there are {count}, from 0"));
    }

    if !network.drag.is_finite() || network.drag < 0.0 {
        return Err(format!("the drag is {} N s/m: a finite number from 0 is needed", network.drag));
    }

    check_triangles(network, settings)?;

    network.elements.iter().try_for_each(|list| check_elements(list, count))?;

    network.springs.iter().enumerate().try_for_each(|(i, spring)| {
        let SpringLaw { stiffness, damping } = spring.law;
        if let Some(end) = spring.particles.iter().find(|end| **end as usize >= count) {
            return Err(format!("spring {i} names particle {end}: there are {count}, from 0"));
        }

        for (what, value) in
            [("stiffness", stiffness), ("damping", damping), ("rest length", spring.rest_length)]
        {
            if !value.is_finite() || value < 0.0 {
                return Err(format!("the {what} of spring {i} is {value}: a finite number from 0 is needed"));
            }
        }

        Ok(())
    })
}

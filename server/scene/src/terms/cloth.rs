//! Terms of bodies of cloth: springs, laws of elements, damping, drag and wind.

use nappe_sim::cloth::{ElementKind, SpringKind};

use super::term::{Removal, SceneTerm};
use crate::{
    body::{Body, SpringLaw, Springs},
    element_law::ElementLaw,
    fabric::FabricText,
};

/// The law of springs of a kind.
fn law(springs: &Springs, kind: SpringKind) -> Option<SpringLaw> {
    let Springs { file: _, pattern: _, stretch, shear, bend } = *springs;
    match kind {
        SpringKind::Stretch => stretch,
        SpringKind::Shear => shear,
        SpringKind::Bend => bend,
    }
}

/// The same, to be changed.
pub(super) fn law_mut(springs: &mut Springs, kind: SpringKind) -> Option<&mut SpringLaw> {
    match kind {
        SpringKind::Stretch => springs.stretch.as_mut(),
        SpringKind::Shear => springs.shear.as_mut(),
        SpringKind::Bend => springs.bend.as_mut(),
    }
}

/// What springs of each kind are, and their damping.
pub(super) fn of_springs(bodies: &[Body]) -> Vec<SceneTerm> {
    let mut terms = Vec::new();
    for kind in SpringKind::ALL {
        let springs = bodies.iter().filter_map(|body| body.springs.as_ref());
        let laws: Vec<SpringLaw> = springs.filter_map(|springs| law(springs, kind)).collect();
        if kind != SpringKind::Stretch && !laws.is_empty() {
            terms.push(SceneTerm::new(format!("springs of {}", kind.name()), Removal::Springs(kind)));
        }
        if laws.iter().any(|SpringLaw { stiffness: _, damping }| *damping > 0.0) {
            terms.push(SceneTerm::new(format!("damping of {}", kind.name()), Removal::Damping(kind)));
        }
    }
    terms
}

/// The laws of elements of bodies, drag, air, and the wind, if any of its velocities (m/s) is one, which acts through them.
pub(super) fn of_bodies(bodies: &[Body], mut winds: impl Iterator<Item = [f64; 3]>) -> Vec<SceneTerm> {
    let mut terms = Vec::new();
    let (mut has_drag, mut has_air) = (false, false);
    for (place, body) in bodies.iter().enumerate() {
        let Body {
            name,
            color: _,
            mesh: _,
            transform: _,
            velocity: _,
            material,
            mass: _,
            springs: _,
            laws,
            pins: _,
            moving_pins: _,
            forces: _,
            drag,
            thickness: _, // Of surfaces, below.
            air,
            integrator: _,
            minimizer: _,
            accuracy: _,
            newton_tolerance: _,
            newton_iterations: _,
            sweeps: _,
            hessian: _,
            substeps: _,
            substep: _,
            safety: _,
            unchecked: _,
            tolerance: _,
            on_pass: _,
            solver: _,
            limits: _,
            block_size: _,
        } = body;
        has_drag |= *drag > 0.0;
        has_air |= air.is_some();
        terms.extend(material.as_ref().and_then(|material| of_material(material, name, place)));
        for kind in ElementKind::ALL {
            let mut damping = laws.iter().filter(|law| law.name == kind).map(damping).peekable();
            if damping.peek().is_none() {
                continue;
            }
            let of = format!("{} of {name}", kind.name());
            let is_damped = damping.any(|damping| damping > 0.0);
            // What holds a cloth together is no term, like springs of stretch.
            if kind != ElementKind::Membrane {
                terms.push(SceneTerm::new(of.clone(), Removal::Elements(place, kind)));
            }
            if is_damped {
                terms.push(SceneTerm::new(format!("damping of {of}"), Removal::ElementDamping(place, kind)));
            }
        }
    }
    if has_drag {
        terms.push(SceneTerm::new("drag", Removal::Drag));
    }
    if has_air {
        terms.push(SceneTerm::new("air", Removal::Air));
    }
    if (has_drag || has_air) && winds.any(|wind| wind != [0.0; 3]) {
        terms.push(SceneTerm::new("wind", Removal::Wind));
    }
    terms
}

/// The damping of the fabric of a body, known by its place, if it has any.
fn of_material(material: &FabricText, name: &str, place: usize) -> Option<SceneTerm> {
    let is_damped = material.fabric()?.damping > 0.0;
    let name = format!("damping of material of {name}");
    is_damped.then(|| SceneTerm::new(name, Removal::FabricDamping(place)))
}

/// Thicknesses of bodies, and the friction (1) between their surfaces.
pub(super) fn of_surfaces(bodies: &[Body], friction: f64) -> Vec<SceneTerm> {
    let thick = bodies.iter().enumerate().filter(|(_, body)| body.thickness > 0.0);
    let mut terms: Vec<SceneTerm> = thick
        .map(|(place, body)| SceneTerm::new(format!("thickness of {}", body.name), Removal::Thickness(place)))
        .collect();
    if !terms.is_empty() && friction > 0.0 {
        terms.push(SceneTerm::new("friction of surfaces", Removal::SurfaceFriction));
    }
    terms
}

/// The damping of a law of elements.
fn damping(law: &ElementLaw) -> f64 {
    let ElementLaw { name: _, stiffness: _, damping, warp: _ } = *law;
    damping
}

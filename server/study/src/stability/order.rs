//! In which order methods are looked at, and which share of the time each may take.

use crate::{case::Case, method::Method};

/// The least share of a part that the scene's own method may take.
const OWN: f64 = 0.4;

/// The method of the first body of a scene.
pub(super) fn own(case: &Case) -> Option<Method> {
    case.setup.bodies.first().map(|body| Method::of(&body.settings))
}

/// The places of some methods in the order of work: the scene's own, then the first of each integrator, then the others, so that where
/// the time does not suffice for all something is known of each.
pub(super) fn order(case: &Case, methods: &[Method]) -> Vec<usize> {
    let own = own(case);
    let is_first = |place: usize| {
        let integrator = methods[place].integrator;
        !methods[..place].iter().any(|method| method.integrator == integrator)
    };
    let mut order: Vec<usize> = (0..methods.len()).collect();
    order.sort_by_key(|place| (own != Some(methods[*place]), !is_first(*place)));
    order
}

/// The share of the time that is left which one of so many may take.
pub(super) fn share(left: usize) -> f64 {
    (2.0 / left.max(1) as f64).min(1.0)
}

/// The same of a method of a case, which is looked at before others, so many with it.
pub(super) fn share_of(case: &Case, method: Method, left: usize) -> f64 {
    if own(case) == Some(method) { OWN.max(share(left)) } else { share(left) }
}

//! Free sheets that meet each other, and solids, gain no energy and keep their momentum, however fast they come and however long a step is.

use nappe_sim::{math::Precision, world::Simulation};
use nappe_tests::{
    Random,
    scene::{difference, momenta, norm, of_text, try_advance},
};

/// Particles along a side of each sheet.
const SIDE: usize = 9;

/// Masses (in any unit) of the particles of a sheet.
fn masses(density: f64) -> Vec<f64> {
    let mut masses = vec![0.0; SIDE * SIDE];
    for corner in nappe_sim::mesh::grid_triangles(SIDE, SIDE).as_flattened() {
        masses[*corner as usize] += density;
    }
    masses
}

/// A meeting at random: its scene, the masses of its particles, and whether a solid stands behind the second sheet.
struct Meeting {
    text: String,
    masses: Vec<f64>,
    has_solid: bool,
}

impl Meeting {
    fn new(seed: u64) -> Self {
        let mut random = Random::seeded(seed);
        let dt = random.decades(1e-3, 2e-2);
        let (speed, ratio) = (random.decades(0.1, 20.0), random.decades(0.1, 10.0));
        let away = 0.07 + (speed * dt * random.between(0.0, 1.0)).max(0.01);
        let (aside, turn) = (random.between(-0.04, 0.04), random.between(0.0, 90.0));
        let friction = 0.3 * f64::from(random.whole(0, 1));
        let has_solid = random.whole(0, 2) == 0;
        let sheet = |name: &str, density: f64, place: &str, more: &str| {
            format!(
                "[[body]]\nname = \"{name}\"\nmesh = {{ grid = [{SIDE}, {SIDE}], spacing = 0.02 }}\ntransform = {{ {place} }}\n\
                 mass = {{ density = {density} }}\nthickness = 0.004\n{more}\n\
                 springs = {{ stretch = {{ stiffness = 400, damping = 0.05 }}, shear = {{ stiffness = 120, damping = 0.02 }}, \
                 bend = {{ stiffness = 4, damping = 0.004 }} }}\n"
            )
        };
        let falling =
            sheet("falling", 0.2, "translate = [-0.08, 0, -0.08]", &format!("velocity = [0, {}, 0]", -speed));
        let place = format!(
            "translate = [{aside}, {}, {aside}], rotate = {{ axis = [0.2, 1, 0.1], degrees = {turn} }}",
            -away
        );
        let standing = sheet("standing", 0.2 * ratio, &place, "");
        let solid = format!(
            "[[collider]]\nname = \"box\"\nbox = {{ center = [{aside}, {}, 0], size = [0.1, 0.03, 0.1] }}\nmargin = 0.003\n",
            -away - 0.1
        );
        let text = format!(
            "version = 1\ndt = {dt}\ngravity = [0, 0, 0]\ncontact = {{ friction = {friction}, surface = \"count\" }}\n\
             {falling}{standing}{}",
            if has_solid { &solid } else { "" }
        );
        Self { text, masses: [masses(1.0), masses(ratio)].concat(), has_solid }
    }

    /// What is wrong with it.
    fn complaint(&self) -> Option<String> {
        let mut simulation = of_text(&self.text, Precision::F64);
        let energy = |simulation: &mut Simulation| simulation.diagnose().total_energy();
        let start = energy(&mut simulation);
        let (before, _) = momenta(&simulation, &self.masses);
        for step in 1..=25 {
            let report = match try_advance(&mut simulation, 1) {
                Ok(report) => report,
                Err(error) => return Some(format!("step {step}: {error}")),
            };
            let now = energy(&mut simulation);
            if now > 1.001 * start {
                return Some(format!("step {step}: {now} J of {start}"));
            }
            if report.surface.is_none_or(|surface| surface.crossings != Some(0)) {
                return Some(format!("step {step}: {:?}", report.surface));
            }
        }
        let (after, _) = momenta(&simulation, &self.masses);
        let off = norm(difference(after, before)) / norm(before);
        (!self.has_solid && off > 1e-12).then(|| format!("off by {off:e} of the momentum"))
    }
}

/// Asks meetings by number.
///
/// # Panics
/// When one of them goes wrong.
pub(crate) fn meetings(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let meeting = Meeting::new(seed);
        if let Some(complaint) = meeting.complaint() {
            panic!("meeting {seed}: {complaint}\n{}", meeting.text);
        }
    }
}

#[test]
fn free_sheets_that_meet_at_random_gain_no_energy_and_keep_their_momentum() {
    meetings(0..40);
}

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

/// A plate that comes at one or two sheets, straight.
struct Plate {
    text: String,
    dt: f64,
    velocity: [f64; 3],
    gravity: f64,
}

impl Plate {
    fn new(seed: u64) -> Self {
        let mut random = Random::seeded(seed);
        let (dt, speed) = (random.decades(1e-3, 2e-2), random.decades(0.05, 5.0));
        let velocity = [speed * random.number() * f64::from(random.whole(0, 1)), speed, 0.0];
        let friction = 0.3 * f64::from(random.whole(0, 1));
        let gravity = -9.81 * f64::from(random.whole(0, 1));
        let sheet = |layer: u32| {
            let at = f64::from(layer);
            format!(
                "[[body]]\nname = \"sheet {layer}\"\nmesh = {{ grid = [{SIDE}, {SIDE}], spacing = 0.02 }}\n\
                 transform = {{ translate = [{}, {}, -0.08] }}\nmass = {{ density = 0.2 }}\nthickness = 0.004\n\
                 springs = {{ stretch = {{ stiffness = 400, damping = 0.05 }}, shear = {{ stiffness = 120, damping = 0.02 }}, \
                 bend = {{ stiffness = 4, damping = 0.004 }} }}\n",
                0.003 * at - 0.08,
                0.006 * at + 0.006
            )
        };
        let sheets: String = (0..=random.whole(0, 1)).map(sheet).collect();
        let text = format!(
            "version = 1\ndt = {dt}\ngravity = [0, {gravity}, 0]\ncontact = {{ friction = {friction} }}\n{sheets}\
             [[collider]]\nname = \"plate\"\nbox = {{ center = [0, -0.05, 0], size = [0.3, 0.09, 0.3] }}\nmargin = 0.003\n\
             friction = {friction}\nvelocity = {velocity:?}\n"
        );
        Self { text, dt, velocity, gravity }
    }
}

#[test]
fn a_plate_that_moves_gives_its_load_times_its_way_and_all_of_the_momentum() {
    for seed in 0..40 {
        let plate = Plate::new(seed);
        let mut simulation = of_text(&plate.text, Precision::F64);
        let start = simulation.diagnose().total_energy();
        let (mut work, mut impulse, mut moved) = (0.0, 0.0, 0.0_f64);
        for step in 1..=20 {
            let report =
                try_advance(&mut simulation, 1).unwrap_or_else(|error| panic!("plate {seed}: {error}"));
            for load in report.loads.iter() {
                work -= plate.dt * (0..3).map(|c| load.force[c] * plate.velocity[c]).sum::<f64>();
                impulse -= plate.dt * load.force[1];
            }
            let now = simulation.diagnose();
            moved = moved.max(now.kinetic_energy);
            let gained = now.total_energy() - start - work;
            assert!(
                gained <= 1e-3 * moved.max(work.abs()),
                "plate {seed}, step {step}: {gained} J\n{}",
                plate.text
            );
            let weight = plate.gravity * f64::from(step) * plate.dt * sheets_mass(&plate.text);
            let off = (now.momentum[1] - impulse - weight).abs();
            let most = impulse.abs().max(weight.abs());
            assert!(
                off <= 1e-12 * most,
                "plate {seed}, step {step}: off by {off} of {most} N s\n{}",
                plate.text
            );
        }
    }
}

/// The mass (kg) of the sheets of a plate.
fn sheets_mass(text: &str) -> f64 {
    text.matches("[[body]]").count() as f64 * 0.2 * (0.02 * (SIDE - 1) as f64).powi(2)
}

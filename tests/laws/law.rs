//! What a law is: a change of a world, and what must then hold of its frames.

use nappe_tests::at_random::{Case, Run, World};

/// What came of asking a law.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Verdict {
    Holds,
    /// The law says nothing about this scene.
    Silent,
    /// Both numbers, in words.
    Broken(String),
}

/// Work that a run of a law may take, see [`World::run_within`]: what goes on after it is left out.
pub(crate) const WORK: u64 = 400_000;

/// A law that no scene may break.
pub(crate) struct Law {
    pub(crate) name: &'static str,
    pub(crate) judge: fn(&World) -> Result<Verdict, String>,
}

impl Law {
    /// What it says of a case; an error where the scene is refused.
    pub(crate) fn ask(&self, case: &Case) -> Result<Verdict, String> {
        (self.judge)(&case.world()?)
    }
}

/// The greatest distance of two frames (m), the second of which is shifted.
pub(crate) fn apart(a: &[[f64; 3]], b: &[[f64; 3]], shift: [f64; 3]) -> f64 {
    let off =
        |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (b[c] - shift[c] - a[c]).abs()).fold(0.0, f64::max);
    let far = |most: f64, off: f64| if off.is_nan() { f64::NAN } else { most.max(off) };
    a.iter().zip(b).map(off).fold(0.0, far)
}

/// A world whose velocities differ by so much (m/s) at random: how far it comes from the first one is how far rounding may lead.
pub(crate) fn shaken(world: &World, by: f64) -> World {
    let mut shaken = world.clone();
    let mut random = nappe_tests::Random::seeded(7);
    for body in &mut shaken.setup.bodies {
        for v in &mut body.network.v {
            *v = v.map(|c| c + by * random.number());
        }
    }
    for object in shaken.setup.snow.iter_mut().flat_map(|snow| &mut snow.objects) {
        for v in &mut object.v {
            *v = v.map(|c| c + by * random.number());
        }
    }
    shaken
}

/// Whether two runs end alike, and stay within what is allowed at each frame; `at` says what the second is shifted by.
pub(crate) fn alike(
    first: &Run,
    second: &Run,
    at: impl Fn(usize) -> [f64; 3],
    allowed: impl Fn(usize) -> f64,
) -> Verdict {
    for (step, (a, b)) in first.frames.iter().zip(&second.frames).enumerate() {
        let (off, most) = (apart(&a.x, &b.x, at(step)), allowed(step));
        if off > most || off.is_nan() {
            let steps = [a, b].map(taken);
            return Verdict::Broken(format!(
                "step {step}: {off:e} m apart, {most:e} m allowed ({} and {})",
                steps[0], steps[1]
            ));
        }
    }
    if first.reason() == second.reason() && first.frames.len() == second.frames.len() {
        return Verdict::Holds;
    }
    let of = |run: &Run| {
        let end = run.end.as_ref().map_or_else(|| "ran".to_owned(), ToString::to_string);
        format!("{} steps, {end}", run.frames.len() - 1)
    };
    Verdict::Broken(format!("{} and {}", of(first), of(second)))
}

/// How a step was divided.
fn taken(frame: &nappe_tests::at_random::Frame) -> String {
    let report = &frame.report;
    let causes: Vec<_> = report.rejections.iter().map(|rejection| format!("{:?}", rejection.cause)).collect();
    let cloth = report.cloth.map_or(0, |cloth| cloth.substeps);
    let snow = report.snow.map_or(0, |snow| snow.substeps);
    format!("{} sub-steps, not accepted: [{}]", cloth + snow, causes.join(", "))
}

/// The greatest distance so far of a run from another one, frame by frame (m).
pub(crate) fn spread(run: &Run, other: &Run) -> Vec<f64> {
    let mut most = 0.0_f64;
    let frames = run.frames.iter().zip(&other.frames);
    let spread = frames.map(|(a, b)| {
        most = most.max(apart(&a.x, &b.x, [0.0; 3]));
        most
    });
    spread.collect()
}

//! A run that is copied on its way, and one that is reset: the same bits as one that goes on, or that begins.

use nappe_sim::{
    report::StepReport,
    world::{Change, Simulation},
};
use nappe_tests::at_random::{Frame, Run, World, go_on};

use crate::law::{Law, Verdict, alike};

pub(crate) const LAW: Law = Law { name: "going on", judge };

fn judge(world: &World) -> Result<Verdict, String> {
    let mut simulation = world.begin()?;
    let half = world.steps / 2;
    let mut before = Run { frames: Vec::new(), end: None };
    go_on(&mut simulation, half, &mut before);
    if before.end.is_some() {
        return Ok(Verdict::Silent);
    }
    let mut copy = simulation.fork();
    let rest = |simulation: &mut Simulation, steps: u64| {
        let mut run = Run { frames: vec![Frame::of(simulation, StepReport::default())], end: None };
        go_on(simulation, steps, &mut run);
        run
    };
    let (first, second) = (rest(&mut simulation, world.steps - half), rest(&mut copy, world.steps - half));
    if let Verdict::Broken(why) = alike(&first, &second, |_| [0.0; 3], |_| 0.0) {
        return Ok(Verdict::Broken(format!("a copy: {why}")));
    }
    if first.end.is_none() && simulation.state_hash() != copy.state_hash() {
        return Ok(Verdict::Broken("a copy has another hash".to_owned()));
    }
    if depends_on_time(world) {
        return Ok(Verdict::Holds);
    }
    simulation.apply(&[Change::Reset]).map_err(|error| error.to_string())?;
    let mut again = rest(&mut simulation, half);
    again.frames.remove(0);
    Ok(match alike(&before, &again, |_| [0.0; 3], |_| 0.0) {
        Verdict::Broken(why) => Verdict::Broken(format!("after a reset: {why}")),
        verdict => verdict,
    })
}

/// Whether something in a world is another one at another time: a reset leaves time as it is.
fn depends_on_time(world: &World) -> bool {
    let setup = &world.setup;
    let moves =
        setup.colliders.iter().any(|collider| collider.way.is_some() || collider.velocity != [0.0; 3]);
    let ends = setup.bodies.iter().flat_map(|body| &body.forces).any(|force| force.until.is_finite());
    moves || ends || !setup.wind_at.is_empty() || !world.changes.is_empty()
}

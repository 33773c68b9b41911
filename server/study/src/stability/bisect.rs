//! The longest step that holds, by bisection.

/// The longest step that holds and the shortest that does not are this near in the end.
const NEAR: f64 = 1.002;
/// The first factor by which steps are lengthened or shortened until the limit lies between two of them; it is squared from
/// one to the next.
const FACTOR: f64 = 1.15;
/// Shares of a limit that are tried too.
const SHORTER: [f64; 4] = [0.97, 0.93, 0.87, 0.75];
/// Says whether a step (s) holds.
pub(super) type Holds<'a> = dyn FnMut(f64) -> Result<bool, TimeIsOver> + 'a;

/// A search between steps.
pub(super) struct Bisection<'a> {
    pub(super) holds: &'a mut Holds<'a>,
    /// The shortest and the longest step that are tried (s).
    pub(super) range: [f64; 2],
}

/// Time was over, or a run could not begin.
pub(super) struct TimeIsOver;

/// The longest step (s) that holds, to 0.2 %, as limits of a study of stability are found: from a step (s) on, between the
/// shortest and the longest that are tried (s). 0 where none holds, infinite where all do.
pub fn longest_step(start: f64, range: [f64; 2], mut holds: impl FnMut(f64) -> bool) -> f64 {
    let mut holds = |dt: f64| Ok(holds(dt));
    match (Bisection { holds: &mut holds, range }).lowest(start) {
        Ok([below, above]) if above.is_finite() => below,
        Ok(_) | Err(TimeIsOver) => f64::INFINITY,
    }
}

impl Bisection<'_> {
    /// A limit below which shorter steps hold too.
    pub(super) fn lowest(&mut self, start: f64) -> Result<[f64; 2], TimeIsOver> {
        let mut start = start;
        loop {
            let found = self.bracket(start).and_then(|found| self.narrow(found))?;
            let mut fails = None;
            for share in SHORTER {
                let dt = share * found[0];
                // What holds by chance just beyond a limit is no limit.
                if fails.is_none() && dt > 0.0 && !(self.holds)(dt)? {
                    fails = Some(dt);
                }
            }
            match fails {
                Some(dt) => start = dt,
                None => return Ok(found),
            }
        }
    }

    /// The longest step that holds and the next that does not: 0 where none holds, infinite where all do that are tried.
    fn bracket(&mut self, start: f64) -> Result<[f64; 2], TimeIsOver> {
        let [shortest, longest] = self.range;
        let mut dt = start.clamp(shortest, longest);
        let goes_up = (self.holds)(dt)?;
        let mut factor = FACTOR;
        loop {
            if goes_up && dt >= longest {
                return Ok([dt, f64::INFINITY]);
            }
            if !goes_up && dt <= shortest {
                return Ok([0.0, dt]);
            }
            let next = if goes_up { (dt * factor).min(longest) } else { (dt / factor).max(shortest) };
            factor *= factor;
            match (goes_up, (self.holds)(next)?) {
                (true, false) => return Ok([dt, next]),
                (false, true) => return Ok([next, dt]),
                _ => dt = next,
            }
        }
    }

    fn narrow(&mut self, [mut below, mut above]: [f64; 2]) -> Result<[f64; 2], TimeIsOver> {
        while below > 0.0 && above.is_finite() && above > NEAR * below {
            let middle = (below * above).sqrt();
            *(if (self.holds)(middle)? { &mut below } else { &mut above }) = middle;
        }
        Ok([below, above])
    }
}

//! Particles that `nappe update` pulls at, as options have them.

use clap::Args;
use nappe_client::v1;
use nappe_server::numbers::{Least, PLAIN, SECONDS, real};

use crate::{
    options::{
        components::vector,
        particles::{self, Named, Particle},
    },
    words::error::{CliError, Result},
};

/// The word that stands in place of a position where a pull ends.
const END: &str = "end";

/// Which particles are drawn where, and how.
#[derive(Args, Debug)]
pub(crate) struct PullArgs {
    /// Draw a particle of a cloth, by its number there or its name, to a position (m), with --frequency, --most and --for; `end`
    /// in place of the position ends its pull, or with `all` in place of the particle those of the whole body
    #[arg(long, value_name = "BODY:PARTICLE=X,Y,Z", value_parser = pull)]
    pull: Vec<Pull>,
    /// How fast a pull draws (1/s): at most 0.5 divided by the time step
    #[arg(long, value_name = "W", value_parser = real(PLAIN, Least::Above0), requires = "pull")]
    frequency: Option<f64>,
    /// The acceleration that a pull gives at most (m/s^2)
    #[arg(long, value_name = "A", value_parser = real(PLAIN, Least::Above0), requires = "pull")]
    most: Option<f64>,
    /// Simulated time after which a pull ends, at most 10
    #[arg(long = "for", value_name = "SECONDS", value_parser = real(SECONDS, Least::Above0), requires = "pull")]
    seconds: Option<f64>,
}

/// A particle that is drawn somewhere, or no longer.
#[derive(Clone, Debug, PartialEq)]
struct Pull {
    body: String,
    /// None: all of them, whose pulls end.
    particle: Option<Particle>,
    /// None: the pull ends.
    point: Option<v1::Vector3>,
}

impl PullArgs {
    /// Whether nothing is pulled at, nor let go.
    pub(crate) fn is_empty(&self) -> bool {
        self.pull.is_empty()
    }

    /// The changes, of which the session may have to say which particles are meant.
    ///
    /// # Errors
    /// When a number is missing, there is no such particle, or the session does not say.
    pub(crate) async fn updates(&self, session: &mut Named<'_>) -> Result<Vec<v1::PullUpdate>> {
        let mut updates = Vec::new();
        for pull in &self.pull {
            updates.push(self.update(pull, session).await?);
        }
        Ok(updates)
    }

    async fn update(&self, pull: &Pull, session: &mut Named<'_>) -> Result<v1::PullUpdate> {
        let Pull { body, particle, point } = pull;
        let on = match particle {
            None => Vec::new(),
            Some(Particle::Number(number)) => vec![*number],
            Some(name) => name.on(particles::body(session.topology().await?, Some(body), name)?)?,
        };
        let particles_u32: Vec<u8> = on.iter().flat_map(|particle| particle.to_le_bytes()).collect();
        let update = v1::PullUpdate {
            body: body.clone(),
            particles_u32: particles_u32.into(),
            ..v1::PullUpdate::default()
        };
        let Some(v1::Vector3 { x, y, z }) = *point else { return Ok(update) };
        let (Some(frequency), Some(most), Some(seconds)) = (self.frequency, self.most, self.seconds) else {
            let words = "--pull draws with a frequency, at most so hard, for a time: it needs --frequency, --most and --for";
            return Err(CliError::usage(words));
        };
        let points_f64: Vec<u8> = on.iter().flat_map(|_| [x, y, z]).flat_map(f64::to_le_bytes).collect();
        Ok(v1::PullUpdate { points_f64: points_f64.into(), frequency, most, seconds, ..update })
    }
}

fn pull(text: &str) -> std::result::Result<Pull, String> {
    let parts = text.rsplit_once('=').and_then(|(on, point)| Some((on.rsplit_once(':')?, point)));
    let ((body, particle), point) = parts.ok_or("a pull is BODY:PARTICLE=X,Y,Z or BODY:PARTICLE=end")?;
    let point = if point == END { None } else { Some(vector(point)?) };
    let particle = match particle {
        "all" if point.is_none() => None,
        "all" => {
            return Err("all particles of a body are let go, by all=end, and not drawn to one point".into());
        }
        particle => Some(Particle::parse(particle)?),
    };
    Ok(Pull { body: body.to_owned(), particle, point })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pull_names_a_particle_and_a_point_or_its_end() {
        let point = Some(v1::Vector3 { x: 0.0, y: -1.0, z: 2.0 });
        let drawn = Pull { body: "a:b".to_owned(), particle: Some(Particle::Number(7)), point };
        assert_eq!(pull("a:b:7=0,-1,2"), Ok(drawn.clone()));
        assert_eq!(pull("a:b:7=end"), Ok(Pull { point: None, ..drawn.clone() }));
        assert_eq!(pull("a:b:all=end"), Ok(Pull { particle: None, point: None, ..drawn }));
        for wrong in
            ["sheet=1,2,3", "sheet:1", "sheet:x=1,2,3", "sheet:1=1,2", "sheet:1=nan,0,0", "sheet:all=0,0,0"]
        {
            assert!(pull(wrong).is_err(), "{wrong}");
        }
    }
}

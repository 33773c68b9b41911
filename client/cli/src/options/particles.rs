//! Particles as the command line names them: by their numbers, or by the names that scenes have for them.
//!
//! Enters: a word, and what a session is made of. Leaves: numbers. A session keeps no names, and needs none: they follow
//! from how the triangles of a grid or the springs of a chain join the particles.

use std::{collections::BTreeSet, fmt};

use nappe_client::{Body, Client, Event, Frame, Topology, WatchOptions, v1};
use nappe_scene::{Layout, suggestion};
use nappe_sim::mesh::grid_triangles;

use crate::words::error::{CliError, Result};

/// A particle, or those of a name, on a body that is said elsewhere.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Particle {
    /// The number that the body or the scene gives it, from 0.
    Number(u32),
    /// A name: `top_left`, `top`, `first`.
    Name(String),
}

impl Particle {
    /// A number or a name.
    ///
    /// # Errors
    /// What is neither, with the nearest name or all of them.
    pub(crate) fn parse(text: &str) -> std::result::Result<Self, String> {
        let text = text.trim();
        if let Ok(number) = text.parse() {
            return Ok(Self::Number(number));
        }
        if Layout::names().any(|name| name == text) {
            return Ok(Self::Name(text.to_owned()));
        }
        let near = suggestion(text, Layout::names());
        Err(format!("'{text}' is not a particle's number (0, 1, 2 ...) and no name of one; {near}"))
    }

    /// The particles that it means on a body of `count` that are numbered so.
    ///
    /// # Errors
    /// What it is, and what there is: `is 12; allowed: 0 to 8`.
    pub(crate) fn among(&self, layout: Layout, count: usize) -> std::result::Result<Vec<u32>, String> {
        match self {
            Self::Number(number) if (*number as usize) < count => Ok(vec![*number]),
            Self::Number(number) => Err(format!("is {number}; allowed: 0 to {}", count.saturating_sub(1))),
            Self::Name(name) => layout.particles(name, count),
        }
    }

    /// The particles that it means on a body of a session, by their numbers there.
    ///
    /// # Errors
    /// When the body has no such particle.
    pub(crate) fn on(&self, body: &Body) -> Result<Vec<u32>> {
        let own = |index: u32| index - body.first_particle as u32;
        let triangles: Vec<[u32; 3]> = body.triangles.iter().map(|corners| corners.map(own)).collect();
        let springs: Vec<[u32; 2]> = body.springs.iter().map(|ends| ends.map(own)).collect();
        let count = body.particle_count;
        let found = self.among(layout(count, triangles, springs), count);
        found.map_err(|message| CliError::usage(format!("the particle of body '{}' {message}", body.name)))
    }
}

impl fmt::Display for Particle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Name(name) => f.write_str(name),
        }
    }
}

/// What a session is made of, and its newest frame.
///
/// # Errors
/// When there is no such session, or the connection breaks.
async fn seen(client: &Client, session_id: &str) -> Result<(Topology, Frame)> {
    let mut stream = client.watch(session_id, WatchOptions::default()).await?;
    let mut found = None;
    while let Some(event) = stream.next().await {
        match (event?, found.take()) {
            (Event::Topology(topology), _) => found = Some(topology),
            (Event::Frame(frame), Some(topology)) => return Ok((topology, frame)),
            (_, before) => found = before,
        }
    }
    Err(CliError::failure(format!("session {session_id} ended before it said what it is made of")))
}

/// What a session is made of, asked for once a name needs it.
pub(crate) struct Named<'a> {
    client: &'a Client,
    id: &'a str,
    found: Option<(Topology, Frame)>,
}

impl<'a> Named<'a> {
    /// A session that was asked for nothing yet.
    pub(crate) fn new(client: &'a Client, id: &'a str) -> Self {
        Self { client, id, found: None }
    }

    async fn seen(&mut self) -> Result<&(Topology, Frame)> {
        if self.found.is_none() {
            self.found = Some(Box::pin(seen(self.client, self.id)).await?);
        }
        Ok(self.found.as_ref().expect("it was found"))
    }

    /// What it is made of.
    ///
    /// # Errors
    /// When there is no such session, or the connection breaks.
    pub(crate) async fn topology(&mut self) -> Result<&Topology> {
        Ok(&self.seen().await?.0)
    }

    /// How far a particle is from a point (m), as the newest frame has it; 0 for one that there is not, which the server refuses.
    ///
    /// # Errors
    /// As [`Self::topology`].
    pub(crate) async fn distance(&mut self, particle: u32, point: v1::Vector3) -> Result<f64> {
        let (_, frame) = self.seen().await?;
        let there = [point.x, point.y, point.z];
        let far = |here: [f64; 3]| here.iter().zip(there).map(|(a, b)| (b - a).powi(2)).sum::<f64>().sqrt();
        Ok(frame.positions.get(particle as usize).map_or(0.0, far))
    }
}

/// The body of a name; without one, the only body that has the name of a particle.
///
/// # Errors
/// When there is none, or several have it.
pub(crate) fn body<'a>(session: &'a Topology, name: Option<&str>, particle: &Particle) -> Result<&'a Body> {
    if let Some(name) = name {
        let near = suggestion(name, session.bodies.iter().map(|body| body.name.as_str()));
        let found = session.bodies.iter().find(|body| body.name == name);
        return found.ok_or_else(|| CliError::usage(format!("no body is named '{name}'; {near}")));
    }
    let having: Vec<&Body> = session.bodies.iter().filter(|body| particle.on(body).is_ok()).collect();
    match having.as_slice() {
        [body] => Ok(*body),
        [] => {
            let pins: Vec<String> =
                session.bodies.iter().flat_map(|body| &body.pins).map(u32::to_string).collect();
            let message =
                format!("no body has a particle '{particle}': those of grids and chains have names");
            Err(CliError::usage(message)
                .hint(format!("pinned particles, by their numbers: {}", first(&pins))))
        }
        several => {
            let ways: Vec<String> = several.iter().map(|body| format!("{}:{particle}", body.name)).collect();
            Err(CliError::usage(format!("several bodies have a particle '{particle}': {}", first(&ways))))
        }
    }
}

/// At most ten of a list.
fn first(words: &[String]) -> String {
    let more = if words.len() > 10 { ", ..." } else { "" };
    let shown: Vec<&str> = words.iter().take(10).map(String::as_str).collect();
    if shown.is_empty() { "none".to_owned() } else { format!("{}{more}", shown.join(", ")) }
}

/// How the particles of a body are numbered: as a grid or a chain if triangles or springs join them so.
pub(crate) fn layout(count: usize, triangles: Vec<[u32; 3]>, springs: Vec<[u32; 2]>) -> Layout {
    let Some([_, _, below]) = triangles.first() else {
        let links: BTreeSet<[u32; 2]> = springs.into_iter().collect();
        let is_chain = count > 1 && (1..count as u32).all(|end| links.contains(&[end - 1, end]));
        return if is_chain { Layout::Chain } else { Layout::Free };
    };
    // The first triangle has two particles of the top row and one of the row below.
    let columns = *below as usize;
    let rows = count.checked_div(columns).unwrap_or(0);
    let is_grid = columns * rows == count && sorted(triangles) == sorted(grid_triangles(columns, rows));
    if is_grid { Layout::Grid { columns: columns as u32, rows: rows as u32 } } else { Layout::Free }
}

/// The same triangles, whatever the order in which they and their corners came.
fn sorted(mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    for corners in &mut triangles {
        corners.sort_unstable();
    }
    triangles.sort_unstable();
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(name: &str, first_particle: usize, columns: usize, rows: usize) -> Body {
        let triangles = grid_triangles(columns, rows);
        let begin = first_particle as u32;
        Body {
            name: name.to_owned(),
            first_particle,
            particle_count: columns * rows,
            triangles: triangles.into_iter().map(|[a, b, c]| [a + begin, b + begin, c + begin]).collect(),
            springs: Vec::new(),
            pins: vec![begin],
            uv: Vec::new(),
            color: None,
            masses: Vec::new(),
            volumes: Vec::new(),
        }
    }

    fn named(name: &str) -> Particle {
        Particle::parse(name).expect(name)
    }

    #[test]
    fn names_follow_from_triangles_and_springs() {
        let mut grid = sheet("sheet", 7, 4, 3);
        // The order of triangles says nothing of how particles are numbered.
        let last = grid.triangles.len() - 1;
        grid.triangles.swap(1, last);
        assert_eq!(named("top_right").on(&grid).expect("a corner"), [3]);
        assert_eq!(named("bottom").on(&grid).expect("a side"), [8, 9, 10, 11]);
        assert!(named("first").on(&grid).is_err_and(|error| error.message.contains("allowed: top_left")));
        let springs = vec![[7, 8], [8, 9], [7, 9]];
        let rope = Body { particle_count: 3, triangles: Vec::new(), springs, ..sheet("rope", 7, 2, 2) };
        assert_eq!(named("last").on(&rope).expect("an end"), [2]);
        let mut free = sheet("free", 0, 3, 3);
        free.triangles.pop();
        assert!(named("top").on(&free).is_err_and(|error| error.message.contains("grids and chains")));
        assert!(named("9").on(&free).is_err_and(|error| error.message.contains("allowed: 0 to 8")));
    }

    #[test]
    fn a_name_that_several_bodies_have_needs_a_body() {
        let bodies = vec![sheet("a", 0, 3, 3), sheet("b", 9, 2, 2)];
        let session = Topology { id: 1, particle_count: 13, bodies, colliders: Vec::new() };
        let body =
            |name, particle: &str| body(&session, name, &named(particle)).map(|body| body.name.as_str());
        assert!(body(None, "top").is_err_and(|error| error.message.contains("a:top, b:top")));
        assert!(body(Some("b"), "top").is_ok_and(|name| name == "b"));
        assert!(body(Some("aa"), "top").is_err_and(|error| error.message.contains("did you mean 'a'?")));
        assert!(body(None, "last").is_err_and(|error| error.hint.is_some_and(|hint| hint.contains("0, 9"))));
    }

    #[test]
    fn what_is_no_particle_says_what_is_near() {
        assert!(Particle::parse("top_lft").is_err_and(|error| error.contains("did you mean 'top_left'?")));
        assert!(Particle::parse("-1").is_err_and(|error| error.contains("0, 1, 2 ...")));
        assert_eq!(Particle::parse(" 12"), Ok(Particle::Number(12)));
    }
}

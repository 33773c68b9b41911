//! The snow's grid to Rerun: its mass as smoke, its velocities on a slice as arrows.
//!
//! Enters: the `GridFrame` of a frame. Leaves: a point at each node, the larger and lighter the more mass it carries,
//! and, when all nodes lie in one plane, an arrow at each. Scales grow with what was seen so far in the recording,
//! so that frames can be compared.

use nappe_client::GridFrame;

use crate::{
    error::{RerunError, refused},
    geometry::length,
    sdk::{Arrows3D, Color, Points3D, Radius, RecordingStream},
};

const SMOKE_PATH: &str = "world/grid/mass";
const ARROWS_PATH: &str = "world/grid/velocity";
const SMOKE_COLOR: [u8; 3] = [186, 204, 226];
/// Alpha of a node without mass, of 255; the heaviest has 255. Viewers that draw points without transparency
/// take alpha as brightness: against the dark background a light node fades all the same.
const FAINTEST: f32 = 24.0;
/// Radius of the heaviest node over the distance of the nodes sent.
const SMOKE_RADIUS: f32 = 0.6;
/// Radius of the lightest node over that of the heaviest.
const SMALLEST: f32 = 0.12;
const ARROW_COLOR: [u8; 3] = [240, 180, 70];
/// Length of the longest arrow over the distance of the nodes sent.
const ARROW_LENGTH: f32 = 2.0;
const ARROW_RADIUS: f32 = 0.06;

/// The grid of a recording.
#[derive(Debug, Default)]
pub(crate) struct GridView {
    largest_mass: f32,
    largest_speed: f32,
    /// Arrows were drawn: a frame without any must clear them.
    has_arrows: bool,
}

impl GridView {
    /// Logs the grid at the stream's current time. Nodes with a number that is not finite are left out.
    pub(crate) fn log(&mut self, stream: &RecordingStream, grid: &GridFrame) -> Result<(), RerunError> {
        let nodes: Vec<Node> = nodes(grid);
        self.largest_mass = nodes.iter().map(|node| node.mass).fold(self.largest_mass, f32::max);
        let spacing = (grid.cell * f64::from(grid.stride)) as f32;
        let smoke = Points3D::new(nodes.iter().map(|node| node.position))
            .with_radii(nodes.iter().map(|node| spacing * self.smoke_radius(node.mass)))
            .with_colors(nodes.iter().map(|node| self.smoke_color(node.mass)));
        stream.log(SMOKE_PATH, &smoke).map_err(refused(SMOKE_PATH))?;

        let arrows: &[Node] = if is_plane(&grid.indices) { &nodes } else { &[] };
        if arrows.is_empty() && !self.has_arrows {
            return Ok(());
        }
        self.has_arrows = true;
        self.largest_speed = arrows.iter().map(Node::speed).fold(self.largest_speed, f32::max);

        let scale = if self.largest_speed > 0.0 { ARROW_LENGTH * spacing / self.largest_speed } else { 0.0 };

        let [red, green, blue] = ARROW_COLOR;
        let arrows = Arrows3D::from_vectors(arrows.iter().map(|node| node.velocity.map(|c| scale * c)))
            .with_origins(arrows.iter().map(|node| node.position))
            .with_radii([Radius::new_scene_units(ARROW_RADIUS * spacing)])
            .with_colors([Color::from_rgb(red, green, blue)]);
        stream.log(ARROWS_PATH, &arrows).map_err(refused(ARROWS_PATH))
    }

    /// Share of the largest mass, 0 to 1.
    fn share(&self, mass: f32) -> f32 {
        if self.largest_mass > 0.0 { mass / self.largest_mass } else { 0.0 }
    }

    /// Radius over the distance of nodes: the volume of the ball follows the mass.
    fn smoke_radius(&self, mass: f32) -> f32 {
        SMOKE_RADIUS * self.share(mass).cbrt().max(SMALLEST)
    }

    fn smoke_color(&self, mass: f32) -> Color {
        let [red, green, blue] = SMOKE_COLOR;
        let alpha = FAINTEST + self.share(mass) * (255.0 - FAINTEST);
        Color::from_unmultiplied_rgba(red, green, blue, alpha as u8)
    }
}

/// A node that can be drawn.
#[derive(Debug)]
struct Node {
    position: [f32; 3],
    mass: f32,
    velocity: [f32; 3],
}

impl Node {
    fn speed(&self) -> f32 {
        length(self.velocity)
    }
}

fn nodes(grid: &GridFrame) -> Vec<Node> {
    let numbers = grid.masses.iter().zip(&grid.velocities);
    grid.positions()
        .zip(numbers)
        .map(|(position, (&mass, &velocity))| Node { position, mass, velocity })
        .filter(|node| {
            let finite = node.position.iter().chain(&node.velocity).all(|c| c.is_finite());
            finite && node.speed().is_finite() && node.mass.is_finite() && node.mass > 0.0
        })
        .collect()
}

/// True if all nodes have one index in common: a slice. Snow is never as thin by itself, since a particle
/// reaches several nodes along each axis.
fn is_plane(indices: &[[i32; 3]]) -> bool {
    let Some(first) = indices.first() else { return false };
    (0..3).any(|axis| indices.iter().all(|index| index[axis] == first[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_is_known_by_its_nodes() {
        assert!(is_plane(&[[1, 5, 0], [2, 5, 3], [-4, 5, 9]]));
        assert!(!is_plane(&[[1, 5, 0], [2, 5, 3], [-4, 6, 9]]));
        assert!(!is_plane(&[]));
    }

    #[test]
    fn the_heaviest_node_is_the_largest_and_the_brightest() {
        let view = GridView { largest_mass: 8.0, ..GridView::default() };
        assert_eq!(view.smoke_radius(8.0).to_bits(), SMOKE_RADIUS.to_bits());
        assert!((view.smoke_radius(1.0) - 0.5 * SMOKE_RADIUS).abs() < 1e-6);
        assert_eq!(view.smoke_color(8.0), Color::from_unmultiplied_rgba(186, 204, 226, 255));
        assert!(view.smoke_radius(1e-9) > 0.0);
    }

    #[test]
    fn a_node_without_a_number_is_left_out() {
        let grid = GridFrame {
            cell: 1.0,
            stride: 1,
            indices: vec![[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]],
            masses: vec![1.0, f32::NAN, 1.0, 0.0],
            velocities: vec![[0.0; 3], [0.0; 3], [f32::INFINITY, 0.0, 0.0], [0.0; 3]],
            forces: Vec::new(),
            node_count: 4,
        };
        let positions: Vec<[f32; 3]> = nodes(&grid).iter().map(|node| node.position).collect();
        assert_eq!(positions, [[0.0; 3]]);
    }
}

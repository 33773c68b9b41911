//! Strips of a plate, one cell wide and clamped at one end, that hang as an elastica: where their tips rest.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Network, SpringLaw, SpringRules},
    linalg::Stop,
};
use nappe_tests::{
    Scene,
    flat::{Diagonals, grid},
    golden::Row,
    statics::equilibrium,
};

const GRAVITY: f64 = 9.81;
/// What each of the two particles of a column weighs (N) in a strip under its own weight; those of the tip have half a cell.
const WEIGHT: f64 = 1e-4;

/// Spacing of a strip (m), which is one cell wide.
pub(crate) const CELL: f64 = 0.01;

/// A strip, clamped between its first two columns, by its cells, its diagonals, and what each particle weighs (N).
pub(crate) struct Strip {
    pub(crate) cells: usize,
    pub(crate) diagonals: Diagonals,
    pub(crate) weight: fn(usize, usize) -> f64,
}

impl Strip {
    /// Length from the clamp, which holds the first half of a cell (m).
    pub(crate) fn length(&self) -> f64 {
        (self.cells as f64 - 0.5) * CELL
    }

    /// One under its own weight.
    pub(crate) fn heavy(cells: usize, diagonals: Diagonals) -> Self {
        Self { cells, diagonals, weight: |column, cells| if column == cells { 0.5 * WEIGHT } else { WEIGHT } }
    }

    /// The bending stiffness (N m) with which one under its own weight has a Gamma.
    pub(crate) fn stiffness(&self, gamma: f64) -> f64 {
        2.0 * WEIGHT / CELL * self.length().powi(3) / (gamma * CELL)
    }

    /// How far from its place in the table (in its length) the tip of one under its own weight rests, of a Gamma; it begins as one of
    /// another Gamma hangs.
    pub(crate) fn error(&self, rows: &[Row], [gamma, start]: [f64; 2]) -> f64 {
        // A step is about 1 / omega of the lowest mode.
        let tip = self.tip(self.stiffness(gamma), hung(rows, start), 0.07 * gamma.sqrt());
        off(tip, hung(rows, gamma))
    }

    /// Where its tip rests, of this bending stiffness (N m): away from the clamp and below it, in its length. It starts as a strip
    /// hangs under its own weight, of a row of the table, and settles in steps of `dt` (s).
    pub(crate) fn tip(&self, stiffness: f64, start: &Row, dt: f64) -> [f64; 2] {
        self.tip_of(&equilibrium(&self.scene(stiffness, start), dt, 60))
    }

    /// The strip of this bending stiffness (N m), as one hangs under its own weight by a row of the table.
    pub(crate) fn scene(&self, stiffness: f64, start: &Row) -> Scene {
        let mesh = grid([self.cells, 1], CELL, self.diagonals);
        let stretch = SpringLaw { stiffness: 1e5, damping: 0.0 };
        let mut network = Network::from_mesh(&mesh, &SpringRules { stretch, shear: None, bend: None }, 0.0);
        let law = SpringLaw { stiffness, damping: 0.0 };
        network.elements = vec![ElementList::new(ElementKind::Plate, law, &mesh)];
        let (columns, length) = (self.cells + 1, self.length());
        let places = heavy_strip(start, self.cells);
        for point in 0..2 * columns {
            let column = point % columns;
            network.masses[point] = (self.weight)(column, self.cells) / GRAVITY;
            if column < 2 {
                network.pins.push(point as u32);
            } else {
                let [along, below] = places[column];
                (network.x[point][0], network.x[point][1]) = (0.5 * CELL + length * along, -length * below);
            }
        }
        let mut scene = Scene::new(network, 0.1).under([0.0, -GRAVITY, 0.0]);
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-12, max_iterations: 4000 };
        scene
    }

    /// Where the tip is among positions (m): away from the clamp and below it, in the length.
    pub(crate) fn tip_of(&self, x: &[[f64; 3]]) -> [f64; 2] {
        let (columns, length) = (self.cells + 1, self.length());
        let [one, other] = [x[self.cells], x[columns + self.cells]];
        [(0.5 * (one[0] + other[0]) - 0.5 * CELL) / length, -0.5 * (one[1] + other[1]) / length]
    }
}

/// How far a tip is from that of a row of the table.
pub(crate) fn off([away, below]: [f64; 2], row: &Row) -> f64 {
    (away - row.number("W_over_L")).hypot(below - row.number("H_over_L"))
}

/// Places of the columns of a strip of unit length that hangs as a row says: theta'' = -Gamma (1 - s) cos theta, from the
/// curvature at the clamp.
fn heavy_strip(row: &Row, cells: usize) -> Vec<[f64; 2]> {
    const SHARES: usize = 64;
    let (gamma, cell) = (row.number("Gamma"), 1.0 / (cells as f64 - 0.5));
    let step = cell / SHARES as f64;
    let (mut s, mut theta, mut curvature) = (0.0, 0.0_f64, row.number("kappa_clamp_times_L"));
    let (mut place, mut places) = ([0.0; 2], vec![[0.0; 2]]);
    for share in 0..cells * SHARES - SHARES / 2 {
        let half = theta + 0.5 * step * curvature;
        curvature -= step * gamma * (1.0 - s - 0.5 * step) * half.cos();
        place = [place[0] + step * half.cos(), place[1] + step * half.sin()];
        (s, theta) = (s + step, half + 0.5 * step * curvature);
        if (share + 1) % SHARES == SHARES / 2 {
            places.push(place);
        }
    }
    places
}

/// The row of a Gamma.
pub(crate) fn hung(rows: &[Row], gamma: f64) -> &Row {
    rows.iter().find(|row| row.number("Gamma") == gamma).expect("a row of the table")
}

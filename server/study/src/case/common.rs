//! Points that a case and a coarser copy of it have in common, and how far apart they are there.
//!
//! Enters: both cases. Leaves: distances (m) between their states.

use std::collections::BTreeMap;

use super::Case;

/// Points of a coarser copy: its free particles, each with what stands for it in the fine case.
#[derive(Clone, Debug, PartialEq)]
pub struct CommonPoints {
    points: Vec<Point>,
}

/// A particle of the coarser copy.
#[derive(Clone, Debug, PartialEq)]
struct Point {
    particle: usize,
    /// Particles of the fine case, with shares that add up to 1.
    shares: Vec<(usize, f64)>,
    /// What is added to where the shares put it (m).
    offset: [f64; 3],
}

impl CommonPoints {
    /// Of cloth: a particle of the copy lies between up to four particles of the grid in place of which its own is, by its share of the
    /// length of both sides. For each body the columns and rows of the fine grid and of the coarser one, `[fine, coarse]`; a chain has
    /// one row. None where these are not the bodies of the cases.
    pub fn of_cloth(fine: &Case, coarse: &Case, grids: &[[[u32; 2]; 2]]) -> Option<Self> {
        let mut begins = [0; 2];
        let mut points = Vec::new();
        for [of_fine, of_coarse] in grids {
            let [columns, rows] = *of_coarse;
            for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
                let particle = begins[1] + index(columns, row, column);
                if coarse.is_free(particle)? {
                    let shares = shares(*of_fine, *of_coarse, [column, row], begins[0]);
                    points.push(Point { particle, shares, offset: [0.0; 3] });
                }
            }
            // An index past the last row is the count.
            begins[0] += index(of_fine[0], of_fine[1], 0);
            begins[1] += index(columns, rows, 0);
        }
        (begins == [fine.particle_count(), coarse.particle_count()]).then_some(Self { points })
    }

    /// Of snow: particles of the copy lie elsewhere in the same objects. Each particle of the fine case belongs to the nearest one of the
    /// copy, within a cell of its grid, as they lie at the start. What moves a particle of the copy is compared with what moves those
    /// that belong to it in the mean; one without any is left out. None where the cases are not snow of the same objects.
    pub fn of_snow(fine: &Case, coarse: &Case) -> Option<Self> {
        let [of_fine, of_coarse] = [fine.setup.snow.as_ref()?, coarse.setup.snow.as_ref()?];
        let cell = of_coarse.settings.cell;
        let mut begins = [0; 2];
        let mut points = Vec::new();
        for (fine, coarse) in of_fine.objects.iter().zip(&of_coarse.objects) {
            let groups = grouped(&fine.x, &coarse.x, cell);
            for (i, group) in groups.into_iter().enumerate().filter(|(_, group)| !group.is_empty()) {
                let share = 1.0 / group.len() as f64;
                let mean = |axis: usize| group.iter().map(|j| share * fine.x[*j][axis]).sum::<f64>();
                let offset = [0, 1, 2].map(|axis| coarse.x[i][axis] - mean(axis));
                let shares = group.iter().map(|j| (begins[0] + j, share)).collect();
                points.push(Point { particle: begins[1] + i, shares, offset });
            }
            begins[0] += fine.x.len();
            begins[1] += coarse.x.len();
        }
        (of_fine.objects.len() == of_coarse.objects.len()).then_some(Self { points })
    }

    /// Of a case and a coarser copy of it, whose cloths have these grids, as [`Self::of_cloth`] takes them. None where they have no point
    /// in common.
    pub fn between(fine: &Case, coarse: &Case, grids: &[[[u32; 2]; 2]]) -> Option<Self> {
        let points =
            if fine.is_snow() { Self::of_snow(fine, coarse) } else { Self::of_cloth(fine, coarse, grids) };
        points.filter(|points| points.count() > 0)
    }

    /// How many there are.
    pub const fn count(&self) -> usize {
        self.points.len()
    }

    /// How far (m) what is compared of one run is from what is compared of a run of this case: at the points in common where they are
    /// given, as the one is of a coarser copy then, unless a number is compared.
    pub(crate) fn apart(points: Option<&Self>, case: &Case, observed: &[f64], known: &[f64]) -> f64 {
        match points {
            Some(points) if case.measure().is_of_positions() => points.rms(observed, known),
            _ => case.distance(observed, known),
        }
    }

    /// Root of the mean square over the points of how far (m) a state of the coarser copy is from a state of the fine case.
    pub fn rms(&self, coarse: &[f64], fine: &[f64]) -> f64 {
        let square = |Point { particle, shares, offset }: &Point| {
            let along = |axis: usize| {
                let there: f64 = shares.iter().map(|(i, share)| share * fine[3 * i + axis]).sum();
                (coarse[3 * particle + axis] - there - offset[axis]).powi(2)
            };
            along(0) + along(1) + along(2)
        };
        let sum: f64 = self.points.iter().map(square).sum();
        if self.points.is_empty() { 0.0 } else { (sum / self.points.len() as f64).sqrt() }
    }
}

/// The index of a particle of a grid in its body.
const fn index(columns: u32, row: u32, column: u32) -> usize {
    row as usize * columns as usize + column as usize
}

/// The particles of a fine grid around a particle of a coarse one, `[column, row]`, from a first one on, with their shares.
fn shares(fine: [u32; 2], coarse: [u32; 2], at: [u32; 2], begin: usize) -> Vec<(usize, f64)> {
    let along = |axis: usize| {
        let [gaps, of_coarse] = [fine, coarse].map(|counts| f64::from(counts[axis].saturating_sub(1)));
        let place = if of_coarse > 0.0 { f64::from(at[axis]) * gaps / of_coarse } else { 0.0 };
        let before = place.floor().min((gaps - 1.0).max(0.0));
        let share = place - before;
        [(before as u32, 1.0 - share), (before as u32 + 1, share)]
    };
    let [columns, rows] = [along(0), along(1)];
    let all = rows.into_iter().flat_map(|row| columns.map(|column| (row, column)));
    let shared =
        all.map(|((row, down), (column, across))| (begin + index(fine[0], row, column), down * across));
    shared.filter(|(_, share)| *share > 0.0).collect()
}

/// For each of some points which of others are nearer to it than to any other, and nearer than a cell of this side (m).
fn grouped(others: &[[f64; 3]], points: &[[f64; 3]], cell: f64) -> Vec<Vec<usize>> {
    let place = |x: &[f64; 3]| x.map(|c| (c / cell).floor() as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (i, x) in points.iter().enumerate() {
        cells.entry(place(x)).or_default().push(i);
    }
    let mut groups = vec![Vec::new(); points.len()];
    for (j, x) in others.iter().enumerate() {
        let [a, b, c] = place(x);
        let near =
            (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [a + i, b + j, c + k])));
        let square = |i: usize| (0..3).map(|axis| (points[i][axis] - x[axis]).powi(2)).sum::<f64>();
        let candidates = near.filter_map(|place| cells.get(&place)).flatten().map(|i| (square(*i), *i));
        let nearest = candidates.min_by(|(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
        if let Some((distance, i)) = nearest
            && distance <= cell * cell
        {
            groups[i].push(j);
        }
    }
    groups
}

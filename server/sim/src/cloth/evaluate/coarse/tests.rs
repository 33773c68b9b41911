//! The matrix on the coarse space, against products with the functions that span it.

use crate::{
    cloth::{
        ClothSettings, ElementKind, ElementList, Model, Network, Spring, SpringLaw, SpringRules,
        evaluate::{Evaluated, step_matrix::StepMatrix},
        settings::Purpose,
    },
    interrupt::Interrupt,
    linalg::{CoarseLayout, LinearOperator, PreconditionerKind, SolverSettings},
    math::{LANES, Padded, Real, Sixteen, Vec3},
    mesh::TriangleMesh,
    surroundings::Surroundings,
};

const BLOCK_SIZE: usize = 32;

/// A sheet of several blocks with springs and elements, some particles pinned, one block of them nearly whole.
fn sheet(sides: [usize; 2]) -> Network {
    let mesh = TriangleMesh::grid(sides[0], sides[1], 0.1);
    let law = SpringLaw { stiffness: 300.0, damping: 0.2 };
    let rules = SpringRules { stretch: law, shear: Some(law), bend: Some(law) };
    let mut network = Network::from_mesh(&mesh, &rules, 0.01);
    network.elements = vec![ElementList::new(
        ElementKind::QuadraticBending,
        SpringLaw { stiffness: 0.5, damping: 0.01 },
        &mesh,
    )];
    network.drag = 0.03;
    network.pins = (0..35).chain([77]).collect();
    network
}

fn surroundings(interrupt: &Interrupt) -> Surroundings<'_> {
    let (gravity, wind) = ([0.0; 3], [0.0; 3]);
    Surroundings { dt: 0.02, gravity, wind, colliders: &[], time: 0.0, steps: 1.0, interrupt }
}

/// The sheet above itself, joined along a side.
fn layers() -> Network {
    let [mut network, other] = [sheet([13, 11]), sheet([13, 11])];
    let first = network.x.len() as u32;
    network.x.extend(other.x.iter().map(|[x, y, z]| [*x, y + 0.02, *z]));
    network.v.extend(other.v);
    network.masses.extend(other.masses);
    for mut link in other.springs.iter().copied() {
        link.particles = link.particles.map(|particle| particle + first);
        network.springs.push(link);
    }
    let seam = network.springs[0];
    network.springs.extend((100..110_u32).map(|i| Spring {
        particles: [i, first + i],
        rest_length: 0.0,
        ..seam
    }));
    network
}

/// Largest difference between the projected matrix and products, over the largest entry; and aggregates per block.
fn error<R: Real>(network: &Network) -> (f64, usize) {
    let solver = SolverSettings { preconditioner: PreconditionerKind::TwoLevel, ..SolverSettings::default() };
    let settings = ClothSettings { solver, block_size: BLOCK_SIZE, ..ClothSettings::default() };
    let (model, parameters, _) = Model::<R>::new(network, &settings).expect("a good network");
    let crumpled: Vec<[f64; 3]> = network
        .x
        .iter()
        .enumerate()
        .map(|(i, [x, y, z])| [x * 0.9, y + 0.01 * (i * i % 7) as f64, z + 0.005 * (i % 5) as f64])
        .collect();
    let x = model.arrange(&crumpled);
    let v = model.arrange(&network.v);

    let mut evaluated = Evaluated::<R>::default();
    let purpose = Purpose::of(&settings);
    evaluated.size_for(&model, purpose);
    let interrupt = &Interrupt::default();
    let around = surroundings(interrupt);
    evaluated.numbers.refresh(&model, &parameters, &settings, &around, (around.whole(), 0.0));
    evaluated.evaluation.look(&model, &evaluated.numbers, purpose, [&x, &v], &evaluated.scratches);
    let Evaluated { numbers, evaluation, scratches, .. } = &evaluated;
    let matrix = StepMatrix::new((&model, numbers), &x, evaluation, scratches, interrupt);
    let layout = model.coarse.as_ref().expect("the settings ask for it");

    let (mut error, mut largest) = (0.0, 0.0);
    for block in 0..model.count.div_ceil(BLOCK_SIZE) {
        let mut found = vec![[[0.0; 12]; 9]; layout.neighbours(block).len()];
        matrix.project(layout, block, &mut found);
        for column_aggregate in 0..layout.len() {
            for column in 0..9 {
                let expected = product(&matrix, layout, column_aggregate, column);
                for row_aggregate in block * layout.per_block()..(block + 1) * layout.per_block() {
                    let place = layout.find(row_aggregate, column_aggregate);
                    let found = place.map_or([0.0; 12], |place| found[place][column]);
                    for row in 0..12 {
                        let expected = expected[row_aggregate][row];
                        error = f64::max(error, (found[row] - expected).abs());
                        largest = f64::max(largest, expected.abs());
                    }
                }
            }
        }
    }
    assert!(largest > 0.0);
    (error / largest, layout.per_block())
}

/// Pᵀ A times a function of an aggregate, on each aggregate.
fn product<R: Real>(
    matrix: &StepMatrix<'_, R>,
    layout: &CoarseLayout,
    aggregate: usize,
    column: usize,
) -> Vec<[f64; 12]> {
    let count = matrix.model.count;
    let mut p = vec![Padded::default(); matrix.model.m.len()];
    for row in (0..count).filter(|row| layout.aggregate(*row) == aggregate) {
        let mut vector = Vec3::zeros();
        vector[column % 3] = R::of(layout.at(row)[column / 3]);
        p[row] = Padded::new(&vector);
    }
    let mut q = vec![Sixteen::default(); p.len() / LANES];
    for (block, q) in q.chunks_mut(BLOCK_SIZE / LANES).enumerate() {
        matrix.apply(block * BLOCK_SIZE, &p, q);
    }

    let mut sums = vec![[0.0; 12]; layout.len()];
    for row in 0..count {
        let (functions, q) = (layout.at(row), q[row / LANES].get(row % LANES));
        for m in 0..3 {
            for c in 0..3 {
                sums[layout.aggregate(row)][4 * m + c] += functions[m] * q[c].to_f64();
            }
        }
    }
    sums
}

#[test]
fn the_projected_matrix_is_what_products_with_its_functions_are() {
    for (network, per_block) in [(sheet([8, 16]), 1..=1), (sheet([13, 11]), 1..=2), (layers(), 2..=4)] {
        let [(single, found), (double, _)] = [error::<f32>(&network), error::<f64>(&network)];
        assert!(per_block.contains(&found), "{found} aggregates per block");
        assert!(double < 1e-13, "{double:e}");
        assert!(single < 1e-6, "{single:e}");
    }
}

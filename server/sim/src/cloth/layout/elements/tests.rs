//! A law that freezes numbers, against a sum over its elements one by one.

use super::{BlockOfRows, ElementFigures, ElementNumbers, Packs};
use crate::{
    cloth::{
        laws::{ElementKind, ElementLaw, Evaluated, Found, Threads, Treatment},
        layout::scratch::{BlockScratch, Scratches},
        network::{ElementList, SpringLaw},
        settings::{Implicit, RightHandSide},
    },
    math::{LANES, Mat3, Pack, Padded, Portable, Vec3, array::dot, three},
    mesh::TriangleMesh,
};

/// Springs as elements of two particles: W = (l - l0)² / 2, of whose second derivative u uᵀ is frozen.
struct Link;

impl ElementLaw<2, 1, 3> for Link {
    fn elements(_: &TriangleMesh, _: &Threads) -> Found<2, 1> {
        Found::default()
    }

    fn evaluate<P: Pack>([rest]: [P; 1], [a, b]: [[P; 3]; 2], _: Treatment<P>) -> Evaluated<P, 2, 3> {
        let d = three!(|c| a[c] - b[c]);
        let length = dot(d, d).sqrt();
        let u = three!(|c| d[c] / length);
        let pull = length - rest;
        let energy = pull.widen() * pull.widen() * 0.5;
        Evaluated {
            energy,
            gradient: [three!(|c| u[c] * pull), three!(|c| P::zero() - u[c] * pull)],
            frozen: u,
            stretch: length / rest,
        }
    }

    fn product<P: Pack>(_: [P; 1], u: [P; 3], [a, b]: [[P; 3]; 2]) -> [[P; 3]; 2] {
        let along = dot(u, three!(|c| a[c] - b[c]));
        [three!(|c| u[c] * along), three!(|c| P::zero() - u[c] * along)]
    }

    fn diagonal<P: Pack>(_: [P; 1], [x, y, z]: [P; 3]) -> [[P; 6]; 2] {
        [[x * x, y * y, z * z, x * y, x * z, y * z]; 2]
    }

    fn shares(_: [f64; 1]) -> [f64; 2] {
        [2.0; 2]
    }
}

const BLOCK_SIZE: usize = 32;
/// Not a multiple of sixteen: the last block has lanes without particles.
const COUNT: usize = 75;

/// Positions and a second field.
fn fields() -> [Vec<Padded<f64>>; 2] {
    let at = |scale: f64| -> Vec<Padded<f64>> {
        let vector = |i: usize| {
            let i = i as f64;
            Vec3::new(0.1 * i, (scale * i * i) % 1.0, (scale * i * i * i) % 0.7)
        };
        (0..COUNT.next_multiple_of(LANES))
            .map(|i| if i < COUNT { Padded::new(&vector(i)) } else { Padded::default() })
            .collect()
    };
    [at(0.37), at(0.59)]
}

/// Each particle with the next and with one far away.
fn pairs() -> Vec<[u32; 2]> {
    let near = (0..COUNT as u32 - 1).map(|i| [i, i + 1]);
    let far = (0..COUNT as u32).map(|i| [i, (i * 29 + 11) % COUNT as u32]);
    near.chain(far).filter(|[a, b]| a != b).collect()
}

fn packs() -> Packs<f64, 2, 1> {
    let pairs = pairs();
    let list = ElementList {
        kind: ElementKind::ALL[0],
        law: SpringLaw { stiffness: 1.0, damping: 0.0 },
        rest: vec![0.3; pairs.len()],
        particles: pairs.into_flattened(),
        bending: None,
        threads: Threads::default(),
    };
    let place: Vec<u32> = (0..COUNT as u32).collect();
    Packs::new(&list, BLOCK_SIZE, &place)
}

/// Rows of a block with its own particles copied, as the springs leave it.
fn with_own(scratch: &mut BlockScratch<f64>, at: &BlockOfRows<'_, f64>) {
    let [x, y] = at.fields;
    for row in 0..at.rows {
        let particle = at.block * BLOCK_SIZE + row;
        scratch.records[row].0 = [x[particle], y[particle]];
    }
    scratch.corners.clear(at.rows);
}

#[test]
fn what_is_frozen_is_what_the_product_and_the_stored_matrix_take() {
    let (packs, [x, v]) = (packs(), fields());
    let numbers = ElementNumbers {
        energy: 2.0,
        gradient: 3.0,
        velocity: 5.0,
        matrix: 7.0,
        elastic: 0.5,
        bounded: [3.0, 0.0],
        is_turning: true,
    };
    let mut scratches = Scratches::default();
    scratches.size_for(1, [BLOCK_SIZE, BLOCK_SIZE, 0], packs.lists.room());
    let (mut frozen, mut sums) =
        (vec![[0.0; LANES]; 3 * packs.lists.particles.len()], ElementFigures::default());
    let (mut rows, mut products) = (Vec::new(), Vec::new());

    for block in 0..COUNT.div_ceil(BLOCK_SIZE) {
        let scratch = &mut *scratches.take();
        let rows_of_block = (x.len() - block * BLOCK_SIZE).min(BLOCK_SIZE);
        let at = BlockOfRows { block, rows: rows_of_block, group: None, fields: [&x, &v] };
        with_own(scratch, &at);
        let range = packs.lists.packs(block);
        let own = &mut frozen[3 * range.start..3 * range.end];
        sums = sums.and(packs.evaluate::<Link, Portable<f64>, 3, Implicit>(
            at,
            &numbers,
            (RightHandSide::Step, 1.0),
            own,
            scratch,
        ));
        let row = |scratch: &BlockScratch<f64>, row: usize| {
            Vec3::from(scratch.corners.sixteen::<Portable<f64>>(row / LANES).map(|c| c.store()[row % LANES]))
        };
        rows.extend((0..rows_of_block).map(|i| row(scratch, i)));
        scratch.corners.clear(rows_of_block);
        packs.multiply::<Link, Portable<f64>, 3>(at, &numbers, own, scratch);
        products.extend((0..rows_of_block).map(|i| row(scratch, i)));
    }

    let mut expected = ([0.0; 3], vec![Vec3::zeros(); x.len()], vec![Vec3::zeros(); x.len()]);
    for [a, b] in pairs() {
        let (a, b) = (a as usize, b as usize);
        let d = x[a].vector() - x[b].vector();
        let (u, pull) = (d.normalize(), d.norm() - 0.3);
        let push = u * u.dot(&(v[a].vector() - v[b].vector()));
        let approach = u.dot(&(v[a].vector() - v[b].vector()));
        let [energy, power, stretch] = expected.0;
        expected.0 = [energy + pull * pull, power - 3.0 * pull * approach, f64::max(stretch, d.norm() / 0.3)];
        for (particle, sign) in [(a, 1.0), (b, -1.0)] {
            expected.1[particle] -= (u * pull * 3.0 + push * 7.0) * sign;
            expected.2[particle] += push * 7.0 * sign;
        }
    }
    for (found, expected) in [sums.energy, sums.power, sums.stretch].into_iter().zip(expected.0) {
        assert!((found - expected).abs() < 1e-12 * expected.abs(), "{found}, {expected}");
    }
    for i in 0..COUNT {
        assert!((rows[i] - expected.1[i]).norm() < 1e-12, "row {i}: {}, {}", rows[i], expected.1[i]);
        assert!((products[i] - expected.2[i]).norm() < 1e-12, "product {i}");

        let mut stored = Vec3::zeros();
        packs.add_row::<Link, 3>(i, &frozen, &mut |other, block: Mat3<f64>| {
            stored += block * v[other as usize].vector() * 7.0;
        });
        assert!((stored - products[i]).norm() < 1e-12, "stored row {i}: {stored}, {}", products[i]);
    }
}

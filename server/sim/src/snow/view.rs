//! What is looked at from outside, and put back: particles in the user's numbering, nodes of the grid.

use super::{
    body::Snow,
    book::Book,
    grid::{CELLS, block_of, key_and_cell, node_of},
    init::settle,
    particles::Particles,
    step::sort_anew,
};
use crate::{
    field::Field,
    held_length::HeldLength,
    math::{Real, vec3},
    parallel::{hash_numbers, sum_hashes},
    surroundings::Surroundings,
};

/// A node of the grid, to be looked at.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct GridNode {
    /// Index of the node: its place is cell * index (m).
    pub index: [i32; 3],
    /// Mass (kg).
    pub mass: f64,
    /// Velocity (m/s) after forces and colliders.
    pub velocity: [f64; 3],
}

/// Everything that a particle carries from step to step, in binary64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleState {
    /// Position (m).
    pub x: [f64; 3],
    /// Velocity (m/s).
    pub v: [f64; 3],
    /// Elastic deformation gradient F_E, by rows.
    pub elastic: [[f64; 3]; 3],
    /// Affine velocity C (1/s), by rows; for PIC/FLIP the velocity gradient of the last step.
    pub affine: [[f64; 3]; 3],
    /// Plastic volume ratio J_P.
    pub plastic_ratio: f64,
    /// Kirchhoff stress tau = P F^T times the volume at rest V0 (J): xx, yy, zz, xy, xz, yz. It
    /// follows from F_E and J_P; kept with them, as a step has it and not divided by V0, so that a
    /// run that goes on from here has the same bits. None: computed anew.
    pub volume_stress: Option<[f64; 6]>,
}

impl<R: Real> Snow<R> {
    /// Particles of all objects.
    pub fn particle_count(&self) -> usize {
        self.state.particles.len()
    }

    /// Names and particle counts of the objects, in order.
    pub fn objects(&self) -> impl Iterator<Item = (&str, usize)> {
        self.model.objects()
    }

    /// Name of the object that a particle belongs to.
    pub fn object_of(&self, particle: u64) -> &str {
        self.model.object_of(particle)
    }

    /// Writes a field over `out`, in the user's numbering of the snow; `around` is what surrounds the step that comes next.
    ///
    /// # Panics
    /// Unless `out` has as many numbers as the field; for forces and accelerations, where several ranks have begun to step it.
    pub fn read<T: Real>(&self, field: Field, around: &Surroundings<'_>, out: &mut [T]) {
        let particles = &self.state.particles;
        let number = |value: R| T::of(value.to_f64());
        match field {
            Field::Positions => particles.write_in_order(out, |place| particles.x(place).map(number)),
            Field::Velocities => particles.write_in_order(out, |place| particles.v(place).map(number)),
            Field::PlasticRatios => {
                particles.write_in_order(out, |place| [number(particles.plastic_ratio(place))]);
            }
            Field::StressNorms => {
                particles.write_in_order(out, |place| [number(stress_norm(particles, place))]);
            }
            Field::Forces => {
                let acting = self.resultant(around);
                particles.write_in_order(out, |place| acting.force(place).map(T::of));
            }
            Field::Accelerations => {
                let acting = self.resultant(around);
                particles.write_in_order(out, |place| acting.acceleration(place).map(T::of));
            }
        }
    }

    /// Mass (kg) and volume at rest (m³) of every particle, in the user's numbering.
    pub(crate) fn weights(&self) -> Vec<[f64; 2]> {
        let particles = &self.state.particles;
        let mut weights = vec![[0.0; 2]; particles.len()];
        for (place, id) in particles.id.iter().enumerate() {
            weights[*id as usize] = [particles.mass(place), particles.volume(place)].map(Real::to_f64);
        }
        weights
    }

    /// The state of every particle, in the user's numbering.
    pub fn particles(&self) -> Vec<ParticleState> {
        let particles = &self.state.particles;
        let mut out = Vec::new();
        let state = |place: usize| ParticleState {
            x: particles.x(place).map(Real::to_f64),
            v: particles.v(place).map(Real::to_f64),
            elastic: particles.f_e(place).map(|row| row.map(Real::to_f64)),
            affine: particles.c(place).map(|row| row.map(Real::to_f64)),
            plastic_ratio: particles.plastic_ratio(place).to_f64(),
            volume_stress: Some(particles.v0_tau(place).map(Real::to_f64)),
        };

        if !particles.id.is_empty() {
            out.resize(particles.len(), state(0));
            particles.write_in_order(&mut out, |place| [state(place)]);
        }

        out
    }

    /// Puts particles, in the user's numbering, in place of those that are there. The length of certified steps and the book of
    /// energy begin anew.
    ///
    /// # Panics
    /// When there are more or fewer than the snow has, or several ranks step it and have begun to.
    pub fn restore(&mut self, states: &[ParticleState]) {
        assert!(self.work.divided().is_none(), "ranks have begun to step this snow: it is restored before");
        assert_eq!(states.len(), self.particle_count(), "as many particles as there are");
        (self.state.hold, self.state.book) = (HeldLength::default(), Book::default());
        let particles = &mut self.state.particles;
        for place in 0..particles.len() {
            let state = &states[particles.id[place] as usize];
            let motion = [state.x, state.v].map(|vector| vector.map(R::of));
            particles.set_motion(place, motion, R::of(state.plastic_ratio));
            let rows = |m: [[f64; 3]; 3]| m.map(|row| row.map(R::of));
            particles.set_tensors(place, rows(state.elastic), rows(state.affine), [R::zero(); 6]);
        }

        self.work.grid.written_blocks.clear();
        sort_anew(&self.model, &self.state.particles, &mut self.work);
        settle(&self.model, &mut self.state, &mut self.work);

        let particles = &mut self.state.particles;
        for place in 0..particles.len() {
            let Some(stress) = states[particles.id[place] as usize].volume_stress else { continue };
            let (f, c) = (particles.f_e(place), particles.c(place));
            particles.set_tensors(place, f, c, stress.map(R::of));
        }
    }

    /// Adds `dv(particle, x, v)` (m/s) to the velocity of each particle, in the user's numbering.
    ///
    /// # Panics
    /// When several ranks step it and have begun to.
    pub fn kick(&mut self, dv: impl Fn(u32, [f64; 3], [f64; 3]) -> [f64; 3] + Sync) {
        assert!(self.work.divided().is_none(), "ranks have begun to step this snow: it is kicked before");
        let particles = &mut self.state.particles;
        let mut fastest = self.work.extremes.speed2;
        for place in 0..particles.len() {
            let (x, v) = (particles.x(place).map(Real::to_f64), particles.v(place).map(Real::to_f64));
            let change = dv(particles.id[place], x, v);
            let v = [0, 1, 2].map(|k| v[k] + change[k]);
            fastest = fastest.max(v.iter().map(|c| c * c).sum());
            particles.set_v(place, v.map(R::of));
        }

        self.work.extremes.speed2 = fastest;
        self.work.culprits = None;
        self.state.book.close();
    }

    /// Nodes with mass as the last step left them, where they were in it; none after particles were put in place of
    /// others. Clears `out` first.
    pub fn grid_nodes(&self, out: &mut Vec<GridNode>) {
        out.clear();
        let grid = &self.work.grid;
        for (key, nodes) in grid.written_blocks.iter().zip(&grid.nodes) {
            let block = block_of(*key);
            for i in (0..CELLS).filter(|i| nodes[*i][3] > R::zero()) {
                let [x, y, z, mass] = nodes[i].map(Real::to_f64);
                out.push(GridNode { index: node_of(block, i), mass, velocity: [x, y, z] });
            }
        }
    }

    /// The force of the stress (N) on each of the nodes of [`Self::grid_nodes`], at the state as it is; 0 on those that no
    /// particle reaches any more.
    ///
    /// # Panics
    /// When several ranks have begun to step it.
    pub fn grid_forces(&self) -> Vec<[f64; 3]> {
        let (grid, mut nodes) = (self.forces_on_nodes(), Vec::new());
        self.grid_nodes(&mut nodes);
        let force = |node: &GridNode| {
            let (key, place) = key_and_cell(node.index, self.model.settings.periodic);
            let Ok(block) = grid.node_blocks.binary_search(&key) else { return [0.0; 3] };
            let [x, y, z, _] = grid.nodes[block][place as usize].map(Real::to_f64);
            [x, y, z]
        };
        nodes.iter().map(force).collect()
    }

    /// Wrapping sum of a hash per particle: position, velocity, F_E and C by rows, J_P; the stress follows from them; and of
    /// the length that is held and what energy is owed. `first` is the number of its first particle among all.
    pub(crate) fn hash(&self, first: u64) -> u64 {
        let particles = &self.state.particles;
        let held = self.state.hold.numbers().map_or(0, |numbers| hash_numbers(first, numbers));
        let owed = self.state.book.numbers().map_or(0, |numbers| hash_numbers(first, numbers));
        let of_particles = sum_hashes(&particles.id, |place, id| {
            let mut numbers = [0.0; 25];
            let (f_e, c) = (particles.f_e(place), particles.c(place));
            let vectors = [particles.x(place), particles.v(place)].into_iter().chain(f_e).chain(c);
            for (numbers, vector) in numbers.as_chunks_mut::<3>().0.iter_mut().zip(vectors) {
                *numbers = vector.map(Real::to_f64);
            }
            numbers[24] = particles.plastic_ratio(place).to_f64();
            hash_numbers(first + u64::from(*id), numbers)
        });
        of_particles.wrapping_add(held).wrapping_add(owed)
    }
}

/// Frobenius norm of the Cauchy stress (Pa) of the particle at a place: |V0 tau| / (V0 J), J = det F_E J_P.
fn stress_norm<R: Real>(particles: &Particles<R>, place: usize) -> R {
    let [xx, yy, zz, xy, xz, yz] = particles.v0_tau(place).map(Real::to_f64);
    let norm2 = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz);
    let [a, b, c] = particles.f_e(place).map(|row| vec3::<f64>(row.map(Real::to_f64)));

    let volume = particles.volume(place).to_f64() * a.cross(&b).dot(&c).abs();
    let volume = volume * particles.plastic_ratio(place).to_f64();
    let stress = if volume > 0.0 { norm2.sqrt() / volume } else { 0.0 };
    R::of(stress.min(R::LARGEST))
}

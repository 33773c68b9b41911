//! Particles as they are stored: quads of numbers, in an order that is renewed now and then.
//!
//! Sixteen particles at a time are read into lanes and written back; a particle is found through
//! the sorted order of its block. Four planes of two quads each, so that no two streams of the same
//! size move in step (they would alias in the first cache).

use crate::{
    math::{LANES, Pack, Real},
    parallel::Disjoint,
};

/// Two quads.
pub(super) type Pair<R> = [[R; 4]; 2];

/// Numbers of a particle by plane: (x, m), (v, J_P) | F rows | F, C | C, V tau.
#[derive(Clone, Debug, Default)]
pub(super) struct Particles<R> {
    /// Position (m) and mass (kg); velocity (m/s) and J_P.
    pub(super) motion: Vec<Pair<R>>,
    /// F_E by rows: xx xy xz yx, yy yz zx zy.
    pub(super) shape: Vec<Pair<R>>,
    /// zz of F_E, xx xy xz of C; yx yy yz zx of C.
    pub(super) affine: Vec<Pair<R>>,
    /// zy zz of C, xx yy of V0 tau; zz xy xz yz of V0 tau (J).
    pub(super) stress: Vec<Pair<R>>,
    /// Volume at rest (m³) and factor on the stiffness.
    pub(super) fixed: Vec<[R; 2]>,
    /// Number of the user.
    pub(super) id: Vec<u32>,
    /// Object, which has a material.
    pub(super) object: Vec<u16>,
}

/// Places of sixteen particles; past `count` the last is repeated.
#[derive(Clone, Copy)]
pub(super) struct Group {
    pub(super) at: [u32; LANES],
    pub(super) count: usize,
}

impl Group {
    /// Places `start..` of a list, sixteen at most; where there are none, its last, and a count of 0.
    #[inline(always)]
    pub(super) fn from(list: &[u32], start: usize) -> Self {
        if start < list.len() {
            Self::of(&list[start..])
        } else {
            Self { count: 0, ..Self::of(&list[list.len() - 1..]) }
        }
    }

    /// The first sixteen of a list that is not empty, or all of it.
    #[inline(always)]
    pub(super) fn of(list: &[u32]) -> Self {
        let count = list.len().min(LANES);
        let mut at = [list[count - 1]; LANES];
        at[..count].copy_from_slice(&list[..count]);
        Self { at, count }
    }
}

/// One quad of each particle of a group, in lanes.
#[inline(always)]
pub(super) fn read<P: Pack, const HALF: usize>(plane: &[Pair<P::Number>], group: &Group) -> [P; 4] {
    let mut quads = [[P::Number::default(); 4]; LANES];
    for lane in 0..LANES {
        quads[lane] = plane[group.at[lane] as usize][HALF];
    }
    P::columns(&quads)
}

/// Both quads of each particle of a group.
pub(super) fn quads<R: Real>(plane: &[Pair<R>], group: &Group) -> [[[R; 4]; LANES]; 2] {
    let mut quads = [[[R::zero(); 4]; LANES]; 2];
    for lane in 0..LANES {
        let pair = plane[group.at[lane] as usize];
        (quads[0][lane], quads[1][lane]) = (pair[0], pair[1]);
    }
    quads
}

/// Writes both quads of each particle of a group.
#[inline(always)]
#[allow(unsafe_code, reason = "the particles of a group belong to one run of blocks")]
pub(super) fn write<P: Pack>(plane: &Disjoint<'_, Pair<P::Number>>, group: &Group, pair: [[P; 4]; 2]) {
    let (first, second) = (P::rows(pair[0]), P::rows(pair[1]));
    plane.hold_all(&group.at);
    for lane in 0..group.count {
        // SAFETY: held above; the sorted order names each particle once, and a run of blocks is
        // worked on by one thread.
        unsafe { *plane.held_slot(group.at[lane] as usize) = [first[lane], second[lane]] };
    }
}

impl<R: Real> Particles<R> {
    pub(super) fn len(&self) -> usize {
        self.id.len()
    }

    /// The mass and position of a particle.
    pub(super) fn x(&self, at: usize) -> [R; 3] {
        let [x, y, z, _] = self.motion[at][0];
        [x, y, z]
    }

    pub(super) fn v(&self, at: usize) -> [R; 3] {
        let [x, y, z, _] = self.motion[at][1];
        [x, y, z]
    }

    pub(super) fn mass(&self, at: usize) -> R {
        self.motion[at][0][3]
    }

    pub(super) fn plastic_ratio(&self, at: usize) -> R {
        self.motion[at][1][3]
    }

    /// F_E by rows.
    pub(super) fn elastic(&self, at: usize) -> [[R; 3]; 3] {
        let ([a, b], last) = (self.shape[at], self.affine[at][0][0]);
        [[a[0], a[1], a[2]], [a[3], b[0], b[1]], [b[2], b[3], last]]
    }

    /// C by rows.
    pub(super) fn affine(&self, at: usize) -> [[R; 3]; 3] {
        let ([a, b], c) = (self.affine[at], self.stress[at][0]);
        [[a[1], a[2], a[3]], [b[0], b[1], b[2]], [b[3], c[0], c[1]]]
    }

    /// V0 tau (J): xx yy zz xy xz yz.
    pub(super) fn volume_stress(&self, at: usize) -> [R; 6] {
        let [a, b] = self.stress[at];
        [a[2], a[3], b[0], b[1], b[2], b[3]]
    }

    /// Puts F_E, C and V0 tau in their places.
    pub(super) fn set_tensors(&mut self, at: usize, f: [[R; 3]; 3], c: [[R; 3]; 3], s: [R; 6]) {
        self.shape[at] = [[f[0][0], f[0][1], f[0][2], f[1][0]], [f[1][1], f[1][2], f[2][0], f[2][1]]];
        self.affine[at] = [[f[2][2], c[0][0], c[0][1], c[0][2]], [c[1][0], c[1][1], c[1][2], c[2][0]]];
        self.stress[at] = [[c[2][1], c[2][2], s[0], s[1]], [s[2], s[3], s[4], s[5]]];
    }

    /// Bytes in use.
    pub(super) fn bytes(&self) -> usize {
        let pairs =
            self.motion.capacity() + self.shape.capacity() + self.affine.capacity() + self.stress.capacity();
        pairs * size_of::<Pair<R>>()
            + self.fixed.capacity() * size_of::<[R; 2]>()
            + self.id.capacity() * 4
            + self.object.capacity() * 2
    }
}

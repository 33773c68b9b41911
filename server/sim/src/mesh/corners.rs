//! The corners of one triangle.

/// Whether a triangle names a point twice.
pub(crate) fn is_degenerate(t: &[u32; 3]) -> bool {
    t[0] == t[1] || t[1] == t[2] || t[2] == t[0]
}

/// The edges of a triangle with the smaller index first; a point joined to itself is left out.
pub(super) fn corner_edges(t: &[u32; 3]) -> impl Iterator<Item = [u32; 2]> + Clone {
    let [a, b, c] = *t;
    [[a, b], [b, c], [c, a]].into_iter().filter(|e| e[0] != e[1]).map(|[p, q]| [p.min(q), p.max(q)])
}

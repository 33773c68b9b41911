//! Nodes of the snow's grid in a frame: kept once for all watchers, chosen and packed once for each choice.
//!
//! Enters: the nodes of a simulation, a watcher's choice. Leaves: the nodes chosen, packed, at
//! most as many as the watcher may have.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use bytes::Bytes;
use nappe_proto::v1;
use nappe_sim::{snow::GridNode, world::Simulation};

use super::{
    memory::{Counted, FrameMemory},
    packing::{NotFinite, Owner},
};

/// Bytes of a node in a message: three i32, one f32, three f32; and those of the force on it, three f32.
const NODE_BYTES: usize = 28;
const FORCE_BYTES: usize = 12;

/// Strides up to this one are tried one by one, then powers of two. That bounds the passes over
/// the nodes, whatever a watcher asks for.
const SMALL_STRIDES: i32 = 8;

/// Choices that a frame keeps packed, the newest ones: watchers may choose anew for as long as it is kept.
const CHOICES: usize = 4;

/// A node that carries mass, as it is sent.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    /// The node stands at cell * index.
    index: [i32; 3],
    /// (kg)
    mass: f32,
    /// (m/s)
    velocity: [f32; 3],
}

/// The nodes of a frame.
#[derive(Debug)]
pub(crate) struct GridFrame {
    /// Distance between neighbouring nodes (m).
    cell: f64,
    nodes: Vec<Node>,
    /// The force on each of them (N), where somebody wants them.
    forces: Option<Vec<[f32; 3]>>,
    /// What watchers chose of them last.
    chosen: Mutex<Vec<(GridChoice, Arc<OnceLock<v1::GridField>>)>>,
    memory: Arc<FrameMemory>,
    _counted: Counted,
}

/// Which nodes of the grid a watcher wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Selection {
    All,
    /// Those of the plane nearest to a coordinate.
    Slice {
        /// Axis across the plane, 0 to 2.
        axis: usize,
        /// Coordinate along the axis (m), finite.
        coordinate: f64,
    },
}

/// What a watcher wants of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GridChoice {
    pub selection: Selection,
    /// Nodes in a frame at most, 1 or more.
    pub max_nodes: u32,
    /// Whether the forces on them go with them.
    pub has_forces: bool,
}

impl GridFrame {
    /// The grid as the last step left it, with the forces (N) on its nodes where they are wanted; none without snow.
    ///
    /// # Errors
    /// A node whose mass, velocity or force is not finite in binary32.
    pub(crate) fn of(
        simulation: &Simulation,
        forces: Option<&[[f64; 3]]>,
        memory: &Arc<FrameMemory>,
    ) -> Result<Option<Self>, NotFinite> {
        let Some(cell) = simulation.snow_cell() else { return Ok(None) };
        let (mut all, mut nodes, mut narrowed) = (Vec::new(), Vec::new(), Vec::new());
        simulation.grid_nodes(&mut all);
        for (place, node) in all.iter().enumerate() {
            let narrow = narrow(node)?;
            if narrow.mass > 0.0 {
                nodes.push(narrow);
                if let Some(force) = forces.and_then(|forces| forces.get(place)) {
                    narrowed.push(narrow_vector(node.index, "force", *force)?);
                }
            }
        }
        Ok(Some(Self::new(cell, nodes, forces.map(|_| narrowed), memory)))
    }

    fn new(cell: f64, nodes: Vec<Node>, forces: Option<Vec<[f32; 3]>>, memory: &Arc<FrameMemory>) -> Self {
        let counted = Counted::new(memory, bytes_of(&nodes, forces.as_deref()));
        Self { cell, nodes, forces, chosen: Mutex::default(), memory: Arc::clone(memory), _counted: counted }
    }

    /// Memory of the nodes (bytes).
    pub(crate) fn size(&self) -> usize {
        bytes_of(&self.nodes, self.forces.as_deref())
    }

    /// Whether it has the forces on its nodes.
    pub(crate) fn has_forces(&self) -> bool {
        self.forces.is_some()
    }

    /// The nodes of a choice, packed once for all watchers that make it, unless others made many choices in between. If there
    /// are too many, only those whose indices are multiples of a stride.
    pub(crate) fn choose(&self, choice: &GridChoice) -> v1::GridField {
        let field = {
            let mut chosen = self.chosen.lock().unwrap_or_else(PoisonError::into_inner);
            let known = chosen.iter().find(|(other, _)| other == choice).map(|(_, field)| Arc::clone(field));
            known.unwrap_or_else(|| {
                let field = Arc::default();
                if chosen.len() == CHOICES {
                    chosen.remove(0);
                }
                chosen.push((*choice, Arc::clone(&field)));
                field
            })
        };
        field.get_or_init(|| self.select(choice)).clone()
    }

    fn select(&self, choice: &GridChoice) -> v1::GridField {
        let (plane, most) = (choice.plane(self.cell), choice.max_nodes as usize);
        let selected = |stride: i32| {
            self.nodes.iter().enumerate().filter(move |(_, node)| is_chosen(node, plane, stride))
        };
        let count = selected(1).count();
        let stride = if count <= most { 1 } else { least_stride(most, |stride| selected(stride).count()) };

        let sent = selected(stride).count();
        let (mut index, mut mass, mut velocity) =
            (Vec::with_capacity(12 * sent), Vec::with_capacity(4 * sent), Vec::with_capacity(12 * sent));
        let forces = self.forces.as_deref().filter(|_| choice.has_forces);
        let mut force = Vec::with_capacity(forces.map_or(0, |_| FORCE_BYTES * sent));
        for (place, node) in selected(stride) {
            if let Some(forces) = forces {
                force.extend(forces[place].iter().flat_map(|f| f.to_le_bytes()));
            }
            index.extend(node.index.iter().flat_map(|i| i.to_le_bytes()));
            mass.extend(node.mass.to_le_bytes());
            velocity.extend(node.velocity.iter().flat_map(|v| v.to_le_bytes()));
        }

        v1::GridField {
            cell: self.cell,
            index_i32: Counted::share(&self.memory, index),
            mass_f32: Counted::share(&self.memory, mass),
            velocity_f32: Counted::share(&self.memory, velocity),
            stride: stride.unsigned_abs(),
            node_count: count as u64,
            force_f32: Counted::share(&self.memory, force),
        }
    }
}

impl GridChoice {
    /// Axis and index of the plane of nodes; none for all nodes. A plane beyond all indices is empty.
    fn plane(&self, cell: f64) -> Option<(usize, i32)> {
        match self.selection {
            Selection::All => None,
            Selection::Slice { axis, coordinate } => Some((axis, (coordinate / cell).round() as i32)),
        }
    }
}

/// Takes the first `count` nodes off packed nodes.
pub(super) fn take_nodes(grid: &mut v1::GridField, count: usize) -> v1::GridField {
    let part = |data: &mut Bytes, element: usize| data.split_to((element * count).min(data.len()));
    v1::GridField {
        index_i32: part(&mut grid.index_i32, 12),
        mass_f32: part(&mut grid.mass_f32, 4),
        velocity_f32: part(&mut grid.velocity_f32, 12),
        force_f32: part(&mut grid.force_f32, FORCE_BYTES),
        ..*grid
    }
}

/// Bytes of each of the nodes that are packed.
pub(super) fn node_bytes(grid: &v1::GridField) -> usize {
    if grid.force_f32.is_empty() { NODE_BYTES } else { NODE_BYTES + FORCE_BYTES }
}

/// How many nodes are packed.
pub(super) fn packed_count(grid: &v1::GridField) -> usize {
    grid.mass_f32.len() / 4
}

/// A node as it is sent. A mass below the range of binary32 becomes 0: such a node is left out.
fn narrow(node: &GridNode) -> Result<Node, NotFinite> {
    let GridNode { index, mass, velocity } = *node;
    let mass = narrow_number(index, "mass", mass)?;
    Ok(Node { index, mass, velocity: narrow_vector(index, "velocity", velocity)? })
}

fn narrow_vector(
    index: [i32; 3],
    quantity: &'static str,
    [x, y, z]: [f64; 3],
) -> Result<[f32; 3], NotFinite> {
    let number = |value: f64| narrow_number(index, quantity, value);
    Ok([number(x)?, number(y)?, number(z)?])
}

fn narrow_number(index: [i32; 3], quantity: &'static str, value: f64) -> Result<f32, NotFinite> {
    let narrow = value as f32;
    let error = NotFinite { owner: Owner::Node(index), quantity, value };
    if narrow.is_finite() { Ok(narrow) } else { Err(error) }
}

/// Memory of nodes, and of forces on them (bytes).
fn bytes_of(nodes: &[Node], forces: Option<&[[f32; 3]]>) -> usize {
    size_of_val(nodes) + forces.map_or(0, size_of_val)
}

/// Whether a node is in the plane, if there is one, and its other indices are multiples of `stride`.
fn is_chosen(node: &Node, plane: Option<(usize, i32)>, stride: i32) -> bool {
    let across = plane.map(|(axis, _)| axis);
    plane.is_none_or(|(axis, index)| node.index[axis] == index)
        && (stride == 1 || (0..3).all(|axis| across == Some(axis) || node.index[axis] % stride == 0))
}

/// The first of 2, 3 ... 8, 16, 32 ... that leaves some nodes, and at most `most`. A thin layer may
/// have no node at the first stride that leaves few enough; if all such strides leave none, the
/// first of them is taken.
fn least_stride(most: usize, count: impl Fn(i32) -> usize) -> i32 {
    let powers = std::iter::successors(Some(2 * SMALL_STRIDES), |stride| stride.checked_mul(2));
    let mut first_empty = None;
    for stride in (2..=SMALL_STRIDES).chain(powers) {
        match count(stride) {
            // Multiples of a power of two are multiples of the one before: there will be none either.
            0 if stride >= SMALL_STRIDES => return first_empty.unwrap_or(stride),
            0 => {
                first_empty.get_or_insert(stride);
            }
            count if count <= most => return stride,
            _ => {}
        }
    }
    first_empty.unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of nodes from `low` to `high` along each axis, each with its index as its velocity.
    fn block(low: i32, high: i32) -> GridFrame {
        let mut nodes = Vec::new();
        for (x, y, z) in
            (low..high).flat_map(|x| (low..high).flat_map(move |y| (low..high).map(move |z| (x, y, z))))
        {
            nodes.push(Node { index: [x, y, z], mass: 1.0, velocity: [x as f32, y as f32, z as f32] });
        }
        GridFrame::new(0.5, nodes, None, &Arc::default())
    }

    fn indices(field: &v1::GridField) -> Vec<[i32; 3]> {
        let numbers: Vec<i32> =
            field.index_i32.as_chunks().0.iter().map(|bytes| i32::from_le_bytes(*bytes)).collect();
        numbers.as_chunks().0.to_vec()
    }

    #[test]
    fn all_nodes_are_sent_in_their_order_when_they_are_few_enough() {
        let grid = block(-2, 3);
        let field = grid.choose(&GridChoice { selection: Selection::All, max_nodes: 125, has_forces: false });
        assert_eq!((field.stride, field.node_count, field.cell), (1, 125, 0.5));
        assert_eq!(indices(&field), grid.nodes.iter().map(|node| node.index).collect::<Vec<_>>());
        assert_eq!((field.mass_f32.len(), field.velocity_f32.len()), (500, 1500));
        assert_eq!(packed_count(&field), 125);
    }

    #[test]
    fn a_stride_thins_the_nodes_to_what_is_allowed_and_to_the_least_that_is_enough() {
        let grid = block(-6, 7);
        for max_nodes in [1, 2, 26, 27, 124, 125, 342, 343, 2196, 2197, 5000] {
            let field = grid.choose(&GridChoice { selection: Selection::All, max_nodes, has_forces: false });
            let sent = indices(&field);
            let stride = field.stride as i32;
            assert!(sent.len() <= max_nodes as usize && field.node_count == 2197);
            let kept = |i: &[i32; 3], s: i32| i.iter().all(|c| c % s == 0);
            assert!(sent.iter().all(|i| kept(i, stride)));
            let with = |s: i32| grid.nodes.iter().filter(|node| kept(&node.index, s)).count();
            assert_eq!(sent.len(), with(stride), "{max_nodes}");
            assert!(stride == 1 || with(stride - 1) > max_nodes as usize, "{max_nodes}: {stride}");
        }
    }

    #[test]
    fn a_frame_keeps_few_choices_however_many_are_made() {
        let grid = block(-6, 7);
        let choose =
            |max_nodes| grid.choose(&GridChoice { selection: Selection::All, max_nodes, has_forces: false });
        let first = choose(2197);
        assert_eq!(choose(2197).mass_f32.as_ptr(), first.mass_f32.as_ptr(), "it is packed once");
        drop(first);
        (2198..2300).for_each(|max_nodes| drop(choose(max_nodes)));
        // The nodes themselves are counted too.
        assert_eq!(grid.memory.held(), (1 + CHOICES as u64) * grid.size() as u64);
        assert_eq!(choose(2197).node_count, 2197);
    }

    #[test]
    fn a_slice_is_the_plane_nearest_to_the_coordinate_and_only_thinned_within_it() {
        let grid = block(-3, 4);
        for (axis, coordinate, index) in [(0, 0.7, 1), (1, -1.1, -2), (2, 0.2, 0)] {
            let selection = Selection::Slice { axis, coordinate };
            let field = grid.choose(&GridChoice { selection, max_nodes: 49, has_forces: false });
            assert_eq!((field.stride, field.node_count), (1, 49));
            assert!(indices(&field).iter().all(|i| i[axis] == index));

            // Every second node within the plane, though the plane's own index may be odd.
            let field = grid.choose(&GridChoice { selection, max_nodes: 48, has_forces: false });
            assert_eq!((field.stride, field.node_count, indices(&field).len()), (2, 49, 9));
        }

        for coordinate in [1e300, -1e300, 99.0] {
            let selection = Selection::Slice { axis: 0, coordinate };
            let field = grid.choose(&GridChoice { selection, max_nodes: 48, has_forces: false });
            assert_eq!((field.stride, field.node_count, packed_count(&field)), (1, 0, 0));
        }
    }

    #[test]
    fn a_thin_row_keeps_some_of_its_nodes_if_any_stride_does() {
        let nodes = (0..100_000).map(|x| Node { index: [x, 40, 40], mass: 1.0, velocity: [0.0; 3] });
        let grid = GridFrame::new(1.0, nodes.collect(), None, &Arc::default());

        // 40 is a multiple of 2, 4, 5 and 8. None is few enough for 10 000 nodes.
        for (max_nodes, stride, sent) in [(50_000, 2, 50_000), (30_000, 4, 25_000), (10_000, 3, 0)] {
            let field = grid.choose(&GridChoice { selection: Selection::All, max_nodes, has_forces: false });
            assert_eq!((field.stride, packed_count(&field)), (stride, sent), "{max_nodes}");
        }
    }

    #[test]
    fn parts_put_together_are_the_whole() {
        let whole =
            block(0, 4).choose(&GridChoice { selection: Selection::All, max_nodes: 64, has_forces: false });
        let (mut rest, mut index, mut left) = (whole.clone(), Vec::new(), 64);
        while packed_count(&rest) > 0 {
            let part = take_nodes(&mut rest, 10);
            assert_eq!((packed_count(&part), part.node_count), (left.min(10), 64));
            left -= packed_count(&part);
            index.extend_from_slice(&part.index_i32);
        }
        assert_eq!(index, whole.index_i32);
    }

    #[test]
    fn forces_go_with_the_nodes_that_are_chosen_where_they_are_wanted() {
        let plain = block(-2, 3);
        let forces = plain.nodes.iter().map(|node| node.velocity.map(|v| 10.0 * v)).collect();
        let grid = GridFrame::new(0.5, block(-2, 3).nodes, Some(forces), &Arc::default());
        let mut choice = GridChoice { selection: Selection::All, max_nodes: 30, has_forces: true };
        let mut field = grid.choose(&choice);
        let numbers: Vec<f32> =
            field.force_f32.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let expected = indices(&field).into_iter().flatten().map(|i| 10.0 * i as f32);
        assert_eq!((field.stride, numbers), (2, expected.collect::<Vec<_>>()));
        assert_eq!((node_bytes(&field), take_nodes(&mut field, 5).force_f32.len()), (40, 60));
        choice.has_forces = false;
        assert!(grid.choose(&choice).force_f32.is_empty() && grid.has_forces() && !plain.has_forces());
        assert_eq!(node_bytes(&grid.choose(&choice)), 28);
    }

    #[test]
    fn a_node_that_binary32_cannot_hold_is_an_error() {
        let node = GridNode { index: [1, -2, 3], mass: 1e-60, velocity: [0.0; 3] };
        assert!(narrow(&node).is_ok_and(|node| node.mass == 0.0));
        let fast = GridNode { velocity: [0.0, 1e39, 0.0], ..node };
        let error = narrow(&fast).expect_err("beyond binary32");
        assert_eq!((error.particle(), error.quantity), (None, "velocity"));
        assert!(error.to_string().contains("node [1, -2, 3]"), "{error}");
        assert!(narrow(&GridNode { mass: f64::NAN, ..node }).is_err());
    }
}

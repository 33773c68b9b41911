//! Cloth whose surfaces keep apart: its scenes, and what their runs come to.

mod scenes;
mod bodies;
mod tally;
mod figures;
mod pinched;
mod walker;
mod folded;
mod twisted;
mod stacked;
mod flung;
mod linked;

pub use bodies::{built, of_bodies};
pub use figures::{RISE, THICKNESS, figure, giving_way, off_frames, sheet_on_a_plate};
pub use flung::flung;
pub use folded::{Folds, folded_twice};
pub use linked::{Rings, linked_rings};
pub use pinched::{Pinched, pinched};
pub use scenes::{Case, DT, GRAVITY, LOOSE, ball, floor, scene, wall};
pub use stacked::{bodies_on_a_ball, on_a_ball, piled};
pub use tally::{Tally, Watched, speeds};
pub use twisted::twisted;
pub use walker::{Walked, walked};

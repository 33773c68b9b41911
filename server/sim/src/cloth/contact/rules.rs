//! Numbers of the rules by which pairs push each other, in shares of what they keep apart.

/// h² k over the reduced mass of a pair.
pub(super) const STIFFNESS: f64 = 100.0;
/// Share of the gap at the start that a pair must keep on its way.
pub(super) const KEPT: f64 = 0.1;
/// Shares of the thickness by which an active pair may pull before it is dropped, by which another may fall short before it is added, and by which
/// the linear gap of one may be off before it is solved for again.
pub(super) const PULL: f64 = 0.0003;
pub(super) const ADDED: f64 = 0.001;
pub(super) const SHORT: f64 = 0.01;
/// Share of the thickness and of the gap at the start below which a pair is made harder, and how much.
pub(super) const THIN: f64 = 0.5;
pub(super) const HARDER: f64 = 4.0;
/// The round from which on what pulls hard is dropped for good.
pub(super) const LATE: u32 = 4;
/// Rounds after which certificates alone decide, and friction stays as it is: what is hard to keep apart does not settle while it changes.
pub(super) const SETTLING: u32 = 6;

//! Laws that no scene may break: scenes at random against each law, and scenes that broke one.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "seeds and their numbers are told to who asks for them"
)]

mod law;
mod boost;
mod stranger;
mod books;
mod units;
mod turn;
mod order;
mod going_on;
mod smooth;
mod halves;
mod seeds;
mod cloth_judges;
mod snow_judges;

//! Rules that the compiler cannot state: layers, module order, headers, lengths, what is absent,
//! and that documents and deployment files speak of what stands. The tree of docs/tree.md is drawn here.
//!
//! Each rule is a function from text to complaints. One test applies it to the tree, another to a
//! small bad example, so that a rule that finds nothing is known to be able to find something.

mod tree;
mod tokens;
mod additions;
mod builds;
mod comments;
mod crates;
mod deployment;
mod documents;
mod licences;
mod modules;
mod places;
mod purity;
mod sources;
mod structs;
mod tables;
mod tree_page;

/// Fails with every complaint, a line each.
#[track_caller]
fn assert_none(complaints: &[String]) {
    assert!(complaints.is_empty(), "\n{}\n", complaints.join("\n"));
}

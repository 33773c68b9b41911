//! The nodes of a glTF file: where each is in its parent, and all of them in the world.

use gltf::scene::Transform;

use super::{
    asset::Asset,
    matrix::{IDENTITY, Matrix, Parts, product},
};
use crate::words::error::Result;

/// All nodes, by their numbers in the file.
#[derive(Debug)]
pub(super) struct Bones {
    parents: Vec<Option<usize>>,
    /// Parents before their children.
    order: Vec<usize>,
    /// Where each is in its parent while nothing moves it.
    rest: Vec<Matrix>,
    /// The same in parts.
    parts: Vec<Parts>,
}

impl Bones {
    /// Reads all nodes.
    ///
    /// # Errors
    /// Nodes that are no trees.
    pub(super) fn read(asset: &Asset) -> Result<Self> {
        let count = asset.document.nodes().count();
        let (mut parents, mut children) = (vec![None; count], vec![Vec::new(); count]);
        let (mut rest, mut parts) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for node in asset.document.nodes() {
            for child in node.children() {
                if parents[child.index()].replace(node.index()).is_some() {
                    let message = format!("node {} has two parents; allowed: one", child.index());
                    return Err(asset.refused(&message));
                }
                children[node.index()].push(child.index());
            }
            let (translation, rotation, scale) = node.transform().decomposed();
            let own = Parts {
                translation: translation.map(f64::from),
                rotation: rotation.map(f64::from),
                scale: scale.map(f64::from),
            };
            rest.push(match node.transform() {
                Transform::Matrix { matrix } => matrix.map(|column| column.map(f64::from)),
                Transform::Decomposed { .. } => own.matrix(),
            });
            parts.push(own);
        }

        // Each has one parent at most, so that none comes twice; those in a circle never come.
        let mut order: Vec<usize> = (0..count).filter(|node| parents[*node].is_none()).collect();
        let mut at = 0;
        while let Some(node) = order.get(at) {
            let own = std::mem::take(&mut children[*node]);
            order.extend(own);
            at += 1;
        }
        if order.len() < count {
            return Err(asset.refused("nodes go in a circle; allowed: trees"));
        }
        Ok(Self { parents, order, rest, parts })
    }

    /// Where each node is in its parent while nothing moves it.
    pub(super) fn parts(&self) -> &[Parts] {
        &self.parts
    }

    /// Where each node is in the world, with those moved that are.
    pub(super) fn places(&self, moved: &[Option<Parts>]) -> Vec<Matrix> {
        let mut places = vec![IDENTITY; self.order.len()];
        for node in self.order.iter().copied() {
            let own = moved[node].map_or(self.rest[node], |parts| parts.matrix());
            places[node] = self.parents[node].map_or(own, |parent| product(&places[parent], &own));
        }
        places
    }
}

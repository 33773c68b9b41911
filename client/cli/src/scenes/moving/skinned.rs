//! The meshes of a glTF file that have a skin: where its joints pull their points.

use gltf::{Node, Primitive, Semantic, mesh::Mode};

use super::{
    asset::Asset,
    frame::Frame,
    matrix::{IDENTITY, Matrix, place, product},
};
use crate::words::error::Result;

/// All meshes with a skin, as one.
#[derive(Debug, Default)]
pub(super) struct Skinned {
    skins: Vec<Skin>,
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    still: usize,
}

/// The joints of a mesh.
#[derive(Debug)]
struct Skin {
    /// Numbers of nodes.
    joints: Vec<usize>,
    /// From where a point is without its skin to where it is from each joint.
    inverse_bind: Vec<Matrix>,
}

/// A point of a mesh.
#[derive(Debug)]
struct Point {
    skin: usize,
    /// Where it is without its skin (m).
    rest: [f64; 3],
    pulls: Vec<Pull>,
}

/// What a joint does with a point.
#[derive(Clone, Copy, Debug)]
struct Pull {
    /// Its number among those of the skin.
    joint: usize,
    /// Its share (1); those of a point add up to 1.
    weight: f64,
}

impl Skinned {
    /// Reads all meshes with a skin.
    ///
    /// # Errors
    /// A file without one, and meshes that are of something else than triangles, have shapes to morph to, or lack joints.
    pub(super) fn read(asset: &Asset) -> Result<Self> {
        let mut all = Self::default();
        for node in asset.document.nodes() {
            let Some(mesh) = node.mesh() else { continue };
            if !all.add_skin(asset, &node)? {
                all.still += 1;
                continue;
            }
            for primitive in mesh.primitives() {
                let name = format!("mesh {}, part {}", mesh.index(), primitive.index());
                all.add(asset, &primitive, &name)?;
            }
        }
        if all.skins.is_empty() {
            let message =
                "has no mesh with a skin; allowed: a file with a skin and an animation that moves it";
            return Err(asset.refused(message));
        }
        Ok(all)
    }

    /// How many points there are.
    pub(super) fn points(&self) -> usize {
        self.points.len()
    }

    /// How many meshes have no skin, and are left out.
    pub(super) fn still(&self) -> usize {
        self.still
    }

    /// The triangles, of numbers of points.
    pub(super) fn into_triangles(self) -> Vec<[u32; 3]> {
        self.triangles
    }

    /// Where the points are (m), with the nodes where they are in the world:  x = sum of w (G B) x_rest  over the joints.
    pub(super) fn frame(&self, nodes: &[Matrix]) -> Frame {
        let of_skin = |skin: &Skin| -> Vec<Matrix> {
            skin.joints
                .iter()
                .zip(&skin.inverse_bind)
                .map(|(node, bind)| product(&nodes[*node], bind))
                .collect()
        };
        let skins: Vec<Vec<Matrix>> = self.skins.iter().map(of_skin).collect();
        let at = |point: &Point| {
            let mut sum = [0.0; 3];
            for Pull { joint, weight } in &point.pulls {
                let pulled = place(&skins[point.skin][*joint], point.rest);
                for (sum, c) in sum.iter_mut().zip(pulled) {
                    *sum += weight * c;
                }
            }
            sum.map(|c| c as f32)
        };
        self.points.iter().map(at).collect()
    }

    /// Takes the skin of a node; says whether it has one.
    fn add_skin(&mut self, asset: &Asset, node: &Node<'_>) -> Result<bool> {
        let Some(skin) = node.skin() else { return Ok(false) };
        let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
        let inverse_bind = match skin.inverse_bind_matrices() {
            None => vec![IDENTITY; joints.len()],
            Some(accessor) => {
                let numbers = asset.numbers(&accessor, 16)?;
                let (columns, _) = numbers.as_chunks::<4>();
                let (matrices, _) = columns.as_chunks::<4>();
                matrices.to_vec()
            }
        };
        if inverse_bind.len() < joints.len() {
            return Err(asset.refused(&format!(
                "skin {} has {} matrices for {} joints; allowed: one for each",
                skin.index(),
                inverse_bind.len(),
                joints.len()
            )));
        }
        self.skins.push(Skin { joints, inverse_bind });
        Ok(true)
    }

    /// Takes a part of a mesh, which has the skin that was taken last.
    fn add(&mut self, asset: &Asset, primitive: &Primitive<'_>, name: &str) -> Result<()> {
        let refused = |what: &str| Err(asset.refused(&format!("{name}: {what}")));
        if primitive.mode() != Mode::Triangles {
            return refused(&format!("is of {:?}; allowed: Triangles", primitive.mode()));
        }
        if primitive.morph_targets().next().is_some() {
            return refused("has morph targets; allowed: meshes that a skin alone moves");
        }
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            return refused("has no POSITION; allowed: parts that have it");
        };
        let numbers = asset.numbers(&positions, 3)?;
        let (places, _) = numbers.as_chunks::<3>();
        let pulls = self.pulls(asset, primitive, name, places.len())?;

        let first = self.points.len() as u32;
        let skin = self.skins.len() - 1;
        let points = places.iter().zip(pulls).map(|(rest, pulls)| Point { skin, rest: *rest, pulls });
        self.points.extend(points);
        let corners: Vec<u32> = match primitive.indices() {
            None => (0..places.len() as u32).collect(),
            Some(accessor) => {
                let numbers = asset.numbers(&accessor, 1)?;
                if let Some(number) = numbers.iter().find(|number| **number >= places.len() as f64) {
                    return refused(&format!("names point {number}; allowed: 0 to {}", places.len() - 1));
                }
                numbers.iter().map(|number| *number as u32).collect()
            }
        };
        let (triangles, rest) = corners.as_chunks::<3>();
        if !rest.is_empty() {
            return refused(&format!("has {} corners; allowed: three for each triangle", corners.len()));
        }
        self.triangles.extend(triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        Ok(())
    }

    /// What the joints do with each of so many points of a part.
    fn pulls(
        &self,
        asset: &Asset,
        primitive: &Primitive<'_>,
        name: &str,
        points: usize,
    ) -> Result<Vec<Vec<Pull>>> {
        let refused = |what: &str| Err(asset.refused(&format!("{name}: {what}")));
        let joints_of_skin = self.skins.last().map_or(0, |skin| skin.joints.len());
        let mut pulls = vec![Vec::new(); points];
        for set in 0.. {
            let names = [Semantic::Joints(set), Semantic::Weights(set)];
            let [Some(joints), Some(weights)] = names.map(|name| primitive.get(&name)) else { break };
            let (joints, weights) = (asset.numbers(&joints, 4)?, asset.numbers(&weights, 4)?);
            if joints.len() != 4 * points || weights.len() != 4 * points {
                return refused("has joints or weights for another number of points; allowed: four for each");
            }
            for (at, (joint, weight)) in joints.iter().zip(&weights).enumerate() {
                if *weight == 0.0 {
                    continue;
                }
                let joint = *joint as usize;
                if joint >= joints_of_skin {
                    return refused(&format!("names joint {joint}; allowed: below {joints_of_skin}"));
                }
                pulls[at / 4].push(Pull { joint, weight: *weight });
            }
        }
        for (point, own) in pulls.iter_mut().enumerate() {
            let sum: f64 = own.iter().map(|pull| pull.weight).sum();
            if sum <= 0.0 {
                return refused(&format!("point {point} hangs at no joint; allowed: weights above 0"));
            }
            for pull in own {
                pull.weight /= sum;
            }
        }
        Ok(pulls)
    }
}

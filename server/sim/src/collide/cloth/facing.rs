//! Colliders as a particle of cloth asks them: with what it knows of those that are meshes.

use std::ops::Deref;

use crate::collide::{
    collider::Collider,
    shape::{MeshSolid, Near, Shape},
};

/// A collider, and what is known of it around a particle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing<'a> {
    pub(crate) collider: &'a Collider,
    near: Option<&'a Near>,
}

impl<'a> From<&'a Collider> for Facing<'a> {
    fn from(collider: &'a Collider) -> Self {
        Self { collider, near: None }
    }
}

impl Deref for Facing<'_> {
    type Target = Collider;

    fn deref(&self) -> &Collider {
        self.collider
    }
}

impl PartialEq for Facing<'_> {
    /// Whether both are the same collider.
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.collider, other.collider)
    }
}

impl Facing<'_> {
    /// [`Collider::distance`], from what is known if that is enough.
    #[inline]
    pub(crate) fn distance(&self, point: [f64; 3], time: f64) -> (f64, [f64; 3]) {
        if let Some(near) = self.near
            && let Some(mesh) = mesh(self.collider)
            && let Some((distance, normal)) = mesh.by_near(self.collider.place(point, time), near)
        {
            return (distance, self.collider.outward(normal, time));
        }
        self.collider.distance(point, time)
    }

    /// Whether a point (m) is so far (m) away at a time (s), or farther.
    pub(crate) fn is_beyond(&self, point: [f64; 3], time: f64, reach: f64) -> bool {
        let is_known = self.near.is_some_and(|near| near.at_least(self.collider.place(point, time)) >= reach);
        is_known || self.distance(point, time).0 >= reach
    }
}

/// The mesh that a collider is, if it is one.
pub(crate) fn mesh(collider: &Collider) -> Option<&MeshSolid> {
    match &collider.shape {
        Shape::Mesh(mesh) => Some(mesh),
        _ => None,
    }
}

/// Colliders with what is known of the meshes among them, one after the other; nothing is known where the list is empty.
pub(crate) fn facing<'a>(
    colliders: &'a [Collider],
    near: &'a [Near],
) -> impl Iterator<Item = Facing<'a>> + Clone {
    let mut near = near.iter();
    colliders.iter().map(move |collider| {
        let near = mesh(collider).and_then(|_| near.next());
        Facing { collider, near }
    })
}

//! Laws of elements of a body, on its mesh at rest.

use nappe_sim::{
    cloth::{self, ElementKind, ElementList, Threads, Warp, WarpError},
    mesh::TriangleMesh,
};

use super::size::{Owner, Size};
use crate::{
    body::Body,
    element_law::{ElementLaw, NamedWarp, Stiffness, WarpText},
    error::SceneError,
    location::Location,
};

/// Laws of elements as a body has them written, and where the body stands.
pub(super) struct LawsText<'a> {
    pub(super) body: &'a Body,
    pub(super) at: &'a Location<'a>,
}

impl LawsText<'_> {
    /// Elements of the laws on a mesh. Each is counted as a spring by the limits, for that is about what it takes.
    pub(super) fn elements(
        &self,
        mesh: &TriangleMesh,
        size: &mut Size<'_>,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<ElementList>, SceneError> {
        let is_fabric = self.body.material.is_some();
        let mut lists = Vec::new();
        for (place, law) in self.body.laws_of_all().iter().enumerate() {
            let at = if is_fabric { self.at.key("material") } else { self.at.key("law").index(place) };
            if is_fabric {
                check_mesh(law.name, "has the law", mesh, &at)?;
            } else {
                check_mesh(law.name, "is", mesh, &at.key("name"))?;
            }
            // No law has more than an element per edge.
            size.add_springs(&Owner { at: self.at, noun: "body" }, 3 * mesh.triangles.len() as u64)?;
            let list = match law.name {
                ElementKind::Membrane if is_fabric => membrane(&with_warp(*law, mesh, &at)?, mesh, &at)?,
                ElementKind::Membrane => membrane(law, mesh, &at)?,
                ElementKind::QuadraticBending | ElementKind::Plate => bending(law, mesh, &at)?,
            };
            let (name, dropped) = (law.name.name(), list.bending().map_or(0, |bending| bending.dropped));
            if dropped > 0 {
                warnings.push(format!(
                    "the law {name} resists {dropped} curvatures of its elements with nothing: there, a triangle and the points \
                     across its edges lie nearly on one conic, or are several times as long as wide, and hardly tell how the \
                     sheet bends"
                ));
            }
            if list.corner_count() == 0 {
                warnings.push(format!("the law {name} finds no elements in its mesh"));
            } else {
                lists.push(list);
            }
        }
        Ok(lists)
    }
}

/// Whether a body with a fabric says nothing that the fabric says.
pub(super) fn check_material(body: &Body, at: &Location<'_>) -> Result<(), SceneError> {
    if body.material.is_none() {
        return Ok(());
    }
    let given =
        [("springs", body.springs.is_some()), ("law", !body.laws.is_empty()), ("mass", body.mass.is_some())];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((key, _)) => {
            at.key(key).inconsistent("does not go with material, which says it by the name of a fabric")
        }
        None => Ok(()),
    }
}

/// Whether a mesh has the triangles that a fabric is made of.
pub(super) fn check_triangles(body: &Body, mesh: &TriangleMesh, at: &Location<'_>) -> Result<(), SceneError> {
    if body.material.is_some() && mesh.triangles.is_empty() {
        return at.key("material").inconsistent(
            "is a fabric, which is made of triangles, and the mesh has none: a chain is stretched by springs.stretch and folds by \
             springs.bend",
        );
    }
    Ok(())
}

/// The membrane of a fabric with its warp: without one along the texture coordinates of the mesh.
fn with_warp(law: ElementLaw, mesh: &TriangleMesh, at: &Location<'_>) -> Result<ElementLaw, SceneError> {
    if law.warp.is_none() && mesh.uv.is_empty() {
        return at.inconsistent(
            "needs a warp, for the mesh has no texture coordinates; allowed: warp = [1, 0, 0], or another direction",
        );
    }
    Ok(ElementLaw { warp: law.warp.or(Some(WarpText::Named(NamedWarp::Uv))), ..law })
}

/// Whether a mesh has what a law acts on: for a plate on both sides of an edge one triangle at most. `verb` is what a message
/// begins with.
fn check_mesh(
    law: ElementKind,
    verb: &str,
    mesh: &TriangleMesh,
    at: &Location<'_>,
) -> Result<(), SceneError> {
    let has_none = mesh.triangles.is_empty();
    match law {
        ElementKind::Membrane if has_none => at.inconsistent(format!(
            "{verb} membrane, which stretches triangles, and the mesh has none: a chain is stretched by springs.stretch"
        )),
        ElementKind::Plate if has_none => at.inconsistent(format!(
            "{verb} plate, which bends triangles, and the mesh has none: a chain folds by springs.bend"
        )),
        ElementKind::Plate => {
            let Some([a, b]) = mesh.crowded_edge() else { return Ok(()) };
            at.inconsistent(format!(
                "{verb} plate, which bends edges between two triangles: more than two share the edge from point {a} to {b}; \
                 allowed: one or two at each edge"
            ))
        }
        ElementKind::QuadraticBending | ElementKind::Membrane => Ok(()),
    }
}

/// Elements of a law that bends.
fn bending(law: &ElementLaw, mesh: &TriangleMesh, at: &Location<'_>) -> Result<ElementList, SceneError> {
    let ElementLaw { name, stiffness, damping, warp } = *law;
    let Stiffness::One(stiffness) = stiffness else {
        let message = format!("is three numbers, and {} has one stiffness", name.name());
        return at.key("stiffness").inconsistent(message);
    };
    if warp.is_some() {
        return at
            .key("warp")
            .inconsistent(format!("does not go with {}, which has no threads", name.name()));
    }
    Ok(ElementList::new(name, cloth::SpringLaw { stiffness, damping }, mesh))
}

/// Elements of a membrane: its greatest stiffness, with that along warp and weft and against shear as shares of it.
fn membrane(law: &ElementLaw, mesh: &TriangleMesh, at: &Location<'_>) -> Result<ElementList, SceneError> {
    let ElementLaw { name: _, stiffness, damping, warp } = *law;
    let Stiffness::Three(each) = stiffness else {
        let message =
            "is one number, and membrane has three: along the warp, along the weft and against shear";
        return at.key("stiffness").inconsistent(message);
    };
    let Some(warp) = warp else {
        let message =
            "is membrane, which needs a warp; allowed: warp = \"uv\", or a direction such as [1, 0, 0]";
        return at.key("name").inconsistent(message);
    };
    let warp = match warp {
        WarpText::Named(NamedWarp::Uv) => Warp::Uv,
        WarpText::Direction(direction) if direction == [0.0; 3] => {
            return at.key("warp").inconsistent("is [0, 0, 0], which is no direction");
        }
        WarpText::Direction(direction) => Warp::Along(direction),
    };

    let greatest = each.into_iter().fold(0.0, f64::max);
    let shares = if greatest > 0.0 { each.map(|one| one / greatest) } else { [1.0; 3] };
    let law = cloth::SpringLaw { stiffness: greatest, damping };
    ElementList::membrane(law, Threads { warp, shares }, mesh).or_else(|error| {
        at.key("warp").inconsistent(match error {
            WarpError::NoUv | WarpError::FlatUv { .. } => {
                format!("is uv, and {error}; allowed: a direction such as [1, 0, 0]")
            }
            WarpError::AlongNormals { .. } => format!("gives no warp: {error}"),
        })
    })
}

/// How many springs keep as much as the elements of laws on two triangles of a mesh.
pub(super) fn springs_per_pair(laws: &[ElementLaw]) -> u64 {
    let of_law = |law: &ElementLaw| match law.name {
        ElementKind::QuadraticBending => 3,
        ElementKind::Plate => 6,
        ElementKind::Membrane => 8,
    };
    laws.iter().map(of_law).sum()
}

/// Stiffness (N/m) and damping (N s/m) of springs that take as much of a step as the membranes among laws, on triangles that are
/// halves of squares.
pub(super) fn as_springs(laws: &[ElementLaw], triangles: u64) -> [f64; 2] {
    let [mut stiffness, mut damping] = [0.0; 2];
    for law in laws {
        if let Stiffness::Three([warp, weft, shear]) = law.stiffness {
            let (greatest, of_triangle) = (warp.max(weft).max(shear), 0.5 * (warp + weft) + 1.46 * shear);
            stiffness += of_triangle * triangles as f64;
            if greatest > 0.0 {
                damping += law.damping * of_triangle / greatest * triangles as f64;
            }
        }
    }
    [stiffness, damping]
}

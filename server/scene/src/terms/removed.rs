//! A scene with its terms listed, and the same scene without some of them.

use nappe_sim::{
    cloth::{SpringKind, SurfaceSettings},
    math::Precision,
};

use super::{
    cloth::{law_mut, of_bodies, of_springs, of_surfaces},
    snow::{hardening, make_elastic, of_snow},
    term::{Removal, SceneTerm},
};
use crate::{collider::ColliderText, scene::Scene, snow::TransferName};

impl Scene {
    /// The terms of its cloths; of a scene without cloth those of its snow. Where there are both, what acts on both is no term: cloth
    /// alone does not tell whether snow can do without it.
    pub fn terms(&self) -> Vec<SceneTerm> {
        let Self {
            version: _,
            title: _,
            dt: _,
            steps: _,
            frame_interval: _,
            precision,
            gravity: _,
            wind,
            wind_at,
            hash_interval: _,
            contact,
            rest: _,
            bodies,
            figures: _,
            snow,
            colliders,
            source: _,
        } = self;
        let mut terms = of_springs(bodies);
        let winds = wind_at.iter().map(|key| key.velocity).chain([*wind]);
        let is_of_one = bodies.is_empty() || snow.is_none();
        // Wind that snow feels too acts on both.
        let is_felt = is_of_one || snow.as_ref().is_some_and(|snow| snow.drag == 0.0);
        terms.extend(of_bodies(bodies, winds.clone().filter(|_| is_felt)));
        terms.extend(of_surfaces(bodies, contact.unwrap_or_default().friction));
        if bodies.is_empty() {
            terms.extend(snow.iter().flat_map(|snow| of_snow(snow, winds.clone())));
        }
        for (place, collider) in colliders.iter().enumerate() {
            let ColliderText {
                name,
                shape: _,
                velocity: _,
                friction,
                restitution,
                margin: _,
                contact: _,
                recovery: _,
                on_start_inside: _,
                keys: _,
            } = collider;
            if is_of_one {
                terms.push(SceneTerm::new(format!("collider {name}"), Removal::Collider(place)));
            }
            if is_of_one && *friction > 0.0 {
                terms.push(SceneTerm::new(format!("friction of {name}"), Removal::Friction(place)));
            }
            // Snow takes none.
            if !bodies.is_empty() && *restitution > 0.0 {
                terms.push(SceneTerm::new(format!("restitution of {name}"), Removal::Restitution(place)));
            }
        }
        if is_of_one && *precision == Precision::F64 {
            terms.push(SceneTerm::new("f64: half of its digits", Removal::Digits));
        }
        terms
    }

    /// The same scene without some of its terms: removed, and not set to 0 where that costs what it cost before.
    #[must_use]
    pub fn without(&self, removals: &[Removal]) -> Self {
        let mut left = self.clone();
        for removal in removals {
            left.remove(*removal);
        }
        // Places are those of the whole scene.
        for (place, body) in left.bodies.iter_mut().enumerate() {
            body.laws.retain(|law| !removals.contains(&Removal::Elements(place, law.name)));
        }
        let mut places = 0..;
        left.colliders
            .retain(|_| places.next().is_some_and(|place| !removals.contains(&Removal::Collider(place))));
        // Without a thickness nothing meets them.
        if left.bodies.iter().all(|body| body.thickness == 0.0) {
            left.figures.clear();
        }
        left
    }

    /// Removes a term, but what has a place in a list: that of others would change.
    fn remove(&mut self, removal: Removal) {
        let springs = self.bodies.iter_mut().filter_map(|body| body.springs.as_mut());
        let objects = self.snow.iter_mut().flat_map(|snow| &mut snow.objects);
        match removal {
            Removal::Springs(SpringKind::Stretch) | Removal::Elements(..) | Removal::Collider(_) => {}
            Removal::Springs(SpringKind::Shear) => springs.for_each(|springs| springs.shear = None),
            Removal::Springs(SpringKind::Bend) => springs.for_each(|springs| springs.bend = None),
            Removal::Damping(kind) => {
                springs.filter_map(|springs| law_mut(springs, kind)).for_each(|law| law.damping = 0.0);
            }
            Removal::ElementDamping(body, kind) => {
                let laws = self.bodies.get_mut(body).into_iter().flat_map(|body| &mut body.laws);
                laws.filter(|law| law.name == kind).for_each(|law| law.damping = 0.0);
            }
            Removal::FabricDamping(place) => {
                let body = self.bodies.get_mut(place);
                if let Some(material) = body.and_then(|body| body.material.as_mut()) {
                    material.damping = Some(0.0);
                }
            }
            Removal::Thickness(place) => {
                if let Some(body) = self.bodies.get_mut(place) {
                    body.thickness = 0.0;
                }
            }
            Removal::SurfaceFriction => {
                self.contact = Some(SurfaceSettings { friction: 0.0, ..self.contact.unwrap_or_default() });
            }
            Removal::Drag => self.bodies.iter_mut().for_each(|body| body.drag = 0.0),
            Removal::SnowDrag => self.snow.iter_mut().for_each(|snow| snow.drag = 0.0),
            Removal::Air => self.bodies.iter_mut().for_each(|body| body.air = None),
            Removal::Wind => {
                self.wind = [0.0; 3];
                self.wind_at.clear();
            }
            Removal::Friction(place) => {
                if let Some(collider) = self.colliders.get_mut(place) {
                    collider.friction = 0.0;
                }
            }
            Removal::Restitution(place) => {
                if let Some(collider) = self.colliders.get_mut(place) {
                    collider.restitution = 0.0;
                }
            }
            Removal::Plasticity => objects.for_each(|object| make_elastic(&mut object.material)),
            Removal::Hardening => {
                let yielding = objects.filter(|object| hardening(&object.material).is_some());
                yielding.for_each(|object| object.material.hardening = Some(0.0));
            }
            Removal::DensityNoise => objects.for_each(|object| object.density_noise = 0.0),
            Removal::StiffnessNoise => objects.for_each(|object| object.stiffness_noise = 0.0),
            Removal::Flip => {
                let snow = self.snow.iter_mut().filter(|snow| snow.transfer == TransferName::PicFlip);
                snow.for_each(|snow| (snow.flip, snow.flip_time) = (Some(0.0), None));
            }
            Removal::Digits => self.precision = Precision::F32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOTH: &str = "version = 1\ndt = 0.01\nsteps = 10\nwind = [1, 0, 0]\nprecision = \"f64\"\n[[body]]\nname = \"cloth\"\n\
        mesh = { grid = [4, 4], spacing = 0.1 }\nmass = { particle = 0.01 }\ndrag = 0.1\n\
        springs = { stretch = { stiffness = 100, damping = 1 }, bend = { stiffness = 5 } }\n\
        law = [{ name = \"quadratic_bending\", stiffness = 1e-4, damping = 1e-6 }]\n\
        [[collider]]\nname = \"a\"\nplane = { point = [0, -1, 0], normal = [0, 1, 0] }\nfriction = 0.5\n\
        [[collider]]\nname = \"b\"\nplane = { point = [0, -2, 0], normal = [0, 1, 0] }\nrestitution = 0.5\n";
    const SNOW: &str = "version = 1\ndt = 0.01\nsteps = 10\nwind = [0, 0, 2]\n[snow]\ncell = 0.1\ndrag = 0.5\ntransfer = \"pic_flip\"\nflip_time = 0.1\n\
        [[snow.object]]\nname = \"block\"\nbox = { center = [0, 1, 0], size = [0.2, 0.2, 0.2] }\nstiffness_noise = 0.1\n\
        material = { critical_stretch = 0.01, hardening = 5 }\n\
        [[snow.object]]\nname = \"ball\"\nsphere = { center = [0, 2, 0], radius = 0.2 }\nmaterial = { preset = \"elastic\" }\n";

    fn names(scene: &Scene) -> Vec<String> {
        scene.terms().into_iter().map(|term| term.name).collect()
    }

    #[test]
    fn every_term_that_is_removed_is_gone_and_no_other_is() {
        for (text, count) in [(CLOTH, 11), (SNOW, 6)] {
            let scene = Scene::parse(text, "small.toml").expect("a scene");
            let terms = scene.terms();
            assert_eq!(terms.len(), count, "{:?}", names(&scene));
            for term in &terms {
                let left = scene.without(&[term.removal]);
                let mut expected = names(&scene);
                // What a term is a part of takes it along.
                expected.retain(|name| match term.removal {
                    Removal::Elements(..) | Removal::Collider(_) => {
                        !name.ends_with(&term.name.replace("collider ", "of ")) && *name != term.name
                    }
                    Removal::Drag | Removal::SnowDrag => name != "drag" && name != "wind",
                    Removal::Plasticity => name != "plasticity" && name != "hardening",
                    _ => *name != term.name,
                });
                assert_eq!(names(&left), expected, "without {}", term.name);
                left.check().unwrap_or_else(|error| panic!("without {}: {error}", term.name));
            }
            let all: Vec<Removal> = terms.iter().map(|term| term.removal).collect();
            let left = scene.without(&all);
            assert!(left.terms().is_empty(), "{:?}", names(&left));
            let again = Scene::parse(&left.to_toml(), "again.toml").expect("a scene");
            assert!(again.terms().is_empty());
        }
    }

    #[test]
    fn a_thickness_and_its_friction_are_terms() {
        let text = CLOTH.replace("name = \"cloth\"\n", "name = \"cloth\"\nthickness = 0.001\n");
        let scene = Scene::parse(&text, "thick.toml").expect("a scene");
        let is_new = |name: &String| name == "thickness of cloth" || name == "friction of surfaces";
        assert_eq!(names(&scene).into_iter().filter(is_new).count(), 2);
        let left = scene.without(&[Removal::SurfaceFriction]);
        let friction = left.contact.map(|contact| contact.friction);
        assert_eq!((friction, left.bodies[0].thickness), (Some(0.0), 0.001));
        let left = scene.without(&[Removal::Thickness(0)]);
        assert_eq!((names(&left).into_iter().filter(is_new).count(), left.bodies[0].thickness), (0, 0.0));
    }

    #[test]
    fn what_acts_on_cloth_and_snow_is_no_term_of_a_scene_of_both() {
        let (_, snow) = SNOW.split_once("[snow]").expect("snow");
        let scene = Scene::parse(&format!("{CLOTH}[snow]{snow}"), "both.toml").expect("a scene");
        let names = names(&scene);
        assert!(names.iter().any(|name| name == "springs of bend"), "{names:?}");
        for shared in ["collider a", "friction of a", "wind", "f64: half of its digits", "plasticity"] {
            assert!(!names.iter().any(|name| name == shared), "{names:?}");
        }
    }
}

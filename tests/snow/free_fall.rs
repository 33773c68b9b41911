//! Free fall, exactly as symplectic Euler has it, for every kernel, transfer and step.

use nappe_sim::math::Precision;
use nappe_tests::{
    networks::scatter,
    scene::advance,
    snow::{SnowScene, Variant, elastic, lattice, object},
};

const H: f64 = 0.1;

#[test]
fn free_fall_is_exact() {
    let (v, gravity) = ([0.7, 2.0, -0.4], [0.3, -9.81, 0.1]);
    for variant in Variant::all() {
        for dt in [1e-4, 1.3e-3, 2.7e-3] {
            let mut x = lattice([0.02, 0.5, -0.9], [7, 5, 6], [0.5 * H; 3]);
            x.extend((0..10).map(|i| [0, 1, 2].map(|a| 2.0 + 2.0 * scatter(3 * i + a))));
            let body = object("snow", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
            let scene = SnowScene::new(vec![body], H, dt).by(variant).moving(|_| v).under(gravity);
            let mut simulation = scene.simulate(Precision::F64);
            advance(&mut simulation, 100);
            let t = 100.0 * dt;

            for (p, start) in simulation.snow_particles().iter().zip(&scene.objects[0].x) {
                for a in 0..3 {
                    let exact = start[a] + v[a] * t + 0.5 * gravity[a] * t * (t + dt);
                    let off = (p.x[a] - exact).abs() / (start[a].abs() + 1.0);
                    assert!(off < 1e-12, "{}, dt = {dt} s: off by {off:e}", variant.name());
                    let exact = v[a] + gravity[a] * t;
                    let off = (p.v[a] - exact).abs();
                    assert!(off < 1e-12, "{}, dt = {dt} s: velocity off by {off:e}", variant.name());
                }
            }
        }
    }
}

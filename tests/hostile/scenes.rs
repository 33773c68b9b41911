//! Texts of scenes whose numbers lie anywhere in the ranges of the format, each well formed.

use std::fmt::Write as _;

use fastrand::Rng;

/// A number from the whole range of lengths, as likely small as large.
fn length(random: &mut Rng) -> f64 {
    10.0_f64.powf(-6.0 + 12.0 * random.f64())
}

/// A coordinate, as likely near as far.
pub(crate) fn coordinate(random: &mut Rng) -> f64 {
    size(random) * [1.0, -1.0, 0.0][random.usize(0..3)]
}

/// A length, more often one that a user would write.
fn size(random: &mut Rng) -> f64 {
    if random.bool() { length(random) } else { 0.01 + random.f64() }
}

fn vector(random: &mut Rng, mut component: impl FnMut(&mut Rng) -> f64) -> String {
    let [x, y, z] = [0; 3].map(|_| component(random));
    format!("[{x:e}, {y:e}, {z:e}]")
}

/// A whole number, as likely of few digits as of many.
fn whole(random: &mut Rng, most: f64) -> u64 {
    most.powf(random.f64()) as u64
}

/// A scene of snow, or of cloth.
pub(crate) fn hostile(random: &mut Rng) -> String {
    let mut text = format!("version = 1\ndt = {:e}\n", 10.0_f64.powf(-6.0 + 4.0 * random.f64()));
    let add = if random.u8(0..4) == 0 { cloth } else { snow };
    add(random, &mut text);
    text
}

fn snow(random: &mut Rng, text: &mut String) {
    writeln!(text, "[snow]\ncell = {:e}", size(random)).expect("a string takes it");
    for name in 0..random.u8(1..4) {
        let center = vector(random, |random| size(random) - 0.5);
        let source = if random.bool() {
            format!("box = {{ center = {center}, size = {} }}", vector(random, size))
        } else {
            format!("sphere = {{ center = {center}, radius = {:e} }}", size(random))
        };
        let count = match random.u8(0..3) {
            0 => String::new(),
            1 => format!("particles_per_cell = {:e}", 10.0_f64.powf(-3.0 + 6.0 * random.f64())),
            _ => format!("particles = {}", whole(random, 2e3)),
        };
        let sampling = ["jittered", "lattice", "poisson"][random.usize(0..3)];
        let object = format!(
            "[[snow.object]]\nname = \"{name}\"\n{source}\n{count}\nsampling = \"{sampling}\"\nseed = {}\n",
            random.u32(..)
        );
        text.push_str(&object);
        if random.u8(0..4) == 0 {
            let velocity = vector(random, |random| 1e3 * (random.f64() - 0.5));
            writeln!(text, "volume = \"grid\"\nvelocity = {velocity}").expect("a string takes it");
        }
    }
}

fn cloth(random: &mut Rng, text: &mut String) {
    let spacing = size(random).min(1e3);
    let (most, pattern) = (5e3, ["lattice", "edges"][random.usize(0..2)]);
    let mesh = match random.u8(0..3) {
        0 => format!("chain = {}", whole(random, most)),
        1 => format!("grid = [1, {}]", whole(random, most)),
        _ => format!("grid = [{}, {}]", whole(random, 100.0), whole(random, 100.0)),
    };
    let law = "{ stiffness = 100.0, damping = 0.1 }";
    let springs = format!("stretch = {law}, shear = {law}, bend = {law}");
    let pattern = if mesh.starts_with("grid") { format!("pattern = \"{pattern}\", ") } else { String::new() };
    let body = format!(
        "[[body]]\nname = \"cloth\"\nmesh = {{ {mesh}, spacing = {spacing:e} }}\nmass = {{ particle = 0.1 }}\n\
         springs = {{ {pattern}{springs} }}\n"
    );
    text.push_str(&body);
}

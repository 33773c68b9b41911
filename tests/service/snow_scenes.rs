//! Scenes of snow for the suite: a ball that hits the floor, a block at rest.

/// A ball of snow, 0.4 m across and just above the floor, with 8 particles per cell, falling at 4 m/s:
/// what a scene needs besides its root. `settings` are further fields of the snow.
pub(crate) fn ball(settings: &str) -> String {
    format!(
        r#"
        [snow]
        cell = 0.1
        {settings}
        [[snow.object]]
        name = "ball"
        sphere = {{ center = [0, 0.23, 0], radius = 0.2 }}
        velocity = [0, -4, 0]
        [[collider]]
        name = "floor"
        plane = {{ point = [0, 0, 0], normal = [0, 1, 0] }}
        "#
    )
}

/// The ball in a scene whose step is a frame of a film, with more lines at the root.
pub(crate) fn snow_with(root: &str, settings: &str) -> String {
    format!("version = 1\ntitle = \"a ball of snow\"\ndt = 0.041666666666666664\n{root}\n{}", ball(settings))
}

/// The ball with default settings.
pub(crate) fn snow(root: &str) -> String {
    snow_with(root, "")
}

/// A block of `side` x `side` x `side` cells with one particle in each.
pub(crate) fn block(side: u32, root: &str) -> String {
    let size = 0.1 * f64::from(side);
    format!(
        r#"
        version = 1
        title = "a block of snow"
        dt = 0.001
        {root}
        [snow]
        cell = 0.1
        [[snow.object]]
        name = "block"
        box = {{ min = [0, 0, 0], max = [{size}, {size}, {size}] }}
        sampling = "lattice"
        particles_per_cell = 1
        "#
    )
}

/// The ball, higher up, with steps of the snow that are stable in flight, but too long once the floor packs
/// it. With `unchecked` it diverges within a few scene steps, each of which is three steps of the snow.
pub(crate) fn too_long(substep: f64, settings: &str) -> String {
    let dt = format!("dt = {}", 3.0 * substep);
    let root = "frame_interval = 1\nhash_interval = 1";
    let settings = format!("substep = {substep}\n{settings}");
    snow_with(root, &settings).replace("dt = 0.041666666666666664", &dt).replace("0.23", "0.33")
}

/// The same ball with steps that are not checked against the bound.
pub(crate) fn diverging() -> String {
    too_long(0.006, "unchecked = true")
}

//! Scenes of cloth for the suite: a hanging sheet, particles without springs.

/// A sheet of `side` x `side` particles that hangs by two corners, with more lines at the root.
pub(crate) fn sheet_with(side: u32, root: &str) -> String {
    format!(
        r#"
        version = 1
        title = "a sheet of {side}"
        dt = 0.002
        {root}
        [[body]]
        name = "sheet"
        mesh = {{ grid = [{side}, {side}], spacing = 0.1, ripple = 0.01 }}
        mass = {{ density = 0.2 }}
        pins = ["top_left", "top_right"]
        drag = 1e-4
        [body.springs]
        stretch = {{ stiffness = 50, damping = 0.02 }}
        shear = {{ stiffness = 20, damping = 0.01 }}
        "#
    )
}

/// A sheet of `side` x `side` particles that hangs by two corners.
pub(crate) fn sheet(side: u32) -> String {
    sheet_with(side, "")
}

/// `side` x `side` particles without springs: frames of 12 bytes each, and hardly any work.
pub(crate) fn dust(side: u32, root: &str) -> String {
    format!(
        r#"
        version = 1
        title = "dust"
        dt = 0.001
        {root}
        [[body]]
        name = "dust"
        mesh = {{ grid = [{side}, {side}], spacing = 0.1 }}
        mass = {{ density = 0.2 }}
        integrator = "symplectic_euler"
        "#
    )
}

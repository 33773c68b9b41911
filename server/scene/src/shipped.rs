//! The scenes that come with the program.

/// Name and text of each shipped scene, the demo first.
pub fn shipped_scenes() -> &'static [(&'static str, &'static str)] {
    &[
        ("demo", include_str!("../../scenes/demo.toml")),
        ("hanging_sheet", include_str!("../../scenes/hanging_sheet.toml")),
        ("flag", include_str!("../../scenes/flag.toml")),
        ("cloth_over_sphere", include_str!("../../scenes/cloth_over_sphere.toml")),
        ("drap10", include_str!("../../scenes/drap10.toml")),
        ("drap70", include_str!("../../scenes/drap70.toml")),
    ]
}

//! The scenes that come with the program.

/// Name and text of each shipped scene, the demo first.
pub fn shipped_scenes() -> &'static [(&'static str, &'static str)] {
    &[
        ("demo", include_str!("../../scenes/demo.toml")),
        ("hanging_sheet", include_str!("../../scenes/hanging_sheet.toml")),
        ("flag", include_str!("../../scenes/flag.toml")),
        ("cloth_over_sphere", include_str!("../../scenes/cloth_over_sphere.toml")),
        ("cloth_on_torus", include_str!("../../scenes/cloth_on_torus.toml")),
        ("gripper", include_str!("../../scenes/gripper.toml")),
        ("towel", include_str!("../../scenes/towel.toml")),
        ("walker", include_str!("../../scenes/walker.toml")),
        ("five_sheets", include_str!("../../scenes/five_sheets.toml")),
        ("fifty_sheets", include_str!("../../scenes/fifty_sheets.toml")),
        ("squeezed_sheet", include_str!("../../scenes/squeezed_sheet.toml")),
        ("swinging_chain", include_str!("../../scenes/swinging_chain.toml")),
        ("stiff_sheet", include_str!("../../scenes/stiff_sheet.toml")),
        ("folded_strip", include_str!("../../scenes/folded_strip.toml")),
        ("drap10", include_str!("../../scenes/drap10.toml")),
        ("drap70", include_str!("../../scenes/drap70.toml")),
        ("snowball_wall", include_str!("../../scenes/snowball_wall.toml")),
        ("two_snowballs", include_str!("../../scenes/two_snowballs.toml")),
        ("block_on_incline", include_str!("../../scenes/block_on_incline.toml")),
        ("rolling_snowball", include_str!("../../scenes/rolling_snowball.toml")),
        ("sphere_in_bed", include_str!("../../scenes/sphere_in_bed.toml")),
        ("plough", include_str!("../../scenes/plough.toml")),
        ("snow_in_wind", include_str!("../../scenes/snow_in_wind.toml")),
        ("elastic_beam", include_str!("../../scenes/elastic_beam.toml")),
        ("brasseur", include_str!("../../scenes/brasseur.toml")),
        ("snow_and_cloth", include_str!("../../scenes/snow_and_cloth.toml")),
    ]
}

//! Endings of mesh files: what is read, what is written, and what helps with the others.

/// What is read.
pub(crate) const READ: &str =
    ".obj, .off, .ply, .stl, each of them also as .gz, points.eti or the folder that holds it";
/// What is written.
pub(crate) const WRITTEN: &str = ".obj, .off, .ply, points.eti or the folder that holds it";

/// Formats of other programs, and their endings.
const OTHERS: [(&str, &[&str]); 9] = [
    ("glTF", &["gltf", "glb"]),
    ("FBX", &["fbx"]),
    ("Collada", &["dae"]),
    ("USD", &["usd", "usda", "usdc", "usdz"]),
    ("3MF", &["3mf"]),
    ("Alembic", &["abc"]),
    ("STEP", &["stp", "step"]),
    ("VTK", &["vtk", "vtu", "vtp"]),
    ("Gmsh", &["msh"]),
];

/// Why a file with this ending, in small letters, is not read, and what helps.
pub(crate) fn not_read(ending: &str) -> String {
    let known = OTHERS.iter().find(|(_, endings)| endings.contains(&ending));
    let help = known.map_or(String::new(), |(format, _)| {
        format!(
            ", and nappe reads no {format}: export the mesh as .obj or .ply from the program that made it, for instance \
             in Blender with File > Export"
        )
    });
    format!("has the extension '{ending}'{help}; allowed: {READ}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_format_is_named_with_the_way_to_one_that_is_read() {
        for (ending, format) in [("glb", "glTF"), ("usdz", "USD"), ("step", "STEP")] {
            let told = not_read(ending);
            assert!(told.contains(&format!("reads no {format}: export")), "{told}");
            assert!(told.starts_with(&format!("has the extension '{ending}'")), "{told}");
            assert!(told.ends_with(READ), "{told}");
        }
        assert_eq!(not_read("xyz"), format!("has the extension 'xyz'; allowed: {READ}"));
    }
}

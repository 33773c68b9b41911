//! What programs are built from is what the .proto files make: `proto/generated/` against the files of build.rs.

use std::{env, fs, path::Path};

/// The code, and the descriptors for reflection.
const FILES: [&str; 2] = ["nappe.v1.rs", "nappe.v1.binpb"];

#[test]
fn the_committed_code_is_what_the_contract_makes() {
    let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../generated");
    for file in FILES {
        let made = fs::read(Path::new(env!("OUT_DIR")).join(file)).expect("build.rs made it");
        if env::var_os("NAPPE_BLESS").is_some() {
            fs::write(committed.join(file), &made).expect("it can be written");
        }
        let found = fs::read(committed.join(file)).expect("it is committed");
        assert!(
            found == made,
            "proto/generated/{file} is not what proto/nappe/v1 makes: cargo xtask bless pages"
        );
    }
}

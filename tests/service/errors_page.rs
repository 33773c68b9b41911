//! Pages of the documentation that are made from the code.

use std::{fs, path::Path};

#[test]
fn the_page_of_errors_is_what_the_code_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/errors.md");
    let page = nappe_server::errors_page();
    if std::env::var_os("NAPPE_BLESS").is_some() {
        fs::write(&path, &page).expect("the page can be written");
    }

    let written = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == page,
        "docs/errors.md is out of date: run `cargo xtask bless pages` and look at the change"
    );
}

//! Places that documents name: each file and folder in backquotes is there, and each scene has its picture.

use std::fs;

use crate::{
    assert_none,
    tree::{self, Source},
};

/// Folders of the root: a word in backquotes that begins with one of them is a path.
const ROOTS: [&str; 7] = ["proto/", "server/", "client/", "viewer/", "tests/", "deploy/", "docs/"];

/// The paths in a page that stand in backquotes. Words with `*` or blanks are patterns and commands, and
/// a file called `x` stands for one that a reader is going to add.
fn named_paths(page: &str) -> Vec<&str> {
    // Every second piece is in backquotes; a fenced block has an odd number of them on either side.
    let quoted = page.split('`').skip(1).step_by(2);
    let is_path = |word: &&str| {
        let plain = word.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
        plain && ROOTS.iter().any(|root| word.starts_with(root)) && !word.contains("/x.")
    };
    quoted.filter(is_path).collect()
}

/// Paths of a page that lead nowhere.
fn against_places(page: &Source) -> Vec<String> {
    let missing = named_paths(&page.text).into_iter().filter(|path| !tree::root().join(path).exists());
    missing.map(|path| format!("{} names {path}, which is not there", page.path)).collect()
}

#[test]
fn every_path_in_a_document_is_there() {
    let pages = tree::sources(|path| tree::has_extension(path, "md"));
    assert!(pages.iter().map(|page| named_paths(&page.text).len()).sum::<usize>() > 40, "pages name paths");
    assert_none(&pages.iter().flat_map(against_places).collect::<Vec<_>>());
}

#[test]
fn every_shipped_scene_has_a_small_picture_in_the_gallery() {
    let gallery = tree::text("docs/gallery.md");
    let scenes = tree::paths().into_iter().filter(|path| path.starts_with("server/scenes/"));
    for scene in scenes.filter_map(|path| path.split(['/', '.']).nth(2).map(str::to_owned)) {
        let picture = format!("images/gallery/{scene}.png");
        assert!(
            gallery.contains(&picture),
            "docs/gallery.md does not show {scene}: docs/picture/gallery.py draws it"
        );
        let size = fs::metadata(tree::root().join("docs").join(&picture)).map_or(0, |file| file.len());
        assert!((1_000..40_000).contains(&size), "docs/{picture} has {size} bytes");
    }
}

#[test]
fn the_rule_finds_what_it_is_for() {
    let page =
        "See `server/sim`, `server/nothing.rs` and `server/x.rs`.\n```sh\ncat tests/none\n```\n`docs/*.md`";
    assert_eq!(named_paths(page), ["server/sim", "server/nothing.rs"]);
    let complaints = against_places(&Source::example("docs/p.md", page));
    assert_eq!(complaints, ["docs/p.md names server/nothing.rs, which is not there"]);
}

//! Documents speak of what stands: links, scenes, laws, decisions, versions. No comment in them is torn: each that
//! ends has begun, so that its end is not shown as text.

use crate::{
    assert_none,
    tree::{self, Source},
};

/// Relative links of a page that lead nowhere.
fn against_links(page: &Source) -> Vec<String> {
    let folder = page.path.rsplit_once('/').map_or("", |(folder, _)| folder);
    let targets = page.text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let relative = targets.filter(|target| !target.starts_with(['#', '<']) && !target.contains("://"));
    let missing = relative.filter(|target| {
        let file = target.split('#').next().unwrap_or_default();
        !tree::root().join(folder).join(file).exists()
    });
    missing.map(|target| format!("{}: the link to {target} leads nowhere", page.path)).collect()
}

/// Comments of a page that end without having begun, or begin without an end. Code may hold arrows.
fn against_torn_comments(page: &Source) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut in_code = false;
    let mut is_open = false;
    for (index, line) in page.text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        if in_code || line.starts_with("    ") {
            continue;
        }
        // Every second piece is in backquotes.
        for text in line.split('`').step_by(2) {
            let mut marks: Vec<_> = text.match_indices("<!--").chain(text.match_indices("-->")).collect();
            marks.sort_unstable();
            for (_, mark) in marks {
                if mark == "-->" && !is_open {
                    complaints.push(format!("{}:{}: --> ends no comment", page.path, index + 1));
                }
                is_open = mark == "<!--";
            }
        }
    }
    complaints.extend(is_open.then(|| format!("{}: a comment has no end", page.path)));
    complaints
}

/// Names that no page speaks of, each in backquotes or as the end of a path.
fn against_silence(what: &str, names: &[String], pages: &str) -> Vec<String> {
    let silent = names.iter().filter(|name| !pages.contains(&format!("{name}`")));
    silent.map(|name| format!("{what} do not speak of `{name}`")).collect()
}

/// The command-line settings that a file of clap's `Args` declares: `--name`, or as `long = "..."` says.
fn settings(config: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut attribute = "";
    for line in config.lines().map(str::trim) {
        if line.starts_with("#[arg(long") {
            attribute = line;
        } else if let Some((field, _)) = line.strip_prefix("pub ").and_then(|rest| rest.split_once(": ")) {
            let renamed = attribute.split("long = \"").nth(1).and_then(|rest| rest.split('"').next());
            let name = renamed.map_or_else(|| field.replace('_', "-"), str::to_owned);
            found.extend((!attribute.is_empty()).then(|| format!("--{name}")));
            attribute = "";
        }
    }
    found
}

/// File names in `folder` that end in `.extension`, without it.
fn stems(folder: &str, extension: &str) -> Vec<String> {
    let ending = format!(".{extension}");
    let stem = |path: String| Some(path.strip_prefix(folder)?.strip_suffix(&ending)?.to_owned());
    tree::paths().into_iter().filter_map(stem).filter(|stem| !stem.contains('/')).collect()
}

/// The names that a closed set of the numerics gives its variants: `X: "name"` in `names!`.
fn named_variants(code: &str) -> Vec<String> {
    let named = code.split_once("names!(").map_or("", |(_, rest)| rest);
    let name = |line: &str| Some(line.split_once(": \"")?.1.strip_suffix("\",")?.to_owned());
    named.lines().take_while(|line| *line != "});").filter_map(name).collect()
}

fn laws() -> String {
    tree::sources(|path| path.starts_with("docs/laws/")).into_iter().map(|page| page.text).collect()
}

#[test]
fn every_link_between_pages_leads_somewhere() {
    let pages = tree::sources(|path| tree::has_extension(path, "md"));
    assert_none(&pages.iter().flat_map(against_links).collect::<Vec<_>>());
}

#[test]
fn no_page_holds_a_torn_comment() {
    let pages = tree::sources(|path| tree::has_extension(path, "md"));
    assert!(pages.iter().any(|page| page.text.contains("<!--")), "pages have comments");
    assert_none(&pages.iter().flat_map(against_torn_comments).collect::<Vec<_>>());
}

#[test]
fn every_shipped_scene_is_described() {
    let scenes = stems("server/scenes/", "toml");
    assert!(scenes.len() > 3, "there are scenes: {scenes:?}");
    assert_none(&against_silence("docs/scenes.md", &scenes, &tree::text("docs/scenes.md")));
}

#[test]
fn every_law_has_its_page() {
    let integrators = named_variants(&tree::text("server/sim/src/cloth/settings/integrator.rs"));
    assert!(integrators.len() > 3, "there are integrators: {integrators:?}");
    assert_none(&against_silence("docs/laws", &integrators, &laws()));
    let mut files = stems("server/sim/src/cloth/laws/", "rs");
    for room in ["", "motion/", "collider/", "cloth/", "snow/"] {
        files.extend(stems(&format!("server/sim/src/collide/{room}"), "rs"));
    }
    files.retain(|file| file != "mod");
    assert!(files.len() > 1, "there are laws: {files:?}");
    let files: Vec<_> = files.iter().map(|file| format!("{file}.rs")).collect();
    assert_none(&against_silence("docs/laws", &files, &laws()));
}

#[test]
fn every_setting_of_the_server_is_described() {
    let settings = settings(&tree::text("server/src/config.rs"));
    assert!(settings.len() > 15, "the server has settings: {settings:?}");
    assert_none(&against_silence("docs/service.md", &settings, &tree::text("docs/service.md")));
}

#[test]
fn the_changelog_and_the_decisions_are_in_order() {
    let version = format!("## {}", env!("CARGO_PKG_VERSION"));
    assert!(tree::text("docs/CHANGELOG.md").contains(&version), "docs/CHANGELOG.md has no {version}");
    for (index, name) in stems("docs/decisions/", "md").iter().enumerate() {
        assert!(name.starts_with(&format!("{:04}-", index + 1)), "decision {name} is number {}", index + 1);
    }
}

#[test]
fn the_citation_names_the_version_that_is_built() {
    let version = format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(tree::text("CITATION.cff").contains(&version), "CITATION.cff has no line{version}");
}

#[test]
fn the_rules_find_what_they_are_for() {
    let page = Source::example("docs/x.md", "[a](../Cargo.toml#b) [c](nowhere.md) [d](https://e.org)");
    assert_eq!(against_links(&page), ["docs/x.md: the link to nowhere.md leads nowhere"]);
    let torn = |text: &str| against_torn_comments(&Source::example("docs/x.md", text));
    assert_eq!(torn("## A\" of x.md,\nby a program. -->\n"), ["docs/x.md:2: --> ends no comment"]);
    assert_eq!(torn("<!-- a -->\n\n-->\n"), ["docs/x.md:3: --> ends no comment"]);
    assert_eq!(torn("<!-- a\n\ntext\n"), ["docs/x.md: a comment has no end"]);
    assert_none(&torn("<!-- a\nb -->\n\n    A --> B\n\n`A --> B`\n```text\nA --> B\n```\n"));
    let config = "#[arg(long, env = \"A\")]\npub max_sessions: u32,\n#[arg(long = \"allow-origin\")]\npub origins: u8,\npub plain: u8,";
    assert_eq!(settings(config), ["--max-sessions", "--allow-origin"]);
    assert_eq!(against_silence("p", &["flag".to_owned(), "demo".to_owned()], "the `demo` scene").len(), 1);
}

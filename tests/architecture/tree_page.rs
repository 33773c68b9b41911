//! The tree of docs/tree.md, drawn from what the files say of themselves in their first sentence.
//!
//! Enters: paths and texts of all files, and the order in which crates declare their modules. Leaves: the lines of the
//! tree, which `cargo xtask bless pages` writes into the page, and complaints about files that say too little or too much.

use std::{collections::BTreeMap, env, fs};

use crate::{
    assert_none, modules,
    tree::{self, Source},
};

/// The page with the tree.
const PAGE: &str = "docs/tree.md";

/// The page that says of every other page what is in it.
const INDEX: &str = "docs/index.md";

/// How the drawing begins in its page; it ends with the block.
const BEGIN: &str = "```text\nnappe/\n";

/// Columns of the tree and the names in it, and of the words beside them.
const NAMES: usize = 48;
const WORDS: usize = 100;

/// What opens a comment at the beginning of a file.
const MARKS: [&str; 4] = ["//!", "//", "#", DOCSTRING];
const DOCSTRING: &str = "\"\"\"";

/// Entries that follow the others of their folder, in this order.
const ORDER: [&str; 18] = [
    "proto/",
    "proto/nappe/",
    "proto/src/",
    "server/",
    "server/sim/",
    "server/scene/",
    "server/scenes/",
    "server/src/",
    "server/tests/",
    "client/",
    "client/src/",
    "client/tests/",
    "client/cli/",
    "client/examples/",
    "viewer/",
    "tests/",
    "deploy/",
    "docs/",
];

/// What is said of entries that cannot say it themselves.
const SAID: [(&str, &str); 46] = [
    ("Cargo.lock", "Versions of all dependencies, committed since this is a program"),
    ("LICENSE", "MIT or Apache-2.0, at your option"),
    ("LICENSE-APACHE", "The text of Apache-2.0"),
    ("LICENSE-MIT", "The text of MIT"),
    ("README.md", "What nappe is, a picture, two commands"),
    ("client/README.md", "The library, the command, examples"),
    ("client/cli/tests/", "The command from outside, and the files that it writes of two frames"),
    (
        "client/cli/tests/golden/",
        "What each writer makes of the same two frames, for readers in any language",
    ),
    ("client/examples/", "Programs that use a server, in Rust and in Python"),
    ("client/python/", "The package for Python: numpy arrays, sync and with asyncio"),
    ("client/python/README.md", "What the package is, ten lines of code"),
    ("client/python/src/", "The package itself"),
    ("client/python/src/nappe/contract.binpb", "The contract as data; made from `proto/nappe`"),
    ("client/python/src/nappe/py.typed", "Says that the package has types"),
    ("client/python/src/nappe/reasons.json", "Why a call can fail; made from `proto/src/reason.rs`"),
    ("client/python/src/nappe/replay.html", "The page of recordings, as `viewer/web` builds it"),
    (
        "client/python/src/nappe/examples/notebook.ipynb",
        "A session in a notebook: arrays, and the run as a page in a cell",
    ),
    ("client/python/tools/", "Writes the reference of its page; measures it; adds programs to its wheel"),
    ("client/python/tests/", "Its tests: the core on made messages, the rest on the real server"),
    ("client/typescript/", "The package for browsers and Node: gRPC-Web over `fetch`, streams that resume"),
    ("client/tests/", "Frames from made messages, as a program meets them"),
    ("deploy/", "Runs a server somewhere"),
    ("docs/", "What is written for readers"),
    ("docs/decisions/", "Why things are as they are, in a page each"),
    (
        "docs/guides/",
        "A page for each use: which numbers to start from, teaching, learning, Blender; questions",
    ),
    ("docs/images/", "Pictures"),
    ("proto/generate/", "Makes the Rust code of the contract, and compares it with `proto/generated/`"),
    ("proto/generated/", "The Rust code of the contract, from which programs are built"),
    ("viewer/proven.txt", "A hash of what the viewer is made from, as it was last proven"),
    ("docs/index.md", "Every document, by purpose"),
    ("docs/laws/", "A page per law: equation, units, limits, proof; mutants, and the tests that catch them"),
    ("docs/picture/", "Scripts that draw the pictures of scenes"),
    ("docs/tutorials/", "Your own scene, client and integrator, run by `cargo xtask tutorials`"),
    ("proto/image.binpb", "The contract that clients were compiled from, for `buf breaking`"),
    ("proto/nappe/v1/", "The contract itself, for any language"),
    ("proto/nappe/v1/reasons.json", "Why a call can fail, for any language; made from `reason.rs`"),
    ("proto/tests/", "What the contract says in code, against golden vectors and random numbers"),
    ("proto/tests/packed/", "Golden vectors of packed arrays, for any language"),
    ("server/scene/tests/", "Every shipped scene, every message about a scene, mesh files"),
    ("server/scenes/", "Scenes that come with nappe, each also a test"),
    ("server/tests/", "The built program, from outside"),
    ("tests/", "Proves it: suites, what they share, and the tasks that run them"),
    ("tests/golden/", "Reference data, and the committed hashes"),
    ("tests/peers/", "Other programs on the same work, for comparison"),
    ("tests/xtask/", "`cargo xtask`: checks, tests, proofs, and the files that are made from the code"),
    ("viewer/web/", "The pages of recordings and of the server, in TypeScript; what is built is in `dist`"),
];

/// Folders of files of one kind, which take one line.
const ONE_LINE: [&str; 6] = [
    "client/cli/tests/golden/",
    "client/typescript/",
    "proto/generated/",
    "proto/tests/packed/",
    "server/scenes/",
    "viewer/web/",
];

/// What the tree is drawn from.
struct Repository {
    /// The text of each file; empty where it is none.
    texts: BTreeMap<String, String>,
    /// The place of each file of a crate in reading order.
    places: BTreeMap<String, usize>,
}

impl Repository {
    fn new(paths: &[String], sources: &[Source]) -> Self {
        let mut texts: BTreeMap<_, _> = paths.iter().map(|path| (path.clone(), String::new())).collect();
        texts.extend(sources.iter().map(|source| (source.path.clone(), source.text.clone())));

        let is_rust = |source: &&Source| tree::has_extension(&source.path, "rs");
        let rust: Vec<_> = sources.iter().filter(is_rust).cloned().collect();
        let mut places = BTreeMap::new();
        for (place, file) in modules::reading_order(&rust).into_iter().enumerate() {
            places.entry(file).or_insert(place);
        }
        Self { texts, places }
    }

    /// The lines of the tree, and complaints about what they are made from.
    fn drawing(&self) -> (String, Vec<String>) {
        let (mut page, mut complaints) = (String::new(), Vec::new());
        self.draw("", "", &mut page, &mut complaints);
        (page, complaints)
    }

    /// Adds a line for each entry of `folder`, and for what stands in it; `indent` is to the left of all.
    fn draw(&self, folder: &str, indent: &str, page: &mut String, complaints: &mut Vec<String>) {
        let head = self.head(folder);
        let mut entries = self.entries(folder);
        entries.retain(|entry| Some(entry) != head.as_ref());

        let last = entries.len();
        for (number, entry) in (1..).zip(entries) {
            let (branch, below) =
                if number == last { ("└── ", "    ") } else { ("├── ", "│   ") };
            let entry = self.joined(entry);
            if folder.is_empty() && listed(&entry) > 0 {
                page.push_str("│\n");
            }

            let words = self.said(&entry).unwrap_or_else(|complaint| {
                complaints.push(complaint);
                String::new()
            });
            let name = format!("{indent}{branch}{}", &entry[folder.len()..]);
            let line = format!("{name:<NAMES$}  {words}");
            page.push_str(line.trim_end());
            page.push('\n');

            if entry.ends_with('/') && !self.is_closed(&entry) {
                self.draw(&entry, &format!("{indent}{below}"), page, complaints);
            }
        }
    }

    /// What stands in a folder: what `ORDER` lists comes last, and modules come as they are declared.
    fn entries(&self, folder: &str) -> Vec<String> {
        let mut found: BTreeMap<String, usize> = BTreeMap::new();
        for path in self.texts.keys() {
            let Some(rest) = path.strip_prefix(folder) else { continue };
            let name = rest.split_inclusive('/').next().unwrap_or_default();
            let place = self.places.get(path).copied().unwrap_or(usize::MAX);
            let first = found.entry(format!("{folder}{name}")).or_insert(place);
            *first = place.min(*first);
        }
        if self.is_crate(folder) {
            // The line of the folder has the name of the crate.
            found.remove(&format!("{folder}Cargo.toml"));
        }

        let mut entries: Vec<_> = found.into_iter().collect();
        entries.sort_by_key(|(entry, place)| (listed(entry), *place));
        entries.into_iter().map(|(entry, _)| entry).collect()
    }

    /// An entry, or the only entry of a folder that needs no line of its own.
    fn joined(&self, entry: String) -> String {
        let is_plain = entry.ends_with('/') && !self.is_closed(&entry) && !self.is_crate(&entry);
        match self.entries(&entry).as_slice() {
            [only] if is_plain && fixed(&entry).is_none() => self.joined(only.clone()),
            _ => entry,
        }
    }

    /// Whether a folder takes one line: pages of one kind, suites of tests, scenes.
    fn is_closed(&self, folder: &str) -> bool {
        let is_below = |top: &str| folder.len() > top.len() && folder.starts_with(top);
        let is_suite = !folder.contains("src/") && self.texts.contains_key(&format!("{folder}main.rs"));
        is_below("docs/") || is_below("tests/") || ONE_LINE.contains(&folder) || is_suite
    }

    /// Whether a folder holds a crate; the root holds the workspace.
    fn is_crate(&self, folder: &str) -> bool {
        !folder.is_empty() && self.texts.contains_key(&format!("{folder}Cargo.toml"))
    }

    /// The file that opens a folder of modules.
    fn head(&self, folder: &str) -> Option<String> {
        let names = ["mod.rs", "lib.rs", "main.rs", "__init__.py"].map(|name| format!("{folder}{name}"));
        names.into_iter().find(|path| self.texts.contains_key(path))
    }

    /// What stands beside an entry, or a complaint.
    fn said(&self, entry: &str) -> Result<String, String> {
        let words = fixed(entry).map(str::to_owned).or_else(|| self.sentence(entry));
        let words = words
            .ok_or_else(|| format!("{entry}: neither its first sentence nor {INDEX} says what it is"))?;

        let manifest = self.texts.get(&format!("{entry}Cargo.toml"));
        let name = manifest.and_then(|text| text.split("name = \"").nth(1)?.split('"').next());
        let name = name.map(|name| format!(" ({name})")).unwrap_or_default();

        let words = format!("{}{name}", shortened(&words, WORDS - width(&name)));
        if width(&words) <= WORDS {
            Ok(words)
        } else {
            Err(format!("{entry}: its first sentence has {} characters, more than {WORDS}", width(&words)))
        }
    }

    /// What an entry says of itself, a folder by the file that opens it; sources are what their crate is.
    fn sentence(&self, entry: &str) -> Option<String> {
        if entry.strip_suffix("src/").is_some_and(|parent| self.is_crate(parent)) {
            Some(String::new())
        } else if entry.ends_with('/') {
            self.sentence(&self.head(entry).or_else(|| self.head(&format!("{entry}src/")))?)
        } else if tree::has_extension(entry, "md") {
            self.in_index(entry)
        } else {
            first_sentence(self.texts.get(entry)?)
        }
    }

    /// What the index of pages says of one.
    fn in_index(&self, page: &str) -> Option<String> {
        let in_docs = page.strip_prefix("docs/").map(|name| format!("]({name})"));
        let link = in_docs.unwrap_or_else(|| format!("](../{page})"));
        let mut rows = self.texts.get(INDEX)?.lines().filter_map(|row| row.split_once(" | "));
        let (_, words) = rows.find(|(name, _)| name.starts_with("| [") && name.ends_with(&link))?;
        let mut letters = words.strip_suffix(" |")?.chars();
        Some(letters.next()?.to_uppercase().chain(letters).collect())
    }

    /// Complaints about names in a list of this file that nothing in the repository has.
    fn against_list(&self, names: &[&str]) -> Vec<String> {
        let is_there = |name: &str| {
            self.texts.keys().any(|path| path == name || name.ends_with('/') && path.starts_with(name))
        };
        let gone = names.iter().filter(|name| !is_there(name));
        gone.map(|name| format!("tests/architecture/tree_page.rs lists {name}, which is not there")).collect()
    }
}

/// The place of an entry in `ORDER`, from 1 on; 0 without one.
fn listed(entry: &str) -> usize {
    ORDER.iter().position(|known| *known == entry).map_or(0, |place| place + 1)
}

/// What `SAID` says of an entry.
fn fixed(entry: &str) -> Option<&'static str> {
    SAID.iter().find(|(known, _)| *known == entry).map(|(_, words)| *words)
}

fn width(text: &str) -> usize {
    text.chars().count()
}

/// The first sentence of the comment with which a text begins, without its full stop.
fn first_sentence(text: &str) -> Option<String> {
    let mut lines = text.lines().skip_while(|line| line.starts_with("#!"));
    let first = lines.next()?;
    let mark = MARKS.into_iter().find(|mark| first.starts_with(*mark))?;
    let more = lines.map_while(|line| if mark == DOCSTRING { Some(line) } else { line.strip_prefix(mark) });
    let comment = first.strip_prefix(mark).into_iter().chain(more).map(str::trim);
    let paragraph = comment.take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
    let paragraph = paragraph.split(DOCSTRING).next().unwrap_or_default();

    // A full stop ends a sentence where another begins; "et al. 2013" goes on.
    let begins = |rest: &str| rest.starts_with(|c: char| c.is_ascii_uppercase() || c == '`');
    let end = paragraph.match_indices(". ").map(|(at, _)| at).find(|at| begins(&paragraph[at + 2..]));
    let sentence = &paragraph[..end.unwrap_or(paragraph.len())];
    let sentence = sentence.strip_suffix('.').unwrap_or(sentence);
    (!sentence.is_empty()).then(|| sentence.to_owned())
}

/// All words that have room; or else those before a colon or a semicolon, the last one that leaves few enough.
fn shortened(words: &str, room: usize) -> &str {
    let ends = words.match_indices(": ").chain(words.match_indices("; "));
    let parts = ends.map(|(at, _)| &words[..at]).chain([words]).filter(|part| width(part) <= room);
    // A parenthesis is not cut.
    let whole = parts.filter(|part| part.matches('(').count() == part.matches(')').count());
    whole.max_by_key(|part| part.len()).unwrap_or(words)
}

/// A page with other lines in its tree.
fn with_tree(page: &str, drawing: &str) -> String {
    let (before, rest) = page.split_once(BEGIN).expect("the page has a tree");
    let (_, after) = rest.split_once("\n```").expect("the block of the tree ends");
    format!("{before}{BEGIN}{drawing}```{after}")
}

#[test]
fn the_drawn_tree_is_made_from_the_files() {
    let repository = Repository::new(&tree::paths(), &tree::sources(|_| true));
    let (drawing, mut complaints) = repository.drawing();
    complaints.extend(repository.against_list(&ORDER));
    complaints.extend(repository.against_list(&SAID.map(|(name, _)| name)));
    assert_none(&complaints);

    let made = with_tree(&tree::text(PAGE), &drawing);
    if env::var_os("NAPPE_BLESS").is_some_and(|value| value == "1") {
        fs::write(tree::root().join(PAGE), &made).expect("the page can be written");
    }
    let written = tree::text(PAGE);
    for (made, written) in made.lines().zip(written.lines()) {
        assert_eq!(made, written, "{PAGE} (cargo xtask bless pages writes it)");
    }
    assert!(made == written, "{PAGE} has other lines (cargo xtask bless pages writes it)");
}

#[test]
fn a_tree_is_drawn_in_reading_order_with_first_sentences() {
    let long = format!("//! A letter (so: one); it has {}.\n", "word ".repeat(20));
    let sources = [
        ("run", "#!/bin/sh\n# Runs `a` and `b`.\n# Twice. Not more.\nexit\n"),
        ("a/Cargo.toml", "[package]\nname = \"nappe-a\"\n"),
        ("a/src/lib.rs", "//! Numbers: in, and out.\n\nmod z;\nmod b;\n"),
        ("a/src/z.rs", "//! The end (Zara et al. 2001) of\n//! the alphabet. See `b`.\n//!\n//! More.\n"),
        ("a/src/b/mod.rs", "//! Letters.\nmod y;\nmod c;\n"),
        ("a/src/b/y.rs", "//! Another. `x` is none.\n"),
        ("a/src/b/c.rs", long.as_str()),
        ("a/tests/suite/main.rs", "//! The suite.\nmod part;\n"),
        ("a/tests/suite/part.rs", "//! A part of it.\n"),
        ("docs/index.md", "| [Page](x.md) | what it says |\n"),
        ("docs/x.md", "# X\n"),
    ];
    let sources = sources.map(|(path, text)| Source::example(path, text));
    let (drawing, complaints) = Repository::new(&[], &sources).drawing();
    let wanted = "\
├── a/                                            Numbers: in, and out (nappe-a)
│   ├── src/
│   │   ├── z.rs                                  The end (Zara et al. 2001) of the alphabet
│   │   └── b/                                    Letters
│   │       ├── y.rs                              Another
│   │       └── c.rs                              A letter (so: one)
│   └── tests/suite/                              The suite
├── run                                           Runs `a` and `b`
│
└── docs/                                         What is written for readers
    ├── index.md                                  Every document, by purpose
    └── x.md                                      What it says
";
    assert_none(&complaints);
    assert_eq!(drawing, wanted);
    let page = with_tree("x\n```text\nnappe/\nold\n```\ny\n", &drawing);
    assert_eq!(page, format!("x\n{BEGIN}{wanted}```\ny\n"));
}

#[test]
fn the_rules_find_what_they_are_for() {
    let long = format!("# {}\n", "word ".repeat(21));
    let sources = [Source::example("a.sh", "exit\n"), Source::example("b.sh", &long)];
    let repository = Repository::new(&["c.bin".to_owned()], &sources);
    let (drawing, complaints) = repository.drawing();
    assert_eq!(drawing, "├── a.sh\n├── b.sh\n└── c.bin\n");
    assert_eq!(
        complaints,
        [
            "a.sh: neither its first sentence nor docs/index.md says what it is",
            "b.sh: its first sentence has 104 characters, more than 100",
            "c.bin: neither its first sentence nor docs/index.md says what it is",
        ]
    );
    assert_eq!(repository.against_list(&["a.sh", "gone/", "a.s"]).len(), 2, "gone/ and a.s");
}

//! The modules of a crate, read from its files: what each declares, imports and names.

use std::collections::BTreeSet;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

use crate::{
    tokens,
    tree::{self, Source},
};

/// Words before the name of an item.
const ITEMS: [&str; 9] = ["fn", "struct", "enum", "trait", "type", "const", "static", "union", "macro_rules"];

/// A module: a file, or a part of one in braces.
#[derive(Debug, Default)]
pub(super) struct Module {
    /// Its name; empty for the root of a crate.
    pub(super) name: String,
    /// File that it stands in, from the root of the repository.
    pub(super) file: String,
    /// Number of the module above it; the root is above itself.
    pub(super) parent: usize,
    /// Numbers of the modules that it declares, in order.
    pub(super) children: Vec<usize>,
    /// Names that `use` brings into it.
    pub(super) imports: Vec<Import>,
    /// Paths whose names it has all, `use path::*`.
    pub(super) globs: Vec<String>,
    /// Names of its own items.
    pub(super) items: Vec<String>,
    /// Paths of two names or more in its code, imports left out.
    pub(super) paths: Vec<String>,
    /// Names in its code, imports left out.
    pub(super) words: BTreeSet<String>,
}

/// A name that `use` brings into a module.
#[derive(Debug)]
pub(super) struct Import {
    /// What it is called there.
    pub(super) name: String,
    /// The path that it stands for.
    pub(super) path: String,
    /// Whether the module passes it on, `pub use`.
    pub(super) passed_on: bool,
}

/// A crate as the modules that its root reaches; number 0 is the root.
#[derive(Debug)]
pub(super) struct Crate {
    /// `server/sim/src/lib.rs`, ...
    pub(super) root: String,
    /// Its modules; a module comes after the one that declares it.
    pub(super) modules: Vec<Module>,
}

/// Every crate of the repository, after its `lib.rs` or `main.rs`.
pub(super) fn crates(sources: &[Source]) -> Vec<Crate> {
    let is_root = |source: &&Source| source.path.ends_with("/lib.rs") || source.path.ends_with("/main.rs");
    sources.iter().filter(is_root).map(|root| read(&root.path, sources)).collect()
}

/// The crate whose root is the file `root`.
pub(super) fn read(root: &str, sources: &[Source]) -> Crate {
    let mut found = Crate { root: root.to_owned(), modules: Vec::new() };
    let folder = folder_of(root).to_owned();
    add_file(&mut found, sources, String::new(), root, &folder, 0);
    found
}

fn folder_of(path: &str) -> &str {
    path.rsplit_once('/').map_or("", |(folder, _)| folder)
}

/// Adds the module `name` of the file `path`; its children's files stand in `folder`.
fn add_file(
    found: &mut Crate,
    sources: &[Source],
    name: String,
    path: &str,
    folder: &str,
    parent: usize,
) -> Option<usize> {
    let source = sources.iter().find(|source| source.path == path)?;
    let stream = tokens::parse(source);
    let module = Module { name, file: path.to_owned(), parent, ..Module::default() };
    Some(add(found, sources, module, stream, folder))
}

fn add(found: &mut Crate, sources: &[Source], module: Module, stream: TokenStream, folder: &str) -> usize {
    let (number, file) = (found.modules.len(), module.file.clone());
    found.modules.push(module);
    let tokens: Vec<_> = stream.into_iter().collect();
    let mut rest = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        match &tokens[i..] {
            [TokenTree::Ident(word), TokenTree::Ident(name), TokenTree::Punct(end), ..]
                if word == "mod" && end.as_char() == ';' =>
            {
                let name = name.to_string();
                let beside = format!("{folder}/{name}.rs");
                let within = format!("{folder}/{name}");
                let child = add_file(found, sources, name.clone(), &beside, &within, number).or_else(|| {
                    add_file(found, sources, name.clone(), &format!("{within}/mod.rs"), &within, number)
                });
                let child = child.unwrap_or_else(|| panic!("{file} declares {name}, which has no file"));
                found.modules[number].children.push(child);
                i += 3;
            }
            [TokenTree::Ident(word), TokenTree::Ident(name), TokenTree::Group(body), ..]
                if word == "mod" && body.delimiter() == Delimiter::Brace =>
            {
                let name = name.to_string();
                let within = format!("{folder}/{name}");
                let module = Module { name, file: file.clone(), parent: number, ..Module::default() };
                let child = add(found, sources, module, body.stream(), &within);
                found.modules[number].children.push(child);
                i += 3;
            }
            [TokenTree::Ident(word), ..] if word == "use" => {
                let end = |token: &TokenTree| matches!(token, TokenTree::Punct(p) if p.as_char() == ';');
                let length = tokens[i..].iter().take_while(|token| !end(token)).count();
                let passed_on = is_public(&tokens[..i]);
                let mut names = Vec::new();
                unfold(&tokens[i + 1..i + length], "", &mut names);
                let module = &mut found.modules[number];
                for (name, path) in names {
                    match name.as_str() {
                        "*" => module.globs.push(path),
                        _ => module.imports.push(Import { name, path, passed_on }),
                    }
                }
                i += length;
            }
            [TokenTree::Ident(word), TokenTree::Ident(name), ..] if ITEMS.iter().any(|item| word == item) => {
                found.modules[number].items.push(name.to_string());
                i += 1;
            }
            [TokenTree::Ident(word), TokenTree::Punct(_), TokenTree::Ident(name), ..]
                if word == "macro_rules" =>
            {
                found.modules[number].items.push(name.to_string());
                i += 3;
            }
            _ => {
                rest.push(tokens[i].clone());
                i += 1;
            }
        }
    }
    let code: TokenStream = rest.into_iter().collect();
    found.modules[number].words = tokens::words(code.clone()).into_iter().collect();
    let paths = tokens::paths(code).into_iter();
    found.modules[number].paths = paths.filter(|path| path.contains("::")).collect();
    number
}

/// Whether what stands before an item ends in `pub` or `pub(...)`.
fn is_public(before: &[TokenTree]) -> bool {
    let is_pub = |token: &TokenTree| matches!(token, TokenTree::Ident(word) if word == "pub");
    match before {
        [.., last] if is_pub(last) => true,
        [.., word, TokenTree::Group(_)] => is_pub(word),
        _ => false,
    }
}

/// What stands between `use` and `;`: each name with the path that it stands for, `*` for all of a path.
fn unfold(tokens: &[TokenTree], prefix: &str, found: &mut Vec<(String, String)>) {
    let mut path = prefix.to_owned();
    let mut name = None;
    for (i, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Ident(word) if word == "as" => {
                name = tokens.get(i + 1).map(ToString::to_string);
                break;
            }
            TokenTree::Ident(word) if word == "self" && !path.is_empty() => {}
            TokenTree::Ident(word) if path.is_empty() => path = word.to_string(),
            TokenTree::Ident(word) => path = format!("{path}::{word}"),
            TokenTree::Group(group) => {
                let parts: Vec<_> = group.stream().into_iter().collect();
                let comma = |token: &TokenTree| matches!(token, TokenTree::Punct(p) if p.as_char() == ',');
                for part in parts.split(comma) {
                    unfold(part, &path, found);
                }
                return;
            }
            TokenTree::Punct(star) if star.as_char() == '*' => name = Some("*".to_owned()),
            _ => {}
        }
    }
    if !tokens.is_empty() {
        let last = path.rsplit("::").next().unwrap_or_default().to_owned();
        found.push((name.unwrap_or(last), path));
    }
}

/// The crates that stand.
pub(super) fn of_repository() -> Vec<Crate> {
    let crates = crates(&tree::rust_sources());
    assert!(crates.len() > 10, "the repository has crates");
    crates
}

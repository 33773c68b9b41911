//! Circles between files of Python and of TypeScript, read from their imports.
//!
//! These languages declare no order of modules, so that the rule is: no files use each other in a circle, however far
//! the way round. What is imported for types alone, or within a function, counts too.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    assert_none,
    tree::{self, Source},
};

use super::{
    arrows::circle_complaints,
    lexer::{Language, Token, tokens},
};

/// Where the package of Python stands.
pub(super) const PYTHON: &str = "client/python/src/";

/// Where TypeScript stands: of the page, and of the client that it uses.
const TYPESCRIPT: [&str; 2] = ["viewer/web/", "client/typescript/"];
/// The same in words.
const OF_TYPESCRIPT: &str = "viewer/web/ and client/typescript/";

/// Arrows between files of Python, from the one that imports.
pub(super) fn of_python(sources: &[Source]) -> BTreeSet<(&str, &str)> {
    let names = sources.iter().filter_map(|source| Some((dotted_names(&source.path)?, source)));
    let names: Vec<_> = names.collect();
    let files: BTreeMap<&str, &str> =
        names.iter().map(|((_, module), source)| (module.as_str(), source.path.as_str())).collect();
    let mut found: BTreeSet<(&str, &str)> = BTreeSet::new();
    for ((package, _), source) in &names {
        for meanings in python_imports(&source.text, package) {
            let file = meanings.iter().find_map(|name| files.get(name.as_str()));
            found.extend(file.map(|to| (source.path.as_str(), *to)));
        }
    }
    found.retain(|(from, to)| from != to);
    found
}

/// The package that a file stands in, and the module that it is; `nappe/__init__.py` is the module `nappe`.
fn dotted_names(path: &str) -> Option<(String, String)> {
    let name = path.strip_prefix(PYTHON)?.strip_suffix(".py")?.replace('/', ".");
    let package = name.rsplit_once('.').map_or("", |(package, _)| package);
    let module = name.strip_suffix(".__init__").unwrap_or(&name);
    Some((package.to_owned(), module.to_owned()))
}

/// What each import of a text may mean, the module of a module first: `from a import b` may mean `a.b`, or `a`.
fn python_imports(text: &str, package: &str) -> Vec<Vec<String>> {
    let tokens = tokens(text, Language::Python);
    let mut depth = 0_usize;
    // An import within brackets goes on over lines; a colon stands before one on the line of its `if`.
    let statements = tokens.split(|token| {
        match token {
            Token::Sign('(' | '[' | '{') => depth += 1,
            Token::Sign(')' | ']' | '}') => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth == 0 && matches!(token, Token::Sign('\n' | ';' | ':'))
    });
    let mut found = Vec::new();
    for statement in statements {
        match statement {
            [Token::Word("import"), names @ ..] => found.extend(listed(names).map(|name| vec![name])),
            [Token::Word("from"), rest @ ..] => {
                let mut parts = rest.splitn(2, |token| *token == Token::Word("import"));
                let (Some(module), Some(names)) = (parts.next(), parts.next()) else { continue };
                let module = absolute(&dotted(module), package);
                found.extend(listed(names).map(|name| vec![format!("{module}.{name}"), module.clone()]));
            }
            _ => {}
        }
    }
    found
}

/// Names with a comma between them, without what they are called from there on.
fn listed(tokens: &[Token<'_>]) -> impl Iterator<Item = String> {
    let names = tokens.split(|token| *token == Token::Sign(','));
    names
        .map(|name| dotted(name.split(|token| *token == Token::Word("as")).next().unwrap_or_default()))
        .filter(|name| !name.is_empty())
}

/// A name with its dots; brackets around names, and ends of lines within them, are left out.
fn dotted(tokens: &[Token<'_>]) -> String {
    let parts = tokens.iter().map(|token| match token {
        Token::Word(word) => *word,
        Token::Sign('.') => ".",
        Token::Sign('*') => "*",
        _ => "",
    });
    parts.collect()
}

/// The module that `module` means in a package: each dot before it but the first leads to the package above.
fn absolute(module: &str, package: &str) -> String {
    let name = module.trim_start_matches('.');
    let dots = module.len() - name.len();
    if dots == 0 {
        return name.to_owned();
    }
    let above = |package: &str| package.rsplit_once('.').map_or("", |(above, _)| above).to_owned();
    let package = (1..dots).fold(package.to_owned(), |package, _| above(&package));
    if name.is_empty() { package } else { format!("{package}.{name}") }
}

/// Arrows between files of TypeScript, from the one that imports.
pub(super) fn of_typescript(sources: &[Source]) -> BTreeSet<(&str, &str)> {
    let files: BTreeSet<&str> = sources.iter().map(|source| source.path.as_str()).collect();
    let mut found: BTreeSet<(&str, &str)> = BTreeSet::new();
    for source in sources {
        for path in typescript_imports(&source.text) {
            let Some(path) = joined(&source.path, path) else { continue };
            let bare = path.strip_suffix(".js").unwrap_or(&path);
            let meanings = [path.clone(), format!("{bare}.ts"), format!("{path}/index.ts")];
            let file = meanings.iter().find_map(|path| files.get(path.as_str()));
            found.extend(file.map(|to| (source.path.as_str(), *to)));
        }
    }
    found.retain(|(from, to)| from != to);
    found
}

/// Paths that a text imports, or exports from.
fn typescript_imports(text: &str) -> Vec<&str> {
    let mut tokens = tokens(text, Language::TypeScript);
    tokens.retain(|token| *token != Token::Sign('\n'));
    let path = |at: usize| match &tokens[at..] {
        [Token::Word("from" | "import"), Token::Quoted(path), ..]
        | [Token::Word("import"), Token::Sign('('), Token::Quoted(path), ..] => Some(*path),
        _ => None,
    };
    (0..tokens.len()).filter_map(path).collect()
}

/// The path from the root that `path` means in a file; nothing for a library.
fn joined(file: &str, path: &str) -> Option<String> {
    if !path.starts_with('.') {
        return None;
    }
    let (folder, _) = file.rsplit_once('/')?;
    let mut parts: Vec<_> = folder.split('/').collect();
    for part in path.split('/') {
        match part {
            "." | "" => {}
            ".." => {
                parts.pop();
            }
            name => parts.push(name),
        }
    }
    Some(parts.join("/"))
}

#[test]
fn no_files_of_the_python_package_use_each_other_in_a_circle() {
    let sources = tree::sources(|path| path.starts_with(PYTHON) && tree::has_extension(path, "py"));
    let arrows = of_python(&sources);
    assert!(arrows.len() > 50, "files of {PYTHON} import each other");
    assert_none(&circle_complaints(PYTHON, &arrows));
}

#[test]
fn no_files_of_typescript_use_each_other_in_a_circle() {
    let is_there = |path: &str| TYPESCRIPT.iter().any(|folder| path.starts_with(folder));
    let sources = tree::sources(|path| is_there(path) && tree::has_extension(path, "ts"));
    let arrows = of_typescript(&sources);
    for folder in TYPESCRIPT {
        let own = arrows.iter().filter(|(from, _)| from.starts_with(folder)).count();
        assert!(own > 30, "files of {folder} import each other");
    }
    assert_none(&circle_complaints(OF_TYPESCRIPT, &arrows));
}

/// Three files, the second and third of which use one before them, with more text in the first.
fn example(files: [(&str, &str); 3], text: &str) -> Vec<Source> {
    let mut sources = files.map(|(path, text)| Source::example(path, text));
    sources[0].text.push_str(text);
    sources.into()
}

#[test]
fn the_rule_for_python_finds_what_it_is_for() {
    let files = [
        ("client/python/src/nappe/_low.py", "\"\"\"Low.\"\"\"\n"),
        ("client/python/src/nappe/__init__.py", "from nappe._low import (\n    Low,  # x\n)\n"),
        ("client/python/src/nappe/examples/show.py", "import nappe\nfrom .. import _low as low\n"),
    ];
    let complaints = |text: &str| circle_complaints(PYTHON, &of_python(&example(files, text)));
    let arrows = ["__init__.py -> _low.py", "examples/show.py -> __init__.py", "examples/show.py -> _low.py"];
    let told = |(from, to): &(&str, &str)| format!("{from} -> {to}").replace("client/python/src/nappe/", "");
    assert_eq!(of_python(&example(files, "")).iter().map(told).collect::<Vec<_>>(), arrows);
    assert_eq!(
        complaints("import nappe\n"),
        ["client/python/src/: 2 files use each other in a circle: \
          client/python/src/nappe/__init__.py -> client/python/src/nappe/_low.py, \
          client/python/src/nappe/_low.py -> client/python/src/nappe/__init__.py"]
    );
    let circles = [
        "from nappe import __version__\n",
        "from nappe.examples import other, show as shown\n",
        "import os, nappe.examples.show as show\n",
        "from . import Name\n",
        "from .examples.show import *\n",
        "from .examples import (\n    other,  # (\n    show,\n)\n",
        "from nappe.examples \\\n    import show\n",
        "if TYPE_CHECKING:\n    from nappe.examples.show import Show\n",
        "if TYPE_CHECKING: from nappe.examples import show\n",
        "def f():\n    x = {1: 2}; import nappe.examples.show\n",
    ];
    for text in circles {
        assert_eq!(complaints(text).len(), 1, "{text}");
    }
    let fine = [
        "\"\"\"Text.\n\nimport nappe\n\"\"\"\n",
        "# import nappe\n",
        "text = 'x\\'; import nappe'\n",
        "import os, numpy as nappe\nfrom other.nappe import show\nfrom nappes import x\n",
        "from nappe.examples import other\n",
        "from ._low import (\n    Low,\n)\n",
        "def f():\n    yield from nappe\n",
    ];
    for text in fine {
        assert_none(&complaints(text));
    }
}

#[test]
fn the_rule_for_typescript_finds_what_it_is_for() {
    let files = [
        ("viewer/web/src/low.ts", "export const low = 1;\n"),
        (
            "viewer/web/src/high.ts",
            "import { Vector3 } from 'three';\nimport {\n  low,\n} from './low.ts';\n",
        ),
        ("viewer/web/src/deep/index.ts", "export { high } from '../high';\n"),
    ];
    let complaints = |text: &str| circle_complaints(OF_TYPESCRIPT, &of_typescript(&example(files, text)));
    let circles = [
        "import { high } from './high.ts';",
        "import high from \"./high\";",
        "import {\n  type High,\n} from './high.js';",
        "import type { High } from './high.ts';",
        "import './high.ts';",
        "export * from './high.ts';",
        "export type { High } from '../src/high.ts';",
        "const high = await import('./high.ts');",
        "type High = import(\n  './high.ts'\n).High;",
        "import { high } from './deep';",
    ];
    for text in circles {
        assert_eq!(complaints(text).len(), 1, "{text}");
    }
    let fine = [
        "// import { high } from './high.ts';",
        "/* export *\n from './high.ts'; */",
        "const text = \"import './high.ts'\";",
        "const text = `\nimport './high.ts';`;",
        "import { high } from 'high.ts';\nimport { deep } from './deeper';",
        "const list = Array.from('./high.ts');",
    ];
    for text in fine {
        assert_none(&complaints(text));
    }
}

//! Structs of the numerics: how many fields each has. A function that gets one may touch all of them.

use proc_macro2::{Delimiter, Spacing, TokenStream, TokenTree};

use crate::{
    assert_none, tokens,
    tree::{self, Source},
};

/// The numerics' sources.
const SIM: &str = "server/sim/src/";

/// Most fields of a struct.
const FIELD_LIMIT: usize = 16;

/// Structs that have more: file, name, why.
const EXCEPTIONS: [(&str, &str, &str); 1] = [(
    "server/sim/src/cloth/layout/model.rs",
    "Model",
    "never changes: who gets it reads, and touches nothing",
)];

/// Structs whose fields have names, wherever they stand, and how many fields each has.
fn structs(stream: TokenStream) -> Vec<(String, usize)> {
    let tokens: Vec<_> = stream.into_iter().collect();
    let mut found = Vec::new();
    for (place, token) in tokens.iter().enumerate() {
        match (token, tokens.get(place + 1)) {
            (TokenTree::Group(group), _) => found.extend(structs(group.stream())),
            (TokenTree::Ident(word), Some(TokenTree::Ident(name))) if word == "struct" => {
                if let Some(body) = body(&tokens[place + 2..]) {
                    found.push((name.to_string(), fields(body)));
                }
            }
            _ => {}
        }
    }
    found
}

/// What stands between the braces of a struct, from behind its name; none where it ends without them.
fn body(rest: &[TokenTree]) -> Option<TokenStream> {
    for token in rest {
        match token {
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => return Some(group.stream()),
            TokenTree::Punct(end) if end.as_char() == ';' => return None,
            _ => {}
        }
    }
    None
}

/// Fields between braces: after the name of each stands a colon that is no half of a `::`.
fn fields(body: TokenStream) -> usize {
    let (mut count, mut is_second) = (0, false);
    for token in body {
        let colon = match &token {
            TokenTree::Punct(punct) if punct.as_char() == ':' => Some(punct.spacing()),
            _ => None,
        };
        let is_first = colon == Some(Spacing::Joint);
        count += usize::from(colon.is_some() && !is_first && !is_second);
        is_second = is_first;
    }
    count
}

fn against_fields(source: &Source) -> Vec<String> {
    let is_excepted =
        |name: &str| EXCEPTIONS.iter().any(|(file, excepted, _)| *file == source.path && *excepted == name);
    let complaint = |(name, count): (String, usize)| {
        (count > FIELD_LIMIT && !is_excepted(&name))
            .then(|| format!("{}: {name} has {count} fields, at most {FIELD_LIMIT}", source.path))
    };
    structs(tokens::parse(source)).into_iter().filter_map(complaint).collect()
}

#[test]
fn no_struct_of_the_numerics_has_more_fields_than_the_limit() {
    let sources = tree::sources(|path| path.starts_with(SIM) && tree::has_extension(path, "rs"));
    let count: usize = sources.iter().map(|source| structs(tokens::parse(source)).len()).sum();
    assert!(count > 100, "{SIM} has structs, {count} were found");
    assert_none(&sources.iter().flat_map(against_fields).collect::<Vec<_>>());
    for (file, name, _) in EXCEPTIONS {
        let source = Source::example(file, &tree::text(file));
        let found = structs(tokens::parse(&source)).into_iter().find(|(found, _)| found == name);
        assert!(
            found.is_some_and(|(_, count)| count > FIELD_LIMIT),
            "{file}: {name} is no exception any more"
        );
    }
}

#[test]
fn fields_are_counted() {
    let named = |i| format!("/// a: b\n pub(super) f{i}: a::B<c::D>,");
    let list = (0..=FIELD_LIMIT).map(named).collect::<Vec<_>>().concat();
    let large = format!("mod a {{ #[derive(Debug)] struct Large<'a, T: Copy> where T: Sync {{ {list} }} }}");
    let source = Source::example("server/sim/src/x.rs", &large);
    assert_eq!(structs(tokens::parse(&source)), [("Large".to_owned(), FIELD_LIMIT + 1)]);
    assert_eq!(against_fields(&source).len(), 1);

    let small =
        "struct A; struct B(u8, u8); struct C { a: u8, b: [u8; 3] } fn f() { let c = C { a: 1, b }; }";
    let source = Source::example("server/sim/src/x.rs", small);
    assert_eq!(structs(tokens::parse(&source)), [("C".to_owned(), 2)]);
    assert_none(&against_fields(&source));
}

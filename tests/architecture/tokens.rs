//! Rust text as tokens: comments and strings are out of the way, `use` groups are unfolded.

use proc_macro2::{Delimiter, TokenStream, TokenTree};

use crate::tree::Source;

/// The tokens of a file.
pub(crate) fn parse(source: &Source) -> TokenStream {
    source.text.parse().unwrap_or_else(|error| panic!("{}: {error}", source.path))
}

/// Every identifier and keyword, in order; lifetimes are left out.
pub(crate) fn words(stream: TokenStream) -> Vec<String> {
    let mut found = Vec::new();
    let mut after_quote = false;
    for token in stream {
        let quote = matches!(&token, TokenTree::Punct(punct) if punct.as_char() == '\'');
        match token {
            TokenTree::Ident(ident) if !after_quote => found.push(ident.to_string()),
            TokenTree::Group(group) => found.extend(words(group.stream())),
            _ => {}
        }
        after_quote = quote;
    }
    found
}

/// Every path, `a::b::c`, of one name or more; `a::{b, c}` gives `a::b` and `a::c`.
pub(crate) fn paths(stream: TokenStream) -> Vec<String> {
    let mut found = Vec::new();
    collect(stream, "", &mut found);
    found
}

fn collect(stream: TokenStream, prefix: &str, found: &mut Vec<String>) {
    let tokens: Vec<_> = stream.into_iter().collect();
    let mut i = 0;
    while i < tokens.len() {
        if let TokenTree::Ident(ident) = &tokens[i] {
            let mut path = format!("{prefix}{ident}");
            let mut unfolded = false;
            while is_colon(tokens.get(i + 1)) && is_colon(tokens.get(i + 2)) {
                match tokens.get(i + 3) {
                    Some(TokenTree::Ident(next)) => path = format!("{path}::{next}"),
                    Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                        collect(group.stream(), &format!("{path}::"), found);
                        unfolded = true;
                    }
                    _ => break,
                }
                i += 3;
            }
            if !unfolded {
                found.push(path);
            }
        } else if let TokenTree::Group(group) = &tokens[i] {
            collect(group.stream(), "", found);
        }
        i += 1;
    }
}

fn is_colon(token: Option<&TokenTree>) -> bool {
    matches!(token, Some(TokenTree::Punct(punct)) if punct.as_char() == ':')
}

#[test]
fn groups_unfold_and_comments_and_strings_are_not_code() {
    let source = Source::example(
        "x.rs",
        r#"//! unsafe
        use a::{b, c::{d, e}}; // std::time
        fn f<'long>(x: &'static str) { g::h("k::l"); }"#,
    );
    let found = paths(parse(&source));
    for path in ["a::b", "a::c::d", "a::c::e", "g::h"] {
        assert!(found.contains(&path.to_owned()), "{path} in {found:?}");
    }
    let words = words(parse(&source));
    for absent in ["unsafe", "time", "k", "long", "static"] {
        assert!(!words.contains(&absent.to_owned()), "{absent} in {words:?}");
    }
}
